"""What the certificate calls unique stays put under every self-stress, and nothing else does."""

import numpy as np
import pytest
from closed_motion import MAKERS, closed_motion, loops, some_load
from mechanisms import four_bar, random_wrist
from self_stress import Open, vertices

from exo_pin import InfeasibleForces, thesis_rotation
from exo_pin.chain import PULL, ClosedChain
from exo_pin.wrist_chain import mechanism_urdf


def names_of(chain):
    return [*list(chain.model.names)[1:], *(closure.name for closure in loops(chain))]


def wrist_at(mechanism, part="whole", pose=(40, -20, -30)):
    chain = ClosedChain.from_urdf(*mechanism_urdf(mechanism, part))
    q = chain.neutral()
    root = chain.configuration_slice("root_joint")
    q[root.stop - 4 : root.stop] = thesis_rotation(*pose, degrees=True).as_quat()
    return chain, chain.close(q, hold=["root_joint"])


@pytest.mark.parametrize("frame", ["world", pytest.param("local", marks=pytest.mark.full)])
@pytest.mark.parametrize("name", MAKERS)
def test_just_the_components_that_are_not_unique_change_with_self_stresses(name, frame):
    # Wojtyra's criterion by brute force: random self-stresses, forces by the tree's recursion.
    chain, q, v, a = closed_motion(name, 31)
    load = some_load(chain, 31)
    forces = chain.inverse_dynamics(q, v, a, external=load)
    other = Open(chain, q, v, a, load)
    assert forces.undetermined == other.size
    rng = np.random.default_rng(0)
    size = np.abs(other.everything(np.zeros(other.size))).max()
    draws = rng.normal(size=(4, other.size)) * size
    at = [0.1, 0.2, -0.3] if frame == "world" else "origin"
    for joint in names_of(chain):
        kind = [closure.type for closure in chain.closures if closure.name == joint]
        where = chain_point(chain, q, joint) if kind == ["distance"] and at == "origin" else at
        expressed = forces.joint_reaction(joint, at=where, in_frame=frame, intervals=False)
        if kind in (["revolute"], ["prismatic"], ["cylindrical"]) and frame == "local":
            continue  # the recursion knows no other axes of a closure than those of its frame a
        wrenches = np.array([other.wrench(joint, z, frame, where) for z in [np.zeros(other.size), *draws]])
        spread = np.ptp(wrenches, axis=0) / size if other.size else np.zeros(6)
        # A self-stress that shows does so by its share of a random draw; one that does not, by rounding.
        assert (spread[expressed.unique] < 1e-9).all()
        assert (spread[~expressed.unique] > 1e-6).all()
        # And its directions are those, all of those, and only those.
        changes = (wrenches[1:] - wrenches[0]).T
        D = expressed.directions
        assert np.linalg.matrix_rank(changes, tol=1e-7 * size) == min(expressed.undetermined, len(draws))
        np.testing.assert_allclose(D @ (np.linalg.pinv(D) @ changes), changes, rtol=0, atol=1e-7 * size)
    efforts = np.array([other.forces(z).tau for z in [np.zeros(other.size), *draws]])
    np.testing.assert_array_equal(np.ptp(efforts, axis=0) < 1e-8 * size, forces.effort_is_unique)


def chain_point(chain, q, closure):
    item = next(item for item in chain.closures if item.name == closure)
    return chain.placement(q, item.frame_b).act(np.array(item.placement_b.translation))


def test_a_four_bar_of_hinges_and_one_ball_is_undetermined_in_one_direction_across_its_plane():
    # A force s along z goes round: from the rocker to the coupler at the tip, and back through every hinge, whose
    # moments balance its levers. Nothing in the plane changes.
    named_bar = four_bar()
    chain, q = named_bar.chain(), named_bar.q
    forces = chain.inverse_dynamics(q)
    tip = np.array([0.7, 0.4])
    assert forces.undetermined == 1
    for joint, point, sign in (
        ("coupler_hinge", (0.0, 0.3), -1),
        ("crank_hinge", (0, 0), -1),
        ("rocker_hinge", (0.4, 0), 1),
    ):
        expressed = forces.joint_reaction(joint)
        x, y = tip - point
        # On the child's side: -s at the hinge where +s acts at the tip, so the moment about the hinge is -(r × s z).
        expected = sign * np.array([0, 0, 1, y, -x, 0])
        np.testing.assert_array_equal(expressed.unique, expected == 0)
        assert expressed.undetermined == 1
        own = expressed.directions[:, 0] / expressed.directions[2, 0]
        np.testing.assert_allclose(own, expected / sign, atol=1e-12)
    expressed = forces.joint_reaction("tip")
    np.testing.assert_array_equal(expressed.unique, [True, True, False, True, True, True])


LIMITS = 60.0 * np.ones(3), 25.0 * np.ones(3)


@pytest.mark.parametrize("kinds", ["UUU", "USUSU"])
def test_intervals_reach_to_the_corners_of_what_the_bounds_allow(kinds):
    chain, q = wrist_at(random_wrist(21 if kinds == "UUU" else 22, kinds, with_masses=True), pose=(20, -10, 15))
    free = chain.inverse_dynamics(q).joint_reaction("root_joint", in_frame="local").force
    bounds = {"root_joint": (np.r_[free - LIMITS[0], [-np.inf] * 3], np.r_[free + LIMITS[1], [np.inf] * 3])}
    efforts = {"limb_1_slide": (-40.0, 5.0), "limb_2_slide": (-30.0, 30.0)} if kinds == "USUSU" else {}
    centre = chain.inverse_dynamics(q)
    efforts = {joint: tuple(centre.effort(joint)[0] + np.array(pair)) for joint, pair in efforts.items()}
    forces = chain.inverse_dynamics(q, reaction_bounds=bounds, effort_bounds=efforts)
    other = Open(chain, q)
    constant, effect = other.affine(lambda z: other.wrench("root_joint", z, "local")[:3])
    low, high = bounds["root_joint"][0][:3], bounds["root_joint"][1][:3]
    C, c = [effect, -effect], [high - constant, constant - low]
    for joint, (least, most) in efforts.items():
        at, change = other.affine(lambda z, joint=joint: other.forces(z).tau[chain.velocity_slice(joint)])
        C, c = [*C, change, -change], [*c, most - at, at - least]
    corners = vertices(np.vstack(C), np.concatenate(c))
    assert len(corners) >= 2**other.size  # a box, cut or not, has that many
    size = np.abs(other.everything(np.zeros(other.size))).max()
    inside = np.random.default_rng(0).dirichlet(np.ones(len(corners)), 200) @ corners
    for joint in ("root_joint", "limb_1_platform_x", "limb_1_slide", "limb_1_base"):
        expressed = forces.joint_reaction(joint)
        constant, effect = other.affine(lambda z, joint=joint: other.wrench(joint, z))
        at_corners = constant + corners @ effect.T
        reach = np.column_stack([at_corners.min(axis=0), at_corners.max(axis=0)])
        np.testing.assert_allclose(expressed.interval, reach, rtol=0, atol=1e-7 * size)
        within = constant + inside @ effect.T
        assert (within >= expressed.interval[:, 0] - 1e-7 * size).all()
        assert (within <= expressed.interval[:, 1] + 1e-7 * size).all()
        assert (expressed.wrench >= expressed.interval[:, 0] - 1e-7 * size).all()
        assert (expressed.wrench <= expressed.interval[:, 1] + 1e-7 * size).all()
    for joint in chain.roles.actuated:
        constant, effect = other.affine(lambda z, joint=joint: other.forces(z).tau[chain.velocity_slice(joint)])
        at_corners = constant + corners @ effect.T
        expected = [[at_corners.min(), at_corners.max()]]
        np.testing.assert_allclose(forces.effort_interval(joint), expected, rtol=0, atol=1e-7 * size)


@pytest.mark.parametrize("seed", [5, 6, 13, 15])
def test_an_interval_is_infinite_only_without_bounds(seed):
    # Five limbs that pull, two ways to share: their tensions reach to the corners of that plane's part, and to
    # infinity along the ways in which no limb comes to push.
    chain, q = wrist_at(random_wrist(seed, "SSSSS", with_masses=True), pose=(10, 5, 0))
    other = Open(chain, q)
    slides = chain.velocity_indices(chain.roles.actuated)
    constant, effect = other.affine(lambda z: other.forces(z).tau[slides])
    assert other.size == 2
    corners = vertices(effect, -constant)
    rays = np.array([sign * np.array([-row[1], row[0]]) for row in effect for sign in (1, -1)])
    rays = rays[(rays @ effect.T <= 1e-9).all(axis=1)]
    bounds = dict.fromkeys(chain.roles.actuated, PULL)
    if not len(corners):
        with pytest.raises(InfeasibleForces):
            chain.inverse_dynamics(q, effort_bounds=bounds)
        return
    forces = chain.inverse_dynamics(q, effort_bounds=bounds)
    assert not forces.effort_is_unique[slides].any()
    at_corners, along = constant + corners @ effect.T, rays @ effect.T
    for k, joint in enumerate(chain.roles.actuated):
        low = -np.inf if len(rays) and along[:, k].min() < -1e-9 else at_corners[:, k].min()
        interval = forces.effort_interval(joint)[0]
        size = np.abs(constant).max()
        np.testing.assert_allclose(interval, [low, at_corners[:, k].max()], rtol=0, atol=1e-7 * size)
        assert interval[0] - 1e-7 * size <= forces.effort(joint)[0] <= interval[1] + 1e-7 * size
