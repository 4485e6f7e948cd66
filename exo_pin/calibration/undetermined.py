"""What measured lengths cannot determine: directions in which the unknowns may move without a length changing.

Known by derivation, of b = R b' and a seen from the shoulder's centre, l² = |a|² + |b'|² - 2 aᵀ R b':

* with the joints and the device's offset both unknown, all joints of a ring may move one way and the offset the other;
* with the joints of a ring and the mounting of its sensor both unknown, the ring may turn with the frame;
* where |a_i| = |b'_i|, A_i may move away from the centre as B_i moves towards it, to first order;
* where all poses turn about one axis, the joints of a limb may move together along it and about it, and one may move
  away from it as the other moves towards it.

Besides these continuous ones each limb has discrete twins: (-a_i, -b'_i), and the same two directions with the
distances |a_i| and |b'_i| exchanged, give the same lengths in all poses. The nominal design decides which is meant.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
import pinocchio as pin
import scipy

from ..core.validation import FloatArray, ReadOnly
from .length_model import LengthModel

#: A known direction is among the undetermined ones if this much of it, or less, lies outside them.
_OUTSIDE_EXACT, _OUTSIDE_WEAK = 1e-5, 0.2
#: A direction with less outside those that are listed already is one of them.
_NEW = 0.1
#: Components below this part of the largest are left out of a description.
_SMALL = 0.05
#: Poses turn about one axis if turns about all others are below this part.
_ONE_AXIS = 0.05


@dataclass(frozen=True, eq=False)
class Undetermined(ReadOnly):
    """One direction in the unknowns that the data do not determine.

    Attributes
    ----------
    description : str
        What moves, in words.
    direction : ndarray
        Shape (p,), changes of the unknowns, largest component 1 (m or rad).
    standard_deviation : float
        Of the data alone along it, m or rad of the largest component; infinite where no length changes at all.

    Examples
    --------
    >>> from exo_pin.calibration import pose_information
    >>> exo = ep.load("three-linear-actuators")
    >>> one = pose_information(exo.pose(flexion=[30]), exo, unknowns="base_points", length_noise=1e-3)
    >>> len(one.undetermined), one.undetermined[0].standard_deviation  # nine coordinates of A_i, three lengths
    (6, inf)
    """

    description: str
    direction: FloatArray
    standard_deviation: float

    @property
    def is_exact(self) -> bool:
        """Whether no length changes along it, to first order; else noise is too large or poses are too alike."""
        return not np.isfinite(self.standard_deviation)

    def __str__(self) -> str:
        if self.is_exact:
            return self.description
        return f"{self.description} (standard deviation {1e3 * self.standard_deviation:.3g} mm or mrad)"


def one_axis(measured: FloatArray) -> FloatArray | None:
    """The axis, in the frame of the arm's sensor, about which all poses turn; None if there is no such axis."""
    relative = np.swapaxes(measured[:1], 1, 2) @ measured
    turns = np.array([pin.log3(turn) for turn in relative])
    _, sizes, axes = np.linalg.svd(turns, full_matrices=False)
    if len(turns) < 2 or sizes[0] < 1e-9:
        return None
    return axes[0] if len(sizes) < 2 or sizes[1] <= _ONE_AXIS * sizes[0] else None


def named_directions(
    model: LengthModel, values: FloatArray, measured: FloatArray, space: FloatArray, deviations: FloatArray
) -> tuple[Undetermined, ...]:
    """Directions with names as far as they are known, the others by their largest components.

    Parameters
    ----------
    model, values, measured
        As in :meth:`LengthModel.evaluate`.
    space : ndarray
        Shape (p, k): orthonormal directions of unknowns divided by ``model.scales``.
    deviations : ndarray
        Shape (k,): standard deviation along each, infinite where no length changes.
    """
    found: list[Undetermined] = []
    for exact in (True, False):
        chosen = ~np.isfinite(deviations) if exact else np.isfinite(deviations)
        whole, own = space[:, chosen], deviations[chosen]
        left = whole
        for name, direction in _known(model, values, measured):
            if left.shape[1] == 0:
                break
            scaled = direction / model.scales
            scaled /= np.linalg.norm(scaled)
            inside, new = whole @ (whole.T @ scaled), left @ (left.T @ scaled)
            if np.linalg.norm(scaled - inside) > (_OUTSIDE_EXACT if exact else _OUTSIDE_WEAK):
                continue
            # The sum of directions that are listed already is none of its own.
            if np.linalg.norm(new) > _NEW:
                found.append(_direction(model, name, inside, _deviation(whole, own, inside)))
                left = left @ scipy.linalg.null_space((left.T @ new)[None], rcond=1e-8)
        for column in _localised(left).T:
            text = _components_of(model, column)
            found.append(_direction(model, text, column, _deviation(whole, own, column)))
    return tuple(found)


def _direction(model: LengthModel, name: str, scaled: FloatArray, deviation: float) -> Undetermined:
    direction = scaled * model.scales
    largest = float(np.abs(direction).max())
    size = largest / float(np.linalg.norm(scaled))
    return Undetermined(name, direction / direction[np.abs(direction).argmax()], deviation * size)


def _deviation(space: FloatArray, deviations: FloatArray, scaled: FloatArray) -> float:
    """Standard deviation along a direction of the space, in the scaled unknowns."""
    if not np.isfinite(deviations).all():
        return float("inf")
    weights = space.T @ (scaled / np.linalg.norm(scaled))
    return float(np.sqrt(((weights * deviations) ** 2).sum()))


def _known(model: LengthModel, values: FloatArray, measured: FloatArray) -> list[tuple[str, FloatArray]]:
    """Directions that are undetermined in principle, if the unknowns that they move are unknown."""
    a, b = model.joints(values)
    found = []
    for ring, points, offset in (
        ("base", "base_points", "base_offset"),
        ("platform", "platform_points", "cuff_offset"),
    ):
        if {points, offset} <= set(model.unknowns):
            for axis, step in zip("xyz", np.eye(3), strict=True):
                change = _change(model, {points: np.tile(step, (len(a), 1)), offset: -step})
                found.append((f"all joints of the {ring} along {axis}, its offset the other way", change))
    for frame, points, mounting, joints, sign in (
        ("base frame {O_A}", "base_points", "torso_mounting", a, 1.0),
        ("arm frame {O_B}", "platform_points", "arm_mounting", b, -1.0),
    ):
        if {points, mounting} <= set(model.unknowns):
            back = np.linalg.inv(pin.Jexp3(-sign * model.group(mounting, values)))
            for axis, step in zip("xyz", np.eye(3), strict=True):
                change = _change(model, {points: np.cross(step, joints), mounting: sign * back @ step})
                found.append((f"turn of the {frame} about {axis}: its joints with its sensor's mounting", change))
    if {"base_points", "platform_points"} <= set(model.unknowns):
        found += _limb_directions(model, values, measured, a, b)
    return found


def _limb_directions(
    model: LengthModel, values: FloatArray, measured: FloatArray, a: FloatArray, b: FloatArray
) -> list[tuple[str, FloatArray]]:
    found, own = [], one_axis(measured)
    torso, arm = model.mountings(values)
    for i in range(len(a)):
        moves = {}
        if own is not None:
            u, v = torso.apply(measured[0] @ own), arm.inv().apply(own)
            moves[" together along the one axis of all poses"] = (u, v)
            moves[" together about the one axis of all poses"] = (np.cross(u, a[i]), np.cross(v, b[i]))
            moves[": one away from the one axis of all poses, the other towards it"] = _apart(a[i], b[i], u, v)
        moves[": one away from the centre, the other towards it"] = (a[i], -b[i])
        for text, (base, platform) in moves.items():
            ring = np.zeros((2, len(a), 3))
            ring[0, i], ring[1, i] = base, platform
            change = _change(model, {"base_points": ring[0], "platform_points": ring[1]})
            found.append((f"A_{i + 1} and B_{i + 1}{text}", change))
    return found


def _apart(
    a: FloatArray, b: FloatArray, base_axis: FloatArray, platform_axis: FloatArray
) -> tuple[FloatArray, FloatArray]:
    """A_i away from the axis, B_i towards it, and both along it so that |a|² + |b|² - 2 (a·u)(b·u) stays."""
    high, low = float(a @ base_axis), float(b @ platform_axis)
    across_a, across_b = a - high * base_axis, b - low * platform_axis
    gap = high - low
    shift = 0.0 if abs(gap) < 1e-9 else -float(across_a @ across_a - across_b @ across_b) / gap
    return across_a + shift * base_axis, -across_b


def _change(model: LengthModel, groups: dict[str, FloatArray]) -> FloatArray:
    change = np.zeros(model.size)
    for name, step in groups.items():
        change[model.places[name]] = np.ravel(step)
    return change


def _localised(space: FloatArray) -> FloatArray:
    """The same space spanned by directions with as few components as a pivoted elimination finds."""
    if space.shape[1] == 0:
        return space
    _, _, pivots = scipy.linalg.qr(space.T, pivoting=True)
    chosen = pivots[: space.shape[1]]
    directions = space @ np.linalg.inv(space[chosen])
    return directions / np.linalg.norm(directions, axis=0)


def _components_of(model: LengthModel, scaled: FloatArray) -> str:
    direction = scaled * model.scales
    parts = direction / direction[np.abs(direction).argmax()]
    order = [k for k in np.argsort(-np.abs(parts)) if abs(parts[k]) > _SMALL]
    words = [f"{parts[k]:+.2g} {model.names[k]}" for k in order[:4]]
    return ", ".join(words) + (", ..." if len(order) > 4 else "")
