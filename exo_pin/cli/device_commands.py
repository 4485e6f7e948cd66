"""What ``exo-pin kinematics`` and ``exo-pin singularity`` say of a device that is not a wrist."""

from __future__ import annotations

import argparse
from typing import Any

import numpy as np
from scipy.spatial.transform import Rotation

from ..core.tables import aligned, filled
from ..core.validation import FloatArray
from ..device import ChainDevice
from ..reaction.holding.verdict import describe_axis
from . import deliver
from .options.option_values import refuse
from .options.outputs import joined_json
from .options.query_options import pose, pose_words

#: Assembly modes that a table has room for.
_MOST_MODES = 6


def device_kinematics(exo: Any, options: argparse.Namespace) -> int:
    """Joints of the device in a pose, in the assembly modes that were found."""
    refuse(options, "poses from measured lengths or angles are of wrists", "lengths", "theta_x", "theta_y")
    poses, idle = pose(options, exo), exo.chain_device.structure.idle
    from_rest = exo.configurations(poses)
    is_reached = bool(np.isfinite(from_rest).all())
    if idle:
        # Each of its modes is a whole family of configurations.
        modes = from_rest[None][:is_reached]
        freedoms = "1 freedom leaves" if idle == 1 else f"{idle} freedoms leave"
        found = f"{freedoms} the arm where it is; joints by their least motion from rest"
    else:
        modes = exo.assembly_modes(poses)
        found = f"{len(modes) or 'no'} assembly mode{'' if len(modes) == 1 else 's'} found"
        found += ", mode 1 continues from rest" if is_reached else ""
    head = filled(f"{pose_words(options, exo)}: {found if is_reached else f'not reached from rest; {found}'}")
    parts, rows = [f"{exo.device.title or exo.name}\n{head}"], joint_rows(exo.chain_device, modes[:_MOST_MODES])
    if not rows:
        parts.append("It has no joints: springs and cables from torso to arm alone.")
    elif len(modes):
        header = ["joint", *(f"mode {k}" for k in range(1, 1 + min(len(modes), _MOST_MODES)))]
        parts.append("\n".join(aligned([header, *rows])))
    deliver(options, "\n\n".join(parts), json=lambda: joined_json(exo, modes=modes))
    return 0


def joint_rows(device: ChainDevice, modes: FloatArray) -> list[list[str]]:
    """Coordinates of the device's joints in configurations of shape (k, nq), a row a joint."""
    model, rows = device.chain.model, []
    for index in range(1, model.njoints):
        if index == device.arm_index:
            continue
        values = modes[:, model.idx_qs[index] : model.idx_qs[index] + model.nqs[index]]
        if model.nvs[index] != 1:
            cells = [", ".join(f"{value:.3f}" for value in row) for row in values]
        else:
            # A hinge without ends has cosine and sine.
            numbers = values[:, 0] if values.shape[1] == 1 else np.arctan2(values[:, 1], values[:, 0])
            if device.chain.metres[model.idx_vs[index]]:
                cells = [f"{np.round(1e3 * value, 2) + 0.0:.2f} mm" for value in numbers]
            else:
                # Whole turns do not count.
                turned = 180.0 - (180.0 - np.degrees(numbers)) % 360.0
                cells = [f"{np.round(value, 2) + 0.0:.2f} °" for value in turned]
        rows.append([str(model.names[index]), *cells])
    return rows


def device_singularity(exo: Any, poses: Rotation, options: argparse.Namespace) -> int:
    """Singularities of a device that is not a wrist."""
    refuse(options, "the singular surface is of wrists with three limbs", "plot")
    state: Any = exo.singularity(poses)
    head = f"{exo.device.title or exo.name}\n{pose_words(options, exo)}: {state.kind}"
    lines = [
        f"margin of the drives, from 0 (singular) to 1 (all moments alike)   {float(state.margin):5.4f}",
        f"turn of the arm about its worst axis over the joints' motion   {float(state.freedom):8.4f}",
        f"reactions that equilibrium does not determine                  {int(state.self_stresses):8d}",
    ]
    axis = describe_axis(state.lost_direction)
    text = "\n\n".join([head, "\n".join(lines), f"The drives resist a moment least about {axis}."])
    deliver(options, text, json=state.to_json)
    return 0
