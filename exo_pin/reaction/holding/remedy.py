"""Other poses and postures: the nearest pose that can be held, and the range of forces over the postures of a device.

The search for a pose tries turns of growing angle (rings) about axes spread evenly over the sphere; larger rings have
more axes. Around the first poses that can be held a direct search then shortens the turn. All poses of a ring or of a
step are one stack. A nearer pose between two axes may have been missed. Of the best the whole degrees around it are
checked as they will be printed: a pose that is suggested is held, clear of the wearer and within the range of motion,
and where there is a choice no other pose looks the same to the drives.

Over postures every configuration that idle freedoms lead to, driven or not, from that of the answer within the limits
of the joints, is asked the same question. Freedoms that no drive holds are taken as held where they are, as by
friction. The set is laid out as a net (:mod:`exo_pin.device.turns.idle_joints`), and both ends are searched from its
best configurations.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Mapping
from dataclasses import dataclass, replace
from typing import Any, NamedTuple, cast

import numpy as np
from numpy.typing import NDArray
from scipy.spatial.transform import Rotation

from ...core.conventions import shoulder_angles, shoulder_rotation
from ...core.errors import InvalidInput
from ...core.errors.checked import checked
from ...core.progress import track
from ...core.results import Result
from ...core.tables import enumerated, three_digits
from ...core.validation import FloatArray, ReadOnly, as_single_rotation
from ...device.accuracy.pose_accuracy import pose_accuracy
from ...device.chain_device import ChainDevice
from ...device.device_model import device_model
from ...device.parts.drives import Brake
from ...device.postures import nearest_reached
from ...device.protocol import Device
from ...device.turns.idle_joints import beside, idle_net, undriven_joints
from ...device.wrist_device import as_device
from ...load_case.case import Case, beyond_motion
from ..assumptions import Assumptions
from ..evidence import Infeasibility
from ..solve_case import solve
from .force_range import spread_directions
from .hold_check import HoldCheck
from .verdict import angle_words

#: Largest turn of the search for a pose that can be held, rad.
_REACH = float(np.radians(60.0))
#: Directions in a ring at 60°, fewest directions in any, the distance between rings, rad, and rings in one stack.
_DIRECTIONS, _FEWEST = 96, 32
_STEP = np.radians(2.0)
_RINGS = 5
#: Number of poses that are refined, and of step lengths, each a quarter of the one before, down to 0.03°.
_REFINED = 2
_SCALES = 4
#: How far around it whole degrees are tried, and how many of the nearest ones are asked for twins.
_WHOLE, _ASKED = (1.0, 3.0), 4


class NearestPose(NamedTuple):
    """A pose that can be held.

    Attributes
    ----------
    pose : Rotation
        Single.
    distance : float
        Angle by which the arm must turn, rad; 0 if the given pose can be held.
    check : HoldCheck
        Of that pose.
    has_twin : bool
        Whether another pose looks the same to the drives (:mod:`exo_pin.device.accuracy`).
    """

    pose: Rotation
    distance: float
    check: HoldCheck
    has_twin: bool = False

    def sentence(self, side: str) -> str:
        """Where it is, in words; ``side`` of the body for the angles."""
        if not self.distance:
            return "The pose itself can be held."
        text = f"The nearest held pose found is {np.degrees(self.distance):.0f}° away: {angle_words(self.pose, side)}."
        return f"{text} Another pose looks the same to the drives there." if self.has_twin else text


@dataclass(frozen=True, eq=False)
class Remedy(Result, ReadOnly):
    """Remedies for a single pose that cannot be held.

    Attributes
    ----------
    nearest : NearestPose or None
        A pose nearby, or the pose itself, that can be held, as far as the limits are known; None if none was found
        within 60°.
    infeasibility : Infeasibility or None
        What is missing in the pose itself, the strokes of the limbs left out; None if nothing is missing, or if the
        split leaves no choice (locked actuators).
    side : {"left", "right"}
        Side of the body, for the angles.
    """

    nearest: NearestPose | None
    infeasibility: Infeasibility | None
    side: str

    def __str__(self) -> str:
        if self.nearest is None:
            parts = [f"No pose within {np.degrees(_REACH):.0f}° can be held."]
        else:
            parts = [self.nearest.sentence(self.side)]
        if self.infeasibility is not None and self.infeasibility.infeasible:
            parts.append(self.infeasibility.explain())
        return " ".join(parts)


def remedy(device: Any, case: Case, assumptions: Assumptions, progress: bool = False) -> Remedy:
    """Remedies for a pose that cannot be held.

    Parameters
    ----------
    device : ShoulderExo
        The device.
    case : Case
        Of a single pose at rest: poses nearby are at rest, too.
    assumptions : Assumptions
        Of the question.
    progress : bool
        Whether to show a bar on standard error: an elastic device takes some milliseconds a pose, for up to a thousand
        poses.

    Raises
    ------
    InvalidInput
        If the case has a stack of poses, a motion, or a configuration as its posture.
    """
    if not isinstance(case.posture, Mapping | None):
        raise InvalidInput("expected a posture as values of joints by name: a configuration is that of its own pose")
    if case.motion is not None:
        raise InvalidInput("expected no motion: the poses nearby are at rest; leave it out")
    pose, device = as_single_rotation("poses", case.poses), as_device(device)
    answer = solve(device, case, assumptions)

    def fits(poses: Rotation) -> NDArray[np.bool_]:
        found = solve(device, case.at(poses), assumptions)
        beyond = beyond_motion(poses.as_matrix().reshape(-1, 3, 3), device.side).reshape(poses.shape)
        return _meets_limits(found.limits) & ~(found.clearance < 0.0) & ~beyond

    nearest = None
    if _meets_limits(answer.limits):
        nearest = NearestPose(pose, 0.0, answer.limits)
    elif (found := _nearest_held(fits, pose, device, progress)) is not None:
        there, has_twin = found
        check = solve(device, case.at(there), assumptions).limits
        nearest = NearestPose(there, float((there * pose.inv()).magnitude()), check, has_twin)
    return Remedy(nearest, answer.infeasibility, device.side)


def _nearest_held(
    fits: Callable[[Rotation], NDArray[np.bool_]], asked: Rotation, device: Device, progress: bool
) -> tuple[Rotation, bool] | None:
    """The nearest pose of a search that fits (held, clear, within the range of motion), and if it has a twin."""

    def held(turns: FloatArray) -> NDArray[np.bool_]:
        return fits(Rotation.from_rotvec(turns) * asked)

    reached = nearest_reached(device, asked) if isinstance(device, ChainDevice) else None
    if reached is not None:
        # No pose of a search is one of the few that such a device reaches.
        exact = (reached, pose_accuracy(device, reached).has_twin.item()) if fits(reached).item() else None
        return _in_whole_degrees(fits, reached, asked, device) or exact
    angles = np.arange(_STEP, _REACH + 0.5 * _STEP, _STEP)
    for block in track(np.split(angles, range(_RINGS, len(angles), _RINGS)), "nearest pose", progress):
        turns = np.concatenate([angle * spread_directions(_count(angle)) for angle in block])
        turns = turns[held(turns)]
        if len(turns):
            best = Rotation.from_rotvec(_shortest(held, _spread(turns))) * asked
            if (found := _in_whole_degrees(fits, best, asked, device)) is not None:
                return found
    return None


def _in_whole_degrees(
    fits: Callable[[Rotation], NDArray[np.bool_]], best: Rotation, asked: Rotation, device: Device
) -> tuple[Rotation, bool] | None:
    """The pose of whole degrees around ``best`` that fits and is nearest to the asked one, and if it has a twin."""
    centre = np.round(shoulder_angles(best, device.side, degrees=True))
    for reach in _WHOLE:
        steps = np.arange(-reach, reach + 1.0)
        angles = centre + np.stack(np.meshgrid(steps, steps, steps, indexing="ij"), axis=-1).reshape(-1, 3)
        # Where the outer axes are one, the three angles do not say what they are.
        flexion, abduction, internal = angles[angles[:, 1] % 180.0 != 90.0].T
        poses = shoulder_rotation(flexion, abduction, internal, device.side, degrees=True)
        poses = poses[(poses * asked.inv()).magnitude().argsort()]
        poses = poses[fits(poses)][:_ASKED]
        if len(poses):
            twin = pose_accuracy(device, poses).has_twin
            return poses[int(twin.argmin())], bool(twin.all())
    return None


def _meets_limits(answer: HoldCheck) -> NDArray[np.bool_]:
    """Poses that have an answer and can be held as far as the limits are known."""
    answered = ~np.isnan(answer.tensions).all(axis=-1)
    return np.asarray(answered & ~answer.violated & (answer.can_hold | answer.unknown))


def _count(angle: float) -> int:
    """Number of directions in a ring, as far apart as at 60°."""
    share = np.sin(0.5 * angle) ** 2 / np.sin(np.radians(30.0)) ** 2
    return max(_FEWEST, round(_DIRECTIONS * share))


def _spread(turns: FloatArray) -> FloatArray:
    """The shortest turn, and others that are nearly as short in other directions."""
    size = np.linalg.norm(turns, axis=1)
    units, chosen = turns / size[:, None], [int(size.argmin())]
    while len(chosen) < min(_REFINED, len(turns)):
        apart = np.linalg.norm(units[:, None] - units[chosen], axis=-1).min(axis=1)
        # Directions that are 1 apart, and more, count in full.
        chosen.append(int((size - _STEP * np.minimum(apart, 1.0) * _RINGS).argmin()))
    return turns[chosen]


def _shortest(held: Callable[[FloatArray], NDArray[np.bool_]], turns: FloatArray) -> FloatArray:
    """The shortest rotation vector to a pose that can be held, by direct search from several at once, shape (k, 3)."""
    # Long and short steps in one stack: for an elastic device, a large stack takes little longer than a small one.
    steps = _STEP * 4.0 ** -np.arange(_SCALES)
    before = np.inf
    while np.linalg.norm(turns, axis=1).min() < before - steps[-1]:
        before = float(np.linalg.norm(turns, axis=1).min())
        tries = np.stack([np.concatenate([turn[None], *(_shorter(turn, step) for step in steps)]) for turn in turns])
        length = np.linalg.norm(tries, axis=-1)
        length[:, 1:][~held(tries[:, 1:].reshape(-1, 3)).reshape(len(turns), -1)] = np.inf
        turns = tries[np.arange(len(turns)), length.argmin(axis=1)]
    return np.asarray(turns[np.linalg.norm(turns, axis=1).argmin()])


def _shorter(turn: FloatArray, step: float) -> FloatArray:
    """Turns shorter by a step, in the same direction, and by less to six sides, shape (13, 3)."""
    size = float(np.linalg.norm(turn))
    unit = turn / size
    beside = np.cross(unit, np.eye(3)[np.abs(unit).argmin()])
    beside /= np.linalg.norm(beside)
    azimuth = np.pi / 3.0 * np.arange(6)[:, None]
    around = np.cos(azimuth) * beside + np.sin(azimuth) * np.cross(unit, beside)
    tries = [max(size - step, 0.5 * size) * unit[None]]
    for aside, less in ((1.0, 0.5), (2.0, 0.1)):
        sides = unit + min(1.0, aside * step / size) * around
        tries.append(max(size - less * step, 0.5 * size) * sides / np.linalg.norm(sides, axis=1, keepdims=True))
    return np.concatenate(tries)


#: Halvings of the net's width in the search for an end.
_HALVINGS = 8


@dataclass(frozen=True, eq=False)
class PostureRange(Result, ReadOnly):
    """|F_s| over the postures of a device, in a pose or a stack of shape (...).

    Attributes
    ----------
    least, greatest : ndarray
        Shape (...), N, over the postures that are held, of all that have an answer if none is. Ends of a search.
    at_least, at_greatest : ndarray
        The configurations, shape (..., nq), for ``posture=``.
    postures, held : ndarray of int
        Shape (...): configurations that were asked, and of these those that are held.
    rule : str
        Over what; of a stack that of its first pose.

    Examples
    --------
    >>> exo = ep.load("four-cables")
    >>> found = ep.reaction.posture_range(exo, ep.Case(exo.pose(30)))
    >>> int(found.postures), int(found.held)
    (1, 1)
    """

    least: FloatArray
    greatest: FloatArray
    at_least: FloatArray
    at_greatest: FloatArray
    postures: NDArray[np.intp]
    held: NDArray[np.intp]
    rule: str

    def __str__(self) -> str:
        several = f" in {self.least.size} poses" if self.least.ndim else ""
        return f"{three_digits(self.least.min())} to {three_digits(self.greatest.max())} N{several} over {self.rule}"


@checked
def posture_range(exo: Any, case: Case, assumptions: Assumptions | None = None) -> PostureRange:
    """The range of |F_s| over all postures of a device in each pose of the arm.

    Parameters
    ----------
    exo : ShoulderExo, Device or Mechanism
        The device.
    case : Case
        ``posture`` is where the search begins.
    assumptions : Assumptions, optional
        As of :func:`exo_pin.solve`.

    Returns
    -------
    PostureRange
        Prints as a sentence.

    Raises
    ------
    InvalidInput
        If the device does not reach a pose.

    Examples
    --------
    >>> exo = ep.load("four-cables")
    >>> print(ep.reaction.posture_range(exo, ep.Case(exo.pose(60))))  # nothing moves by itself
    46.1 to 46.1 N over one posture: no joint moves by itself
    """
    shape = case.poses.shape
    found = [_single_range(exo, case.row(k), assumptions) for k in range(math.prod(shape))]
    if not found:
        raise InvalidInput("expected poses for the range over postures, got an empty stack")
    *parts, rules = zip(*found, strict=True)
    ends = [np.array(part).reshape((*shape, *np.shape(part[0]))) for part in parts]
    return PostureRange(*(*ends, rules[0]))


def _single_range(exo: Any, case: Case, assumptions: Assumptions | None) -> tuple[Any, ...]:
    """The fields of :class:`PostureRange` of a single pose."""
    answer = solve(exo, case, assumptions)
    if answer.source.poses.placed is None:
        # Closed forms: spins of limbs about themselves change no force.
        only, none = float(answer.magnitude), np.zeros(0)
        return only, only, none, none, 1, int(answer.held), "one posture: no joint moves by itself"
    # A device that gives way has the postures of the rigid one.
    rigid = answer
    if answer.source.split.moves:
        rigid = solve(exo, replace(case, centre_offset=None), Assumptions(limits="none"))
    placed, device = rigid.source.poses.placed, cast(ChainDevice, rigid.source.poses.mechanism)
    assert placed is not None
    if not placed.reached[0]:
        raise InvalidInput(f"expected a pose that the device reaches, got {answer.status}")
    model = device_model(device)
    loose = undriven_joints(model, placed.q[0])
    if loose:
        names = {drive.name for drive in device.efforts}
        own = [Brake(f"{joint} held" if joint in names else joint, joint) for joint in loose]
        device = device.replace(brakes=(*device.brakes, *own))
    net, whole, width = idle_net(model, placed.q[0])
    count = [0, 0]

    def sizes(places: FloatArray) -> tuple[FloatArray, NDArray[np.bool_]]:
        asked = replace(
            answer.case, wearer=None, poses=Rotation.concatenate([case.poses] * len(places)), posture=places
        )
        found = solve(device, asked, assumptions)
        count[0] += len(places)
        count[1] += int(found.held.sum())
        return np.where(found.has_answer, found.magnitude, np.nan), found.held

    force, held = sizes(net)
    rows = held if held.any() else np.isfinite(force)
    if not rows.any():
        raise InvalidInput("expected a pose with an answer in some posture")
    ends = []
    for sign in (-1.0, 1.0):
        best = int(np.where(rows, sign * force, -np.inf).argmax())
        q, size, step = net[best], float(force[best]), width
        for _ in range(_HALVINGS if width else 0):
            step *= 0.5
            there = np.array(beside(model, q, step)).reshape(-1, len(q))
            if not len(there):
                continue
            near, good = sizes(there)
            near = np.where(good if held.any() else np.isfinite(near), sign * near, -np.inf)
            if near.max() > sign * size:
                q, size = there[near.argmax()], float(sign * near.max())
        ends.append((size, q))
    idle = "joints that move while the arm rests" if width else "one posture: no joint moves by itself"
    rule = f"all postures of {idle}, within their limits" if width else idle
    rule += f"; {enumerated(loose)} held where no drive holds {'it' if len(loose) == 1 else 'them'}" if loose else ""
    rule += "" if whole else f"; the first {len(net)} of them that were found"
    return ends[0][0], ends[1][0], ends[0][1], ends[1][1], *count, rule
