"""Region of validity of the force law, found from the data: the thick line of Tables 3-3a and 3-3b (Section 3.2.1).

A weight beyond the muscle's capability leaves the braid almost unstretched. The braid then carries a part of it, so
the muscle holds more than the law says. Measurements are sorted by contraction, the most contracted first. The region
is the largest set from there on that one law describes. The test is Chow's: for every cut, an F test asks whether the
measurements after it agree with the law of those before it, each variance over its own degrees of freedom; the level
holds for all cuts together (Bonferroni). So one regime is the answer unless the data prove two, and the region of a
region is all of it. A single measurement that the others contradict is an outlier. The capability line is the
straight line in pressure and force that separates selected from rejected measurements by the widest margin.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
import scipy
from numpy.typing import ArrayLike, NDArray

from ...core.errors import InvalidInput, NotIdentifiable, SolverFailed
from ...core.errors.checked import checked
from ...core.records import Record
from ...core.validation import FloatArray, as_positive, frozen
from ..laws.static import BAR
from ..laws.validity import Validity
from .plausibility import as_measurements
from .regimes import LEAST_EXCESS, SECOND_ORDER, Powers, regimes

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
    outliers : ndarray of int
        Indices of single measurements that the others contradict; they are not selected.
    misfit : float
        Root mean square of what one law leaves over, N, where the data prove that it does not describe all of them but
        the rest is not where a braid puts it; None where the law describes what is selected.

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
    outliers: NDArray[np.int_]
    misfit: float | None = None


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


#: What one law may leave over, as a share of the greatest force, before it is said that it does not describe the data.
_MISFIT = 0.02


@checked
def find_region(
    contraction: ArrayLike,
    pressure: ArrayLike,
    force: ArrayLike,
    nominal_length: float,
    powers: Powers = SECOND_ORDER,
    level: float = 0.01,
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
        Probability of calling measurements of one law two regimes.

    Returns
    -------
    Region

    Raises
    ------
    InvalidInput
        If the measurements are not usable columns, or no muscle can have made them.
    NotIdentifiable
        If there are too few measurements for a law.

    Notes
    -----
    The region is that of Section 3.2.1 of the thesis, the test that of predictions by G. Chow, Econometrica 28 (1960)
    591.

    Examples
    --------
    >>> from exo_pin.muscle import find_region, steady_states
    >>> states = steady_states()  # 66 weights hung at rest
    >>> region = find_region(states.contraction, states.pressure, states.force, nominal_length=0.3)
    >>> int(region.selected.sum())  # of them obey the law
    27
    """
    x, p, f, _ = as_measurements(contraction, pressure, force, nominal_length)
    return region_of(x, p, f, as_positive("nominal_length", nominal_length), powers, level)


def region_of(
    x: FloatArray, p: FloatArray, f: FloatArray, length: float, powers: Powers, level: float = 0.01
) -> Region:
    """:func:`find_region` of measurements that are checked already."""
    if not 0 < as_positive("level", level) < 1:
        raise InvalidInput(f"expected level between 0 and 1, got {level:g}")
    k = len(powers)
    if len(x) < k + 3:
        raise NotIdentifiable(f"expected at least {k + 3} measurements for a law and a test of it, got {len(x)}")
    matrix, order, size, outliers = regimes(x, p, f, powers, level)
    selected = np.zeros(len(x), dtype=bool)
    selected[order[:size]] = True
    rejected = order[size:]
    misfit: float | None = None
    if len(rejected):
        law = np.linalg.lstsq(matrix[selected], f[selected])[0]
        excess = f[rejected] - matrix[rejected] @ law
        if np.median(excess) <= 0.0 or excess.max() < LEAST_EXCESS * np.abs(f).max():
            selected[rejected] = True
            law = np.linalg.lstsq(matrix[selected], f[selected])[0]
            left = float(np.sqrt(np.mean((f - matrix @ law)[selected] ** 2)))
            misfit = left if left > _MISFIT * np.abs(f).max() else None
    judged = np.ones(len(x), dtype=bool)
    judged[outliers] = False
    line, margin = capability_line(p[judged], f[judged], selected[judged])
    basis = f"test for one regime over {len(x)} measurements, {int(selected.sum())} selected"
    found_validity = hull(x[selected], p[selected], length, line, basis)
    return Region(selected, found_validity, margin, frozen(np.array(sorted(outliers), dtype=int)), misfit)
