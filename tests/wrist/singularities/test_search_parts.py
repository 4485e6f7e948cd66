"""Parts of the searches on the singular surface alone: first zeros, least turns, and cells of a grid."""

import numpy as np
import pytest
from scipy.optimize import brentq, minimize
from scipy.spatial.transform import Rotation
from wrists import random_mechanism

from exo_pin.design import preset
from exo_pin.numerics.polynomial import MAX_DEGREE
from exo_pin.wrist.singularities import singular_surface as search
from exo_pin.wrist.singularities.singular_surface import _first_zero, _nearest


def unit_rows(rng, count):
    rows = rng.normal(size=(count, 3))
    return rows / np.linalg.norm(rows, axis=1, keepdims=True)


def first_zero(axis, a, b):
    room = np.empty(MAX_DEGREE + 1), np.empty(MAX_DEGREE + 1), np.empty(2 * MAX_DEGREE), np.empty((3, 3, 3))
    return _first_zero(axis, a, b, *room)


def surface(axis, angle, a, b):
    """det[a_i × b_i] after turns about an axis."""
    turned = Rotation.from_rotvec(np.multiply.outer(angle, axis)).as_matrix() @ b.T
    return np.linalg.det(np.cross(a, np.swapaxes(turned, -1, -2)))


@pytest.mark.usefixtures("plain")
def test_first_zeros_along_a_turn_are_those_of_a_scan():
    """Of every third of the turn some: zeros beyond 90° come from the second chart."""
    rng, found = np.random.default_rng(200), []
    scan = np.linspace(0.0, 2.0 * np.pi, 2001)
    for _ in range(40):
        a, b, axis = unit_rows(rng, 3), unit_rows(rng, 3), unit_rows(rng, 1)[0]
        values = surface(axis, scan, a, b)
        crossed, expected = np.flatnonzero(np.diff(np.sign(values)) != 0), np.pi
        if crossed.size:
            ends = scan[crossed[0] : crossed[0] + 2]
            expected = brentq(lambda angle, *turn: surface(turn[0], angle, *turn[1:]), *ends, (axis, a, b), 1e-14)
        found.append(first_zero(axis, a, b))
        assert found[-1] == pytest.approx(min(expected, np.pi), abs=1e-7)
    assert np.histogram(found, [0.0, 0.3, np.pi / 2, 2.5])[0].min() > 1


@pytest.mark.usefixtures("plain")
def test_what_is_singular_in_every_pose_is_so_at_once():
    rng = np.random.default_rng(201)
    a, b = unit_rows(rng, 3), unit_rows(rng, 3)
    a[:] = [0.0, 1.0, 0.0]  # all normals in one plane
    assert first_zero(unit_rows(rng, 1)[0], a, b) == 0.0


@pytest.mark.full
@pytest.mark.usefixtures("plain")
def test_no_other_axis_leads_to_the_surface_sooner():
    """From few directions: a minimum of the angle near each, and the least of them."""
    rng = np.random.default_rng(203)
    a, b = unit_rows(rng, 3), unit_rows(rng, 3)
    directions, axis = unit_rows(rng, 5), np.empty(3)
    least = _nearest(a, b, directions, axis)
    assert np.linalg.norm(axis) == pytest.approx(1.0, abs=1e-14)
    assert first_zero(axis, a, b) == least
    assert least <= min(first_zero(one, a, b) for one in directions)
    better = minimize(
        lambda v: first_zero(v / np.linalg.norm(v), a, b), axis, method="Nelder-Mead", options={"xatol": 1e-6}
    )
    assert better.fun > least - 1e-10
    # The gradient along the surface is the axis: with it as normal the turn is straight.
    h, slopes = 1e-6, []
    for step in np.eye(3):
        ends = [surface(step, s * h, a, Rotation.from_rotvec(least * axis).apply(b)) for s in (1, -1)]
        slopes.append((ends[0] - ends[1]) / (2 * h))
    assert np.linalg.norm(np.cross(slopes, axis)) < 1e-5 * np.linalg.norm(slopes)


def test_axes_are_spread_evenly_over_the_sphere_in_pairs(monkeypatch):
    """About 12° apart, as far as 300 of them can be; and no direction is far from one."""
    asked = []
    monkeypatch.setattr(search, "nearest_stack", lambda b, a, directions, distance, axis: asked.append(directions))
    geometry = preset("prototype").geometry
    search.nearest_singularity(geometry, Rotation.identity())
    (directions,) = asked
    assert directions.shape == (300, 3)
    np.testing.assert_allclose(np.linalg.norm(directions, axis=1), 1.0, rtol=1e-14)
    np.testing.assert_array_equal(directions[1::2], -directions[::2])
    cosines = directions @ directions.T - 3.0 * np.eye(300)
    # Beside the equator the two halves of the sphere meet.
    nearest = np.degrees(np.arccos(cosines.max(axis=1)))
    assert 9.0 < np.median(nearest) < 13.0
    inner = np.abs(directions[:, 2]) > 0.2
    assert nearest[inner].min() > 9.0
    away = unit_rows(np.random.default_rng(204), 3000) @ directions.T
    assert np.degrees(np.arccos(away.max(axis=1))).max() < 12.0


def test_the_singular_pose_is_the_turned_one_and_its_folded_limbs_are_told(monkeypatch):
    """By given turns: to the pose in which the second limb is folded, by nothing, and by half a radian."""
    geometry = random_mechanism(np.random.default_rng(205), 3).geometry
    a, b = geometry.base_points[1], geometry.platform_points[1]
    folded, _ = Rotation.align_vectors(a[None], b[None])
    turn = Rotation.from_rotvec([0.3, -0.2, 0.1])
    poses = Rotation.concatenate([turn.inv() * folded, Rotation.identity(), Rotation.identity()])
    size = turn.magnitude()

    def given(b, a, directions, distance, axis):
        np.testing.assert_allclose(np.linalg.norm(a, axis=-1), 1.0, rtol=1e-14)
        np.testing.assert_allclose(np.linalg.norm(b, axis=-1), 1.0, rtol=1e-14)
        distance[:] = size, 0.0, 0.5
        axis[:] = turn.as_rotvec() / size, [1.0, 0.0, 0.0], [0.0, 0.6, 0.8]

    monkeypatch.setattr(search, "nearest_stack", given)
    found = search.nearest_singularity(geometry, Rotation.from_quat(poses.as_quat().reshape(3, 1, 4)))
    assert found.distance.shape == (3, 1)
    assert found.pose.shape == (3, 1)
    np.testing.assert_allclose(found.degrees[:, 0], np.degrees([size, 0.0, 0.5]), rtol=1e-14)
    np.testing.assert_array_equal(found.axis[1, 0], 0.0)
    ends = Rotation.from_quat(found.pose.as_quat()[:, 0]) * poses.inv()
    np.testing.assert_allclose(ends[0].as_rotvec(), turn.as_rotvec(), atol=1e-14)
    assert ends[1].magnitude() < 1e-15
    np.testing.assert_allclose(ends[2].as_rotvec(), [0.0, 0.3, 0.4], atol=1e-14)
    np.testing.assert_array_equal(found.folded[:, 0], [[False, True, False], [False] * 3, [False] * 3])
    for k in range(3):
        for i in range(3):
            first = geometry.base_points[i] / np.linalg.norm(geometry.base_points[i])
            second = poses[k].apply(np.array(geometry.platform_points[i]))
            between = np.arccos(first @ second / np.linalg.norm(second))
            assert found.fold_distance[k, 0, i] == pytest.approx(min(between, np.pi - between), abs=1e-7)


@pytest.mark.usefixtures("plain")
@pytest.mark.parametrize("wide", [5.0, 8.0])
def test_the_search_refines_four_axes_of_different_minima(monkeypatch, wide):
    """On a smooth function with five minima, in place of the angle to the surface: the least of all, to rounding."""
    rng = np.random.default_rng(206)
    centres = np.array([[1.0, 0.1, 0.2], [-0.2, 1.0, 0.1], [0.1, -0.3, 1.0], [-1.0, -0.2, 0.1], [0.2, -1.0, -0.3]])
    centres /= np.linalg.norm(centres, axis=1, keepdims=True)
    depths, asked = np.array([0.56, 0.62, 0.58, 0.6, 0.3]), []

    def function(n, *_):
        asked.append(np.array(n))
        return 1.0 - float(depths @ np.exp(wide * 4.0 * (centres @ n - 1.0)))

    monkeypatch.setitem(_nearest.plain.__globals__, "_first_zero", function)
    directions, axis = unit_rows(rng, 600), np.empty(3)
    value = _nearest(np.eye(3), np.eye(3), directions, axis)
    # Smooth around its minimum: an error of the axis counts squared.
    exact = minimize(lambda v: function(v / np.linalg.norm(v)), centres[1], method="BFGS", options={"gtol": 1e-10})
    asked = asked[: len(asked) - exact.nfev]
    assert value == pytest.approx(exact.fun, abs=1e-14)
    assert np.linalg.norm(axis - exact.x / np.linalg.norm(exact.x)) < 1e-7
    assert function(axis) == value
    np.testing.assert_allclose(np.linalg.norm(asked, axis=1), 1.0, rtol=1e-14)
    np.testing.assert_array_equal(asked[:600], directions)
    tried = np.array(asked[600:])
    # The four deepest are visited closely, the fifth is not.
    close = [(tried @ centre > np.cos(0.02)).sum() for centre in centres]
    assert min(close[:4]) > 20
    assert close[4] == 0
    assert len(tried) < 1200


def test_limbs_count_as_folded_within_a_few_thousandths_of_a_degree(monkeypatch):
    """By reach over the radius: the root of what is lost to rounding in a pose that is found by its determinant."""
    geometry = random_mechanism(np.random.default_rng(207), 3).geometry
    a, b = np.array(geometry.base_points[1]), np.array(geometry.platform_points[1])
    folded, _ = Rotation.align_vectors(-a[None], b[None])
    across = np.cross(a, [0.0, 0.0, 1.0]) / np.linalg.norm(np.cross(a, [0.0, 0.0, 1.0]))
    # Opposite sides of O: the reach is |a| |b| sin φ / (|a| + |b|).
    share = np.linalg.norm(a) / (np.linalg.norm(a) + np.linalg.norm(b))
    monkeypatch.setattr(search, "nearest_stack", lambda b, a, directions, distance, axis: distance.fill(0.0))
    for reach, expected in ((2.8e-5, True), (3.5e-5, False)):
        found = search.nearest_singularity(geometry, Rotation.from_rotvec(reach / share * across) * folded)
        assert found.folded.tolist() == [False, expected, False]
