"""The oracle of tree forces itself, against balances by hand and the package's own reactions."""

import numpy as np
import pinocchio as pin
import pytest
from mechanisms import four_bar, random_wrist
from moving_chains import moving as motion_of
from tree_forces import tree_forces

from exo_pin.chain import ClosedChain
from exo_pin.design import preset
from exo_pin.wrist_chain import mechanism_urdf

MECHANISMS = {
    "prototype": preset("prototype"),
    "heavy limbs": random_wrist(21, "UUU", with_masses=True),
    "mixed": random_wrist(22, "USUSU", with_masses=True),
}


def moving(mechanism, part="whole", seed=0):
    """A chain in random closed motion with random multipliers."""
    rng = np.random.default_rng(seed)
    chain = ClosedChain.from_urdf(*mechanism_urdf(mechanism, part))
    q = chain.close(pin.integrate(chain.model, chain.neutral(), rng.uniform(-0.3, 0.3, chain.model.nv)))
    v, a = rng.normal(size=(2, chain.model.nv))
    return chain, q, v, a, rng.normal(size=chain.row_count)


@pytest.mark.parametrize("name", MECHANISMS)
def test_multipliers_make_the_generalised_force_of_the_transposed_jacobian(name):
    chain, q, v, a, multipliers = moving(MECHANISMS[name])
    data = chain.model.createData()
    free = pin.rnea(chain.model, data, q, v, a)
    np.testing.assert_allclose(tree_forces(chain, q, v, a).tau, free, atol=1e-13)
    expected = free - chain.constraint_jacobian(q).T @ multipliers
    np.testing.assert_allclose(tree_forces(chain, q, v, a, multipliers).tau, expected, atol=1e-12)


@pytest.mark.parametrize("name", MECHANISMS)
def test_every_joint_transmits_what_its_coordinates_feel(name):
    # τ of a joint is its wrench along its own axes.
    chain, q, v, a, multipliers = moving(MECHANISMS[name], seed=1)
    forces = tree_forces(chain, q, v, a, multipliers)
    data = chain.model.createData()
    pin.computeJointJacobians(chain.model, data, q)
    for joint in list(chain.model.names)[1:]:
        wrench = forces.joint_wrench(joint, at=(0.0, 0.0, 0.0))
        columns = data.J[:, chain.velocity_slice(joint)]
        np.testing.assert_allclose(columns.T @ wrench, forces.tau[chain.velocity_slice(joint)], atol=1e-12)


@pytest.mark.parametrize("name", MECHANISMS)
@pytest.mark.parametrize("part", ["whole", "floating"])
def test_the_whole_is_in_balance(name, part):
    # Rate of momentum about O = root joint + closures + weight + load.
    chain, q, v, a, multipliers = moving(MECHANISMS[name], part, seed=2)
    load = np.array([3.0, -5.0, 2.0, 0.4, 0.1, -0.7])
    point = chain.placement(q, "arm").translation
    forces = tree_forces(chain, q, v, a, multipliers, external={"arm": load})
    data = chain.model.createData()
    rate = pin.computeCentroidalMomentumTimeVariation(chain.model, data, q, v, a)
    centre = data.com[0]
    total = forces.joint_wrench("root_joint", at=(0.0, 0.0, 0.0))
    for closure in chain.closures:
        assert closure.frame_b == "universe"
        total = total + forces.closure_wrench(closure.name, at=(0.0, 0.0, 0.0))
    weight = data.mass[0] * chain.model.gravity.linear
    total[:3] += weight + load[:3]
    total[3:] += np.cross(centre, weight) + load[3:] + np.cross(point, load[:3])
    expected = np.concatenate([rate.linear, rate.angular + np.cross(centre, rate.linear)])
    np.testing.assert_allclose(total, expected, atol=1e-11)


def test_frames_and_points_of_a_wrench():
    chain, q, v, a, multipliers = moving(MECHANISMS["heavy limbs"], seed=3)
    forces = tree_forces(chain, q, v, a, multipliers)
    joint = chain.placement(q, "limb_2_slide")
    wrench = forces.joint_wrench("limb_2_slide")
    local = forces.joint_wrench("limb_2_slide", frame="local")
    np.testing.assert_allclose(local[:3], joint.rotation.T @ wrench[:3], atol=1e-13)
    np.testing.assert_allclose(local[3:], joint.rotation.T @ wrench[3:], atol=1e-13)
    point = np.array([0.1, -0.2, 0.3])
    there = forces.joint_wrench("limb_2_slide", at=point)
    moment = wrench[3:] + np.cross(joint.translation - point, wrench[:3])
    np.testing.assert_allclose(there, np.concatenate([wrench[:3], moment]), atol=1e-13)
    # In its own axes at its own point, a closure's wrench is its multipliers.
    for closure in chain.closures:
        own = forces.closure_wrench(closure.name, frame="local")
        rows = multipliers[chain.rows(closure.name)]
        np.testing.assert_allclose(own[: len(rows)], rows, atol=1e-12)
        np.testing.assert_allclose(own[len(rows) :], 0.0, atol=1e-12)


def test_a_closure_between_two_links_pushes_both_ways():
    named = four_bar()
    chain = named.chain()
    force = np.array([2.0, -3.0, 0.0])
    forces = tree_forces(chain, named.q, multipliers=force)
    # With λ in the axes of the coupler: what the coupler's hinge carries more, the rocker's carries less.
    world = chain.placement(named.q, "coupler").rotation @ force
    still = tree_forces(chain, named.q)
    for hinge, sign in (("crank_hinge", -1.0), ("coupler_hinge", -1.0), ("rocker_hinge", 1.0)):
        change = forces.joint_wrench(hinge)[:3] - still.joint_wrench(hinge)[:3]
        np.testing.assert_allclose(change, sign * world, atol=1e-13)


@pytest.mark.parametrize("kind", ["rigid", "revolute", "universal", "prismatic", "cylindrical", "distance"])
def test_the_wrench_of_a_closure_is_about_the_point_of_its_multipliers(kind):
    # A closure that has slid has two origins: λ acts at frame b's, and both ways of asking say so.
    case = motion_of(f"{kind} loop")
    chain = case.chain
    solved = chain.inverse_dynamics(case.q, case.v, case.a, actuated=case.independent)
    forces = tree_forces(chain, case.q, case.v, case.a, solved.multipliers)
    size = np.abs(solved.multipliers).max()
    for frame in ("world", "local"):
        expressed = solved.joint_reaction("loop", in_frame=frame).wrench
        np.testing.assert_allclose(forces.closure_wrench("loop", frame=frame), expressed, atol=1e-12 * size)
    closure = chain.closures[0]
    place = chain.placement(case.q, closure.frame_b)
    point = place.rotation @ np.array(closure.placement_b.translation) + place.translation
    np.testing.assert_allclose(
        forces.closure_wrench("loop"), forces.closure_wrench("loop", at=point), atol=1e-12 * size
    )
    if kind in ("prismatic", "cylindrical"):
        # Free along and about its own z axis there.
        free = forces.closure_wrench("loop", frame="local")[[2] if kind == "prismatic" else [2, 5]]
        np.testing.assert_allclose(free, 0.0, atol=1e-12 * size)
