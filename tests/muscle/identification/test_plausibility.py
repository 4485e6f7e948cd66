"""Single measurements against the law of all others."""

import numpy as np
import pytest
from scipy import stats

from exo_pin.muscle.identification.regimes import (
    leave_one_out_p,
)


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
