"""Closed-loop kinematics: splits, reduced Jacobians and their rates, projections, branches."""

import numpy as np
import pinocchio as pin
import pytest
from closed_chains import CHAINS, off

STEP = 1e-5


@pytest.fixture(params=CHAINS)
def case(request):
    chain, q = CHAINS[request.param]
    rng = np.random.default_rng(4)
    return chain, chain.close(off(chain, q, rng, 0.02)), rng


def test_the_chosen_split_determines_everything(case):
    chain, q, rng = case
    split = chain.split(q)
    dof = chain.mobility(q).degrees_of_freedom
    assert len(split.independent) == dof
    np.testing.assert_array_equal(
        np.sort(np.concatenate([split.independent, split.dependent])), np.arange(chain.model.nv)
    )
    G = chain.reduced_jacobian(q)
    np.testing.assert_array_equal(G[split.independent], np.eye(dof))
    np.testing.assert_allclose(chain.constraint_jacobian(q) @ G, 0.0, atol=1e-9)
    # Every motion that keeps the loops closed is one of G's.
    v = chain.project_velocity(q, rng.normal(size=chain.model.nv))
    np.testing.assert_allclose(G @ v[split.independent], v, atol=1e-8)


def test_dependent_accelerations_are_the_change_of_the_dependent_motion(case):
    chain, q, rng = case
    actuated = chain.roles.actuated
    if chain.description.name.startswith("loop"):
        # Their first joints may be a poor choice; all have one coordinate.
        actuated = [chain.model.names[1 + int(index)] for index in chain.split(q).independent]
    rates, accelerations = 0.3 * rng.normal(size=(2, chain.reduced_jacobian(q, actuated).shape[1]))
    v, a = chain.dependent_motion(q, actuated, rates, accelerations)
    # Off the loops by h² only: closing brings back what that is worth.
    places = {s: chain.close(pin.integrate(chain.model, q, s * STEP * v), restarts=0) for s in (1, -1)}
    ahead, behind = (
        chain.dependent_motion(there, actuated, rates + s * STEP * accelerations)[0] for s, there in places.items()
    )
    size = 1 + np.abs(a).max()
    np.testing.assert_allclose(a, (ahead - behind) / (2 * STEP), atol=2e-6 * size)


def test_projections_close_the_loops_and_move_least(case):
    chain, q, rng = case
    J = chain.constraint_jacobian(q)
    v, a = rng.normal(size=(2, chain.model.nv))
    kept = chain.project_velocity(q, v)
    assert np.abs(J @ kept).max() < 1e-9
    np.testing.assert_allclose(chain.project_velocity(q, kept), kept, atol=1e-9)
    held = chain.project_acceleration(q, kept, a)
    assert np.abs(J @ held + chain.constraint_drift(q, kept)).max() < 1e-8 * (1 + np.abs(held).max())
    # What is taken away stands at right angles to every motion that is allowed.
    scale = np.where(chain.metres, chain.characteristic_length, 1.0)
    allowed = chain.reduced_jacobian(q) / scale[:, None]
    size = np.abs(allowed).max()
    for given, answer in ((v, kept), (a, held)):
        np.testing.assert_allclose(
            allowed.T @ ((given - answer) / scale), 0.0, atol=1e-8 * size * (1 + np.abs(held).max())
        )


def test_the_frame_jacobian_is_the_frames_motion(case):
    chain, q, rng = case
    frame = chain.closures[0].frame_a
    actuated = chain.roles.actuated
    J = chain.frame_jacobian(q, frame, actuated)
    rates = 0.3 * rng.normal(size=J.shape[1])
    v, _ = chain.dependent_motion(q, actuated, rates)
    ahead, behind = (
        chain.placement(chain.close(pin.integrate(chain.model, q, s * STEP * v), restarts=0), frame) for s in (1, -1)
    )
    expected = np.concatenate(
        [ahead.translation - behind.translation, pin.log3(ahead.rotation @ behind.rotation.T)]
    ) / (2 * STEP)
    np.testing.assert_allclose(J @ rates, expected, atol=1e-6 * (1 + np.abs(expected).max()))
