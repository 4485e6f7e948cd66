"""``exo-pin kinematics`` and ``singularity``: poses from measurements, and singular poses."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Annotated, Any

import numpy as np

from ..chain import ClosedChain
from ..chain.kinematics.assemblies import Assemblies
from ..core.conventions import shoulder_angles, thesis_angles
from ..core.errors import InvalidInput
from ..core.schema import OnDesign, joined
from ..core.tables import aligned, filled
from ..core.validation import FloatArray
from ..design import DEFAULT_PRESET
from ..device.accuracy.pose_accuracy import PoseAccuracy
from ..exo.loading import load
from ..exo.shoulder_exo import ShoulderExo
from ..load_case.ranges_of_motion import ADL_BOX, DAILY_RANGES
from ..reaction.holding.verdict import describe_axis
from ..wrist import AssemblyModes, NearestSingularity, RangeCrossing, Singularity, daily_crossings
from ..wrist.kinematics.inverse import LimbState
from ..wrist.singularities.singular_surface import side_of_rest
from . import options
from .command import Files, writes
from .robot_commands import configuration, joint_value

#: Assembly modes that a table has room for.
_MOST_MODES = 6


@dataclass(frozen=True)
class Kinematics(OnDesign):
    """Poses that fit positions of the drives, and how well these place the arm.

    Attributes
    ----------
    modes : AssemblyModes or ndarray
        The poses; of a device that is not a wrist coordinates of all joints, m and rad, a row a mode.
    limbs : LimbState or None
        Lengths and angles of the limbs in the pose.
    accuracy : PoseAccuracy or None
        Of the pose, or the nearest of those that fit; None if none does.
    """

    modes: AssemblyModes | FloatArray
    accuracy: PoseAccuracy | None
    limbs: LimbState | None = None


@dataclass(frozen=True)
class ClosedConfigurations(OnDesign):
    """Closed configurations of a robot without an arm.

    Attributes
    ----------
    assemblies : Assemblies
        What was found.
    """

    assemblies: Assemblies


@dataclass(frozen=True)
class SingularPose(OnDesign):
    """How far a pose is from a singular one.

    Attributes
    ----------
    singularity : Singularity
        Of the pose.
    accuracy : PoseAccuracy
        Of the pose.
    nearest : NearestSingularity or None
        The nearest singular pose, of wrists with three limbs.
    ranges : list
        How much of daily life lies beyond singular poses.
    """

    singularity: Singularity
    accuracy: PoseAccuracy
    nearest: NearestSingularity | None
    ranges: list[Any]


def _device_kinematics(exo: Any, pose: options.Pose, files: Files) -> None:
    """Joints of the device in a pose, in the assembly modes that were found."""
    poses, idle = pose.of(exo), exo.chain_device.structure.idle
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
    head = filled(f"{pose.words(exo)}: {found if is_reached else f'not reached from rest; {found}'}")
    parts = [f"{exo.device.title or exo.name}\n{head}"]
    rows = joint_rows(exo.chain, exo.chain_device.arm_index, modes[:_MOST_MODES])
    if not rows:
        parts.append("It has no joints: springs and cables from torso to arm alone.")
    elif len(modes):
        header = ["joint", *(f"mode {k}" for k in range(1, 1 + min(len(modes), _MOST_MODES)))]
        parts.append("\n".join(aligned([header, *rows])))
    seen = exo.accuracy(poses)
    parts.append(filled(str(seen)))
    files.deliver("\n\n".join(parts), data=lambda: joined(Kinematics, exo, modes=modes, accuracy=seen), exo=exo)


def _robot_kinematics(exo: Any, pose: options.Pose, joints: options.Texts, files: Files) -> None:
    """All closed configurations of a robot without an arm, with joints set, or else its actuated ones as drawn."""
    chain = exo.chain
    held = tuple(joint_value(text)[0] for text in joints) or chain.roles.actuated
    found = chain.assemblies(held, configuration(exo, pose, joints))
    count = min(len(found), _MOST_MODES)
    head = filled(f"{', '.join(held) or 'no joint'} held: {str(found).splitlines()[0]}")
    header = ["joint", *(f"{hits} hits" for hits in found.hits[:count])]
    table = "\n".join(aligned([header, *joint_rows(chain, 0, found.configurations[:count])])) if count else ""
    said = f"{exo.name}\n{head}\n\n{table}".rstrip()
    files.deliver(said, data=lambda: joined(ClosedConfigurations, exo, assemblies=found), exo=exo)


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
            turns = values[:, 0] if values.shape[1] == 1 else np.arctan2(values[:, 1], values[:, 0])
            if chain.metres[model.idx_vs[index]]:
                cells = [f"{np.round(1e3 * value, 2) + 0.0:.2f} mm" for value in turns]
            else:
                # Whole turns do not count.
                turned = 180.0 - (180.0 - np.degrees(turns)) % 360.0
                cells = [f"{np.round(value, 2) + 0.0:.2f} °" for value in turned]
        rows.append([str(model.names[index]), *cells])
    return rows


def _device_singularity(exo: Any, pose: options.Pose, files: Files) -> None:
    """Singularities of a device that is not a wrist."""
    options.refuse("the singular surface is of wrists with three limbs", plot=files.plot)
    state: Any = exo.singularity(pose.of(exo))
    head = f"{exo.device.title or exo.name}\n{pose.words(exo)}: {state.kind}"
    lines = [
        f"margin of the drives, from 0 (singular) to 1 (all moments alike)   {float(state.margin):5.4f}",
        f"turn of the arm about its worst axis over the joints' motion   {float(state.freedom):8.4f}",
        f"reactions that equilibrium does not determine                  {int(state.self_stresses):8d}",
    ]
    axis = describe_axis(state.lost_direction)
    seen = filled(str(exo.accuracy(pose.of(exo))))
    text = "\n\n".join([head, "\n".join(lines), f"The drives resist a moment least about {axis}.", seen])
    files.deliver(text, data=state.document, exo=exo)


#: Limb lengths, mm, below which all of them are likely to be metres.
_SHORT = 3.0


@writes(".json")
def kinematics(
    design: options.Design = DEFAULT_PRESET,
    /,
    *,
    side: options.Side = None,
    pose: options.Pose = options.Pose(),
    set: options.Joints = (),
    leave_out: options.LeaveOut = (),
    lengths: Annotated[str | None, options.called("MM,...")] = None,
    files: Files = Files(),
) -> None:
    """Compute limb lengths and joint angles in a pose, or the poses that fit measured lengths.

    Without measurements: lengths and angles in the pose, and every other pose with the same lengths. With measurements:
    every pose that fits them, and which is closest to the pose (default: rest). Of a device that is no wrist: its
    joints in the pose, in every assembly mode that is found. Of a robot without an arm: every closed configuration that
    is found with the joints of --set, or its actuated ones, held.

    Parameters
    ----------
    lengths : str, optional
        Measured limb lengths between joint centres, mm, one for each limb.

    Examples
    --------
    exo-pin kinematics --flexion 30
    exo-pin kinematics prototype --lengths 262.96,330.50,384.21
    """
    exo = load(design, side=side, leave_out=leave_out)
    if exo.has_arm:
        options.refuse("--set is for robots without an arm: joints of a device follow its arm", set=set)
    if exo.wrist is None:
        options.refuse("poses from measured lengths are of wrists", lengths=lengths)
        if exo.has_arm:
            _device_kinematics(exo, pose, files)
        else:
            _robot_kinematics(exo, pose, set, files)
        return
    near, parts, limbs = pose.of(exo), [exo.device.title or exo.name], None
    if lengths is None:
        limbs = exo.inverse_kinematics(near)
        own = limbs.lengths
        parts.append(f"{pose.words(exo)}\n{_limb_table(limbs)}")
    else:
        n = exo.geometry.limb_count
        given = np.array(options.numbers(lengths, f"--lengths as {n} numbers with commas between", n))
        if 0.0 < np.abs(given).max() < _SHORT:
            raise InvalidInput(f"expected --lengths in mm, got {lengths} (metres?)")
        own = 1e-3 * given
    modes = exo.forward_kinematics(own, near=near)
    # Of the pose that is asked, or the one of those that fit.
    seen = exo.accuracy(near) if limbs else exo.accuracy(modes.rotations[int(modes.nearest)]) if modes.count else None
    parts += [_modes_table(exo, modes), *([] if seen is None else [filled(str(seen))])]
    files.deliver(
        "\n\n".join(parts),
        data=lambda: joined(Kinematics, exo, modes=modes, limbs=limbs, accuracy=seen),
        exo=exo,
    )


def _limb_table(state: Any) -> str:
    lines = [f"{'limb':>4} {'length, mm':>11} {'θ_xA, °':>9} {'θ_yA, °':>9} {'θ_xB, °':>9} {'θ_yB, °':>9}"]
    columns = (state.base_theta_x, state.base_theta_y, state.platform_theta_x, state.platform_theta_y)
    for i in range(len(state.lengths)):
        joint_angles = " ".join(f"{np.degrees(column[i]):9.3f}" for column in columns)
        lines.append(f"{i + 1:>4} {state.lengths[i] * 1e3:11.3f} {joint_angles}")
    return "\n".join(lines)


def _modes_table(exo: ShoulderExo, modes: AssemblyModes) -> str:
    count = int(modes.count)
    if count == 0:
        return f"no pose fits: {modes.status}"
    noun = "pose fits" if count == 1 else "poses fit"
    lines = [
        f"{count} {noun}{', some of them modes that meet' if modes.status == 'meeting' else ''}",
        f"     {'flexion, abduction, internal, °':>32} {'(4-7) θx, θy, θz, °':>32} {'residual, mm':>14} {'margin':>9}",
    ]
    for k in np.flatnonzero(modes.valid):
        mode = modes.rotations[int(k)]
        clinical, printed = shoulder_angles(mode, exo.side, degrees=True), thesis_angles(mode, degrees=True)
        mark = "*" if modes.nearest == k else " "
        lines.append(
            f"{mark}{k + 1:>3} "
            + " ".join("".join(f"{round(angle, 4) + 0.0:11.4f}" for angle in triple) for triple in (clinical, printed))
            + f" {1e3 * modes.residual[k]:14.1e} {modes.margin[k]:9.4f}"
        )
    doubt = "; another may be meant" if modes.ambiguous else ""
    lines.append(f"* closest to the given pose{doubt}. Two modes meet where the margin is 0.")
    return "\n".join(lines)


@writes(".json", plot="det X over flexion and abduction")
def singularity(
    design: options.Design = DEFAULT_PRESET,
    /,
    *,
    side: options.Side = None,
    pose: options.Pose = options.Pose(),
    files: Files = Files(),
) -> None:
    """Show how far a pose is from a singular one, in which the limbs cannot resist a moment about some axis.

    It also shows how much of daily life lies beyond the singular poses.

    Examples
    --------
    exo-pin singularity prototype --abduction 60
    exo-pin singularity prototype --abduction 90 --plot map.png
    """
    exo = load(design, side=side)
    if exo.wrist is None:
        _device_singularity(exo, pose, files)
        return
    poses = pose.of(exo)
    state = exo.singularity(poses)
    # More than three limbs have no singular surface, hence no sides and no way to its nearest point.
    nearest = exo.nearest_singularity(poses) if exo.geometry.limb_count == 3 else None
    crossings = []
    if nearest is not None and side_of_rest(exo.geometry) != 0:
        crossings = daily_crossings(exo.geometry, (ADL_BOX, *DAILY_RANGES), side=exo.side)
    head = f"{exo.device.title or exo.name}\n{pose.words(exo)}: {state.kind}"
    seen = exo.accuracy(poses)
    parts = [head, _singularity_table(exo, state, nearest), filled(str(seen))]
    parts.append(_sides(nearest, crossings))

    def figure() -> Any:
        from ..view.plots.angle_maps import determinant_map

        return determinant_map(exo, internal_rotation=pose.internal_rotation).figure

    files.deliver(
        "\n\n".join(parts),
        data=lambda: joined(SingularPose, exo, singularity=state, accuracy=seen, nearest=nearest, ranges=crossings),
        figure=figure,
        exo=exo,
    )


def _singularity_table(exo: ShoulderExo, state: Singularity, nearest: NearestSingularity | None) -> str:
    # Rounded first, so that no -0.0 is printed.
    x, y, z = np.round(state.lost_direction, 3) + 0.0
    rows = {} if nearest is None else {"det X": f"{state.determinant:+.5f}{_side(exo, state)}"}
    rows["reach h_i"] = f"{', '.join(f'{h * 1e3:.1f}' for h in state.reach)} mm"
    if nearest is not None:
        there = np.round(shoulder_angles(nearest.pose, exo.side, degrees=True), 1) + 0.0
        rows["nearest singular pose"] = (
            f"{nearest.degrees:.2f}° away, at flexion {there[0]:.1f}°, abduction {there[1]:.1f}°, "
            f"internal rotation {there[2]:.1f}°"
        )
    rows |= {
        "limb force per moment, worst": _bounded(float(state.amplification), "N per N m"),
        "axis that the limbs resist least": f"({x:.3f}, {y:.3f}, {z:.3f})",
    }
    if nearest is not None:
        shift = _bounded(float(state.centre_shift), "mm per mm of play in each limb")
        rows["centre shift without ball joint"] = shift
    rows["condition of the limbs"] = _bounded(float(state.condition), "")
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


def _bounded(value: float, unit: str) -> str:
    """A number with its unit; in words where it has no bound."""
    return f"{value:.1f} {unit}".rstrip() if value < 1e9 else "without bound"
