"""Parts of forward kinematics alone, against SciPy's rotations, polynomials' roots and sorting."""

import math

import numpy as np
import pytest
from scipy.spatial.transform import Rotation

from exo_pin.wrist.kinematics.assembly import _add, _pivot, fill_rows, frame_along, margin_of, rotate
from exo_pin.wrist.kinematics.forward import nearest_slots
from exo_pin.wrist.kinematics.from_lengths import twist_roots, wrapped
from exo_pin.wrist.kinematics.solutions import (
    Modes,
    Solutions,
    _least_squares,
    half_cosine,
    insert,
    quaternion,
    write_modes,
)

pytestmark = pytest.mark.usefixtures("plain")

UNIT = {"rtol": 0, "atol": 2e-15}


def unit_rows(rng, count=3):
    rows = rng.normal(size=(count, 3))
    return rows / np.linalg.norm(rows, axis=1, keepdims=True)


@pytest.mark.parametrize("angle", [0.0, 1e-9, 0.9e-4, 1.1e-4, 0.3, 3.0])
def test_turns_of_a_matrix_are_those_of_scipy(angle):
    rng = np.random.default_rng(130)
    R = Rotation.random(rng=rng)
    v = angle * unit_rows(rng, 1)[0]
    turned = R.as_matrix().copy()
    rotate(turned, *v.tolist())
    np.testing.assert_allclose(turned, (Rotation.from_rotvec(v) * R).as_matrix(), **UNIT)


@pytest.mark.parametrize("largest", range(4))
def test_quaternions_are_those_of_scipy(largest):
    """The largest component is each of the four in turn; half turns, whose scalar part is zero, among them."""
    rng = np.random.default_rng(131)
    for _ in range(10):
        q = rng.uniform(-0.4, 0.4, 4)
        q[largest] = rng.choice([-1.0, 1.0])
        if largest < 3 and rng.random() < 0.3:
            q[3] = 0.0
        q /= np.linalg.norm(q)
        out = np.empty(4)
        quaternion(Rotation.from_quat(q).as_matrix(), out)
        np.testing.assert_allclose(out * np.sign(out @ q), q, **UNIT)
        other = rng.normal(size=4)
        other /= np.linalg.norm(other)
        angle = (Rotation.from_quat(other) * Rotation.from_quat(q).inv()).magnitude()
        assert half_cosine(q, other) == pytest.approx(np.cos(angle / 2.0), rel=1e-12)


def test_frames_along_an_axis_are_rotations():
    for axis in (*np.eye(3), *unit_rows(np.random.default_rng(132), 5)):
        frame = np.empty((3, 3))
        frame_along(axis, frame)
        np.testing.assert_allclose(frame.T @ frame, np.eye(3), **UNIT)
        assert np.linalg.det(frame) == pytest.approx(1.0, abs=1e-14)
        np.testing.assert_array_equal(frame[:, 2], axis)


def test_errors_their_gradient_and_the_margin():
    rng = np.random.default_rng(133)
    u, v, c = unit_rows(rng), unit_rows(rng), rng.uniform(-0.5, 0.5, 3)
    R = Rotation.random(rng=rng).as_matrix()
    rows, error = np.empty((3, 3)), np.empty(3)
    worst = fill_rows(R, u, v, c, rows, error)
    expected = c - np.einsum("ij,ij->i", u, v @ R.T)
    np.testing.assert_allclose(error, expected, **UNIT)
    assert worst == np.abs(error).max()
    h = 1e-6
    for k, axis in enumerate(h * np.eye(3)):
        ends = [np.einsum("ij,ij->i", u, v @ (Rotation.from_rotvec(s * axis).as_matrix() @ R).T) for s in (1, -1)]
        np.testing.assert_allclose(rows[:, k], (ends[0] - ends[1]) / (2 * h), atol=1e-9)
    low, middle, high = np.linalg.svd(rows, compute_uv=False)[::-1]
    second = (low * middle) ** 2 + (middle * high) ** 2 + (low * high) ** 2
    assert margin_of(rows) == pytest.approx(np.linalg.det(rows) / np.sqrt(second), rel=1e-12)
    assert margin_of(np.zeros((3, 3))) == 0.0
    assert margin_of(rows[[1, 0, 2]]) == pytest.approx(-margin_of(rows), rel=1e-12)


def test_the_first_equation_is_one_whose_vector_is_parallel_to_no_other():
    v = np.array([[1.0, 0.0, 0.0], [1.0, 0.0, 0.0], [0.0, 1.0, 0.0]])
    for order in ([0, 1, 2], [2, 0, 1], [0, 2, 1]):
        # The others are parallel to each other; all scores are zero but none is negative: the first is kept.
        assert _pivot(v[order], np.zeros(3)) in (0, 1, 2)
    v = np.array([[1.0, 0.0, 0.0], [1.0, 0.1, 0.0], [0.0, 0.0, 1.0]])
    for shift in range(3):
        order = np.roll([0, 1, 2], shift)
        assert _pivot(v[order], np.zeros(3)) == list(order).index(2)
        folded = np.where(order == 2, 1.0, 0.0)  # its cosine is one
        assert _pivot(v[order], folded) == list(order).index(1)
        assert _pivot(v[order], -folded) == list(order).index(1)


def test_solutions_are_kept_once_up_to_room():
    R = Rotation.from_rotvec([[0.0, 0.0, angle] for angle in (0.0, 0.5e-6, 2e-6, 0.5)]).as_matrix()
    rotations, margins, count = np.empty((3, 3, 3)), np.empty(3), 0
    for k, expected in ((0, 1), (1, 1), (2, 2), (3, 3), (3, 3)):
        count = _add(R[k], 0.1 * k, rotations, margins, count)
        assert count == expected
    np.testing.assert_allclose(margins, [0.0, 0.2, 0.3], rtol=1e-15)
    assert _add(Rotation.from_rotvec([1.0, 0, 0]).as_matrix(), 1.0, rotations, margins, 3) == 3


def test_least_squares_of_more_equations_are_stationary():
    rng = np.random.default_rng(138)
    u, v, R = unit_rows(rng, 5), unit_rows(rng, 5), Rotation.random(rng=rng)
    c = np.einsum("ij,ij->i", u, R.apply(v)) + 1e-3 * rng.normal(size=5)
    found = R.as_matrix().copy()
    square = _least_squares(found, u, v, c)
    rows, error = np.empty((5, 3)), np.empty(5)
    fill_rows(found, u, v, c, rows, error)
    assert square == pytest.approx(error @ error, rel=1e-15)
    assert np.abs(rows.T @ error).max() < 1e-13
    assert square < 5e-6


def empty_modes(width=5):
    return Modes(
        np.full((1, width, 4), np.nan), np.full((1, width), np.nan), np.full((1, width), np.nan), np.zeros(1, int)
    )


def test_modes_are_ordered_by_their_angle_from_the_reference_after_those_that_are_there():
    rng = np.random.default_rng(139)
    R = Rotation.from_rotvec(np.array([2.0, 0.3, 1.0, 0.1])[:, None] * unit_rows(rng, 4))
    reference = np.array([0.0, 0.0, 0.0, 1.0])
    modes = empty_modes()
    first = Solutions(R[:1].as_matrix(), np.array([10.0]), np.array([1.0]))
    assert write_modes(first, 1, reference, modes, 0, 0) == 1
    rest = Solutions(R[1:].as_matrix(), np.array([11.0, 12.0, 13.0]), np.array([2.0, np.nan, 4.0]))
    assert write_modes(rest, 3, reference, modes, 0, 1) == 3
    np.testing.assert_array_equal(modes.residual[0], [4.0, 2.0, 1.0, np.nan, np.nan])
    np.testing.assert_array_equal(modes.margin[0], [13.0, 11.0, 10.0, np.nan, np.nan])
    near = np.abs(modes.q[0, :3] @ np.array(reference))
    np.testing.assert_allclose(2.0 * np.arccos(near), [0.1, 0.3, 2.0], rtol=1e-12)
    assert write_modes(rest, -1, reference, modes, 0, 1) == -1
    insert(modes, 0, 1, 3, np.arange(4.0), 7.0, 8.0)
    np.testing.assert_array_equal(modes.residual[0], [4.0, 7.0, 2.0, 1.0, np.nan])
    np.testing.assert_array_equal(modes.margin[0], [13.0, 8.0, 11.0, 10.0, np.nan])
    np.testing.assert_array_equal(modes.q[0, 1], np.arange(4.0))


def test_roots_that_meet_are_one():
    """With |b| < |a| the line at cos θ = b/a touches the sphere; by 1e-6 of b it counts as touching."""
    a, b = 0.3, 0.2
    for width, count in ((0.0, 1), (0.5e-6, 1), (2e-6, 2), (1e-3, 2)):
        cosine = math.sqrt(b * b * (1.0 - width * width)) / a
        roots = np.full(2, np.nan)
        found, half = twist_roots(-math.sqrt(1.0 - cosine * cosine), a, b, roots)
        assert found == count
        assert half == pytest.approx(width, abs=2e-8)
    for off, count in ((1e-16, 1), (1e-12, 0)):
        cosine = b / a * (1.0 + off)
        assert twist_roots(-math.sqrt(1.0 - cosine * cosine), a, b, np.empty(2))[0] == count


def test_angles_are_wrapped_to_a_turn():
    for angle in np.linspace(-20.0, 20.0, 41):
        assert wrapped(angle) == pytest.approx(math.atan2(math.sin(angle), math.cos(angle)), abs=1e-14)


def test_nearest_slots_are_ambiguous_beyond_half_way_and_where_modes_meet():
    turns = Rotation.from_rotvec([[0.0, 0.0, 0.0], [0.0, 0.0, 1.0], [0.0, 0.0, 3.0], [0.1, 0.0, 0.0]]).as_quat()
    turns[1] *= -1.0  # of either sign
    valid, none = np.array([True, True, True, False]), np.zeros(4, dtype=bool)
    for angle, slot, unsure in ((0.1, 0, False), (0.49, 0, False), (0.51, 1, False), (0.45, 0, False), (1.9, 1, True)):
        near = Rotation.from_rotvec([0.0, 0.0, angle]).as_quat()
        assert tuple(map(int, nearest_slots(turns, valid, none, near))) == (slot, unsure), angle
    away = Rotation.from_rotvec([0.6, 0.0, 0.0]).as_quat()  # farther than half way to a neighbour
    assert tuple(map(int, nearest_slots(turns, valid, none, away))) == (0, True)
    met = np.array([True, False, False, False])
    assert tuple(map(int, nearest_slots(turns, valid, met, turns[0]))) == (0, True)
    assert tuple(map(int, nearest_slots(turns, valid, met, turns[1]))) == (1, False)
    assert tuple(map(int, nearest_slots(turns, none, none, turns[1]))) == (-1, True)
    one = np.array([False, True, False, False])
    assert tuple(map(int, nearest_slots(turns, one, none, turns[2]))) == (1, False)
