"""Small quadratic programs whose numbers are no numbers."""

from dataclasses import replace

import numpy as np
import pytest

from exo_pin import SolverFailed
from exo_pin.numerics import LeastSquares, solve

PROGRAM = LeastSquares(
    np.eye(3), np.ones(3), np.ones((1, 3)), np.ones(1), -np.ones(3), np.ones(3), np.eye(3)[:1], np.ones(1)
)


@pytest.mark.parametrize(
    ("name", "number"),
    [
        *((name, number) for name in "EdAbC" for number in (np.nan, np.inf)),
        ("low", np.nan),
        ("high", np.nan),
        ("c", np.nan),
    ],
)
def test_numbers_that_are_not_finite_give_no_answer(name, number):
    assert solve(PROGRAM).is_optimal
    spoilt = np.array(getattr(PROGRAM, name))
    spoilt.flat[0] = number
    with pytest.raises(SolverFailed, match="finite"):
        solve(replace(PROGRAM, **{name: spoilt}))
