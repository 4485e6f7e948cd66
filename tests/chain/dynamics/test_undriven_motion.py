"""Which motions of chains with fewer actuators than freedoms are refused: those alone that no actuator makes."""

import itertools

import numpy as np
import pinocchio as pin
import pytest
from mechanisms import random_wrist
from scipy.optimize import linprog
from self_stress import Open
from skeletons import four_bar_skeleton
from tree_forces import tree_forces
from underactuated_chains import LOOPS, TREES, underactuated

from exo_pin import InfeasibleForces, UndrivenMotion
from exo_pin.chain import ClosedChain, Closures
from exo_pin.wrist_chain import mechanism_urdf


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


def test_forces_that_no_actuator_makes_are_reported_by_joint_and_size():
    chain = four_bar_skeleton().chain(("C",))
    q = chain.neutral()
    with pytest.raises(UndrivenMotion) as refusal:
        chain.inverse_dynamics(q, actuated=())
    # The open tree's forces less the nearest that closures make, in the least-squares sense.
    J, tau = chain.constraint_jacobian(q), tree_forces(chain, q).tau
    left = tau - J.T @ np.linalg.lstsq(J.T, tau, rcond=1e-10)[0]
    np.testing.assert_allclose(refusal.value.missing, left, atol=1e-9)
    assert refusal.value.joints[0] == chain.model.names[1 + int(np.abs(left).argmax())]
    # Power: what is missing along the one freedom is what one motor would give.
    v, _ = chain.dependent_motion(q, ["A"], [1.0])
    assert refusal.value.missing @ v == pytest.approx(chain.inverse_dynamics(q, actuated=["A"]).effort("A")[0])


def slack_needed(C, c):
    """Least t with C z - t <= c by a linear program of our own."""
    size = C.shape[1]
    found = linprog(
        np.append(np.zeros(size), 1.0), A_ub=np.column_stack([C, -np.ones(len(c))]), b_ub=c, bounds=(None, None)
    )
    assert found.status in (0, 3)
    return found.fun if found.status == 0 else -np.inf


@pytest.mark.parametrize("seed", range(6))
def test_named_bounds_are_those_in_the_way_and_give_way_by_the_excess(seed):
    mechanism = random_wrist(seed, "SSSSS", with_masses=True)
    chain = ClosedChain.from_urdf(*mechanism_urdf(mechanism))
    q = chain.close(chain.neutral())
    other = Open(chain, q)
    rng = np.random.default_rng(seed)
    bounds, rows = {}, {}
    constant, effect = other.affine(lambda z: other.forces(z).tau[chain.velocity_indices(chain.roles.actuated)])
    for k, joint in enumerate(chain.roles.actuated):
        low = rng.uniform(-30, 20)
        bounds[joint] = (low, low + rng.uniform(1, 10))
        rows[f"effort of {joint} at least {low:.6g}"] = (-effect[k], constant[k] - low)
        rows[f"effort of {joint} at most {bounds[joint][1]:.6g}"] = (effect[k], bounds[joint][1] - constant[k])
    C, c = np.array([row for row, _ in rows.values()]), np.array([side for _, side in rows.values()])
    needed = slack_needed(C, c)
    assert needed > 0.01, "a case that is feasible tells nothing"
    with pytest.raises(InfeasibleForces) as refusal:
        chain.inverse_dynamics(q, effort_bounds=bounds)
    assert refusal.value.excess == pytest.approx(needed, rel=1e-6)
    # The named ones alone are in each other's way by as much; without any one of them the others agree better.
    named = list(refusal.value.bounds)
    assert set(named) <= set(rows)
    own = np.array([rows[name][0] for name in named]), np.array([rows[name][1] for name in named])
    assert slack_needed(*own) == pytest.approx(needed, rel=1e-6)
    for fewer in itertools.combinations(range(len(named)), len(named) - 1):
        if fewer:
            assert slack_needed(own[0][list(fewer)], own[1][list(fewer)]) < 0.999 * needed
    # Given the excess, and a little for rounding, there is an answer; given less, there is none.
    wider = {joint: (low - 1.0001 * needed, high + 1.0001 * needed) for joint, (low, high) in bounds.items()}
    assert chain.inverse_dynamics(q, effort_bounds=wider).residual < 1e-8
    narrower = {joint: (low - 0.999 * needed, high + 0.999 * needed) for joint, (low, high) in bounds.items()}
    with pytest.raises(InfeasibleForces):
        chain.inverse_dynamics(q, effort_bounds=narrower)
