"""Rows of single closures, and forces of a tree in world axes, against SciPy's rotations and Pinocchio."""

import itertools

import numpy as np
import pinocchio as pin
import pytest
from closed_chains import CHAINS
from scipy.spatial.transform import Rotation

from exo_pin.chain.dynamics.equations.equation_kernels import _scaled, _size, _tree_wrenches, missed
from exo_pin.chain.structure.projection import (
    ANGULAR,
    COUPLED_ANGLE,
    COUPLED_LENGTH,
    LINEAR,
    compose,
    project,
    project_rate,
    project_rate_change,
    projection_turns,
    relative_pose,
)
from exo_pin.numerics.small_linear import copy_numbers

pytestmark = pytest.mark.usefixtures("plain")

RULES = [(m, r) for m, r in itertools.product(LINEAR, ANGULAR) if r != "joints" and m + r]


def rows_of(linear, angular):
    return (linear == "length" or len(linear)) + ANGULAR[angular][0]


def projected(linear, angular, d, Q, length=0.0):
    count = rows_of(linear, angular)
    out, S = np.full(count, np.nan), np.full((count, 6), np.nan)
    project(LINEAR[linear] | ANGULAR[angular][1], np.array(d, dtype=float), Q, length, out, S)
    return out, S


def as_rows(R, p):
    """The pose as kernels take it: columns of R, then p."""
    return np.vstack([R.as_matrix().T, p])


def test_relative_pose_of_frames_on_moved_bodies():
    rng = np.random.default_rng(230)
    bodies, frames = Rotation.random(2, rng), Rotation.random(2, rng)
    places, offsets = rng.normal(size=(2, 2, 3))
    poses = np.array([as_rows(R, p) for R, p in zip(bodies, places, strict=True)])
    local = np.array([as_rows(R, p) for R, p in zip(frames, offsets, strict=True)])[None]
    a, b, d, Q = np.empty((4, 3)), np.empty((4, 3)), np.empty(3), np.empty((3, 3))
    relative_pose(poses, np.array([[0, 1]]), local, 0, a, b, d, Q)
    world = bodies * frames
    points = bodies.apply(offsets) + places
    np.testing.assert_allclose(Q, (world[1].inv() * world[0]).as_matrix(), atol=1e-14)
    np.testing.assert_allclose(d, world[0].inv().apply(points[0] - points[1]), atol=1e-14)
    out = np.empty((4, 3))
    compose(poses[0], local[0, 0], out)
    np.testing.assert_allclose(out, as_rows(world[0], points[0]), atol=1e-14)


@pytest.mark.parametrize(("linear", "angular"), RULES)
def test_rows_are_the_named_components_and_their_rates(linear, angular):
    """d in the axes of a; the turn by its vector, by the least turn of the z axes, or as the angle of x_a and y_b."""
    rng = np.random.default_rng(231)
    d, Q, length = rng.normal(size=3), Rotation.random(rng=rng), 0.4
    out, _ = projected(linear, angular, d, Q.as_matrix(), length)
    metres = [np.linalg.norm(d) - length] if linear == "length" else [d["xyz".index(axis)] for axis in linear]
    z = Q.as_matrix()[2]  # of b, in the axes of a
    tilt = np.cross(z, [0.0, 0.0, 1.0]) * np.arccos(z[2]) / np.hypot(z[0], z[1])
    radians = {"": [], "xyz": Q.as_rotvec(), "xy": tilt[:2], "cross": [np.arcsin(Q.as_matrix()[1, 0])]}[angular]
    np.testing.assert_allclose(out, [*metres, *radians], atol=1e-12)
    # Rates, closed or nearly so: the axes turn with a.
    turn = Q if angular == "cross" else Rotation.identity()
    d = 0.4 * np.array([0.6, 0.0, 0.8]) if linear == "length" else np.zeros(3)
    _, S = projected(linear, angular, d, turn.as_matrix(), length)
    h = 1e-6
    for k, unit in enumerate(np.eye(6)):
        v, w = (np.zeros(3) if linear == "length" and k > 2 else unit[:3]), unit[3:]
        ends = [
            projected(linear, angular, d + s * h * v, (turn * Rotation.from_rotvec(s * h * w)).as_matrix(), length)[0]
            for s in (1, -1)
        ]
        np.testing.assert_allclose(S[:, k], (ends[0] - ends[1]) / (2 * h), atol=1e-8)


def test_opposite_axes_are_half_a_turn_apart_about_any_axis_across():
    for flip in (np.diag([1.0, -1.0, -1.0]), np.diag([-1.0, 1.0, -1.0])):
        out, S = projected("", "xy", np.zeros(3), flip)
        assert np.linalg.norm(out) == pytest.approx(np.pi)
        np.testing.assert_allclose(Rotation.from_rotvec([*out, 0.0]).apply(flip[2]), [0.0, 0.0, 1.0], atol=1e-15)
        np.testing.assert_array_equal(S, np.eye(6)[3:5])
    np.testing.assert_array_equal(projected("", "xy", np.zeros(3), np.diag([-1.0, -1.0, 1.0]))[0], 0.0)


@pytest.mark.parametrize("axis", [*np.eye(3).tolist(), [0.6, 0.0, -0.8], [0.5, -0.7, 0.5]])
@pytest.mark.parametrize("angle", [0.0, 1e-9, 1e-3, 2.0, 3.0, np.pi - 1e-9])
def test_turns_of_all_sizes_have_their_rotation_vector(axis, angle):
    turn = Rotation.from_rotvec(angle * np.array(axis) / np.linalg.norm(axis))
    out, _ = projected("", "xyz", np.zeros(3), turn.as_matrix())
    np.testing.assert_allclose(out, turn.as_rotvec(), rtol=1e-8, atol=1e-15)


def test_points_that_meet_part_in_some_direction_and_right_angles_have_a_rate():
    out, S = projected("length", "", np.zeros(3), np.eye(3), 0.25)
    assert (out[0], np.linalg.norm(S)) == (-0.25, 1.0)
    np.testing.assert_array_equal(S[0, 3:], 0.0)
    _, S = projected("length", "", [0.0, 3e-12, 4e-12], np.eye(3), 0.25)
    np.testing.assert_allclose(S[0], [0.0, 0.6, 0.8, 0.0, 0.0, 0.0], atol=1e-15)
    # x_a along y_b: a right angle off, where the sine is at its top and any turn lessens it.
    out, S = projected("", "cross", np.zeros(3), np.array([[0.0, 1.0, 0.0], [1.0, 0.0, 0.0], [0.0, 0.0, -1.0]]))
    assert out[0] == pytest.approx(np.pi / 2)
    assert np.linalg.norm(S) == 1.0


@pytest.mark.parametrize(("kind", "place"), [(COUPLED_ANGLE, 5), (COUPLED_LENGTH, 2)])
def test_a_multiplier_of_a_coupling_is_a_moment_or_a_force(kind, place):
    out, S = np.array([np.nan]), np.full((1, 6), np.nan)
    project(kind, np.ones(3), Rotation.random(rng=np.random.default_rng(0)).as_matrix(), 0.0, out, S)
    assert out[0] == 0.0
    np.testing.assert_array_equal(S[0], np.eye(6)[place])


def test_forces_of_a_tree_about_the_worlds_origin_are_pinocchios():
    rng = np.random.default_rng(232)
    turns, places, forces = Rotation.random(4, rng), rng.normal(size=(4, 3)), rng.normal(size=(4, 6))
    out = np.full((4, 6), np.nan)
    _tree_wrenches(np.array([as_rows(*one) for one in zip(turns, places, strict=True)]), forces, out)
    for turn, place, force, found in zip(turns, places, forces, out, strict=True):
        np.testing.assert_allclose(found, pin.SE3(turn.as_matrix(), place).act(pin.Force(force)).vector, atol=1e-13)


def test_errors_and_sizes_count_in_characteristic_lengths():
    rng = np.random.default_rng(233)
    J, drift, a = rng.normal(size=(3, 4)), rng.normal(size=3), rng.normal(size=4)
    row_scale, column = rng.uniform(0.5, 3.0, 3), rng.uniform(0.5, 3.0, 4)
    error = J @ a + drift
    expected = np.abs(error).max(), np.abs(row_scale * error).max(), np.abs(a / column).max()
    *found, finite = missed(J, drift, a, row_scale, column)
    np.testing.assert_allclose(found, expected, rtol=1e-12)
    assert finite
    for wrong in (np.nan, np.inf):
        assert not missed(J, drift, np.array([0.0, wrong, 0.0, 0.0]), row_scale, column)[3]
    assert _scaled(drift, row_scale) == pytest.approx(np.abs(drift * row_scale).max())
    assert _size(a, column) == pytest.approx(expected[2])
    assert np.isnan(_size(np.array([1.0, np.nan, 2.0, 0.0]), column))
    out = np.zeros(4)
    copy_numbers(a, out)
    np.testing.assert_array_equal(out, a)


@pytest.mark.parametrize("name", ["five_bar", "stewart", "wrist-floating"])
def test_scales_take_metres_to_characteristic_lengths(name):
    """A turn counts as it is, in motions and rows; a force times a scaled motion is work over the length."""
    chain, _ = CHAINS[name]
    topology, length = chain._state.topology, chain.characteristic_length
    assert topology.length == length > 0.0
    metres = np.concatenate(
        [
            ["JointModelP" in joint.shortname()]
            if joint.nv == 1
            else [k < 3 and joint.nv == 6 for k in range(joint.nv)]
            for joint in list(chain.model.joints)[1:]
        ]
    )
    np.testing.assert_array_equal(topology.metres, metres)
    np.testing.assert_allclose(topology.column, np.where(metres, length, 1.0))
    np.testing.assert_allclose(topology.column / topology.per_newton, length)
    np.testing.assert_allclose(topology.weight, topology.column**2)
    np.testing.assert_allclose(topology.row_scale, np.where(topology.row_metres, 1.0 / length, 1.0))


@pytest.mark.parametrize(("linear", "angular"), RULES)
def test_rates_of_the_rows_axes_and_their_changes_are_differences(linear, angular):
    """Of S along a twist, and of that rate along another; a turns against b's axes, seen from a."""
    rng = np.random.default_rng(234)
    d, Q = rng.normal(size=3), Rotation.random(rng=rng)
    twist, along = rng.normal(size=(2, 6))
    kind, shape = LINEAR[linear] | ANGULAR[angular][1], (rows_of(linear, angular), 6)
    assert projection_turns(kind) == (linear == "length" or angular == "cross")

    def moved(h, by):
        return d + h * by[:3], (Q * Rotation.from_rotvec(h * by[3:])).as_matrix()

    def rate(h):
        out = np.full(shape, np.nan)
        project_rate(kind, *moved(h, along), twist, out)
        return out

    h, change = 1e-6, np.full(shape, np.nan)
    ends = [projected(linear, angular, *moved(s * h, twist))[1] for s in (1, -1)]
    np.testing.assert_allclose(rate(0.0), (ends[0] - ends[1]) / (2 * h), atol=1e-8)
    project_rate_change(kind, *moved(0.0, along), twist, along, change)
    np.testing.assert_allclose(change, (rate(h) - rate(-h)) / (2 * h), atol=1e-7)


def test_rows_without_a_direction_do_not_turn():
    """Points that meet, and a right angle off: no rate, and no division by zero; couplings have no axes at all."""
    assert not projection_turns(COUPLED_ANGLE)
    assert not projection_turns(COUPLED_LENGTH)
    off = np.array([[0.0, 1.0, 0.0], [1.0, 0.0, 0.0], [0.0, 0.0, -1.0]])
    out = np.full((2, 6), np.nan)
    twist = np.arange(1.0, 7.0)
    for fill in (project_rate, lambda *given: project_rate_change(*given[:4], twist[::-1], given[4])):
        fill(LINEAR["length"] | ANGULAR["cross"][1], np.zeros(3), off, twist, out)
        np.testing.assert_array_equal(out, 0.0)
    # A billionth of a metre apart they turn at once.
    project_rate(LINEAR["length"], np.array([0.0, 0.0, 1e-9]), off, twist, out[:1])
    np.testing.assert_allclose(out[0, :3], [1e9, 2e9, 0.0])
