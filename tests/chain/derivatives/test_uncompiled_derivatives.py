"""Derivatives of the smallest chains by differences along one direction, without compiled kernels; the rest is full."""

import numpy as np
import pinocchio as pin
import pytest
from moving_chains import drivers, moving
from underactuated_chains import underactuated

from exo_pin.chain import ClosedChain, JointProperties
from exo_pin.core import compiled

STEP = 1e-3


@pytest.fixture(autouse=True)
def _plain():
    """Kernels of derivatives compile longest."""
    with compiled.mode("plain"):
        yield


def difference(f):
    """Of fourth order."""
    return (8 * (f(STEP) - f(-STEP)) - (f(2 * STEP) - f(-2 * STEP))) / (12 * STEP)


@pytest.mark.parametrize(
    "name", ["five-bar", "rigid loop", "distance loop", "universal loop", "coupling loop", "parallelogram"]
)
def test_derivatives_along_a_direction_are_differences(name):
    case, rng = moving(name, 5), np.random.default_rng(6)
    chain, q, joints = case.chain, case.q, case.independent
    own = chain.velocity_indices(joints)
    external = {chain.closures[0].frame_a: 3.0 * rng.normal(size=6)}
    problem = {"external": external, "actuated": drivers(case)}
    found = chain.inverse_dynamics_derivatives(q, case.v, case.a, independent=joints, **problem)
    np.testing.assert_array_equal(found.independent, own)
    way, G = rng.normal(size=len(own)), chain.reduced_jacobian(q, joints)

    def at(kind, s):
        there, unit = q, s * way
        if kind == "q":
            there = chain.close(pin.integrate(chain.model, q, G @ unit), hold=joints, tolerance=1e-13)
        v, a = chain.dependent_motion(
            there, joints, case.v[own] + (kind == "v") * unit, case.a[own] + (kind == "a") * unit
        )
        forces = chain.inverse_dynamics(there, v, a, metric="closures", **problem)
        return [forces.tau, forces.multipliers, v, a]

    still = np.zeros_like(G)
    for kind, v, a in (("q", found.v_q, found.a_q), ("v", G, found.a_v), ("a", still, G)):
        got = [getattr(found, f"tau_{kind}"), getattr(found, f"multipliers_{kind}"), v, a]
        ends = [at(kind, s * STEP) for s in (1, -1, 2, -2)]
        for k, matrix in enumerate(got):
            one, two, three, four = (end[k] for end in ends)
            expected = (8 * (one - two) - (three - four)) / (12 * STEP)
            largest = np.abs(expected).max(initial=0.0)
            np.testing.assert_allclose(matrix @ way, expected, atol=1e-7 * (1e-2 + largest))


def test_derivatives_with_springs_and_dampers_are_differences():
    case, rng = moving("five-bar", 5), np.random.default_rng(6)
    chain, joints = case.chain, case.independent
    springs = tuple(JointProperties(name, float(rng.uniform(1.0, 5.0))) for name in list(chain.model.names)[1:])
    chain = ClosedChain(chain.model, chain.description.__class__(**(vars(chain.description) | {"joints": springs})))
    chain.model.damping = rng.uniform(0.1, 1.0, chain.model.nv)
    own = chain.velocity_indices(joints)
    found = chain.inverse_dynamics_derivatives(case.q, case.v, case.a, independent=joints)
    G = chain.reduced_jacobian(case.q, joints)
    for kind in "qv":
        for k in range(len(own)):

            def tau(s, kind=kind, k=k):
                unit, there = s * np.eye(len(own))[k], case.q
                if kind == "q":
                    there = chain.close(pin.integrate(chain.model, case.q, G @ unit), hold=joints, tolerance=1e-13)
                v, a = chain.dependent_motion(there, joints, case.v[own] + (kind == "v") * unit, case.a[own])
                return chain.inverse_dynamics(there, v, a, metric="closures").tau

            expected = difference(tau)
            np.testing.assert_allclose(
                getattr(found, f"tau_{kind}")[:, k], expected, atol=1e-7 * (1.0 + np.abs(expected).max())
            )


@pytest.mark.parametrize("name", ["five-bar", "rigid loop"])
def test_missing_forces_of_undriven_chains_are_least_squares(name):
    """By NumPy, from Pinocchio's RNEA and from J, along a direction of the closed motions."""
    case = underactuated(name, 0)
    chain, passive = case.chain, case.chain._state.drive(case.actuated).passive
    found = chain.inverse_dynamics_derivatives(case.q, case.v, case.a, actuated=case.actuated)
    top, own = chain._state.topology, found.independent
    rest = np.setdiff1d(np.arange(chain.model.nv), own)
    way = np.random.default_rng(1).normal(size=len(own))

    def following(q, motion, right):
        J, motion = chain.constraint_jacobian(q), np.array(motion)
        motion[rest] = np.linalg.lstsq(J[:, rest], right - J[:, own] @ motion[own], rcond=1e-9)[0]
        return motion

    def at(kind, s):
        none = np.zeros(chain.model.nv)
        step, q = none.copy(), case.q
        step[own] = s * way
        if kind == "q":
            q = pin.integrate(chain.model, q, step)
            for _ in range(5):
                q = pin.integrate(chain.model, q, following(q, none, -chain.residual(q)))
        v = following(q, case.v + step * (kind == "v"), np.zeros(chain.row_count))
        a = following(q, case.a + step * (kind == "a"), -chain.constraint_drift(q, v))
        tau, J = pin.rnea(chain.model, chain.model.createData(), q, v, a), chain.constraint_jacobian(q)
        A = (J * top.row_scale[:, None] * top.column)[:, passive].T
        multipliers = top.row_scale * np.linalg.lstsq(A, top.column[passive] * tau[passive], rcond=1e-9)[0]
        return np.concatenate([tau - J.T @ multipliers, multipliers])

    for kind in "qva":
        expected = difference(lambda s, kind=kind: at(kind, s))
        got = np.vstack([getattr(found, f"tau_{kind}"), getattr(found, f"multipliers_{kind}")]) @ way
        np.testing.assert_allclose(got, expected, atol=1e-6 * (1.0 + np.abs(expected).max()))


def test_a_tree_has_pinocchios_derivatives():
    case = underactuated("acrobot", 0)
    found = case.chain.inverse_dynamics_derivatives(case.q, case.v, case.a, actuated=case.actuated)
    data = case.chain.model.createData()
    expected = pin.computeRNEADerivatives(case.chain.model, data, case.q, case.v, case.a)
    for got, matrix in zip((found.tau_q, found.tau_v, found.tau_a), expected, strict=True):
        got = got[:, np.argsort(found.independent)]
        np.testing.assert_allclose(got, np.reshape(matrix, got.shape), atol=1e-10 * (1 + np.abs(matrix).max()))
