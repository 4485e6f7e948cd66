"""Measured lengths as a function of the unknowns, with exact derivatives.

A sensor pair measures S = R_GTᵀ R_GS, the arm's sensor seen from the torso's (Figure 5-9). The arm's orientation is
R = Q_T S Q_S, with Q_T from the torso's sensor to {O_A} and Q_S from {O_B} to the arm's sensor. Of limb i

    a_i = A_i + ε_base        b_i = R (B_i + ε_cuff)        measured length = (|b_i - a_i| - o_i) / (1 + s)

with A_i and B_i in the device's own frames, ε the offsets of the device's centre from the shoulder's (base frame and
arm frame), o_i the length that the sensor leaves out, the end fittings of a muscle or the zero of an encoder, and s by
how much more than it shows a sensor of lengths passes, the same of all limbs.

Nonlinear least squares for the unknowns, weighted for errors of lengths and orientations.
"""

from __future__ import annotations

from collections.abc import Iterable
from dataclasses import dataclass
from typing import NamedTuple

import numpy as np
import pinocchio as pin
import scipy
from scipy.spatial.transform import Rotation

from ..core.errors import InvalidInput, SolverFailed
from ..core.errors.base import echo
from ..core.records import Record, keeps_read_only
from ..core.validation import FloatArray, as_choice, frozen

#: What can be unknown, and what is written before its components. The unit is m, but rad of the mountings, and that of
#: the scale is 1.
_SYMBOLS = {
    "base_points": "A",
    "platform_points": "B",
    "length_offsets": "length offset",
    "length_scale": "length scale",
    "base_offset": "base offset",
    "cuff_offset": "cuff offset",
    "torso_mounting": "torso mounting",
    "arm_mounting": "arm mounting",
}
GROUPS = tuple(_SYMBOLS)
#: The unit of each in texts and options, and how many of it are one in SI.
UNITS = {name: ("deg", float(np.degrees(1.0))) if name.endswith("mounting") else ("mm", 1e3) for name in GROUPS} | {
    "length_scale": ("%", 100.0)
}


class Lengths(NamedTuple):
    """Measured lengths that a model predicts in N poses, n limbs, p unknowns, of devices in a stack (...).

    Attributes
    ----------
    values : ndarray
        Shape (..., N, n), m.
    by_unknowns : ndarray
        Shape (..., N, n, p): derivatives by the unknowns.
    by_orientation : ndarray
        Shape (..., N, n, 3), m/rad: derivatives by a turn of the arm about the axes of {O_A}.
    """

    values: FloatArray
    by_unknowns: FloatArray
    by_orientation: FloatArray


def as_unknowns(names: str | Iterable[str]) -> tuple[str, ...]:
    """Groups of unknowns in the order of :data:`GROUPS`.

    Raises
    ------
    InvalidInput
        If there is none, or one is unknown (:class:`exo_pin.UnknownName`).
    """
    try:
        given = (names,) if isinstance(names, str) else tuple(names)
    except TypeError:
        raise InvalidInput(f"expected unknowns as names, got {echo(names)}") from None
    found = {as_choice("quantity to calibrate", name, GROUPS) for name in given}
    if not found:
        raise InvalidInput(f"expected one unknown or more of {', '.join(GROUPS)}, got none")
    return tuple(name for name in GROUPS if name in found)


@dataclass(eq=False, repr=False)
class LengthModel(Record):
    """The equations above for one design; the vector of unknowns holds changes from its values.

    Parameters
    ----------
    base, platform : ndarray
        Shape (n, 3), m: A_i and B_i to start from.
    offsets : ndarray
        Shape (n,), m: o_i to start from.
    torso, arm : Rotation
        Q_T and Q_S to start from.
    unknowns : tuple of str
        Of :data:`GROUPS`, in their order.
    known : tuple of str
        Those among them that are known, but for a tolerance.
    """

    base: FloatArray
    platform: FloatArray
    offsets: FloatArray
    torso: Rotation
    arm: Rotation
    unknowns: tuple[str, ...]
    known: tuple[str, ...] = ()

    def __post_init__(self) -> None:
        self.limb_count = len(self.base)
        #: Where each group stands in the vector of unknowns.
        self.places: dict[str, slice] = {}
        names, units = list[str](), list[str]()
        for name in self.unknowns:
            own = _components(name, self.limb_count)
            self.places[name] = slice(len(names), len(names) + len(own))
            names += own
            units += ["rad" if name.endswith("mounting") else "1" if name == "length_scale" else "m"] * len(own)
        #: Number of unknowns p.
        self.size = len(names)
        #: Name of each unknown, such as ``"A_2 x"``, and its unit.
        self.names, self.units = tuple(names), tuple(units)
        self._torso, self._arm = self.torso.as_matrix(), self.arm.as_matrix()
        #: Mean distance of the joints from the centre, m: a turn by 1 rad moves them by this much.
        self.reach = float(np.linalg.norm(np.concatenate([self.base, self.platform]), axis=1).mean())
        #: Changes of the unknowns that move joints by about the same length.
        self.scales = frozen(np.array([1.0 if unit == "m" else 1.0 / self.reach for unit in units]))
        #: Which of the unknowns are asked for, shape (p,): all but those known to a tolerance.
        self.asked = frozen(np.repeat([name not in self.known for name in self.unknowns],
                                      [place.stop - place.start for place in self.places.values()]))  # fmt: skip

    @property
    def unit(self) -> str:
        """Of a thousandth of an unknown, for texts."""
        return "mm, mrad or per mille" if "1" in self.units else "mm or mrad" if "rad" in self.units else "mm"

    def group(self, name: str, values: FloatArray, shape: tuple[int, ...] = (3,)) -> FloatArray:
        """Values of one group in vectors of unknowns (..., p), zero if it is not unknown."""
        stack = values.shape[:-1]
        return (
            values[..., self.places[name]].reshape(*stack, *shape) if name in self.places else np.zeros(stack + shape)
        )

    def points(self, values: FloatArray) -> tuple[FloatArray, FloatArray]:
        """A_i and B_i, shape (..., n, 3) each: joints seen from the device's centre."""
        shape = self.base.shape
        return (
            self.base + self.group("base_points", values, shape),
            self.platform + self.group("platform_points", values, shape),
        )

    def joints(self, values: FloatArray) -> tuple[FloatArray, FloatArray]:
        """A_i + ε_base and B_i + ε_cuff, shape (..., n, 3) each: joints seen from the shoulder's centre."""
        a, b = self.points(values)
        base, cuff = (self.group(name, values)[..., None, :] for name in ("base_offset", "cuff_offset"))
        return a + base, b + cuff

    @property
    def joint_slopes(self) -> FloatArray:
        """Derivatives of :meth:`joints` by the unknowns, shape (2, n, 3, p)."""
        n = self.limb_count
        rows = np.zeros((2, n, 3, self.size))
        for ring, names in enumerate((("base_points", "base_offset"), ("platform_points", "cuff_offset"))):
            for name in set(names) & self.places.keys():
                own = np.eye(3 * n).reshape(n, 3, -1) if name.endswith("points") else np.eye(3)
                rows[ring, ..., self.places[name]] = own
        return rows

    def mountings(self, values: FloatArray) -> tuple[Rotation, Rotation]:
        """Q_T and Q_S, shape (...)."""
        # SciPy takes no read-only array.
        torso, arm = (
            Rotation.from_rotvec(np.array(self.group(name, values))) for name in ("torso_mounting", "arm_mounting")
        )
        return torso * self.torso, self.arm * arm

    def length_offsets(self, values: FloatArray) -> FloatArray:
        """o_i, shape (..., n)."""
        return self.offsets + self.group("length_offsets", values, (self.limb_count,))

    def length_scale(self, values: FloatArray) -> FloatArray:
        """1 + s, shape (...)."""
        return np.asarray(1.0 + self.group("length_scale", values, (1,))[..., 0])

    def lengths(self, values: FloatArray, measured: FloatArray) -> FloatArray:
        """Lengths alone, shape (..., N, n); arguments of :meth:`evaluate`."""
        beyond = self._lines(values, measured)[3] - self.length_offsets(values)[..., None, :]
        return np.asarray(beyond / self.length_scale(values)[..., None, None])

    def _lines(self, values: FloatArray, measured: FloatArray) -> tuple[FloatArray, FloatArray, FloatArray, FloatArray]:
        """R, b_i, b_i - a_i and |b_i - a_i|."""
        a, b = self.joints(values)
        R = measured
        # In sweeps of many devices products of matrices are faster than those of Rotations.
        if "torso_mounting" in self.places:
            R = _turns(self.group("torso_mounting", values)) @ (self._torso @ R)
        else:
            R = self._torso @ R
        R = R @ self._arm
        if "arm_mounting" in self.places:
            R = R @ _turns(self.group("arm_mounting", values))
        ends = b[..., None, :, :] @ np.swapaxes(R, -2, -1)
        lines = ends - a[..., None, :, :]
        return R, ends, lines, np.sqrt((lines**2).sum(axis=-1))

    def evaluate(self, values: FloatArray, measured: FloatArray) -> Lengths:
        """Lengths and their derivatives.

        Parameters
        ----------
        values : ndarray
            Shape (..., p), the unknowns.
        measured : ndarray
            Shape (N, 3, 3), S of each pose.
        """
        R, ends, lines, lengths = self._lines(values, measured)
        b = self.joints(values)[1][..., None, :, :]
        directions = lines / lengths[..., None]
        # Of the platform's joint in {O_B}, and of a turn in {O_A} and {O_B}.
        in_arm = directions @ R
        turned = np.cross(ends, directions)
        out, limbs = np.zeros((*lengths.shape, self.size)), np.arange(self.limb_count)
        scale = self.length_scale(values)[..., None, None]
        own = {"base_points": -directions, "platform_points": in_arm, "base_offset": -directions, "cuff_offset": in_arm}
        for name, place in self.places.items():
            block = out[..., place]
            if name.endswith("points"):
                for i in limbs:
                    block[..., i, 3 * i : 3 * i + 3] = own[name][..., i, :]
            elif name in own:
                block[:] = own[name]
            elif name == "length_offsets":
                block[..., limbs, limbs] = -1.0
            elif name == "length_scale":
                block[..., 0] = (self.length_offsets(values)[..., None, :] - lengths) / scale
            elif name == "torso_mounting":
                # exp(θ + dθ) = exp(J_l dθ) exp(θ), J_l(θ) = J_r(-θ).
                block[:] = turned @ _right_jacobians(-self.group(name, values))
            else:
                block[:] = np.cross(b, in_arm) @ _right_jacobians(self.group(name, values))
        lengths = lengths - self.length_offsets(values)[..., None, :]
        return Lengths(lengths / scale, out / scale[..., None], turned / scale[..., None])


def _turns(turns: FloatArray) -> FloatArray:
    """Matrices of rotation vectors (..., 3), shape (..., 1, 3, 3)."""
    return Rotation.from_rotvec(np.array(turns)).as_matrix()[..., None, :, :]


def _right_jacobians(turns: FloatArray) -> FloatArray:
    """J_r of rotation vectors (..., 3), shape (..., 1, 3, 3)."""
    return np.array([pin.Jexp3(turn) for turn in turns.reshape(-1, 3)]).reshape(*turns.shape[:-1], 1, 3, 3)


def labels(name: str, count: int) -> list[str]:
    """What a group consists of, for ``count`` limbs: points, numbers, or one vector."""
    symbol = _SYMBOLS[name]
    if name.endswith("points"):
        return [f"{symbol}_{i + 1}" for i in range(count)]
    if name == "length_offsets":
        return [f"{symbol} {i + 1}" for i in range(count)]
    return [symbol]


def _components(name: str, count: int) -> list[str]:
    parts = labels(name, count)
    return parts if name.startswith("length") else [f"{part} {axis}" for part in parts for axis in "xyz"]


def whitening(lengths: Lengths, length_noise: float, orientation_noise: float) -> FloatArray:
    """Matrices that make the errors of one pose's lengths independent with standard deviation 1, shape (N, n, n).

    An error of the measured orientation moves all lengths of its pose at once: the covariance is
    σ_l² 1 + σ_R² G Gᵀ with G the lengths' derivatives by a turn of the arm (errors in variables, to first order).
    """
    G = lengths.by_orientation
    n = G.shape[1]
    covariance = length_noise**2 * np.eye(n) + orientation_noise**2 * (G @ np.swapaxes(G, 1, 2))
    return np.linalg.inv(np.linalg.cholesky(covariance))


#: Weights have converged when the unknowns move by less than this part of the joints' distance from the centre, or the
#: lengths by less than this part of their errors.
_STILL, _UNNOTICED = 1e-7, 1e-4
_MOST_ROUNDS = 200
#: Relative change of the unknowns at which least squares ends: the last time, and before.
_FINE, _COARSE = 1e-12, 1e-6
#: Gradient at which least squares ends: none. Where it is zero SciPy would divide zero by zero.
_FLAT = float(np.finfo(float).eps)
#: Lengths without a stated noise are weighted with this one, m.
UNIT = 1e-3
#: Noise, m, below which no sensor measures: smaller residuals come from rounding.
FINEST = 1e-6
#: Tolerances, m, that lead to the solution nearest to the nominal design before they are dropped: what is not
#: determined then stays near its nominal value.
_NEAR = (0.02, 1.0)


class MeasurementErrors(NamedTuple):
    """Errors as stated: of lengths (m, None if unknown) and of orientations (rad)."""

    length_noise: float | None
    orientation_noise: float

    @property
    def noise(self) -> float:
        """What lengths are weighted with, m: :data:`UNIT` if their noise is unknown."""
        return UNIT if self.length_noise is None else self.length_noise


@keeps_read_only
class CalibrationProblem(NamedTuple):
    """Measurements of a device, and what its unknowns are estimated with.

    Attributes
    ----------
    model : LengthModel
        Equations and unknowns.
    measured : ndarray
        Shape (N, 3, 3), S of each pose.
    lengths : ndarray
        Shape (N, n), m.
    errors : MeasurementErrors
        As stated.
    prior : ndarray
        Shape (p,), tolerances of the unknowns, infinite without one.
    """

    model: LengthModel
    measured: FloatArray
    lengths: FloatArray
    errors: MeasurementErrors
    prior: FloatArray


class Estimate(NamedTuple):
    """What least squares found.

    Attributes
    ----------
    values : ndarray
        Shape (p,).
    residuals : ndarray
        Shape (N n,): measured minus predicted lengths, errors independent with standard deviation 1 as far as known.
    jacobian : ndarray
        Shape (N n, p): derivatives of the predicted lengths in the same unit.
    scale : float
        Standard deviation of the residuals: 1 if the noise is stated, else estimated.
    """

    values: FloatArray
    residuals: FloatArray
    jacobian: FloatArray
    scale: float


def estimate(problem: CalibrationProblem, start: FloatArray, near: bool = True) -> Estimate:
    """Minimise the weighted squares of the lengths' errors, and of the unknowns' changes over their tolerances.

    Parameters
    ----------
    problem : CalibrationProblem
        The noise of lengths is estimated from the residuals if it is not stated.
    start : ndarray
        Shape (p,), near the minimum.
    near : bool
        Whether to bring what is undetermined near to the nominal design first.

    Raises
    ------
    SolverFailed
        If least squares or the weights do not converge.
    """
    model, (length_noise, orientation_noise) = problem.model, problem.errors
    values = start
    for size in _NEAR if near else ():
        values = _Weighted(problem, values).solve(values, np.minimum(problem.prior, size * model.scales), _COARSE)
    # With one kind of error the weights are the same everywhere.
    plain = orientation_noise == 0.0
    for _ in range(_MOST_ROUNDS):
        fit, before = _Weighted(problem, values), values
        values = fit.solve(values, problem.prior, _FINE if plain else 1e-2 * _STILL)
        residuals, jacobian = fit.residuals(values), fit.jacobian(values)
        freedom = len(residuals) - min(np.linalg.matrix_rank(jacobian * model.scales), len(residuals))
        scale = 1.0
        if length_noise is None:
            scale = float(np.sqrt(residuals @ residuals / freedom)) if freedom > 0 else float("nan")
        moved = float(np.abs((values - before) / model.scales).max(initial=0.0))
        still = moved < _STILL * model.reach
        if plain or still or np.linalg.norm(jacobian @ (values - before)) < _UNNOTICED * scale:
            return Estimate(values, residuals, jacobian, scale)
    raise SolverFailed("reweighted least squares", moved, "the weights do not converge")


class _Weighted:
    """Residuals and their derivatives, errors weighted as they are at some values."""

    def __init__(self, problem: CalibrationProblem, values: FloatArray) -> None:
        self.model, self.measured, self.lengths = problem.model, problem.measured, problem.lengths
        here, errors = self.model.evaluate(values, self.measured), problem.errors
        self.whiten = whitening(here, errors.noise, errors.orientation_noise)

    def residuals(self, values: FloatArray) -> FloatArray:
        """Measured minus predicted."""
        short = self.lengths - self.model.lengths(values, self.measured)
        return np.asarray(np.einsum("kij,kj->ki", self.whiten, short).ravel())

    def jacobian(self, values: FloatArray) -> FloatArray:
        """Derivatives of the predicted lengths."""
        by = self.model.evaluate(values, self.measured).by_unknowns
        return np.asarray((self.whiten @ by).reshape(-1, self.model.size))

    def solve(self, start: FloatArray, prior: FloatArray, tolerance: float) -> FloatArray:
        """Least squares with these weights."""
        held = np.isfinite(prior)
        stiff = np.diag(1.0 / prior)[held]
        found = scipy.optimize.least_squares(
            lambda p: np.concatenate([-self.residuals(p), p[held] / prior[held]]),
            start,
            jac=lambda p: np.concatenate([self.jacobian(p), stiff]),
            x_scale=self.model.scales,
            xtol=tolerance,
            ftol=1e-14,
            gtol=_FLAT,
            max_nfev=500,
        )
        if found.status == 0 and tolerance < _COARSE:
            raise SolverFailed("least squares", found.optimality, "start nearer to the device: check the design")
        return np.asarray(found.x)
