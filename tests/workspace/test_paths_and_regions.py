"""Ways from rest over a grid, largest regions, and the diamonds of joints and shoulder, by floods and by angles."""

import numpy as np
import pytest
from scipy import ndimage
from scipy.spatial.transform import Rotation

from exo_pin import shoulder_rotation
from exo_pin.workspace.evaluation import _from_z, rest_side
from exo_pin.workspace.kernels import (
    _bend,
    _larger,
    connection_margin,
    largest_region,
    nearest_to_rest,
    shoulder_stack,
    widest_path,
)

pytestmark = pytest.mark.usefixtures("plain")

FACES = ndimage.generate_binary_structure(3, 1)


def by_floods(value, start):
    """The greatest level at which each node is in one piece with the start."""
    found = np.full(value.shape, -np.inf)
    for level in np.unique(value[np.isfinite(value)]):
        labels, _ = ndimage.label(value >= level, FACES)
        if labels[start]:
            found[labels == labels[start]] = level
    return found


@pytest.mark.parametrize("shape", [(2, 3, 4), (1, 5, 3), (4, 1, 6), (3, 4, 1), (1, 1, 7)])
def test_widest_paths_go_through_faces_and_not_around_the_edges(shape):
    rng = np.random.default_rng(sum(shape))
    value = rng.integers(0, 6, shape).astype(float) + 1e-3 * rng.random(shape)
    value[tuple(rng.integers(0, side) for side in shape)] = -np.inf
    for _ in range(4):
        start = tuple(int(rng.integers(0, side)) for side in shape)
        if not np.isfinite(value[start]):
            continue
        flat, out = value.ravel(), np.full(value.size, np.nan)
        widest_path(flat, np.argsort(-flat), shape, int(np.ravel_multi_index(start, shape)), out)
        np.testing.assert_array_equal(out.reshape(shape), by_floods(value, start))


def angle_from(matrices):
    return Rotation.from_matrix(matrices).magnitude()


def test_the_way_to_the_first_node_counts_too():
    """Independence falls with the angle up to 20° and rises beyond: the way sees the dip, the grid does not."""
    turns = np.radians(np.arange(25.0, 45.0, 5.0))
    matrices = Rotation.from_rotvec(turns[:, None] * [0.0, 1.0, 0.0]).as_matrix()

    def margin_of(at):
        return 0.1 + np.abs(angle_from(at) - np.radians(20.0))

    value = margin_of(matrices)
    assert nearest_to_rest(matrices) == 0
    margin = connection_margin(margin_of, matrices, (4, 1, 1), value)
    np.testing.assert_allclose(margin, 0.1, atol=np.radians(0.5))
    # On the other side of the surface the way is as bad as it gets; so is one without a plane on it.
    other = connection_margin(lambda at: -margin_of(at), matrices, (4, 1, 1), value)
    np.testing.assert_allclose(other, -margin_of(np.eye(3)[None])[0], atol=0.02)
    lost = connection_margin(lambda at: np.where(angle_from(at) > 0.1, np.nan, 1.0), matrices, (4, 1, 1), value)
    np.testing.assert_array_equal(lost, -np.inf)


def test_a_node_without_a_plane_is_no_way():
    matrices = Rotation.from_rotvec(np.radians([0.0, 5.0, 10.0, 15.0])[:, None] * [1.0, 0.0, 0.0]).as_matrix()
    value = np.array([0.5, 0.7, np.nan, 0.9])
    margin = connection_margin(lambda at: np.ones(len(at)), matrices, (4, 1, 1), value)
    np.testing.assert_array_equal(margin, [0.5, 0.5, -np.inf, -np.inf])
    assert nearest_to_rest(matrices[::-1]) == 3


def test_the_largest_region_is_on_one_side():
    inside = np.zeros((5, 3, 2), dtype=bool)
    inside[:4, 0, 0] = inside[4, 2, 1] = inside[4, 2, 0] = True
    np.testing.assert_array_equal(largest_region(inside), inside & (np.arange(3)[:, None] == 0))
    sign = np.ones(inside.shape)
    sign[1] = -1.0
    # The surface leaves two of the four together, as many as elsewhere; on it is on neither side.
    assert largest_region(inside, sign).sum() == 2
    sign[1] = 1.0
    sign[3] = 0.0
    expected = inside & (np.arange(3)[:, None] == 0)
    expected[3] = False
    np.testing.assert_array_equal(largest_region(inside, sign), expected)
    np.testing.assert_array_equal(largest_region(inside, -sign), expected)
    assert not largest_region(np.zeros((2, 2, 2), dtype=bool)).any()
    # Neighbours share a face, not an edge.
    corner = np.zeros((2, 2, 2), dtype=bool)
    corner[0, 0, 0] = corner[1, 1, 0] = corner[1, 1, 1] = True
    assert largest_region(corner).sum() == 2


def test_bends_of_a_universal_joint_up_to_three_right_angles():
    rng = np.random.default_rng(270)
    for _ in range(40):
        x, y = rng.uniform(-np.pi / 2, np.pi / 2), rng.uniform(-np.pi, np.pi)
        frame = Rotation.random(rng=rng)
        direction = (frame * Rotation.from_euler("YX", [y, x])).apply([0.0, 0.0, 1.0])
        cosine, sine = _bend(tuple(map(tuple, frame.as_matrix().T)), tuple(direction))
        assert np.arctan2(sine, cosine) % (2.0 * np.pi) == pytest.approx(abs(x) + abs(y), abs=1e-9)
    angles = rng.uniform(0.0, 1.5 * np.pi, (200, 2))
    for a, b in [*angles, (0.0, 0.1), (np.pi - 0.1, np.pi + 0.1), (np.pi / 2 + 0.1, np.pi / 2 - 0.1), (4.6, 0.05)]:
        larger = _larger((np.cos(a), np.sin(a)), (2.0 * np.cos(b), 2.0 * np.sin(b)))
        assert np.arctan2(larger[1], larger[0]) % (2.0 * np.pi) == pytest.approx(max(a, b))


@pytest.mark.parametrize(("side", "outward"), [("left", 1.0), ("right", -1.0)])
def test_the_shoulders_diamond_is_about_its_centre(side, outward):
    """|abduction - centre| + |rotation| below half; flexion is free."""
    rng = np.random.default_rng(271)
    angles = np.radians(rng.uniform([-90, -80, -179], [170, 85, 179], (60, 3)))
    poses, margin = shoulder_rotation(*angles.T, side=side), np.empty(60)
    shoulder_stack(poses.as_matrix(), 0.4, 1.3, outward, margin)
    first = np.abs(angles[:, 1] - 0.4) + np.abs(angles[:, 2])
    # The same pose has a second triple, beyond 90° of abduction.
    second = np.abs(np.pi - angles[:, 1] - 0.4) + np.pi - np.abs(angles[:, 2])
    np.testing.assert_allclose(margin, 1.3 - np.minimum(first, second), atol=1e-12)
    assert (second < first).any()


@pytest.mark.parametrize(("degrees", "count"), [(0.0, 1), (0.4, 2), (24.5, 26), (25.5, 27)])
def test_the_way_to_the_first_node_is_in_steps_of_a_degree(degrees, count):
    matrices, seen = Rotation.from_rotvec([[0.0, np.radians(degrees), 0.0]]).as_matrix(), []

    def noted(at):
        seen.extend(np.degrees(angle_from(at)))
        return np.ones(len(at))

    connection_margin(noted, matrices, (1, 1, 1), np.ones(1))
    np.testing.assert_allclose(seen, np.linspace(0.0, degrees, count), atol=1e-9)


@pytest.mark.parametrize("rest", [0.3, -0.3, 1e-12, -1e-12])
def test_sign_at_rest(rest):
    """Where rest itself is singular most poses decide, however near they are."""
    for values, side in (
        ([0.5, 0.3, -0.4], 1.0), ([0.5, -0.3, -0.4], -1.0), ([0.5, -0.5], 1.0), ([0.0, -0.1], -1.0),
        ([1.0, -1.0, np.nan], 1.0),
    ):  # fmt: skip
        assert rest_side(rest, np.array(values)) == (np.sign(rest) if abs(rest) > 0.1 else side)


def test_least_turn_from_the_straight_direction():
    rng = np.random.default_rng(1)
    for direction in (*rng.normal(size=(4, 3)), [0.0, 0.0, 1.0], [0.0, 0.0, -1.0], [1e-14, 0.0, 1.0]):
        unit = np.array(direction) / np.linalg.norm(direction)
        turn = _from_z(unit)
        np.testing.assert_allclose(turn @ [0.0, 0.0, 1.0], unit, atol=1e-12)
        np.testing.assert_allclose(turn @ turn.T, np.eye(3), atol=1e-12)
        assert np.linalg.det(turn) == pytest.approx(1.0)
        # The least one turns by the angle between them.
        angle = np.arctan2(np.hypot(unit[0], unit[1]), unit[2])
        assert Rotation.from_matrix(turn).magnitude() == pytest.approx(angle, abs=1e-7)


@pytest.mark.parametrize("outward", [1.0, -1.0])
def test_shoulder_range_at_a_right_angle_of_abduction_whatever_the_rounding(outward):
    for last in (1.0, 1.0 + 2.0**-52):
        for sign in (1.0, -1.0):
            R = np.array([[[1.0, 0.0, 0.0], [0.0, 0.0, -sign * outward * last], [0.0, sign * outward, 0.0]]])
            margin = np.empty(1)
            shoulder_stack(R, 0.4, 2.5, outward, margin)
            assert margin[0] == pytest.approx(2.5 - abs(sign * np.pi / 2 - 0.4))
