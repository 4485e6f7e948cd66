"""Derivatives of forward dynamics against differences along the closed loops and against Pinocchio's own."""

import numpy as np
import pinocchio as pin
import pytest
from moving_chains import WITH_MASS, moving
from rubbing_chains import with_friction
from underactuated_chains import underactuated

from exo_pin.chain import ClosedChain, JointProperties
from exo_pin.core import errors

# Kernels of derivatives compile longest; the examples of the two functions run by default.
pytestmark = pytest.mark.full

STEP = 1e-3


def difference(f):
    return (8 * (f(STEP) - f(-STEP)) - (f(2 * STEP) - f(-2 * STEP))) / (12 * STEP)


def along_the_loops(chain, joints, q, v, tau, external=None):
    """Differences of all accelerations with q_i, v_i and τ, and of all velocities with q_i: fourth order."""
    own, G = chain.velocity_indices(joints), chain.reduced_jacobian(q, joints)
    d, nv = len(own), chain.model.nv

    def motion(q, speeds, tau):
        velocity = chain.dependent_motion(q, joints, speeds, np.zeros(d))[0]
        return np.concatenate([chain.forward_dynamics(q, velocity, tau, external=external).a, velocity])

    def moved(step):
        return chain.close(pin.integrate(chain.model, q, G @ step), hold=joints, tolerance=1e-13)

    by_q = [difference(lambda s, u=unit: motion(moved(s * u), v[own], tau)) for unit in np.eye(d)]
    by_v = [difference(lambda s, u=unit: motion(q, v[own] + s * u, tau)) for unit in np.eye(d)]
    by_tau = [difference(lambda s, u=unit: motion(q, v[own], tau + s * u)) for unit in np.eye(nv)]
    by_q, by_v, by_tau = (np.array(columns).T for columns in (by_q, by_v, by_tau))
    return by_q[:nv], by_v[:nv], by_tau[:nv], by_q[nv:]


def check(chain, joints, q, v, tau, external=None, share=1e-6):
    """Compare, relative to the largest of each; return the derivatives."""
    found = chain.forward_dynamics_derivatives(q, v, tau, independent=joints, external=external)
    Z, own = found.reduced_jacobian, found.independent
    np.testing.assert_array_equal(own, chain.velocity_indices(joints))
    given = found.a_q @ Z + found.a_v @ found.v_q, found.a_v @ Z, found.a_tau, found.v_q
    size = np.abs(found.motion.a).max()
    for expected, got in zip(along_the_loops(chain, joints, q, v, tau, external), given, strict=True):
        np.testing.assert_allclose(got, expected, rtol=0, atol=share * (np.abs(expected).max() + 1e-3 * size))
    for reduced, whole in zip((found.independent_q, found.independent_v, found.independent_tau), given, strict=False):
        np.testing.assert_allclose(reduced, whole[own], atol=1e-12 * (1.0 + np.abs(whole).max()))
    return found


@pytest.mark.parametrize("name", WITH_MASS)
def test_all_kinds_of_loops_redundant_ones_too_against_differences(name):
    case, rng = moving(name, 3), np.random.default_rng(1)
    tau, external = rng.normal(size=case.chain.model.nv), {case.chain.closures[0].frame_a: 3 * rng.normal(size=6)}
    check(case.chain, case.independent, case.q, np.array(case.v), tau, external)


@pytest.mark.parametrize("seed", range(3))
def test_a_rigid_loop_has_pinocchios_derivatives_along_the_loop(seed):
    # Those of points on two moving bodies differ from differences of Pinocchio's own accelerations (4.1).
    case, rng = moving("rigid loop", seed), np.random.default_rng(seed)
    chain, model, tau = case.chain, case.chain.model, rng.normal(size=case.chain.model.nv)
    found = chain.forward_dynamics_derivatives(case.q, case.v, tau)
    closures, datas, data = pin.StdVec_RigidConstraintModel(), pin.StdVec_RigidConstraintData(), model.createData()
    for closure in chain.constraint_models:
        closures.append(closure)
        datas.append(closure.createData())
    settings = pin.ProximalSettings(1e-14, 1e-10, 100)
    pin.initConstraintDynamics(model, data, closures, datas)
    a = pin.constraintDynamics(model, data, case.q, case.v, tau, closures, datas, settings)
    np.testing.assert_allclose(found.motion.a, a, atol=1e-9 * np.abs(a).max())
    by_q, by_v, by_tau, *_ = pin.computeConstraintDynamicsDerivatives(model, data, closures, datas, settings)
    Z, along = found.reduced_jacobian, found.v_q
    for got, expected in (
        (found.a_q @ Z + found.a_v @ along, by_q @ Z + by_v @ along),
        (found.a_v @ Z, by_v @ Z),
        (found.a_tau, by_tau),
    ):
        np.testing.assert_allclose(got, expected, atol=1e-8 * np.abs(expected).max())


@pytest.mark.parametrize("seed", range(4))
def test_a_tree_has_pinocchios_derivatives(seed):
    case = underactuated("random tree", seed)
    chain, q, v, tau = case.chain, case.q, case.v, np.random.default_rng(seed).normal(size=case.chain.model.nv)
    found, data = chain.forward_dynamics_derivatives(q, v, tau), chain.model.createData()
    by_q, by_v, by_tau = pin.computeABADerivatives(chain.model, data, q, v, tau)
    # Of the inverse of the mass matrix Pinocchio has one half.
    for got, expected in ((found.a_q, by_q), (found.a_v, by_v), (np.triu(found.a_tau), np.triu(by_tau))):
        np.testing.assert_allclose(got, expected, atol=1e-9 * (1.0 + np.abs(expected).max()))


def test_springs_dampers_and_sliding_friction_are_differentiated():
    case, rng = moving("five-bar", 5), np.random.default_rng(6)
    springs = tuple(JointProperties(name, float(rng.uniform(1.0, 5.0))) for name in list(case.chain.model.names)[1:])
    described = case.chain.description.__class__(**(vars(case.chain.description) | {"joints": springs}))
    chain = ClosedChain(case.chain.model, described)
    chain.model.damping = rng.uniform(0.1, 1.0, chain.model.nv)
    check(chain, case.independent, case.q, np.array(case.v), rng.normal(size=chain.model.nv))
    chain = with_friction(case.chain, np.full(case.chain.model.nv, 0.2))
    check(chain, case.independent, case.q, np.array(case.v), rng.normal(size=chain.model.nv))
    with pytest.raises(errors.UnsupportedDynamics):
        chain.forward_dynamics_derivatives(case.q)
