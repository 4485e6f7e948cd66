"""Whether a person's arm can have made a recorded movement, and which other reading of the record it could have made.

A shoulder's range is a region of directions of the arm, somewhat smaller than the one of which single poses warn
(:mod:`exo_pin.load_case.case`), and in each direction an interval of rotation about the arm's own axis. The
middle of the interval is the arm turned by the shortest way from hanging as long as it is below the horizontal.
Overhead it is the one in which the front of the arm faces the midline, whichever way it was raised (Codman's paradox).
"""

from __future__ import annotations

from collections.abc import Callable, Mapping
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray
from scipy.spatial.transform import Rotation

from ...core.conventions import mirrored
from ...core.validation import FloatArray
from .angles import Y_UP

#: Inward rotation of the arm beyond which nobody turns it, rad, from the middle; outward, hanging and horizontal.
_INWARD, _OUTWARD = np.radians(115.0), (np.radians(100.0), np.radians(140.0))
#: Most backward component of the arm's direction; most component into the body, unless this far forward: sines.
_BACKWARD, _ACROSS, _IN_FRONT = np.sin(np.radians([52.0, 40.0, 20.0]))
#: Share of samples outside the range from which on the stated reading is doubted, is refused, and another is no better.
_DOUBTFUL, _IMPOSSIBLE, _FINE = 0.05, 0.25, 0.01
#: Speed of a person's arm, rad/s, over so many s.
_FASTEST, _SPAN = 30.0, 0.05
#: A turn from hanging below which an arm hangs, and one from the horizontal above which it is raised, rad.
_HANGING, _RAISED = np.radians(45.0), np.radians(10.0)
#: Largest turn of a record that could be radians called degrees, and its least turn if it is, rad.
_TINY, _MOVED = np.radians(3.3), np.radians(15.0)
#: Distance from a stated start, rad, of another one, and of the same.
_ELSEWHERE, _THERE = np.radians(30.0), np.radians(20.0)
#: Turn of the trunk at the start, rad, from which on it is not upright, in place of what the record needs.
_LEANING = np.radians(45.0)
#: Least flexion of an elbow whose plane shows, and how far that plane may be from the front of the arm, rad.
_BENT, _ASIDE = np.radians([30.0, 75.0])
#: Largest noise, rad, of a reading: radians that are really degrees multiply it.
_NOISE = np.radians(2.0)
#: Most samples that are looked at.
_MOST = 2000

#: Readings of a record besides the stated one, the likelier one first: what is then taken for true.
READINGS = {
    "w-first": "quaternions are w, x, y, z",
    "w-last": "quaternions are x, y, z, w",
    "radians": "angles are radians",
    "degrees": "angles are degrees",
    "turned-trunk": "the trunk's sensor points backward with the axis that is said to point forward",
    "inverse": "orientations take {O_A} to {O_B} (transposed matrices)",
    "other-order": "angles of (4-7), X-Y-Z, stand under flexion, abduction and internal rotation, or these under them",
    "other-side": "orientations are of the other side of the body",
    "y-up": "axes are x forward, y up, z right, as OpenSim and the ISB have them",
    "t-pose": "the arm is stretched to the side where angles are zero",
    "minus-flexion": "flexion is counted backward",
    "minus-abduction": "abduction is counted inward",
    "minus-elevation": "elevation is counted downward",
    "milliseconds": "times are ms",
    "seconds": "times are s",
}
#: Accept a record as it stands.
AS_NAMED = "as-named"


def of_orientations(poses: Rotation, side: str) -> dict[str, Callable[[], Rotation]]:
    """Readings of orientations of whatever kind."""
    turn = Rotation.from_euler("x", -90.0 if side == "right" else 90.0, degrees=True)
    return {
        "inverse": poses.inv,
        "other-side": lambda: mirrored(poses),
        "y-up": lambda: Y_UP.inv() * poses * Y_UP,
        "t-pose": lambda: poses * turn,
    }


class Reading(NamedTuple):
    """A record in one reading.

    Attributes
    ----------
    poses : Rotation
        Of the arm, shape (N,), {O_B} to {O_A}.
    times : ndarray or None
        Shape (N,), s; None for poses that are no movement.
    leaning : float
        How far the trunk, or the axis of its sensor that points forward, is from where it is in a person who stands
        upright, at the start, rad; 0 where only the arm is known.
    forearm : ndarray or None
        Direction of the forearm in axes of the arm, shape (N, 3).
    """

    poses: Rotation
    times: FloatArray | None = None
    leaning: float = 0.0
    forearm: FloatArray | None = None

    @property
    def aside(self) -> float:
        """Of the samples with a bent elbow, the share that bends sideways or backward; 0 if it is seldom bent."""
        if self.forearm is None:
            return 0.0
        x, y, z = self.forearm.T
        bent = -z < np.cos(_BENT)
        return float((np.abs(np.arctan2(y, x)) > _ASIDE)[bent].mean()) if bent.mean() > _DOUBTFUL else 0.0


class Evidence(NamedTuple):
    """What a reading of a record says about the arm.

    Attributes
    ----------
    outside : float
        Share of the samples outside a shoulder's range.
    hanging, raised : bool
        Whether the arm hangs, or is above the horizontal, in the first sample.
    speed : float
        Largest angular velocity, rad/s; 0 without times.
    moved : float
        Largest turn from the first sample, rad.
    noise : float
        Median of the turn that three samples in a row are off a straight way, rad.
    effort : float
        How far on average the arm is turned from the middle of its range, 0 to 1: less is likelier.
    from_start : float
        Turn from the stated start, rad; 0 without one.
    leaning : float
        As in :class:`Reading`.
    aside : float
        As in :class:`Reading`.
    """

    outside: float
    hanging: bool
    raised: bool
    speed: float
    moved: float
    noise: float
    effort: float
    from_start: float
    leaning: float
    aside: float

    @property
    def is_possible(self) -> bool:
        """Whether an arm can have moved like this."""
        moves = self.speed <= _FASTEST and self.noise <= _NOISE and self.from_start <= _THERE
        return moves and max(self.outside, self.aside) <= _FINE and self.leaning <= _LEANING


def turned_about_own_axis(matrices: FloatArray, side: str) -> FloatArray:
    """Inward rotation of the arm from the middle of its interval in each direction, rad, shape (N,)."""
    _, _, z, w = Rotation.from_matrix(matrices).as_quat().T
    inward = 2.0 * np.arctan2(-z if side == "left" else z, w)
    plane = np.arctan2(-matrices[:, 0, 2], _outward(matrices, side))
    above = (np.arccos(matrices[:, 2, 2].clip(-1.0, 1.0)) / (0.5 * np.pi) - 1.0).clip(0.0, 1.0)
    middle = above * (2.0 * plane - 0.5 * np.pi)
    return np.asarray(np.remainder(inward - middle + np.pi, 2.0 * np.pi) - np.pi)


def _outward(matrices: FloatArray, side: str) -> FloatArray:
    """Component of the arm's direction away from the body, shape (N,)."""
    return np.asarray(-matrices[:, 1, 2] if side == "left" else matrices[:, 1, 2])


def unreachable(matrices: FloatArray, side: str) -> NDArray[np.bool_]:
    """Whether no shoulder brings the arm into a pose, shape (N,)."""
    inward = turned_about_own_axis(matrices, side)
    forward, outward = -matrices[:, 0, 2], _outward(matrices, side)
    raised = np.arccos(matrices[:, 2, 2].clip(-1.0, 1.0))
    most = np.interp(raised, np.radians([30.0, 90.0]), _OUTWARD)
    turned = (inward > _INWARD) | (inward < -most)
    return np.asarray(turned | (forward < -_BACKWARD) | ((outward < -_ACROSS) & (forward < _IN_FRONT)))


def evidence(reading: Reading, side: str, start: Rotation | None = None) -> Evidence:
    """What a reading says of the arm."""
    poses, times = reading.poses, reading.times
    few = poses[:: max(1, len(poses) // _MOST)]
    matrices = few.as_matrix()
    inward = turned_about_own_axis(matrices, side)
    outside = unreachable(matrices, side)
    # Behind the trunk and across it an arm is seldom.
    behind = np.maximum(matrices[:, 0, 2], 0.0) + np.maximum(-_outward(matrices, side), 0.0)
    effort = float((0.5 * np.abs(inward) / np.pi + 0.5 * behind).mean())
    first = matrices[0]
    moved = float((few * few[0].inv()).magnitude().max())
    speed, noise = 0.0, 0.0
    if times is not None and len(poses) > 2:
        span = max(1, round(_SPAN / max(float(np.median(np.diff(times))), 1e-9)))
        span = min(span, max(1, len(poses) // 20))
        rates = (poses[span:] * poses[:-span].inv()).magnitude() / np.maximum(times[span:] - times[:-span], 1e-12)
        speed = float(np.quantile(rates, 0.98))
        steps = (poses[1:] * poses[:-1].inv()).as_rotvec()
        noise = float(np.median(np.linalg.norm(np.diff(steps, axis=0), axis=1)))
    hanging = float(np.arccos(np.clip(0.5 * (np.trace(first) - 1.0), -1.0, 1.0))) < _HANGING
    away = 0.0 if start is None else float((poses[0] * start.inv()).magnitude())
    raised = -first[2, 2] > np.sin(_RAISED)
    share = float(outside.mean())
    return Evidence(share, hanging, bool(raised), speed, moved, noise, effort, away, reading.leaning, reading.aside)


class Doubt(NamedTuple):
    """What speaks against the stated reading of a record.

    Attributes
    ----------
    text : str
        A sentence or two, with what to do.
    readings : tuple of str
        Other readings that a person's arm can have made, the likeliest first.
    is_refused : bool
        Whether the stated reading is impossible while another is not.
    """

    text: str
    readings: tuple[str, ...]
    is_refused: bool


def doubt(
    stated: Reading,
    side: str,
    others: Mapping[str, Callable[[], Reading | None]],
    start: Rotation | None = None,
) -> Doubt | None:
    """Why a record cannot be what it says, and what it can be; None where nothing speaks against it.

    Parameters
    ----------
    stated : Reading
        The record as it names itself.
    side : {"left", "right"}
        Side of the body.
    others : mapping of str to callable
        Other readings by name, of :data:`READINGS`; one that the record cannot have makes None.
    start : Rotation, optional
        Pose in which the movement is known to begin.
    """
    own = evidence(stated, side, start)
    is_movement = stated.times is not None
    reasons = []
    if own.outside > _DOUBTFUL:
        reasons.append(
            f"the arm is outside the range of a {side} shoulder in {100.0 * own.outside:.0f} % of the samples"
        )
    if own.speed > _FASTEST:
        reasons.append(f"the arm turns at up to {own.speed:.3g} rad/s, above the {_FASTEST:g} of a person's")
    if own.from_start > _ELSEWHERE:
        reasons.append(f"the record begins {np.degrees(own.from_start):.0f}° from the stated start")
    if own.aside > _DOUBTFUL:
        reasons.append(f"in {100.0 * own.aside:.0f} % of the samples with a bent elbow it bends sideways or backward")
    is_tiny = own.moved < _TINY and is_movement
    leans = own.leaning > _LEANING
    if not reasons and not is_tiny and not leans and not (own.raised and is_movement):
        return None
    read = {name: make() for name, make in others.items()}
    found = {name: evidence(each, side, start) for name, each in read.items() if each is not None}
    if not reasons and is_tiny:
        reasons.append(f"the arm turns by no more than {np.degrees(own.moved):.2g}° in all")
        found = {name: each for name, each in found.items() if name == "radians" and each.moved > _MOVED}
    elif not reasons:
        if leans:
            reasons.append(f"the trunk is {np.degrees(own.leaning):.0f}° from upright at the start")
        if own.raised and is_movement:
            reasons.append("the record begins with the arm above the horizontal")
        found = {name: each for name, each in found.items() if each.hanging}
        if not any(each.is_possible for each in found.values()):
            return None
    elif is_tiny:
        found = {name: each for name, each in found.items() if each.moved > own.moved}
    return _said(reasons, own, found, is_movement)


def _said(reasons: list[str], own: Evidence, found: Mapping[str, Evidence], is_movement: bool) -> Doubt | None:
    order = list(READINGS)
    fits = [name for name, each in found.items() if each.is_possible]
    started = [name for name in fits if found[name].hanging]
    fits = started if started and is_movement else fits
    fits.sort(key=lambda name: (round(found[name].effort, 2), order.index(name)))
    said = f"{reasons[0][0].upper()}{'; '.join(reasons)[1:]}."
    if not fits:
        if not is_movement or (own.moved < _TINY and own.outside <= _DOUBTFUL):
            return None
        advice = "No other reading that is known fits better: check axes, order and signs of the angles, and the side."
        return Doubt(f"{said} {advice}", (), False)
    best = fits[0]
    others = " and ".join(f'reading="{name}"' for name in fits[1:3])
    more = f" It also fits {others}." if others else ""
    advice = f'It fits an arm where {READINGS[best]}: reading="{best}" (--reading {best}).{more}'
    begins = own.raised and found[best].hanging and own.outside > _DOUBTFUL
    impossible = max(own.outside, own.aside) > _IMPOSSIBLE or own.speed > _FASTEST or (is_movement and begins)
    return Doubt(
        f'{said} {advice} If the record is right as it is: reading="{AS_NAMED}" (--reading {AS_NAMED}).',
        tuple(fits),
        impossible,
    )
