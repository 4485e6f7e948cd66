"""How much measured lengths say about the unknowns: covariance, singular values, undetermined directions."""

from __future__ import annotations

import functools
from dataclasses import dataclass

import numpy as np
import pinocchio as pin
import scipy

from ..core.errors.checked import checked
from ..core.records import Record
from ..core.validation import FloatArray, ReadOnly, frozen
from .length_model import LengthModel, Lengths

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


#: Singular values below this part of the largest are zero.
_RANK = 1e-10
#: A quantity with this part of itself, or less, in undetermined directions is determined.
_TOUCHES = 1e-6
#: A direction whose standard deviation is beyond this part of the joints' distance from the centre is not determined.
_TOO_UNCERTAIN = 0.1


def whitening(lengths: Lengths, length_noise: float, orientation_noise: float) -> FloatArray:
    """Matrices that make the errors of one pose's lengths independent with standard deviation 1, shape (N, n, n).

    An error of the measured orientation moves all lengths of its pose at once: the covariance is
    σ_l² 1 + σ_R² G Gᵀ with G the lengths' derivatives by a turn of the arm (errors in variables, to first order).
    """
    G = lengths.by_orientation
    n = G.shape[1]
    covariance = length_noise**2 * np.eye(n) + orientation_noise**2 * (G @ np.swapaxes(G, 1, 2))
    return np.linalg.inv(np.linalg.cholesky(covariance))


@checked
class Information(Record):
    """Of lengths measured in some poses, and of tolerances.

    Parameters
    ----------
    model : LengthModel
        The unknowns.
    values : ndarray
        Shape (p,), where the derivatives are taken.
    measured : ndarray
        Shape (N, 3, 3), orientations as measured.
    jacobian : ndarray
        Shape (N n, p): derivatives of the lengths, errors independent with standard deviation 1.
    variance : float
        Of these errors, if it is not 1.
    prior : ndarray
        Shape (p,): standard deviation of each unknown before any measurement; infinite if there is no tolerance.

    Examples
    --------
    >>> from exo_pin.calibration import pose_information
    >>> exo = ep.load("three-linear-actuators")
    >>> told = pose_information(exo.pose(flexion=[0, 30, 60]), exo, unknowns="length_offsets", length_noise=1e-3)
    >>> told.rank, (1e3 * told.standard_deviations).round(3)  # mm: 1 mm/√3, of three lengths each
    (3, array([0.577, 0.577, 0.577]))
    """

    def __init__(
        self,
        model: LengthModel,
        values: FloatArray,
        measured: FloatArray,
        jacobian: FloatArray,
        variance: float,
        prior: FloatArray,
    ) -> None:
        self.model, self.values, self.measured, self.prior = model, values, measured, prior
        self.variance = float(variance)
        scaled = _triangle(jacobian * model.scales)
        _, sizes, directions = np.linalg.svd(scaled)
        #: Of the Jacobian, shape (p,), largest first: standard deviations of the lengths per m of a joint.
        self.singular_values = frozen(np.concatenate([sizes, np.zeros(model.size - len(sizes))]))
        self._directions = directions.T
        # Measurements without any error determine exactly what they determine.
        self._known = scaled
        if variance > 0.0:
            self._known = np.concatenate([scaled / np.sqrt(variance), np.diag(model.scales / prior)])

    @property
    def rank(self) -> int:
        """Number of directions that the data determine."""
        return int((self.singular_values > _RANK * max(float(self.singular_values[0]), 1e-300)).sum())

    @functools.cached_property
    def _spectrum(self) -> tuple[FloatArray, FloatArray]:
        """Standard deviation along each of p orthonormal directions of the scaled unknowns, tolerances included."""
        _, sizes, directions = np.linalg.svd(_triangle(self._known))
        sizes = np.concatenate([sizes, np.zeros(self.model.size - len(sizes))])
        zero = sizes <= _RANK * sizes[0]
        deviations = np.full(len(sizes), np.inf)
        deviations[~zero] = 0.0 if self.variance == 0.0 else 1.0 / sizes[~zero]
        return deviations, directions.T

    def spread(self, rows: FloatArray) -> FloatArray:
        """Covariance of linear functions of the unknowns.

        Parameters
        ----------
        rows : ndarray
            Shape (k, p).

        Returns
        -------
        ndarray
            Shape (k, k). A function that is not determined has an infinite variance, and NaN with all others.

        Examples
        --------
        >>> from exo_pin.calibration import pose_information
        >>> exo = ep.load("three-linear-actuators")
        >>> poses = exo.pose(flexion=[0, 20, 40, 60])
        >>> told = pose_information(poses, exo, unknowns="length_offsets", length_noise=1e-3)
        >>> mean = np.full((1, 3), 1.0 / 3.0)
        >>> round(1e3 * float(np.sqrt(told.spread(mean)[0, 0])), 4)  # mm: 1 mm/√12, of the mean of the three
        0.2887
        """
        deviations, directions = self._spectrum
        open_ = ~np.isfinite(deviations)
        along = (rows * self.model.scales) @ directions
        size = np.linalg.norm(along, axis=1)
        lost = np.linalg.norm(along[:, open_], axis=1) > _TOUCHES * np.maximum(size, 1e-300)
        half = along[:, ~open_] * deviations[~open_]
        covariance = half @ half.T
        covariance[lost, :] = covariance[:, lost] = np.nan
        covariance[lost, lost] = np.inf
        return frozen(covariance)

    @functools.cached_property
    def covariance(self) -> FloatArray:
        """Shape (p, p), m² and rad²; infinite variance and NaN where an unknown is not determined."""
        return self.spread(np.eye(self.model.size))

    @functools.cached_property
    def standard_deviations(self) -> FloatArray:
        """Shape (p,), m and rad; infinite where an unknown is not determined."""
        return frozen(np.sqrt(np.diag(self.covariance)))

    @functools.cached_property
    def undetermined(self) -> tuple[Undetermined, ...]:
        """What the measurements alone do not determine, or not to a tenth of the joints' distance from the centre."""
        sizes = self.singular_values
        deviations = np.full(len(sizes), np.inf)
        deviations[: self.rank] = np.sqrt(self.variance) / sizes[: self.rank]
        lost = deviations > _TOO_UNCERTAIN * self.model.reach
        return named_directions(self.model, self.values, self.measured, self._directions[:, lost], deviations[lost])

    @property
    def names(self) -> tuple[str, ...]:
        """Of the unknowns."""
        return self.model.names

    def __str__(self) -> str:
        lost, poses = self.undetermined, len(self.measured)
        if lost:
            lines = [f"{poses} poses do not determine {len(lost)} of {self.model.size} directions:"]
            return "\n".join(lines + [f"  {direction}" for direction in lost])
        worst = 1e3 * float(self.standard_deviations.max())
        return f"{poses} poses determine all {self.model.size} unknowns, each to {worst:.2g} {self.model.unit}"


def _triangle(matrix: FloatArray) -> FloatArray:
    """Upper triangular matrix with the same singular values and directions of unknowns."""
    return np.asarray(scipy.linalg.qr(matrix, mode="r")[0])[: matrix.shape[1]]
