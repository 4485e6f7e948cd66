"""Forces in closed chains against MuJoCo's inverse dynamics of the open tree.

The tree is read anew from the URDF (tests/mujoco_tree.py). The closures' wrenches go on as forces applied to the two
bodies; then MuJoCo says what is left for the joints and what every joint carries.
"""

import numpy as np
import pytest
from closed_motion import MAKERS, closed_motion, coupled, loops, named, some_load
from mechanisms import Named
from mujoco_tree import MujocoTree
from scipy.spatial.transform import Rotation

from exo_pin.chain import Closures

#: Both sides evaluate the same recursion in double precision: a rounding a joint, at most 21 of them, and MuJoCo's
#: inertias, diagonalised to 1e-12 of their size. Measured: below 1e-15 of the largest force.
TOLERANCE = 1e-11
SEEDS = [pytest.param(seed, marks=() if seed < 1 else pytest.mark.full) for seed in range(4)]


def counterpart(chain, name, gravity, state, load, forces):
    """MuJoCo's tree with load and closures' wrenches on it."""
    q = state[0]
    tree = MujocoTree(named(name), gravity)
    tree.put(chain, *state)
    for link, wrench in load.items():
        tree.push(link, wrench, chain.placement(q, link).translation)
    for closure in loops(chain):
        # About a point that is no one's own, in axes that are no one's own.
        point, frame = np.array([0.3, -0.2, 0.5]), chain.model.names[-1]
        expressed = forces.joint_reaction(closure.name, at=point, in_frame=frame, intervals=False).wrench
        R = chain.placement(q, frame).rotation
        wrench = np.concatenate([R @ expressed[:3], R @ expressed[3:]])
        tree.push(closure.frame_a, wrench, point)
        tree.push(closure.frame_b, -wrench, point)
    return tree


def largest(forces, chain):
    return max(np.abs(forces.joint_reaction(joint, intervals=False).wrench).max() for joint in joints(chain))


def joints(chain):
    return list(chain.model.names)[1:]


@pytest.fixture(params=SEEDS)
def seed(request):
    return request.param


@pytest.fixture(params=MAKERS)
def both(request, seed):
    name = request.param
    chain, *state = closed_motion(name, seed)
    gravity = np.random.default_rng(seed).normal(size=3) * 8
    chain.model.gravity.linear = gravity
    load = some_load(chain, seed)
    forces = chain.inverse_dynamics(*state, external=load)
    efforts = forces.tau + coupled(chain, state[0], forces.multipliers)
    return chain, forces, counterpart(chain, name, gravity, state, load, forces), efforts


def test_joints_carry_the_efforts_and_nothing_else(both):
    chain, forces, tree, efforts = both
    tau, size = tree.inverse(chain), largest(forces, chain)
    np.testing.assert_allclose(tau, efforts, rtol=0, atol=TOLERANCE * size)
    passive = np.ones(chain.model.nv, dtype=bool)
    passive[chain.velocity_indices(chain.roles.actuated)] = False
    assert not forces.tau[passive].any()
    assert np.abs((tau - efforts)[passive]).max() < TOLERANCE * size


def test_sensors_at_every_joint_feel_its_reaction(both):
    chain, forces, tree, _ = both
    tree.inverse(chain)
    size = largest(forces, chain)
    for joint in joints(chain):
        expressed = forces.joint_reaction(joint, in_frame="local", intervals=False).wrench
        np.testing.assert_allclose(expressed, tree.transmitted(joint), rtol=0, atol=TOLERANCE * size)


#: What a closure of each type transmits none of, in the axes of frame a about its point: force and moment along axes.
FREE = {
    "rigid": ([], []),
    "spherical": ([], [0, 1, 2]),
    "revolute": ([], [2]),
    "universal": ([], [0]),  # and the moment about frame b's y, below
    "prismatic": ([2], []),
    "cylindrical": ([2], [2]),
    "distance": ([], [0, 1, 2]),  # and no force across the line, below
}


def frame(chain, q, closure, end):
    """Point and axes, as columns, of a closure's frame; a stated axis is its z."""
    place = closure.placement_a if end == "a" else closure.placement_b
    carrier = chain.placement(q, closure.frame_a if end == "a" else closure.frame_b)
    R = carrier.rotation @ Rotation.from_quat(place.quaternion).as_matrix()
    point = carrier.rotation @ np.array(place.translation) + carrier.translation
    if closure.axis is not None:
        z = R @ np.array(closure.axis)
        x = np.cross(z, [0.3, 0.5, -0.8])
        x /= np.linalg.norm(x)
        R = np.column_stack([x, np.cross(z, x), z])
    return point, R


@pytest.mark.parametrize("seed", SEEDS)
@pytest.mark.parametrize("name", MAKERS)
def test_a_closure_transmits_nothing_along_what_it_allows(name, seed):
    chain, q, v, a = closed_motion(name, seed)
    forces = chain.inverse_dynamics(q, v, a, external=some_load(chain, seed))
    for closure in loops(chain):
        point_a, axes = frame(chain, q, closure, "a")
        point_b, axes_b = frame(chain, q, closure, "b")
        expressed = forces.joint_reaction(closure.name, at=point_b, intervals=False)
        size = max(np.abs(expressed.wrench).max(), 1e-3)
        no_force, no_moment = FREE[closure.type]
        force, moment = axes.T @ expressed.force, axes.T @ expressed.moment
        assert np.abs(force[no_force]).max(initial=0.0) < 1e-11 * size
        assert np.abs(moment[no_moment]).max(initial=0.0) < 1e-11 * size
        if closure.type == "universal":
            assert abs(expressed.moment @ axes_b[:, 1]) < 1e-11 * size
        if closure.type == "distance":
            line = (point_b - point_a) / np.linalg.norm(point_b - point_a)
            assert np.linalg.norm(np.cross(expressed.force, line)) < 1e-11 * size


def test_mujocos_sensors_measure_the_wrench_of_the_parent_on_the_child():
    # A weight of 2 kg hangs 0.1 m out along x of a hinge about z: its parent holds it up, against gravity along -y.
    urdf = """<robot name="weight"><link name="ground"/>
        <link name="bob"><inertial><origin xyz="0.1 0 0"/><mass value="2"/>
        <inertia ixx="0.01" iyy="0.01" izz="0.01" ixy="0" ixz="0" iyz="0"/></inertial></link>
        <joint name="hinge" type="revolute"><parent link="ground"/><child link="bob"/><axis xyz="0 0 1"/>
        <limit lower="-1" upper="1" effort="1" velocity="1"/></joint></robot>"""
    named_weight = Named(urdf, Closures("weight"), np.zeros(1))
    chain = named_weight.chain()
    tree = MujocoTree(named_weight, [0.0, -9.81, 0.0])
    zero = np.zeros(1)
    tree.put(chain, zero, zero, zero)
    assert tree.inverse(chain)[0] == pytest.approx(2 * 9.81 * 0.1)
    np.testing.assert_allclose(tree.transmitted("hinge"), [0, 2 * 9.81, 0, 0, 0, 2 * 9.81 * 0.1], atol=1e-12)
