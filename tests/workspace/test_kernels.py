import coal
import numpy as np
import pytest
from scipy.spatial.transform import Rotation
from workspace_examples import free_design

import exo_pin as ep
from exo_pin import wrist
from exo_pin.load_case.pose_stacks import pose_matrices
from exo_pin.reaction.holding.infeasible_poses import disturbing_moment
from exo_pin.workspace.evaluation import PoseValues
from exo_pin.workspace.kernels.connection import widest_path
from exo_pin.workspace.kernels.joint_kernels import kinematic_stack
from exo_pin.wrist.clearance.clearance import clearance_stack, segment_distance


@pytest.mark.parametrize("limb_count", [3, 4, 5, 6])
def test_forces_agree_with_pinocchio_and_with_the_exact_condition(limb_count):
    exo = free_design(limb_count, seed=2, family="linear" if limb_count == 3 else "cable")
    poses = Rotation.random(12, rng=np.random.default_rng(1))
    found = exo.workspace(poses, ["forces"])
    lower = -300.0 if limb_count == 3 else 0.0
    exact = exo.replace(limbs=[ep.Limb("SPS")] * limb_count).reaction(poses, limits=(lower, 400.0))
    exact_margin = disturbing_moment(exact.source.poses)
    held = found.margins["forces"] >= 0.0
    assert held.any()
    np.testing.assert_array_equal(held, exact.held)
    np.testing.assert_allclose(found.margins["forces"][held], exact_margin[held], rtol=1e-9, atol=1e-9)
    other = exo.reaction(poses[held], split="minimal", limits=(lower, 400.0))
    np.testing.assert_allclose(found.magnitude[held], other.magnitude, rtol=1e-7, atol=1e-7)
    assert np.isnan(found.magnitude[~held]).all()


def test_limits_that_bind_give_the_same_least_force_as_the_quadratic_program():
    exo = free_design(6, seed=5)
    poses = Rotation.random(60, rng=np.random.default_rng(3))
    limits = ep.Criteria(names=("forces",), least_tension=20.0)
    found = exo.workspace(poses, limits)
    held = np.flatnonzero(found.margins["forces"] >= 0.0)[:12]
    at_limit = np.isclose(found.tensions[held], 20.0).any(axis=1)
    assert at_limit.sum() >= 3
    other = exo.reaction(poses[held], split="minimal", limits=(20.0, 400.0))
    np.testing.assert_allclose(found.magnitude[held], other.magnitude, rtol=1e-7, atol=1e-7)
    assert (found.tensions[held] >= 20.0 - 1e-6).all()


def test_joint_margin_is_the_diamond_of_the_angles():
    geometry = ep.load("prototype").geometry
    poses = Rotation.random(20, rng=np.random.default_rng(0))
    _, matrices = pose_matrices(poses)
    lengths, bend, independent = np.empty((20, 3)), np.empty(20), np.empty(20)
    kinematic_stack(
        matrices, geometry.base_points, geometry.platform_points, np.zeros((1, 3)), np.zeros((1, 3)),
        np.swapaxes(geometry.base_frames, 1, 2).copy(), np.swapaxes(geometry.platform_frames, 1, 2).copy(),
        np.full(3, 1.5), lengths, bend, independent,
    )  # fmt: skip
    state = wrist.inverse_kinematics(geometry, poses)
    at_base = np.abs(state.base_theta_x) + np.abs(state.base_theta_y)
    at_arm = np.abs(state.platform_theta_x) + np.abs(state.platform_theta_y)
    np.testing.assert_allclose(bend, 1.5 - np.maximum(at_base, at_arm).max(axis=1), atol=1e-12)
    np.testing.assert_allclose(lengths, state.lengths, rtol=1e-12)
    np.testing.assert_allclose(independent, np.linalg.det(state.normals), atol=1e-12)


def test_independence_of_more_limbs_is_the_volume_of_their_normals():
    exo = free_design(5)
    found = exo.workspace(Rotation.random(8, rng=np.random.default_rng(4)), ["singularity"])
    X = wrist.inverse_kinematics(exo.geometry, found.poses).normals
    expected = np.sqrt(np.linalg.det(np.einsum("kni,knj->kij", X, X)))
    np.testing.assert_allclose(found.independent, expected, rtol=1e-10)


def test_segment_distance_agrees_with_coal():
    rng = np.random.default_rng(6)
    request, result = coal.DistanceRequest(), coal.DistanceResult()
    for _ in range(200):
        p, q, r, t = rng.uniform(-0.5, 0.5, (4, 3))
        radius = 1e-3
        shapes = []
        for start, end in ((p, q), (r, t)):
            size = np.linalg.norm(end - start)
            turn = Rotation.align_vectors([end - start], [[0.0, 0.0, 1.0]])[0]
            shapes += [coal.Capsule(radius, size), coal.Transform3s(turn.as_matrix(), 0.5 * (start + end))]
        result.clear()
        expected = coal.distance(shapes[0], shapes[1], shapes[2], shapes[3], request, result) + 2 * radius
        # Where the segments all but touch, coal gives a depth.
        if expected > 3 * radius:
            assert segment_distance(tuple(p), tuple(q), tuple(r), tuple(t)) == pytest.approx(expected, abs=1e-6)


@pytest.mark.parametrize(
    ("p", "q", "r", "t", "distance"),
    [
        ((0, 0, 0), (1, 0, 0), (0, 2, 0), (1, 2, 0), 2.0),  # parallel
        ((0, 0, 0), (1, 0, 0), (3, 0, 0), (5, 0, 0), 2.0),  # on one line
        ((0, 0, 0), (1, 0, 0), (0.5, -1, 0.3), (0.5, 1, 0.3), 0.3),  # crossing
        ((0, 0, 0), (0, 0, 0), (0, 3, 4), (0, 3, 4), 5.0),  # two points
        ((0, 0, 0), (0, 0, 0), (-1, 1, 0), (1, 1, 0), 1.0),  # a point and a segment
    ],
)
def test_segment_distance_by_hand(p, q, r, t, distance):
    points = [tuple(float(x) for x in point) for point in (p, q, r, t)]
    assert segment_distance(*points) == pytest.approx(distance, abs=1e-12)
    assert segment_distance(*points[2:], *points[:2]) == pytest.approx(distance, abs=1e-12)


def test_clearance_by_hand():
    base = np.array([[0.0, 0.0, 1.0], [0.5, 0.0, 1.0], [1.0, 0.0, 1.0]])
    platform = base - [0.0, 0.0, 2.0]
    gap = np.empty((1, 3))
    torso = np.array([[0.0, 0.3, -1.0, 0.0, 0.3, 1.0, 0.1]])
    arm = np.array([[-0.4, 0.0, 0.0, -0.4, 0.0, -1.0, 0.05]])
    none = np.zeros((1, 3))
    clearance_stack(np.eye(3)[None], base, platform, none, none, np.array([0.01, 0.02, 0.03]), torso, arm, gap)
    np.testing.assert_allclose(gap[0], [0.4 - 0.01 - 0.05, 0.3 - 0.01 - 0.1, 0.5 - 0.02 - 0.03], atol=1e-12)


def brute_widest(value, shape, start):
    """Greatest least value on a path, by raising it step by step."""
    best = np.full(value.shape, -np.inf)
    grid = np.arange(value.size).reshape(shape)
    for level in np.unique(value)[::-1]:
        if value[start] < level:
            continue
        seen, queue = {start}, [start]
        while queue:
            node = queue.pop()
            index = np.unravel_index(node, shape)
            for axis in range(3):
                for step in (-1, 1):
                    other = list(index)
                    other[axis] += step
                    if not 0 <= other[axis] < shape[axis]:
                        continue
                    neighbour = int(grid[tuple(other)])
                    if neighbour not in seen and value[neighbour] >= level:
                        seen.add(neighbour)
                        queue.append(neighbour)
        for node in seen:
            best[node] = max(best[node], level)
    return best


@pytest.mark.parametrize("seed", range(4))
def test_widest_path_agrees_with_a_flood_at_every_level(seed):
    rng = np.random.default_rng(seed)
    shape = (4, 3, 5)
    value = rng.integers(0, 12, 60).astype(float)
    start = int(rng.integers(60))
    out = np.empty(60)
    widest_path(value, np.argsort(-value, kind="stable"), shape, start, out)
    # No path is wider than its start.
    np.testing.assert_array_equal(out, brute_widest(np.minimum(value, value[start]), shape, start))


def test_a_bad_pose_spoils_no_other():
    exo = free_design(4)
    _, matrices = pose_matrices(Rotation.random(5, rng=np.random.default_rng(0)))
    clean = PoseValues(exo.mechanism, matrices, (5,), ep.Criteria(), ("singularity", "forces"))
    matrices[2] = np.nan
    spoiled = PoseValues(exo.mechanism, matrices, (5,), ep.Criteria(), ("singularity", "forces"))
    rows = [0, 1, 3, 4]
    np.testing.assert_array_equal(clean.margins["forces"][rows], spoiled.margins["forces"][rows])
    assert not spoiled.margins["forces"][2] >= 0.0
