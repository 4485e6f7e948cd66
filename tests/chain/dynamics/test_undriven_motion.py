"""Which motions of chains with fewer actuators than freedoms are refused: those alone that no actuator makes."""

import numpy as np
import pinocchio as pin
import pytest
from tree_forces import tree_forces
from underactuated_chains import LOOPS, TREES, underactuated

from exo_pin import UndrivenMotion
from exo_pin.chain import ClosedChain, Closures


@pytest.mark.parametrize("name", [*TREES, "random tree", *LOOPS])
@pytest.mark.parametrize("seed", [pytest.param(k, marks=() if k < 1 else pytest.mark.full) for k in range(20)])
def test_a_driven_motion_is_taken_and_any_other_refused(name, seed):
    case = underactuated(name, seed)
    chain, passive = case.chain, case.chain._state.drive(case.actuated).passive
    forces = chain.inverse_dynamics(case.q, case.v, case.a, actuated=case.actuated)
    full = tree_forces(chain, case.q, case.v, case.a, forces.multipliers).tau
    np.testing.assert_allclose(full, forces.tau, rtol=0, atol=1e-9 * (1 + np.abs(forces.multipliers).max(initial=0.0)))
    assert not forces.tau[passive].any()
    # Another acceleration of its size is not driven.
    G = chain.reduced_jacobian(case.q)
    a = case.a + (1.0 + np.abs(case.a).max()) * G @ np.random.default_rng(seed).normal(size=G.shape[1])
    a = chain.project_acceleration(case.q, case.v, a)
    with pytest.raises(UndrivenMotion):
        chain.inverse_dynamics(case.q, case.v, a, actuated=case.actuated)


@pytest.mark.parametrize("seed", range(20))
def test_a_fall_needs_no_actuator(seed):
    # Weights and inertia forces cancel: what is missing is their rounding.
    rng, model = np.random.default_rng(seed), pin.Model()
    for k, kind in enumerate((pin.JointModelFreeFlyer(), pin.JointModelRY(), pin.JointModelPX())):
        added = model.addJoint(k, kind, pin.SE3(np.eye(3), rng.normal(size=3)), f"joint{k}")
        body = pin.SE3(np.eye(3), rng.normal(size=3))
        model.appendBodyToJoint(added, pin.Inertia.FromSphere(rng.uniform(0.1, 10), 0.2), body)
    chain = ClosedChain(model, Closures("falling"))
    q = pin.integrate(model, chain.neutral(), rng.normal(size=model.nv))
    a = chain.forward_dynamics(q).a
    forces = chain.inverse_dynamics(q, a=a, actuated=())
    assert not forces.tau.any()
    assert chain.inverse_dynamics_derivatives(q, a=a, actuated=()).tau_q.any()
