"""``exo-pin kinematics`` and ``exo-pin singularity``: poses from measurements, and singular poses.

``exo-pin mobility`` and ``exo-pin forces`` are for any robot: its freedoms, and the forces in actuators and joints.
"""

from __future__ import annotations

import argparse
from collections.abc import Sequence
from typing import Any

import numpy as np
from scipy.spatial.transform import Rotation

from ..chain import PULL, ClosedChain
from ..core.conventions import shoulder_angles, thesis_angles
from ..core.errors import InvalidInput
from ..core.tables import aligned, filled
from ..core.validation import FloatArray
from ..exo.shoulder_exo import ShoulderExo
from ..load_case.ranges_of_motion import ADL_BOX, DAILY_RANGES
from ..reaction.holding.verdict import describe_axis
from ..wrist import AssemblyModes, NearestSingularity, RangeCrossing, Singularity, daily_crossings
from ..wrist.singularities.singular_surface import side_of_rest
from . import deliver, main
from .options.query_options import (
    configuration,
    design,
    joined_json,
    joint_value,
    named_numbers,
    numbers,
    pose,
    pose_words,
    refuse,
)

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
    parts, rows = (
        [f"{exo.device.title or exo.name}\n{head}"],
        joint_rows(exo.chain, exo.chain_device.arm_index, modes[:_MOST_MODES]),
    )
    if not rows:
        parts.append("It has no joints: springs and cables from torso to arm alone.")
    elif len(modes):
        header = ["joint", *(f"mode {k}" for k in range(1, 1 + min(len(modes), _MOST_MODES)))]
        parts.append("\n".join(aligned([header, *rows])))
    deliver(options, "\n\n".join(parts), json=lambda: joined_json(exo, modes=modes))
    return 0


def robot_kinematics(exo: Any, options: argparse.Namespace) -> int:
    """All closed configurations of a robot without an arm, with joints set, or else its actuated ones as drawn."""
    refuse(options, "poses from measured lengths or angles are of wrists", "lengths", "theta_x", "theta_y")
    chain = exo.chain
    held = tuple(joint_value(text)[0] for text in options.set) or chain.roles.actuated
    found = chain.assemblies(held, configuration(options, exo), options.frame)
    count = min(len(found), _MOST_MODES)
    head = filled(f"{', '.join(held) or 'no joint'} held: {str(found).splitlines()[0]}")
    header = ["joint", *(f"{hits} hits" for hits in found.hits[:count])]
    table = "\n".join(aligned([header, *joint_rows(chain, 0, found.configurations[:count])])) if count else ""
    deliver(options, f"{exo.name}\n{head}\n\n{table}".rstrip(), json=lambda: joined_json(exo, assemblies=found))
    return 0


def joint_rows(chain: ClosedChain, arm: int, modes: FloatArray) -> list[list[str]]:
    """Coordinates of all joints but the arm's in configurations of shape (k, nq), a row a joint."""
    model, rows = chain.model, []
    for index in range(1, model.njoints):
        if index == arm:
            continue
        values = modes[:, model.idx_qs[index] : model.idx_qs[index] + model.nqs[index]]
        if model.nvs[index] != 1:
            cells = [", ".join(f"{value:.3f}" for value in row) for row in values]
        else:
            # A hinge without ends has cosine and sine.
            numbers = values[:, 0] if values.shape[1] == 1 else np.arctan2(values[:, 1], values[:, 0])
            if chain.metres[model.idx_vs[index]]:
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


_SENSORS: tuple[tuple[str, tuple[str, ...]], ...] = (
    ("limb lengths", ("lengths",)),
    ("θ_xA of the base joints", ("base_theta_x",)),
    ("θ_yA of the base joints", ("base_theta_y",)),
    ("both angles of the base joints", ("base_theta_x", "base_theta_y")),
)
#: Options of ``exo-pin forces`` that say a pose, and those that ask for something of the chain.
_POSE = ("flexion", "abduction", "internal_rotation")
_OF_CHAIN = ("joint", "actuated", "external", "pull", "least", "set", "leave_out")
#: Limb lengths, mm, below which all of them are likely to be metres.
_SHORT = 3.0


def _numbers(name: str, text: str | None, count: int) -> FloatArray | None:
    if text is None:
        return None
    return np.array(numbers(text, f"--{name} as {count} numbers with commas between", count))


def run_kinematics(options: argparse.Namespace) -> int:
    """Answer ``exo-pin kinematics`` and return its exit status."""
    exo = design(options)
    if exo.wrist is None:
        return device_kinematics(exo, options) if exo.has_arm else robot_kinematics(exo, options)
    n = exo.geometry.limb_count
    lengths = _numbers("lengths", options.lengths, n)
    theta_x, theta_y = (_numbers(name, getattr(options, name.replace("-", "_")), n) for name in ("theta-x", "theta-y"))
    if lengths is not None and 0.0 < np.abs(lengths).max() < _SHORT:
        raise InvalidInput(f"expected --lengths in mm, got {options.lengths} (metres?)")
    measured_angles = theta_x is not None or theta_y is not None
    if lengths is not None and measured_angles:
        raise InvalidInput("expected --lengths, or --theta-x and --theta-y, not both")
    near = pose(options, exo)
    if measured_angles:
        x, y = (None if angles is None else np.radians(angles) for angles in (theta_x, theta_y))
        modes = exo.forward_kinematics_from_base_angles(x, y, near=near)
        unit, scale = "°", np.degrees(1.0)
    else:
        known = exo.inverse_kinematics(near).lengths if lengths is None else lengths * 1e-3
        modes = exo.forward_kinematics(known, near=near)
        unit, scale = "mm", 1e3
    given = None if lengths is not None or measured_angles else near
    parts = [] if given is None else [f"{pose_words(options, exo)}\n{_limb_table(exo, given)}"]
    text = "\n\n".join([exo.device.title or exo.name, *parts, _modes_table(exo, modes, unit, scale)])
    limbs = None if given is None else exo.inverse_kinematics(given)
    deliver(options, text, json=lambda: joined_json(exo, modes=modes, limbs=limbs))
    return 0


def _limb_table(exo: ShoulderExo, poses: Rotation) -> str:
    state = exo.inverse_kinematics(poses)
    lines = [f"{'limb':>4} {'length, mm':>11} {'θ_xA, °':>9} {'θ_yA, °':>9} {'θ_xB, °':>9} {'θ_yB, °':>9}"]
    columns = (state.base_theta_x, state.base_theta_y, state.platform_theta_x, state.platform_theta_y)
    for i in range(exo.geometry.limb_count):
        joint_angles = " ".join(f"{np.degrees(column[i]):9.3f}" for column in columns)
        lines.append(f"{i + 1:>4} {state.lengths[i] * 1e3:11.3f} {joint_angles}")
    return "\n".join(lines)


def _modes_table(exo: ShoulderExo, modes: AssemblyModes, unit: str, scale: float) -> str:
    count = int(modes.count)
    if count == 0:
        return f"no pose fits: {modes.status}"
    noun = "pose fits" if count == 1 else "poses fit"
    lines = [
        f"{count} {noun}{', some of them modes that meet' if modes.status == 'meeting' else ''}",
        f"     {'flexion, abduction, internal, °':>32} {'(4-7) θx, θy, θz, °':>32} "
        f"{'residual, ' + unit:>14} {'margin':>9}",
    ]
    for k in np.flatnonzero(modes.valid):
        mode = modes.rotations[int(k)]
        clinical, printed = shoulder_angles(mode, exo.side, degrees=True), thesis_angles(mode, degrees=True)
        mark = "*" if modes.nearest == k else " "
        lines.append(
            f"{mark}{k + 1:>3} "
            + " ".join("".join(f"{round(angle, 4) + 0.0:11.4f}" for angle in triple) for triple in (clinical, printed))
            + f" {modes.residual[k] * scale:14.1e} {modes.margin[k]:9.4f}"
        )
    doubt = "; another may be meant" if modes.ambiguous else ""
    lines.append(f"* closest to the given pose{doubt}. Two modes meet where the margin is 0.")
    return "\n".join(lines)


def run_singularity(options: argparse.Namespace) -> int:
    """Answer ``exo-pin singularity`` and return its exit status."""
    exo = design(options)
    poses = pose(options, exo)
    if exo.wrist is None:
        return device_singularity(exo, poses, options)
    state = exo.singularity(poses)
    # More than three limbs have no singular surface, hence no sides and no way to its nearest point.
    nearest = exo.nearest_singularity(poses) if exo.geometry.limb_count == 3 else None
    crossings = []
    if nearest is not None and side_of_rest(exo.geometry) != 0:
        crossings = daily_crossings(exo.geometry, (ADL_BOX, *DAILY_RANGES), side=exo.side)
    head = f"{exo.device.title or exo.name}\n{pose_words(options, exo)}: {state.kind}"
    lines = ["turn of the arm per unit of sensor error, worst"]
    sensors = {label: exo.sensor_sensitivity(poses, names) for label, names in _SENSORS}
    for label, sensor in sensors.items():
        unit, factor = ("° per mm", np.degrees(1e-3)) if label == "limb lengths" else ("° per °", 1.0)
        lines.append(f"  {label:32} {_bounded(float(sensor.sensitivity) * factor, unit, 2)}")
    parts = [head, _singularity_table(exo, state, nearest), "\n".join(lines), _sides(nearest, crossings)]

    def figure() -> Any:
        from ..view.plots.angle_maps import determinant_map

        return determinant_map(exo, internal_rotation=float(options.internal_rotation)).figure

    deliver(
        options,
        "\n\n".join(parts),
        json=lambda: joined_json(exo, singularity=state, nearest=nearest, sensors=sensors, ranges=crossings),
        figure=figure,
    )
    return 0


def _singularity_table(exo: ShoulderExo, state: Singularity, nearest: NearestSingularity | None) -> str:
    # Rounded first, so that no -0.0 is printed.
    x, y, z = np.round(state.lost_direction, 3) + 0.0
    rows = {
        "det X": f"{state.determinant:+.5f}{_side(exo, state)}",
        "reach h_i": f"{', '.join(f'{h * 1e3:.1f}' for h in state.reach)} mm",
        "nearest singular pose": "",
        "limb force per moment, worst": _bounded(float(state.amplification), "N per N m"),
        "axis that the limbs resist least": f"({x:.3f}, {y:.3f}, {z:.3f})",
        "centre shift without ball joint": _bounded(float(state.centre_shift), "mm per mm of play in each limb"),
        "condition of the limbs": _bounded(float(state.condition), ""),
    }
    if nearest is None:
        for name in ("det X", "nearest singular pose", "centre shift without ball joint"):
            del rows[name]
    else:
        there = np.round(shoulder_angles(nearest.pose, exo.side, degrees=True), 1) + 0.0
        rows["nearest singular pose"] = (
            f"{nearest.degrees:.2f}° away, at flexion {there[0]:.1f}°, abduction {there[1]:.1f}°, "
            f"internal rotation {there[2]:.1f}°"
        )
    return "\n".join(f"{name:31} {value}" for name, value in rows.items())


def _side(exo: ShoulderExo, state: Singularity) -> str:
    """Whether a pose lies on the same side of the singular surface as the hanging arm, in words."""
    rest = side_of_rest(exo.geometry) if exo.geometry.limb_count == 3 else 0
    if rest == 0 or state.kind not in ("regular", "near"):
        return ""
    return ", on the side of rest" if state.determinant * rest > 0.0 else ", beyond det X = 0 as seen from rest"


def _sides(nearest: NearestSingularity | None, crossings: Sequence[RangeCrossing]) -> str:
    """How the ranges of motion lie about the singular surface."""
    if nearest is None:
        return (
            "The singular poses of more than three limbs form no surface, but curves or single poses: they have no\n"
            "sides, and a movement can go round them."
        )
    if not crossings:
        return "the hanging arm is itself singular: no range of motion lies on either side of it"
    lines = ["share of each range of motion beyond the singular surface and close to it"]
    lines.append(f"  {'':36} {'beyond':>11} {'|det X| < 0.05':>15}")
    lines += [f"  {c.range.name:36} {c.across:11.1%} {c.close:15.1%}" for c in crossings]
    return "\n".join(lines)


def _bounded(value: float, unit: str, digits: int = 1) -> str:
    """A number with its unit; in words where it has no bound."""
    return f"{value:.{digits}f} {unit}".rstrip() if value < 1e9 else "without bound"


def run_mobility(options: argparse.Namespace) -> int:
    """Answer ``exo-pin mobility`` and return its exit status."""
    exo = design(options)
    chain, q = exo.chain, configuration(options, exo)
    answer = chain.mobility(q, frame=options.frame, part=options.part or "pose")
    print(f"{exo.name}\n{answer}")
    beyond = chain.beyond_limits(q)
    if beyond:
        print(f"beyond their limits  {', '.join(beyond)}")
    for text in chain.description.left_out:
        print(f"left out             {text}")
    return 0


def run_forces(options: argparse.Namespace) -> int:
    """Answer ``exo-pin forces`` and return its exit status.

    In a pose of a device whose drives are no limbs it is what ``exo-pin reaction`` answers, with springs and cables,
    unless an option asks for something of the chain.
    """
    exo = design(options)
    chain = exo.chain
    if any(getattr(options, name) for name in _POSE) and not chain.roles.limbs and exo.has_arm:
        if not any(getattr(options, name) for name in _OF_CHAIN):
            return main(_as_reaction(options))
        device = exo.chain_device
        parts: list[Any] = [*device.springs, *(drive for drive in device.drives if drive.route is not None)]
        if parts:
            raise InvalidInput(
                f"joints of the chain do not feel {', '.join(part.name for part in parts)}: ask for the forces in the "
                f"pose without options of the chain, or exo-pin reaction {options.design}"
            )
    actuated = chain.roles.actuated if options.actuated is None else tuple(options.actuated.split(","))
    forces = chain.inverse_dynamics(
        configuration(options, exo),
        external=_wrenches(options.external),
        actuated=actuated,
        effort_bounds=dict.fromkeys(actuated, PULL) if options.pull else None,
        objective=None if options.least is None else {options.least: [1.0] * 3 + [0.0] * 3},
    )
    names = options.joint or _default_joints(chain)
    reactions = [forces.joint_reaction(name, at=options.at, in_frame=options.in_frame) for name in names]
    lines = [exo.name, *(f"Caution: {text}" for text in forces.cautions)]
    lines += [f"Left out: {text}" for text in chain.description.left_out]
    slides = False
    for joint in actuated:
        own = chain.velocity_slice(joint)
        rows = zip(forces.effort(joint), forces.effort_is_unique[own], forces.effort_interval(joint), strict=True)
        for (value, alone, (low, high)), slide in zip(rows, chain.metres[own], strict=True):
            slides |= bool(slide)
            reach = "can be any number" if np.isinf([low, high]).all() else f"from {low:.6g} to {high:.6g}"
            range_text = "unique" if alone else f"undetermined, {reach}"
            lines.append(f"effort of {joint:24} {value + 0.0:14.6f} {'N' if slide else 'N m':4} {range_text}")
    if slides:
        lines.append("A slide's effort is positive where it pushes: the tension of a limb is its negative.")
    text = "\n".join([*lines, *(f"\n{reaction}" for reaction in reactions)])
    efforts = {joint: {"value": forces.effort(joint), "interval": forces.effort_interval(joint)} for joint in actuated}
    joints = {each.name: each for each in reactions}
    deliver(
        options,
        text,
        json=lambda: joined_json(exo, forces=forces, efforts=efforts, reactions=joints, cautions=forces.cautions),
    )
    return 0


def _as_reaction(options: argparse.Namespace) -> list[str]:
    """The words of ``exo-pin reaction`` with the same options."""
    names = (*_POSE, "side", "person", "elbow_flexion", "payload", "out")
    given = {name: value for name in names if (value := getattr(options, name)) is not None}
    plain = ["--json"] if options.json else []
    return ["reaction", options.design, *(f"--{key.replace('_', '-')}={value}" for key, value in given.items()), *plain]


def _default_joints(chain: ClosedChain) -> list[str]:
    """The shoulder where there is one, else the closures that transmit a wrench."""
    if chain.roles.shoulder is not None:
        return [chain.roles.shoulder]
    return [closure.name for closure in chain.closures if not closure.kind.is_coupling]


def _wrenches(texts: list[str]) -> dict[str, np.ndarray]:
    """Wrenches by frame; several on one frame add up."""
    total: dict[str, np.ndarray] = {}
    for text in texts:
        expected = "--external FRAME=FX,FY,FZ or with ,MX,MY,MZ behind"
        frame, values = named_numbers(text, expected, 3, 6, finite=True)
        total[frame] = total.get(frame, np.zeros(6)) + np.append(values, np.zeros(6 - len(values)))
    return total
