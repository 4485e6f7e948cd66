"""Digits of columns, single measurements against all others, and where one law ends."""

import numpy as np
import pytest
from scipy import stats

from exo_pin.muscle.identification.regimes import (
    SECOND_ORDER,
    design_matrix,
    leave_one_out_p,
    regimes,
    resolution_of,
    rounding_variance,
)

BAR = 1e5


@pytest.mark.parametrize(
    ("values", "step"),
    [([0.0, 0.0], 0.0), ([], 0.0), ([0.25, 0.1, 3.0], 0.01), ([3e5, 2.4e5], 1e4), ([np.pi, 1.0], 0.0), ([20, 300], 10)],
)
def test_the_last_digit_of_a_column(values, step):
    assert resolution_of(np.array(values, dtype=float)) == pytest.approx(step, rel=1e-12)


def test_rounding_adds_the_variance_of_its_steps_by_the_slopes_of_the_law():
    rng = np.random.default_rng(1)
    x, p = rng.uniform(0.01, 0.08, 2000), rng.uniform(1.0, 4.0, 2000) * BAR

    def law(x, p):
        return (p / BAR) * (900.0 * x**2 - 330.0 * x + 20.0) + 40.0 * x**2 - 11.0 * x - 3.0

    rounded = x.round(3), (p / BAR).round(1) * BAR, law(x, p).round(0)
    off = rounded[2] - law(*rounded[:2])
    assert rounding_variance(*rounded, SECOND_ORDER) == pytest.approx((off**2).mean(), rel=0.05)
    assert rounding_variance(x, p, law(x, p), SECOND_ORDER) == 0.0


def test_each_measurement_against_the_law_of_all_others():
    rng = np.random.default_rng(2)
    matrix, force = rng.normal(size=(14, 3)), rng.normal(size=14)
    found = leave_one_out_p(matrix, force, 0.0)
    for i in range(14):
        rest = np.arange(14) != i
        values, squares = np.linalg.lstsq(matrix[rest], force[rest], rcond=None)[:2]
        spread = squares[0] / 10.0 * (1.0 + matrix[i] @ np.linalg.inv(matrix[rest].T @ matrix[rest]) @ matrix[i])
        t = (force[i] - matrix[i] @ values) / np.sqrt(spread)
        assert found[i] == pytest.approx(2.0 * stats.t(10).sf(abs(t)), rel=1e-9)
    # A stated variance, larger than what is found, counts; without freedom nothing is unlikely.
    assert (leave_one_out_p(matrix, force, 100.0) > 0.5).all()
    assert leave_one_out_p(matrix[:4], force[:4], 0.0).tolist() == [1.0] * 4


@pytest.mark.parametrize(("planted", "size"), [((), 40), ((7,), 39), ((7, 30), 38)])
def test_one_law_its_outliers_and_where_it_ends(planted, size):
    rng = np.random.default_rng(3)
    x, p = np.linspace(0.08, 0.0, 40), rng.uniform(2.0, 4.0, 40) * BAR
    law = (p / BAR) * (900.0 * x**2 - 330.0 * x + 20.0) + 5.0
    f = law + rng.normal(0.0, 0.05, 40)
    f[list(planted)] += 20.0
    matrix, order, found, outliers = regimes(x, p, f, SECOND_ORDER, 0.01)
    assert (found, sorted(outliers)) == (size, list(planted))
    assert order.tolist() == [i for i in range(40) if i not in planted]
    columns = design_matrix(x, p, SECOND_ORDER)
    np.testing.assert_allclose(matrix, columns / np.linalg.norm(columns, axis=0), rtol=1e-12)
    # A braid that takes over below 20 mm of contraction.
    stiff = f + np.where(x < 0.02, 2e4 * (0.02 - x), 0.0)
    if not planted:
        assert abs(regimes(x, p, stiff, SECOND_ORDER, 0.01)[2] - (x >= 0.02).sum()) <= 1
