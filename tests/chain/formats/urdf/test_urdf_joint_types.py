"""Random URDF trees with joints of every type and closures of every type, against two other readings of the file."""

import numpy as np
import pinocchio as pin
import pytest
from pydrake.multibody.parsing import Parser
from pydrake.multibody.plant import MultibodyPlant
from pydrake.multibody.tree import MultibodyForces
from scipy.spatial.transform import Rotation
from urdf_oracle import Tree, coordinates, reordering
from urdf_trees import KINDS, random_tree

from exo_pin.chain import TYPES, ClosedChain, Closure, Closures, Placement

SEEDS = [pytest.param(seed, marks=() if seed < 3 else pytest.mark.full) for seed in range(12)]
GRAVITY = (0.3, -0.2, -9.7)


def state(model, rng):
    q = pin.integrate(model, pin.neutral(model), rng.normal(size=model.nv))
    return q, rng.normal(size=model.nv), rng.normal(size=model.nv)


def loaded(seed, kinds=KINDS):
    xml = random_tree(seed, kinds=kinds)
    chain = ClosedChain.from_urdf(xml, Closures(f"tree-{seed}"))
    chain.model.gravity.linear = np.array(GRAVITY)
    return xml, chain, Tree(xml)


@pytest.mark.parametrize("seed", SEEDS)
def test_the_tree_is_that_of_the_file(seed):
    _, chain, tree = loaded(seed)
    model, rng = chain.model, np.random.default_rng(seed)
    data, order = model.createData(), reordering(model, tree)
    assert len(order) == model.nv == tree.width
    for _ in range(3):
        q, v, a = state(model, rng)
        named = coordinates(model, q)
        still = tree.rates(np.zeros(tree.width))
        for link, motion in tree.motion(named, still, still).items():
            place = chain.placement(q, link)
            np.testing.assert_allclose(place.rotation, motion[0], atol=1e-12)
            np.testing.assert_allclose(place.translation, motion[1], atol=1e-12)
        M = pin.crba(model, data, q)
        M = np.triu(M) + np.triu(M, 1).T
        scale = np.abs(M).max()
        np.testing.assert_allclose(M[np.ix_(order, order)], tree.mass_matrix(named), atol=1e-9 * scale)
        for vel, acc in ((0 * v, 0 * a), (v, 0 * a), (v, a)):
            theirs = tree.forces(named, vel[order], acc[order], GRAVITY)
            np.testing.assert_allclose(pin.rnea(model, data, q, vel, acc)[order], theirs, atol=1e-9 * scale * 10)
    for name in tree.moving:
        part, joint = chain.velocity_slice(name), tree.joints[name]
        np.testing.assert_array_equal(model.damping[part], joint.dynamics.get("damping", 0.0))
        np.testing.assert_array_equal(model.upperDryFrictionLimit[part], joint.dynamics.get("friction", 0.0))
        np.testing.assert_array_equal(model.upperEffortLimit[part], joint.limit.get("effort", np.inf))
        np.testing.assert_array_equal(model.upperVelocityLimit[part], joint.limit.get("velocity", np.inf))
        np.testing.assert_array_equal(model.lowerVelocityLimit[part], -joint.limit.get("velocity", np.inf))


class Drake:
    """The same file in Drake, whose planar joints have velocities in the axes of the joint's frame."""

    def __init__(self, xml):
        self.plant = MultibodyPlant(0.0)
        Parser(self.plant).AddModelsFromString(xml, "urdf")
        self.plant.WeldFrames(self.plant.world_frame(), self.plant.GetFrameByName("l0"))
        self.plant.mutable_gravity_field().set_gravity_vector(np.array(GRAVITY))
        self.plant.Finalize()
        self.context = self.plant.CreateDefaultContext()

    def put(self, tree, named, v, a):
        """Set q and v; the map from our velocity to theirs, and their acceleration."""
        plant = self.plant
        positions = np.zeros(plant.num_positions())
        T, bias = np.zeros((plant.num_velocities(), tree.width)), np.zeros(plant.num_velocities())
        at = 0
        for name in tree.moving:
            joint, kind, q = plant.GetJointByName(name), tree.joints[name].kind, named[name]
            start, width = joint.velocity_start(), joint.num_velocities()
            own, block = np.array(q), np.eye(width)
            rates = v[at : at + width]
            if kind == "continuous":
                own = np.array([np.arctan2(q[1], q[0])])
            elif kind == "planar":
                own = np.array([q[0], q[1], np.arctan2(q[3], q[2])])
                block[:2, :2] = [[q[2], -q[3]], [q[3], q[2]]]
                bias[start : start + 2] = block[:2, :2] @ np.array([-rates[2] * rates[1], rates[2] * rates[0]])
            positions[joint.position_start() : joint.position_start() + len(own)] = own
            T[start : start + width, at : at + width] = block
            at += width
        plant.SetPositions(self.context, positions)
        plant.SetVelocities(self.context, T @ v)
        return T, T @ a + bias

    def forces(self, acceleration):
        # Damping and friction are not in this: Drake counts damping among the applied forces.
        forces = MultibodyForces(self.plant)
        gravity = self.plant.CalcGravityGeneralizedForces(self.context)
        return self.plant.CalcInverseDynamics(self.context, acceleration, forces) - gravity


@pytest.mark.parametrize("seed", SEEDS)
def test_drake_reads_the_same(seed):
    # Drake reads no floating joints from a URDF.
    xml, chain, tree = loaded(seed, [kind for kind in KINDS if kind != "floating"])
    model, rng, drake = chain.model, np.random.default_rng(seed + 100), Drake(xml)
    data, order = model.createData(), reordering(model, tree)
    for _ in range(2):
        q, v, a = state(model, rng)
        T, acceleration = drake.put(tree, coordinates(model, q), v[order], a[order])
        for link in tree.links:
            there = drake.plant.EvalBodyPoseInWorld(drake.context, drake.plant.GetBodyByName(link))
            place = chain.placement(q, link)
            np.testing.assert_allclose(there.translation(), place.translation, atol=1e-12)
            np.testing.assert_allclose(there.rotation().matrix(), place.rotation, atol=1e-12)
        M = pin.crba(model, data, q)
        M = (np.triu(M) + np.triu(M, 1).T)[np.ix_(order, order)]
        theirs = T.T @ drake.plant.CalcMassMatrix(drake.context) @ T
        scale = np.abs(M).max()
        np.testing.assert_allclose(M, theirs, atol=1e-9 * scale)
        ours = pin.rnea(model, data, q, v, a)[order]
        np.testing.assert_allclose(ours, T.T @ drake.forces(acceleration), atol=1e-8 * scale)
    for name in tree.moving:
        joint = drake.plant.GetJointByName(name)
        if tree.joints[name].dynamics:
            assert joint.default_damping_vector()[0] == model.damping[chain.velocity_slice(name)][0]


@pytest.mark.parametrize("kind", sorted(set(TYPES) - {"point", "coupling"}))
@pytest.mark.parametrize("seed", [3, 4])
def test_a_closure_between_any_two_links(kind, seed):
    xml, _, tree = loaded(seed)
    rng = np.random.default_rng(seed)
    places = [Placement(tuple(rng.normal(size=3)), tuple(Rotation.random(rng=rng).as_quat())) for _ in range(2)]
    closure = Closure("c", kind, "l2", f"l{len(tree.links) - 1}", *places, distance=0.7 if kind == "distance" else None)
    chain = ClosedChain.from_urdf(xml, Closures("looped", closures=(closure,)))
    model, order = chain.model, reordering(chain.model, tree)
    q, v, _ = state(model, rng)
    states = tree.motion(coordinates(model, q), tree.rates(v[order]), tree.rates(0 * v))
    ends = []
    for link, place in zip((closure.frame_a, closure.frame_b), places, strict=True):
        R, p, u, _, w, _ = states[link]
        ends.append((R @ Rotation.from_quat(place.quaternion).as_matrix(), p + R @ place.translation, u, w, p))
    (R_a, p_a, *moves_a), (R_b, p_b, *moves_b) = ends
    at_b = [u + np.cross(w, p_b - p) for u, w, p in (moves_a, moves_b)]
    d, linear = R_a.T @ (p_a - p_b), R_a.T @ (at_b[0] - at_b[1])
    angular, turn = R_a.T @ (moves_a[1] - moves_b[1]), Rotation.from_matrix(R_b.T @ R_a).as_rotvec()
    cross = np.cross([1.0, 0.0, 0.0], R_a.T @ R_b[:, 1])
    expected = {
        "rigid": ([*d, *turn], [*linear, *angular]),
        "spherical": (d, linear),
        "revolute": (d, [*linear, *angular[:2]]),
        "universal": ([*d, np.arcsin(R_a[:, 0] @ R_b[:, 1])], [*linear, angular @ cross]),
        "prismatic": ([*d[:2], *turn], [*linear[:2], *angular]),
        "cylindrical": (d[:2], [*linear[:2], *angular[:2]]),
        "distance": ([np.linalg.norm(d) - 0.7], [d @ linear / np.linalg.norm(d)]),
    }[kind]
    np.testing.assert_allclose(chain.residual(q)[: len(expected[0])], expected[0], atol=1e-11)
    rate = chain.constraint_jacobian(q) @ v
    if kind == "universal":
        # Only the direction of its last row means something.
        rate[3], expected[1][3] = rate[3] * np.linalg.norm(cross), expected[1][3]
        assert abs(rate[3]) == pytest.approx(abs(expected[1][3]), abs=1e-9)
        rate, expected = rate[:3], (None, expected[1][:3])
    np.testing.assert_allclose(rate, expected[1], atol=1e-9)
