"""Equilibrium of a device whose cuff or harness gives way, in a stack of poses that are held by the drives."""

from __future__ import annotations

from functools import lru_cache

import numpy as np

from ...core.errors import ExoPinError, InvalidInput
from ...core.progress import track
from ...core.validation import FloatArray
from ...load_case.pose_stacks import Query
from ..chain_device import ChainDevice
from ..device_state import DeviceState
from ..device_structure import Structure
from ..equilibrium import DeviceEquilibrium, device_equilibrium
from ..pose_forces import attachment_count
from .soft_model import CUFF, SoftModel, soft_device

#: Codes of the statuses of an answer, and of a pose without an equilibrium nearby.
_OK, _NO_EQUILIBRIUM = 0, 5

Shift = tuple[float, float, float]


@lru_cache(maxsize=64)
def _soft_model(device: ChainDevice, base: Shift, cuff: Shift) -> SoftModel:
    return SoftModel(device, base, cuff)


@lru_cache(maxsize=8)
def determined_device(device: ChainDevice) -> ChainDevice:
    """The device on its springs, of which equilibrium determines every reaction that loads the shoulder."""
    soft = soft_device(device)
    vars(soft)["structure"] = Structure(device.structure.moments, 0, 0, 0)
    return soft


def soft_equilibrium(
    device: ChainDevice, query: Query, base: FloatArray, cuff: FloatArray, progress: bool = False
) -> DeviceEquilibrium:
    """Equilibrium of N poses.

    Parameters
    ----------
    device : ChainDevice
        With three drives or none, whose cuff or harness has a stiffness.
    query : Query
        Poses, motion and load.
    base, cuff : ndarray
        Shifts of torso side and arm side, shape (N, 3), m, in base and arm frame.
    progress : bool
        Whether to show a bar.

    Raises
    ------
    InvalidInput
        If the device has another number of drives: stiffness alone does not say how more share the load.
    """
    count, p = len(query.matrices), device.limb_count
    if p != 3:
        raise InvalidInput(f'split="elastic" is for devices with three drives or none, got {len(device.drives)}')
    # The rigid, aligned device: where it goes, and where the search for equilibrium begins.
    rigid = device_equilibrium(device, query, progress=progress)
    first = _soft_model(device, (0.0, 0.0, 0.0), (0.0, 0.0, 0.0))
    state = DeviceState.zeros(count, 3, attachment_count(first.model))
    status, interfaces = rigid.status.copy(), np.full((count, 2, 6), np.nan)
    q = np.zeros((count, first.model.held.nq))
    coordinates, margin = rigid.coordinates.copy(), rigid.margin.copy()
    for k in track(np.flatnonzero(rigid.reached).tolist(), "equilibrium on springs", progress):
        model = _soft_model(device, tuple(base[k].tolist()), tuple(cuff[k].tolist()))
        status[k] = _NO_EQUILIBRIUM
        try:
            pose, q[k] = model.solve(model.start(rigid.q[k], query.quaternions[k]), query, k)
        except ExoPinError:
            continue
        one = DeviceState.zeros(1, 3, state.attached.shape[1])
        pose.fill(one, 0)
        f = np.linalg.lstsq(one.moment_of_f[0], one.moment[0], rcond=None)[0]
        none = np.zeros(3)
        on_arm, on_torso = one.wrenches(f[None], none[None])
        # Springs determine all forces: there is nothing that depends on f.
        state.moment_of_f[k], state.moment[k] = np.eye(3), f
        state.shoulder[k] = one.shoulder_force(f[None], none[None])[0]
        state.attached[k], state.standing[k] = on_arm[0], on_torso[0]
        status[k] = _OK
        coordinates[k, : len(pose.coordinates)] = pose.coordinates
        interfaces[k] = 0.0
        for joint, _, _, spring in model.springs:
            row = 1 if model.model.held.model.names[joint] == CUFF else 0
            interfaces[k, row] = model.displacement(q[k], joint, spring)[0]
    return rigid._replace(
        state=state, q=q, coordinates=coordinates, status=status, margin=margin, interfaces=interfaces
    )
