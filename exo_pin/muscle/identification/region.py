"""Region of validity of the force law, found from the data: the thick line of Tables 3-3a and 3-3b (Section 3.2.1).

A weight beyond the muscle's capability leaves the braid almost unstretched, and the muscle then follows another
law. So the measurements, sorted by contraction, are split in two regimes; each gets its own least-squares fit and
its own scatter, and the split is judged by its likelihood (a change point). Of all splits that the data cannot tell
from the most likely one at 95 %, the one that keeps the fewest measurements is taken. The capability line is then
the straight line in pressure and force that separates selected from rejected measurements by the widest margin.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
import scipy
from numpy.typing import ArrayLike, NDArray

from ...core.errors import InvalidInput, NotIdentifiable, SolverFailed
from ...core.errors.checked import checked
from ...core.records import Record
from ...core.validation import FloatArray, as_finite, as_positive
from ..laws.static import BAR
from ..laws.validity import Validity

#: Condition index above which a dependency among columns of unit length is called strong (Belsley, Kuh, Welsch).
CONDITION_LIMIT = 30.0


def collinear(jacobian: FloatArray) -> NDArray[np.bool_]:
    """Columns that the data cannot distinguish.

    Columns are scaled to unit length. A column is flagged if more than half of the variance of its coefficient
    comes from directions with a condition index above ``CONDITION_LIMIT`` (variance decomposition of Belsley, Kuh
    and Welsch), or if it is zero.

    Parameters
    ----------
    jacobian : ndarray
        Shape (n, k), n at least k.

    Returns
    -------
    ndarray of bool
        Shape (k,).
    """
    norms = np.linalg.norm(jacobian, axis=0)
    flagged = norms == 0
    live = ~flagged
    if not live.any():
        return flagged
    _, singular, right = np.linalg.svd(jacobian[:, live] / norms[live], full_matrices=False)
    singular = np.maximum(singular, np.finfo(float).tiny)
    shares = (right / singular[:, np.newaxis]) ** 2
    weak = singular[0] / singular > CONDITION_LIMIT
    flagged[live] = shares[weak].sum(axis=0) > 0.5 * shares.sum(axis=0)
    return flagged


def confidence_interval(centre: FloatArray, variance: FloatArray, level: float, degrees_of_freedom: int) -> FloatArray:
    """Student's interval about each of n estimates, shape (n, 2)."""
    if not 0 < as_positive("level", level) < 1:
        raise InvalidInput(f"expected level between 0 and 1, got {level:g}")
    half = scipy.stats.t.ppf(0.5 + level / 2, degrees_of_freedom) * np.sqrt(variance)
    return np.column_stack([centre - half, centre + half])


Powers = tuple[tuple[int, int], ...]

#: Powers (of contraction, of pressure) of (3-10), in the order K_1, K_2, C_1, S_1, S_2, S_3.
SECOND_ORDER: Powers = ((2, 1), (1, 1), (0, 1), (2, 0), (1, 0), (0, 0))
#: More than any pneumatic muscle bears, Pa: a pressure in another unit.
_MOST_PRESSURE = 1e7


def as_measurements(
    contraction: ArrayLike, pressure: ArrayLike, force: ArrayLike, nominal_length: float
) -> tuple[FloatArray, FloatArray, FloatArray]:
    """Check three columns of measurements, shape (n,) each, in m, Pa and N, of a muscle of a nominal length in m.

    Raises
    ------
    InvalidInput
        If one is not finite or not of shape (n,), their lengths differ, a pressure is below zero or
        that of no pneumatic muscle, or a contraction is as long as the muscle.
    """
    x = as_finite("contraction", contraction, (None,))
    p = as_finite("pressure", pressure, (None,))
    f = as_finite("force", force, (None,))
    if not len(x) == len(p) == len(f):
        raise InvalidInput(
            f"expected contraction, pressure and force of one length, got {len(x)}, {len(p)} and {len(f)}"
        )
    if (p < 0).any():
        raise InvalidInput(f"expected pressure to be zero or more, got {p.min():g} Pa")
    if p.max(initial=0.0) > _MOST_PRESSURE:
        raise InvalidInput(f"expected pressure in Pa, at most {_MOST_PRESSURE / BAR:g} bar, got {p.max() / BAR:g} bar")
    length, most = as_positive("nominal_length", nominal_length), np.abs(x).max(initial=0.0)
    if most >= length:
        raise InvalidInput(f"expected contraction in m, less than the nominal length of {length:g} m, got {most:g} m")
    return x, p, f


def design_matrix(contraction: FloatArray, pressure: FloatArray, powers: Powers) -> FloatArray:
    """Columns x^i P^j with x in m and P in bar, shape (n, len(powers))."""
    bar = pressure / BAR
    if not len(powers):
        raise InvalidInput("expected one pair of powers or more, got none")
    return np.column_stack([contraction**i * bar**j for i, j in powers])


def hull(
    contraction: FloatArray,
    pressure: FloatArray,
    nominal_length: float,
    capability: tuple[float, float] | None = None,
    basis: str = "",
) -> Validity:
    """Smallest ranges of strain and pressure that hold these measurements (m, Pa)."""
    return Validity(
        strain=(float(contraction.min()) / nominal_length, float(contraction.max()) / nominal_length),
        pressure=(float(pressure.min()), float(pressure.max())),
        capability=capability,
        basis=basis,
    )


@dataclass(frozen=True)
class Region(Record):
    """Where the law holds, and how that was decided.

    Attributes
    ----------
    selected : ndarray of bool
        Shape (n,), in the order of the measurements.
    validity : Validity
        Ranges of the selected measurements and the capability line.
    margin : float
        Half the width of the empty band around the capability line, N; zero if the line does not separate selected from
        rejected measurements, infinite if none was rejected.

    Examples
    --------
    >>> from exo_pin.muscle import find_region, steady_states
    >>> states = steady_states()
    >>> region = find_region(states.contraction, states.pressure, states.force, nominal_length=0.3)
    >>> [round(1e-5 * bound, 2) for bound in region.validity.pressure]  # bar, of the states that obey the law
    [1.22, 4.07]
    """

    selected: NDArray[np.bool_]
    validity: Validity
    margin: float


def _squares(matrix: FloatArray, force: FloatArray) -> float:
    fitted = matrix @ np.linalg.lstsq(matrix, force, rcond=None)[0]
    return float(((force - fitted) ** 2).sum())


def capability_line(
    pressure: FloatArray, force: FloatArray, selected: NDArray[np.bool_]
) -> tuple[tuple[float, float] | None, float]:
    """Straight line in pressure and force that separates selected from rejected measurements by the widest margin.

    Parameters
    ----------
    pressure, force : ndarray
        Shape (n,), Pa and N.
    selected : ndarray of bool
        Shape (n,); the selected ones shall lie below the line.

    Returns
    -------
    line : (float, float) or None
        Slope in N/Pa and intercept in N; None if none was rejected.
    margin : float
        As in :class:`Region`.

    Raises
    ------
    SolverFailed
        If the linear program does not end.
    """
    if selected.all():
        return None, np.inf
    n = len(force)
    side = np.where(selected, 1.0, -1.0)
    # Unknowns: slope (N/bar), intercept, margin, and one violation a measurement, which costs more than any margin
    # could bring, so that it is used only where no line parts the two.
    rows = np.column_stack([-side * pressure / BAR, -side, np.ones(n), -np.eye(n)])
    cost = np.concatenate([[0.0, 0.0, -1.0], np.full(n, 10.0)])
    bounds = [(None, None), (None, None), (0.0, None)] + [(0.0, None)] * n
    answer = scipy.optimize.linprog(cost, A_ub=rows, b_ub=-side * force, bounds=bounds)
    if answer.status != 0:
        raise SolverFailed("linprog", np.inf, f"capability line: {answer.message}")
    return (float(answer.x[0]) / BAR, float(answer.x[1])), float(answer.x[2])


@checked
def find_region(
    contraction: ArrayLike,
    pressure: ArrayLike,
    force: ArrayLike,
    nominal_length: float,
    powers: Powers = SECOND_ORDER,
    level: float = 0.95,
) -> Region:
    """Find where a force law holds from measurements alone.

    Parameters
    ----------
    contraction, pressure, force : array_like
        Shape (n,), m, Pa and N.
    nominal_length : float
        Nominal length of the muscle, m.
    powers : tuple of (int, int)
        Terms of the law; (3-10) by default.
    level : float
        Confidence of the change point.

    Returns
    -------
    Region

    Raises
    ------
    InvalidInput
        If the measurements are not usable columns.
    NotIdentifiable
        If there are too few measurements for two regimes.

    Examples
    --------
    >>> from exo_pin.muscle import find_region, steady_states
    >>> states = steady_states()  # 66 weights hung at rest
    >>> region = find_region(states.contraction, states.pressure, states.force, nominal_length=0.3)
    >>> int(region.selected.sum())  # of them obey the law
    27
    """
    x, p, f = as_measurements(contraction, pressure, force, nominal_length)
    length = as_positive("nominal_length", nominal_length)
    confidence = as_positive("level", level)
    if confidence >= 1:
        raise InvalidInput(f"expected level below 1, got {confidence:g}")
    least = len(powers) + 2
    if len(x) < 2 * least:
        raise NotIdentifiable(f"expected at least {2 * least} measurements for two regimes, got {len(x)}")
    order = np.argsort(-x, kind="stable")
    matrix, sorted_force = design_matrix(x, p, powers)[order], f[order]
    splits = np.arange(least, len(x) - least + 1)
    deviance = np.empty(len(splits))
    # Exact data would have no scatter and an unbounded likelihood; the print's last digit bounds it below.
    floor = 1e-12 * float(f @ f) + 1e-300
    for row, k in enumerate(splits):
        long, short = _squares(matrix[:k], sorted_force[:k]), _squares(matrix[k:], sorted_force[k:])
        rest = len(x) - k
        deviance[row] = k * np.log((long + floor) / k) + rest * np.log((short + floor) / rest)
    whole = len(x) * np.log((_squares(matrix, sorted_force) + floor) / len(x))
    # A second regime must pay for its coefficients, its scatter and its place (the information criterion of Bayes).
    price = (len(powers) + 2) * np.log(len(x))
    selected = np.ones(len(x), dtype=bool)
    if deviance.min() + price < whole:
        alike = splits[deviance - deviance.min() <= scipy.stats.chi2.ppf(confidence, 1)]
        selected[order[alike.min() :]] = False
    line, margin = capability_line(p, f, selected)
    basis = f"change point in contraction over {len(x)} measurements, {int(selected.sum())} selected"
    return Region(selected=selected, validity=hull(x[selected], p[selected], length, line, basis), margin=margin)
