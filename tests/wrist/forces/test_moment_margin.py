"""Moments that limbs can supply against the convex hull of all corners, linear programs and relaxed limits."""

import numpy as np
import pytest
from scipy.optimize import linprog

from exo_pin.wrist.forces.wrench_feasibility import moment_margin

pytestmark = pytest.mark.usefixtures("plain")


def margin_of(arms, moment, lower, upper):
    n = len(arms)
    direction, low, high = np.empty(3), np.empty(n), np.empty(n)
    return moment_margin(arms, moment, lower, upper, direction, low, high), direction, low, high


@pytest.mark.parametrize("n", [3, 4, 5])
def test_missing_limits_are_rays(n):
    rng, seen = np.random.default_rng(93), set()
    for _ in range(25):
        arms, moment = rng.normal(size=(n, 3)), rng.normal(size=3)
        lower = np.where(rng.random(n) < 0.2, -np.inf, rng.uniform(-1.0, 0.5, n))
        upper = np.where(rng.random(n) < 0.4, np.inf, np.maximum(lower, -1.0) + rng.uniform(0.1, 2.0, n))
        margin, direction, _, _ = margin_of(arms, moment, lower, upper)
        limits = np.stack([lower, upper], axis=1)
        assert (margin >= 0.0) == (linprog(np.zeros(n), A_eq=arms.T, b_eq=moment, bounds=limits).status == 0)
        if np.isfinite(margin):
            # As much further moment along the axis of least margin is held, and no more.
            for more, held in ((0.999, True), (1.001, False)):
                further = moment + direction * (margin * more if margin > 0.0 else margin / more)
                assert (
                    linprog(np.zeros(n), A_eq=arms.T, b_eq=further, bounds=limits).status == 0
                ) == held or margin < 0.0
        else:
            assert np.isnan(direction).all()
        seen.add((bool(margin >= 0.0), bool(np.isfinite(margin))))
    assert {(True, True), (False, True)} <= seen
