"""Forces of many samples at once are those of each alone, and a bad sample spoils no other."""

import numpy as np
import pinocchio as pin
import pytest
from moving_chains import moving

from exo_pin import LoopNotClosed
from exo_pin.core import errors

small = pytest.mark.usefixtures("plain")
SMALL = ("four-bar", "five-bar", "parallelogram")


def moved(name, count=3, seed=0):
    """Closed configurations of a chain near one, motions of them, and its joints."""
    case, rng = moving(name, seed), np.random.default_rng(seed)
    chain, nv = case.chain, case.chain.model.nv
    q = chain.close(np.array([pin.integrate(chain.model, case.q, rng.uniform(-0.1, 0.1, nv)) for _ in range(count)]))
    v = chain.project_velocity(q, rng.normal(size=(count, nv)))
    a = chain.project_acceleration(q, v, rng.normal(size=(count, nv)))
    return chain, q, v, a, [str(name) for name in list(chain.model.names)[1:]]


@small
@pytest.mark.parametrize("name", SMALL)
def test_projections_of_stacks_are_those_of_each_and_least(name):
    chain, q, _, _, _ = moved(name)
    rng, nv = np.random.default_rng(1), chain.model.nv
    v, a = rng.normal(size=(2, 3, nv))
    speeds = chain.project_velocity(q, v)
    np.testing.assert_allclose(speeds, [chain.project_velocity(*one) for one in zip(q, v, strict=True)], atol=1e-12)
    rates = chain.project_acceleration(q, speeds, a)
    each = [chain.project_acceleration(*one) for one in zip(q, speeds, a, strict=True)]
    np.testing.assert_allclose(rates, each, atol=1e-12)
    for k in range(3):
        # By least squares: what is left off is in the row space.
        J = chain.constraint_jacobian(q[k])
        np.testing.assert_allclose(speeds[k], v[k] - np.linalg.pinv(J, rcond=1e-10) @ (J @ v[k]), atol=1e-9)
        drift = chain.constraint_drift(q[k], speeds[k])
        np.testing.assert_allclose(rates[k], a[k] - np.linalg.pinv(J, rcond=1e-10) @ (J @ a[k] + drift), atol=1e-9)
    wrong = q.copy()
    wrong[1] += 0.1
    with pytest.raises(errors.SamplesFailed) as failed:
        chain.project_velocity(wrong, v)
    assert list(failed.value.failures) == [1]
    assert isinstance(failed.value.failures[1], LoopNotClosed)
    assert np.isnan(failed.value.result[1]).all()
    np.testing.assert_array_equal(failed.value.result[[0, 2]], speeds[[0, 2]])
    with pytest.raises(errors.SamplesFailed) as failed:
        chain.project_acceleration(wrong, speeds, a)
    np.testing.assert_array_equal(failed.value.result[[0, 2]], rates[[0, 2]])


@small
def test_progress_is_shown_on_request(capsys):
    chain, q, v, a, _ = moved("five-bar")
    quiet = chain.inverse_dynamics(q, v, a)
    assert not capsys.readouterr().err
    shown = chain.inverse_dynamics(q, v, a, progress=True)
    assert "forces" in capsys.readouterr().err
    np.testing.assert_array_equal(quiet.tau, shown.tau)
