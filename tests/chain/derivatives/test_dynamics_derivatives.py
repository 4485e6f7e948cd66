"""Derivatives of inverse dynamics against differences along the closed loops."""

from dataclasses import replace

import numpy as np
import pinocchio as pin
import pytest
from moving_chains import ALL, drivers, moving

from exo_pin import UndeterminedMotion
from exo_pin.chain import ClosedChain, JointProperties

#: Differences of fourth order: step⁴ of the formula, and the closing tolerance 1e-13 over the step.
STEP, TOLERANCE = 1e-3, 1e-7


def loaded(name, seed=3):
    case = moving(name, seed)
    rng = np.random.default_rng(seed)
    return case, {case.chain.closures[0].frame_a: 3 * rng.normal(size=6)}


def sprung(chain, rng):
    springs = tuple(JointProperties(name, float(rng.uniform(1.0, 5.0))) for name in list(chain.model.names)[1:])
    chain = ClosedChain(chain.model, replace(chain.description, joints=springs))
    chain.model.damping = rng.uniform(0.1, 1.0, chain.model.nv)
    return chain


def check(case, chain, external, ways):
    """Changes along some directions of the independent joints, as rows, against differences."""
    q, joints, own = case.q, case.independent, chain.velocity_indices(case.independent)
    problem = {"external": external, "actuated": drivers(case)}
    found = chain.inverse_dynamics_derivatives(q, case.v, case.a, independent=joints, **problem)
    np.testing.assert_array_equal(found.independent, own)
    G = chain.reduced_jacobian(q, joints)

    def at(kind, unit):
        there = q
        if kind == "q":
            there = chain.close(pin.integrate(chain.model, q, G @ unit), hold=joints, tolerance=1e-13)
        speeds, rates = case.v[own] + (kind == "v") * unit, case.a[own] + (kind == "a") * unit
        v, a = chain.dependent_motion(there, joints, speeds, rates)
        forces = chain.inverse_dynamics(there, v, a, metric="closures", **problem)
        return [forces.tau, forces.multipliers, v, a]

    still = np.zeros_like(G)
    for kind, v, a in (("q", found.v_q, found.a_q), ("v", G, found.a_v), ("a", still, G)):
        got = [getattr(found, f"tau_{kind}"), getattr(found, f"multipliers_{kind}"), v, a]
        for way in ways:
            ends = [at(kind, s * STEP * way) for s in (1, -1, 2, -2)]
            for matrix, one, two, three, four in zip(got, *ends, strict=True):
                expected = (8 * (one - two) - (three - four)) / (12 * STEP)
                largest = np.abs(expected).max(initial=0.0)
                np.testing.assert_allclose(matrix @ way, expected, atol=TOLERANCE * (1e-3 + largest))


@pytest.mark.full
@pytest.mark.parametrize("name", ALL)
def test_efforts_multipliers_and_motions_against_differences(name):
    case, external = loaded(name)
    check(case, case.chain, external, np.eye(case.dof))


def test_changes_of_springs_and_dampers_against_differences(plain):
    case, external = loaded("five-bar")
    check(case, sprung(case.chain, np.random.default_rng(6)), external, np.eye(case.dof))


def test_a_joint_given_twice_leaves_others_undetermined(plain):
    case = moving("five-bar", 3)
    twice = [case.independent[0]] * 2
    for ask in (case.chain.inverse_dynamics_derivatives, case.chain.forward_dynamics_derivatives):
        with pytest.raises(UndeterminedMotion):
            ask(case.q, independent=twice)
