import numpy as np
import pytest
from scipy.optimize import minimize

from exo_pin.numerics.bounded.polytope_program import least_sum_force


def program(rng, limb_count):
    """A program with an interior point, some of whose bounds bind at the answer."""
    m = limb_count - 3
    N = np.linalg.qr(rng.standard_normal((limb_count, m)))[0]
    f = 50.0 * rng.standard_normal(limb_count)
    inside = f + N @ (30.0 * rng.standard_normal(m))
    low, high = inside - rng.uniform(1.0, 40.0, limb_count), inside + rng.uniform(1.0, 40.0, limb_count)
    return 100.0 * rng.standard_normal(3), rng.standard_normal((3, m)), f, np.ascontiguousarray(N), low, high


@pytest.mark.full
@pytest.mark.parametrize("limb_count", [4, 5, 6])
def test_least_force_agrees_with_a_solver(limb_count):
    rng = np.random.default_rng(limb_count)
    bound = 0
    for _ in range(15):
        c, G, f, N, low, high = program(rng, limb_count)
        z = np.empty(limb_count - 3)
        assert least_sum_force(c, G, f, N, low, high, z)
        tensions = f + N @ z
        assert (tensions >= low - 1e-8).all()
        assert (tensions <= high + 1e-8).all()
        bound += bool(np.isclose(tensions, low).any() or np.isclose(tensions, high).any())
        other = minimize(
            lambda y, c=c, G=G: 0.5 * ((c + G @ y) ** 2).sum(),
            np.zeros(limb_count - 3),
            jac=lambda y, c=c, G=G: G.T @ (c + G @ y),
            method="SLSQP",
            constraints=[
                {"type": "ineq", "fun": lambda y, f=f, N=N, low=low: f + N @ y - low},
                {"type": "ineq", "fun": lambda y, f=f, N=N, high=high: high - f - N @ y},
            ],
            options={"ftol": 1e-14, "maxiter": 500},
        )
        assert np.linalg.norm(c + G @ z) <= np.linalg.norm(c + G @ other.x) + 1e-5
    assert bound >= 5
