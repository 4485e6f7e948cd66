import numpy as np
import pinocchio as pin
import pytest
from moving_chains import ALL, drivers, moving

from exo_pin import InvalidInput, UnknownName

# Kernels of derivatives compile longest; examples and other tests of chains use some of them by default.
pytestmark = pytest.mark.full

#: Differences of fourth order: step⁴ of the formula, and the closing tolerance 1e-13 over the step.
STEP, TOLERANCE = 1e-3, 1e-7


def difference(f):
    return (8 * (f(STEP) - f(-STEP)) - (f(2 * STEP) - f(-2 * STEP))) / (12 * STEP)


def loaded(name, seed=3):
    case = moving(name, seed)
    rng = np.random.default_rng(seed)
    return case, {case.chain.closures[0].frame_a: 3 * rng.normal(size=6)}


@pytest.mark.parametrize("name", ALL)
def test_efforts_multipliers_and_motions_against_differences(name):
    case, external = loaded(name)
    chain, q, joints = case.chain, case.q, case.independent
    own = chain.velocity_indices(joints)
    velocity, acceleration = case.v[own], case.a[own]
    problem = {"external": external, "actuated": drivers(case)}
    found = chain.inverse_dynamics_derivatives(q, case.v, case.a, independent=joints, **problem)
    np.testing.assert_array_equal(found.independent, own)
    G = chain.reduced_jacobian(q, joints)

    def everything(q, velocity, acceleration):
        v, a = chain.dependent_motion(q, joints, velocity, acceleration)
        forces = chain.inverse_dynamics(q, v, a, metric="closures", **problem)
        return [forces.tau, forces.multipliers, v, a]

    def at(kind, k, s):
        unit = s * np.eye(case.dof)[k]
        there = q
        if kind == "q":
            there = chain.close(pin.integrate(chain.model, q, s * G[:, k]), hold=joints, tolerance=1e-13)
        return np.concatenate(everything(there, velocity + (kind == "v") * unit, acceleration + (kind == "a") * unit))

    sizes = [len(part) for part in everything(q, velocity, acceleration)]
    still = np.zeros_like(G)
    for kind, v_change, a_change in (("q", found.v_q, found.a_q), ("v", G, found.a_v), ("a", still, G)):
        expressed = np.vstack(
            [getattr(found, f"tau_{kind}"), getattr(found, f"multipliers_{kind}"), v_change, a_change]
        )
        for k in range(case.dof):
            expected = difference(lambda s, kind=kind, k=k: at(kind, k, s))
            first = 0
            for size in sizes:
                part = slice(first, first + size)
                largest = np.abs(expected[part]).max()
                np.testing.assert_allclose(expressed[part, k], expected[part], atol=TOLERANCE * (1e-3 + largest))
                first += size


def test_derivatives_by_acceleration_are_the_inertia_of_the_chain():
    # For a chain driven in its independent joints: Gᵀ M G.
    case, _ = loaded("five-bar")
    found = case.chain.inverse_dynamics_derivatives(case.q, case.v, case.a, independent=case.independent)
    G = case.chain.reduced_jacobian(case.q, case.independent)
    upper = np.triu(pin.crba(case.chain.model, case.chain.model.createData(), case.q))
    M = upper + np.triu(upper, 1).T
    np.testing.assert_allclose(found.tau_a[found.independent], G.T @ M @ G, atol=1e-12)


def test_later_changes_of_the_input_do_not_change_the_result():
    case, external = loaded("five-bar")
    chain = case.chain

    def question():
        found = chain.inverse_dynamics_derivatives(case.q, case.v, case.a, external=external)
        motion = chain.forward_dynamics(case.q, case.v, external=external)
        return lambda: (found.tau_q, motion.forces.multipliers)

    before, after = question()(), question()
    chain.model.gravity.linear = np.array([0.0, -9.81, 0.0])
    for wrench in external.values():
        wrench *= 100.0
    for one, other in zip(before, after(), strict=True):
        np.testing.assert_array_equal(one, other)


def test_the_independent_joints_are_chosen_if_none_are_named():
    case, _ = loaded("Stewart platform")
    found = case.chain.inverse_dynamics_derivatives(case.q, case.v, case.a)
    np.testing.assert_array_equal(found.independent, case.chain.split(case.q).independent)
    assert found.tau_q.shape == (case.chain.model.nv, 6)
    assert not found.tau_q.flags.writeable


def test_bad_input_is_refused():
    case, _ = loaded("five-bar")
    with pytest.raises(UnknownName):
        case.chain.inverse_dynamics_derivatives(case.q, independent=["knee"])
    with pytest.raises(InvalidInput):
        case.chain.inverse_dynamics_derivatives(case.q, np.ones(4))
