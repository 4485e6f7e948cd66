"""Forces of many samples at once are those of each alone, and a bad sample spoils no other."""

import numpy as np
import pinocchio as pin
import pytest
from moving_chains import moving

from exo_pin import LoopNotClosed

small = pytest.mark.usefixtures("plain")
SMALL = ("four-bar", "five-bar", "parallelogram")


def moved(name, count=3, seed=0):
    """Closed configurations of a chain near one, motions of them, and its joints."""
    case, rng = moving(name, seed), np.random.default_rng(seed)
    chain, nv = case.chain, case.chain.model.nv
    q = chain.close(np.array([pin.integrate(chain.model, case.q, rng.uniform(-0.1, 0.1, nv)) for _ in range(count)]))
    v = np.array([chain.project_velocity(each, rng.normal(size=nv)) for each in q])
    a = np.array([chain.project_acceleration(*each, rng.normal(size=nv)) for each in zip(q, v, strict=True)])
    return chain, q, v, a, [str(name) for name in list(chain.model.names)[1:]]


@small
@pytest.mark.parametrize("name", SMALL)
def test_projections_are_least(name):
    chain, q, _, _, _ = moved(name)
    rng, nv = np.random.default_rng(1), chain.model.nv
    v, a = rng.normal(size=(2, 3, nv))
    for k in range(3):
        # By least squares: what is left off is in the row space.
        J = chain.constraint_jacobian(q[k])
        speed = chain.project_velocity(q[k], v[k])
        np.testing.assert_allclose(speed, v[k] - np.linalg.pinv(J, rcond=1e-10) @ (J @ v[k]), atol=1e-9)
        rate, drift = chain.project_acceleration(q[k], speed, a[k]), chain.constraint_drift(q[k], speed)
        np.testing.assert_allclose(rate, a[k] - np.linalg.pinv(J, rcond=1e-10) @ (J @ a[k] + drift), atol=1e-9)
    with pytest.raises(LoopNotClosed):
        chain.project_velocity(q[1] + 0.1, v[1])


@small
def test_progress_is_shown_on_request(capsys):
    chain, q, v, a, _ = moved("five-bar")
    quiet = chain.inverse_dynamics(q, v, a)
    assert not capsys.readouterr().err
    shown = chain.inverse_dynamics(q, v, a, progress=True)
    assert "forces" in capsys.readouterr().err
    np.testing.assert_array_equal(quiet.tau, shown.tau)
