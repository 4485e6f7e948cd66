"""Searches of smoothing splines at their ends, and the weights of conditions; curves of few samples by hand."""

import numpy as np
import pytest
import scipy

from exo_pin.numerics.smoothing import smoothing_splines as splines
from exo_pin.numerics.smoothing.smoothing_splines import SplineBasis, _inverse_bands, _Search, motion_of_quaternions


@pytest.mark.parametrize("best", [0, 1, 7, -2, -1])
@pytest.mark.parametrize("count", [13, 50])
def test_three_trials_in_a_decade_and_the_best_is_refined_between_its_neighbours(monkeypatch, best, count):
    search, asked, ranges = _Search(np.arange(float(count)), np.zeros((count, 1)), 1, 0.1), [], []
    low, high = np.log(1e-9), np.log(1e4) + search.levels * np.log(2.0**8)
    decades = (high - low) / np.log(10.0)
    trials = np.linspace(low, high, 1 + int(3.0 * decades))
    goal = trials[best] + 0.02 * (1 if best >= 0 else -1)
    monkeypatch.setattr(search, "score", lambda at: asked.append(at) or abs(at - goal))
    kernel = scipy.optimize.minimize_scalar
    monkeypatch.setattr(
        splines.scipy.optimize,
        "minimize_scalar",
        lambda *given, **to: ranges.append(to["bounds"]) or kernel(*given, **to),
    )
    found = search.best()
    np.testing.assert_allclose(asked[: len(trials)], trials, rtol=1e-12)
    assert 3.0 * decades - 1.0 < len(trials) - 1 <= 3.0 * decades
    assert len(asked) <= len(trials) + 20
    k = best % len(trials)
    np.testing.assert_allclose(ranges, [(trials[max(k - 1, 0)], trials[min(k + 1, len(trials) - 1)])], rtol=1e-12)
    assert np.log(found) == pytest.approx(goal, abs=0.02)


def test_a_refinement_that_finds_nothing_better_leaves_the_trial(monkeypatch):
    search = _Search(np.arange(20.0), np.zeros((20, 1)), 1, 0.1)
    trials = []
    monkeypatch.setattr(search, "score", lambda at: trials.append(at) or (0.0 if len(trials) == 9 else 1.0))
    assert np.log(search.best()) == pytest.approx(trials[8], rel=1e-14)


def test_each_condition_of_rest_weighs_as_much_as_many_samples():
    """Two at either end, each a unit row times 1e5, however near the samples are to each other there."""
    even = np.arange(30.0)
    for x in (even, even + 0.4 * np.sin(even), np.r_[0.0, 0.1, 0.2, even[3:]]):
        free, held = SplineBasis(x), SplineBasis(x, rest=True)
        assert (held._normal - free._normal)[0].sum() == pytest.approx(4e10, rel=1e-9)
        values = held.values(np.sin(x / 5.0)[:, None], held.factor(1.0))
        assert np.abs(values[1:, [0, -1]]).max() < 1e-6
        hat = held.values(np.eye(30), held.factor(10.0))[0]
        assert held.freedom(10.0) == pytest.approx(np.trace(hat), abs=1e-3)


@pytest.mark.parametrize("size", [1, 2, 8, 9])
def test_bands_of_inverses_of_any_size(size):
    """Of a full lower triangle within seven bands; what is beyond the matrix is not read."""
    rng = np.random.default_rng(size)
    half = np.tril(rng.normal(size=(size, size))) + 4.0 * np.eye(size)
    half *= np.subtract.outer(np.arange(size), np.arange(size)) <= 7
    bands = np.array([np.append(np.diagonal(half, -k), np.zeros(min(k, size)))[:size] for k in range(8)])
    found, dense = _inverse_bands(bands), np.linalg.inv(half @ half.T)
    for k in range(min(8, size)):
        np.testing.assert_allclose(found[k, : size - k], np.diagonal(dense, -k), rtol=1e-10, atol=1e-15)


def test_growing_quaternions_turn_as_unit_ones_do():
    """A turn about one axis by θ(t), times a length e^{kt}: ω = θ' along the axis and η = θ''."""
    axis, t, k = np.array([0.36, 0.48, 0.8]), np.linspace(0.0, 2.0, 7), 5.0
    angle, rate, bend = 0.5 + 3.0 * t - 0.8 * t**2, 3.0 - 1.6 * t, np.full(7, -1.6)
    half = np.stack([*(np.sin(angle / 2.0) * a for a in axis), np.cos(angle / 2.0)], axis=-1)
    across = np.stack([*(np.cos(angle / 2.0) * a for a in axis), -np.sin(angle / 2.0)], axis=-1)
    w, e = 0.5 * rate[:, None], 0.5 * bend[:, None]
    length = np.exp(k * t)[:, None]
    values = np.stack([half, k * half + w * across, (k**2 - w**2) * half + (2.0 * k * w + e) * across]) * length
    u, velocity, acceleration = motion_of_quaternions(values)
    np.testing.assert_allclose(u, half, rtol=1e-13, atol=1e-15)
    np.testing.assert_allclose(velocity, rate[:, None] * axis, atol=1e-13)
    np.testing.assert_allclose(acceleration, bend[:, None] * axis, atol=1e-12)


@pytest.mark.parametrize(("left", "finite"), [(3.0, True), (0.5, True), (1e-3, True), (-1e-3, False), (-2.0, False)])
def test_scores_are_finite_while_degrees_of_freedom_are_left(monkeypatch, left, finite):
    """With 1.4 for each that is used."""
    rng = np.random.default_rng(122)
    x, y = np.arange(20.0), rng.normal(size=(20, 1))
    search = _Search(x, y, 1, None)
    basis = search.basis(1.0)
    monkeypatch.setattr(basis, "freedom", lambda penalty: (20.0 - left) / 1.4)
    squares = ((y - basis.values(y, basis.factor(1.0))[0]) ** 2).sum()
    expected = np.log(squares) - 2.0 * np.log(left) if finite else np.inf
    assert search.score(0.0) == pytest.approx(expected, rel=1e-9)


def test_curves_have_a_value_and_two_derivatives():
    x = np.arange(20.0)
    y = np.random.default_rng(123).normal(size=(20, 2))
    for count in (5, 20):
        assert splines.interpolate_samples(x[:count], y[:count], 2).values.shape == (3, count, 2)
    assert splines.smooth_samples(x, y, 2).values.shape == (3, 20, 2)
