"""Smallest cones against all pairs and triples of directions, forks against a finer search."""

from itertools import combinations

import numpy as np
import pytest
from scipy.optimize import minimize
from scipy.spatial.transform import Rotation

from exo_pin.numerics.cones import fork_tilt, smallest_cone


def by_pairs_and_triples(directions):
    """The narrowest cone through two or three of the directions that holds them all: its axis and half opening."""
    axes = [a + b for a, b in combinations(directions, 2)]
    axes += [sign * np.cross(b - a, c - a) for a, b, c in combinations(directions, 3) for sign in (1.0, -1.0)]
    axes = np.array(axes)
    axes /= np.linalg.norm(axes, axis=1, keepdims=True)
    half = np.arccos(np.clip(axes @ directions.T, -1.0, 1.0)).max(axis=1)
    return axes[half.argmin()], half.min()


@pytest.mark.parametrize("spread", [0.01, 0.3, 1.0])
def test_the_smallest_cone_is_held_by_two_or_three_directions(spread):
    rng = np.random.default_rng(51)
    for count in (2, 3, 5, 9):
        for _ in range(4):
            rows = np.array([0.0, 0.0, 1.0]) + spread * rng.uniform(-1.0, 1.0, (count, 3)) * [1.0, 1.0, 0.5]
            rows = Rotation.random(rng=rng).apply(rows / np.linalg.norm(rows, axis=1, keepdims=True))
            axis, half = smallest_cone(rows)
            best, least = by_pairs_and_triples(rows)
            assert half == pytest.approx(least, abs=1e-9)
            np.testing.assert_allclose(axis, best, atol=1e-6)
            assert (rows @ axis >= np.cos(half) - 1e-12).all()


@pytest.mark.parametrize("rows", [[[1, 0, 0], [-1, 0, 0]], [[1, 0, 0], [-0.5, 0.75**0.5, 0], [-0.5, -(0.75**0.5), 0]]])
def test_directions_all_around_have_no_cone(rows):
    axis, half = smallest_cone(np.array(rows, dtype=float))
    assert half == np.pi
    assert np.isnan(axis).all()
    assert axis.shape == (3,)


@pytest.mark.parametrize("count", [3, 40, 5000])
def test_the_fork_is_within_the_spacing_of_its_trial_axes_of_the_best(count):
    """Directions about a plane, so that the best axis is across it; a search from there finds the least tilt."""
    rng = np.random.default_rng(52)
    around, off = rng.uniform(0.0, 2.0 * np.pi, count), rng.uniform(-0.2, 0.2, count)
    turn = Rotation.random(rng=rng)
    rows = turn.apply(np.stack([np.cos(off) * np.cos(around), np.cos(off) * np.sin(around), np.sin(off)], axis=-1))
    axis, tilt = fork_tilt(rows)
    assert np.linalg.norm(axis) == pytest.approx(1.0, abs=1e-15)
    assert tilt == pytest.approx(np.arcsin(np.abs(rows @ axis).max()), abs=1e-14)

    def tilt_of(angles):
        return np.arcsin(np.abs(rows @ turn.apply(Rotation.from_euler("xy", angles).apply([0.0, 0.0, 1.0]))).max())

    best = minimize(tilt_of, np.zeros(2), method="Nelder-Mead").fun
    assert best - 1e-6 <= tilt <= best + np.radians(2.5)


def test_the_trial_axes_of_forks_are_near_every_direction():
    """Two crossing planes leave one axis, the common perpendicular of what is in them."""
    rng = np.random.default_rng(53)
    for turn in (Rotation.identity(), *Rotation.random(120, rng=rng)):
        around = np.linspace(0.0, 2.0 * np.pi, 37)
        rows = turn.apply(np.stack([np.cos(around), np.sin(around), 0.0 * around], axis=-1))
        axis, tilt = fork_tilt(rows)
        off = np.arccos(min(1.0, abs(axis @ turn.apply([0.0, 0.0, 1.0]))))
        assert off < np.radians(2.92)
        assert tilt == pytest.approx(off, abs=2e-3)


def test_forks_of_rounded_directions_have_a_tilt():
    """A direction along a trial axis, of a length of one and a last digit, is a right angle."""
    axis, tilt = fork_tilt(np.array([[1.0, 0.0, 0.0]]))
    assert tilt < np.radians(2.5)
    every = np.concatenate([np.eye(3), -np.eye(3), np.random.default_rng(54).normal(size=(3000, 3))])
    every /= np.linalg.norm(every, axis=1, keepdims=True)
    axis, tilt = fork_tilt(every * (1.0 + 4e-16))
    assert np.radians(80.0) < tilt <= 0.5 * np.pi
    assert np.linalg.norm(axis) == pytest.approx(1.0, rel=1e-14)


def test_directions_have_no_cone_where_the_nearest_point_of_their_hull_is_within_rounding():
    """Two that are almost opposite: the middle of the line between them is at the sine of half of what is missing."""
    for off, has_one in ((0.0, False), (0.5e-9, False), (0.9e-9, False), (1.1e-9, True), (2e-9, True), (1e-6, True)):
        _, half = smallest_cone(np.array([[1.0, 0.0, off], [-1.0, 0.0, off]]))
        assert half == pytest.approx(0.5 * np.pi - off if has_one else np.pi, abs=1e-6)


def test_forks_of_more_directions_than_are_worked_on_at_once_and_of_one_more():
    """The last one decides: without it the axis is the pole's neighbour, with it an axis across both."""
    around = np.linspace(0.0, 2.0 * np.pi, 2001)
    rows = np.stack([np.cos(around), np.sin(around), 0.0 * around], axis=-1)
    for count in (2000, 2001):
        changed = rows[:count].copy()
        changed[-1] = [0.0, np.sin(0.4), np.cos(0.4)]
        axis, tilt = fork_tilt(changed)
        assert tilt == pytest.approx(np.arcsin(np.abs(changed @ axis).max()), abs=1e-15)
        assert fork_tilt(rows[:count])[1] < 0.05 < 0.5 < tilt


def test_limbs_along_every_trial_axis_of_a_fork_need_a_right_angle():
    """Of directions that are longer than one by a last digit; the axes are the spiral of the golden angle."""
    k = np.arange(1500)
    height, around = 1.0 - (k + 0.5) / 1500.0, 2.0 * np.pi * k * (1.0 - 2.0 / (1.0 + np.sqrt(5.0)))
    rows = np.stack([np.cos(around), np.sin(around), height], axis=-1)
    rows[:, :2] *= np.sqrt(1.0 - height[:, None] ** 2)
    _, tilt = fork_tilt(rows * (1.0 + 1e-15))
    assert tilt == pytest.approx(0.5 * np.pi, abs=1e-7)
