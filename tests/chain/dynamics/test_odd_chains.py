"""Chains and bounds at the edge of sense: undriven, overdriven, without loops, joints or mass, out of reach."""

import dataclasses
import itertools

import numpy as np
import pinocchio as pin
import pytest
from closed_motion import closed_motion
from mechanisms import five_bar, four_bar, random_wrist
from scipy.optimize import linprog
from self_stress import Open
from skeletons import four_bar_skeleton, parallelogram_skeleton
from tree_forces import tree_forces

from exo_pin import InfeasibleForces, UndrivenMotion, UnknownName, thesis_rotation
from exo_pin.chain import PULL, ClosedChain, Closure, Closures, Placement, Roles
from exo_pin.design import preset
from exo_pin.wrist_chain import mechanism_urdf

NAMED = four_bar()
Q = NAMED.q


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


def test_nothing_drives_a_chain_in_an_equilibrium_of_its_own():
    # No gravity in the plane of motion: the hinges carry the weights, no motor is needed, nor brake.
    forces = NAMED.chain().inverse_dynamics(Q, actuated=())
    assert not forces.tau.any()
    weight = sum(inertia.mass for inertia in NAMED.chain().model.inertias[1:]) * 9.81
    assert forces.wrench_on("universe").force[2] == pytest.approx(-weight)
    # Nor in free fall.
    chain = NAMED.chain()
    chain.model.gravity.linear = np.zeros(3)
    still = chain.inverse_dynamics(Q, actuated=())
    for name in ("crank_hinge", "coupler_hinge", "rocker_hinge", "tip"):
        np.testing.assert_allclose(still.joint_reaction(name).wrench, 0.0, atol=1e-14)
        assert not still.joint_reaction(name).unique.all()
    # A pendulum of two links that hangs straight down needs none either; beside that, it does.
    swing = parallelogram_skeleton().chain(("high_1", "high_2"))
    swing.model.gravity.linear = np.array([0.1, 0.2, 0.0]) * -9.81 / np.hypot(0.1, 0.2)
    assert not swing.inverse_dynamics(swing.neutral(), actuated=()).tau.any()
    swing.model.gravity.linear = np.array([0.0, -9.81, 0.0])
    with pytest.raises(UndrivenMotion):
        swing.inverse_dynamics(swing.neutral(), actuated=())


def test_a_brake_on_every_joint_makes_all_efforts_undetermined():
    chain, q, v, a = closed_motion("five_bar", 2)
    forces = chain.inverse_dynamics(q, v, a, actuated=list(chain.model.names)[1:])
    assert forces.undetermined == chain.row_count
    # In the plane every hinge may work against the others; across it nothing does.
    assert not forces.effort_is_unique.any()
    other = Open(chain, q, v, a, actuated=list(chain.model.names)[1:])
    best = min(np.linalg.norm(other.forces(z).tau) for z in np.random.default_rng(0).normal(size=(50, other.size)))
    least = chain.inverse_dynamics(q, v, a, actuated=list(chain.model.names)[1:], objective="efforts")
    assert np.linalg.norm(least.tau) <= best


def test_a_second_motor_makes_efforts_undetermined_but_not_their_power():
    chain = four_bar_skeleton().chain(("C",), actuated=("A", "B"))
    q = chain.neutral()
    forces = chain.inverse_dynamics(q)
    assert not forces.effort_is_unique[chain.velocity_indices(["A", "B"])].any()
    assert forces.effort_is_unique[chain.velocity_indices(["D"])].all()
    assert np.isinf(forces.effort_interval("A")).all()
    v, _ = chain.dependent_motion(q, ["A"], [1.0])
    alone = chain.inverse_dynamics(q, actuated=["A"]).effort("A")[0]
    assert forces.tau @ v == pytest.approx(alone)


def test_a_chain_without_closures_is_a_tree():
    named = five_bar()
    tree = ClosedChain.from_urdf(
        named.urdf, Closures("tree", roles=Roles(actuated=tuple(named.chain().model.names)[1:]))
    )
    rng = np.random.default_rng(0)
    q, v, a = rng.normal(size=(3, tree.model.nv))
    forces = tree.inverse_dynamics(q, v, a)
    np.testing.assert_allclose(forces.tau, pin.rnea(tree.model, tree.model.createData(), q, v, a), atol=1e-13)
    assert forces.undetermined == 0
    assert forces.effort_is_unique.all()
    assert forces.joint_reaction("left_crank_hinge").unique.all()
    with pytest.raises(UndrivenMotion):
        tree.inverse_dynamics(q, v, a, actuated=["left_crank_hinge"])
    limits = {"left_crank_hinge": (forces.effort("left_crank_hinge") + 1.0, np.inf)}
    with pytest.raises(InfeasibleForces) as refusal:
        tree.inverse_dynamics(q, v, a, effort_bounds=limits)
    assert refusal.value.excess == pytest.approx(1.0)


def test_a_chain_without_joints_has_empty_results():
    chain = ClosedChain(pin.Model(), Closures("nothing"))
    forces = chain.inverse_dynamics(np.zeros(0))
    assert forces.tau.shape == (0,)
    assert forces.undetermined == 0
    np.testing.assert_array_equal(forces.wrench_on("universe").wrench, np.zeros(6))
    with pytest.raises(UnknownName):
        forces.joint_reaction("shoulder")


def test_links_without_mass_carry_external_wrenches():
    # The prototype's limbs have none: all the torso carries is the arm, and every limb is in balance by itself.
    mechanism = preset("prototype")
    chain = ClosedChain.from_urdf(*mechanism_urdf(mechanism))
    q = chain.neutral()
    q[chain.configuration_slice("root_joint")] = thesis_rotation(40, -20, -30, degrees=True).as_quat()
    q = chain.close(q, hold=["root_joint"])
    forces = chain.inverse_dynamics(q, external={"limb_1_base_body": [1.0, 2.0, 3.0, 0.0, 0.0, 0.0]})
    np.testing.assert_allclose(
        forces.wrench_on("universe").force, mechanism.arm.mass * np.array([0, 0, -9.81]) + [1, 2, 3], atol=1e-9
    )
    np.testing.assert_allclose(forces.wrench_on("limb_1_base_body").force, [-1, -2, -3], atol=1e-9)
    np.testing.assert_allclose(forces.wrench_on("limb_2_base_body").wrench, 0.0, atol=1e-9)


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


def test_bounds_on_unique_forces_are_met_or_infeasible():
    # Three limbs' forces are unique: bounds around them change nothing, and bounds beside them are refused by name.
    mechanism = random_wrist(21, "UUU", with_masses=True)
    chain = ClosedChain.from_urdf(*mechanism_urdf(mechanism))
    q = chain.close(chain.neutral())
    free = chain.inverse_dynamics(q)
    effort = free.effort("limb_1_slide")[0]
    for bounds in ((effort - 1.0, effort + 1.0), (effort, effort), (-1e6, 1e6)):
        held = chain.inverse_dynamics(q, effort_bounds={"limb_1_slide": bounds}, objective="efforts")
        np.testing.assert_allclose(held.multipliers, free.multipliers, atol=1e-7 * np.abs(free.multipliers).max())
        assert np.isinf(held.joint_reaction("root_joint").interval[:3]).all()
        np.testing.assert_allclose(held.effort_interval("limb_1_slide"), [[effort, effort]])
    with pytest.raises(InfeasibleForces, match="effort of limb_1_slide at most") as refusal:
        chain.inverse_dynamics(q, effort_bounds={"limb_1_slide": (-np.inf, effort - 2.0), "limb_2_slide": (-1e6, 1e6)})
    assert refusal.value.excess == pytest.approx(2.0, rel=1e-6)
    assert len(refusal.value.bounds) == 1
    wrong = {name: PULL if free.effort(name)[0] > 0 else (0.0, np.inf) for name in chain.roles.actuated}
    with pytest.raises(InfeasibleForces):
        chain.inverse_dynamics(q, effort_bounds=wrong)


def test_an_objective_of_weight_zero_or_of_unique_forces_has_no_effect():
    chain, q, v, a = closed_motion("heavy limbs", 5)
    free = chain.inverse_dynamics(q, v, a)
    for objective in ({}, {"root_joint": 0.0}, "efforts", {"root_joint": [0, 0, 0, 1, 1, 1]}):
        other = chain.inverse_dynamics(q, v, a, objective=objective)
        np.testing.assert_allclose(other.multipliers, free.multipliers, atol=1e-7 * np.abs(free.multipliers).max())


def test_effort_limits_of_the_model_are_read_from_the_urdf():
    urdf = NAMED.urdf.replace('effort="0"', 'effort="2.5"')
    chain = ClosedChain.from_urdf(urdf, NAMED.closures)
    chain.model.gravity.linear = np.array([0.0, -9.81, 0.0])
    needed = chain.inverse_dynamics(Q).effort("crank_hinge")[0]
    limit = float(chain.model.upperEffortLimit[chain.velocity_slice("crank_hinge")][0])
    assert abs(needed) > limit
    with pytest.raises(InfeasibleForces) as refusal:
        chain.inverse_dynamics(Q, effort_bounds="model")
    assert refusal.value.excess == pytest.approx(abs(needed) - limit, rel=1e-7)


def test_a_rigid_closure_that_only_repeats_another_shares_its_load_with_it():
    # The rocker's tip pinned twice: the two share, equally by symmetry of the metric, and say that it is open.
    extra = Closure(
        "tip_again", "spherical", "coupler", "rocker", Placement((float(np.sqrt(0.5)), 0, 0)), Placement((0.5, 0, 0))
    )
    closures = dataclasses.replace(NAMED.closures, closures=(*NAMED.closures.closures, extra))
    chain = ClosedChain.from_urdf(NAMED.urdf, closures)
    chain.model.gravity.linear = np.array([3.0, -9.0, -1.0])
    bare = NAMED.chain()
    bare.model.gravity.linear = chain.model.gravity.linear
    one, two = bare.inverse_dynamics(Q), chain.inverse_dynamics(Q)
    np.testing.assert_allclose(two.tau, one.tau, atol=1e-12)
    assert two.undetermined == one.undetermined + 3
    shares = [two.joint_reaction(name) for name in ("tip", "tip_again")]
    np.testing.assert_allclose(shares[0].force, shares[1].force, atol=1e-11)
    np.testing.assert_allclose(shares[0].force[:2] * 2, one.joint_reaction("tip").force[:2], atol=1e-11)
    assert not shares[0].unique[:3].any()
    assert shares[0].unique[3:].all()
