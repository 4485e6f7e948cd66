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
