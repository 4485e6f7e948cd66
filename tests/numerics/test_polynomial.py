"""Real roots of polynomials on [-1, 1], which forward kinematics and the nearest singular pose rest on."""

import numpy as np
import pytest

from exo_pin.numerics.polynomial import HALF_WIDTH, roots_and_touches


def found(p, touch=0.0):
    out = np.full(32, np.nan)
    return np.sort(out[: roots_and_touches(np.array(p, dtype=float), len(p) - 1, touch, out)])


@pytest.mark.parametrize("degree", range(1, 9))
def test_roots_are_those_that_were_put_in(degree):
    """Newton's steps alone go to and fro on either side of some of them for ever."""
    rng = np.random.default_rng(degree)
    for _ in range(200):
        real = rng.integers(0, degree // 2 + 1) * 2 + degree % 2
        inside = np.sort(rng.uniform(-0.99, 0.99, real))
        if real > 1 and np.diff(inside).min() < 1e-3:
            continue
        pairs = rng.uniform(-1.5, 1.5, (degree - real) // 2) + 1j * rng.uniform(0.05, 1.0, (degree - real) // 2)
        p = np.polynomial.polynomial.polyfromroots([*inside, *pairs, *pairs.conj()]).real
        np.testing.assert_allclose(found(p), inside, atol=1e-7)


def test_polynomial_roots_against_a_companion_matrix():
    rng = np.random.default_rng(10)
    out = np.empty(16)
    for _ in range(300):
        p = rng.normal(size=9) if rng.random() < 0.7 else np.poly(rng.uniform(-1.5, 1.5, 8))[::-1].copy()
        number = roots_and_touches(p, 8, 0.0, out)
        reference = np.roots(p[::-1])
        real = np.sort(reference[np.abs(reference.imag) < 1e-9].real)
        real = real[np.abs(real) < 1.0]
        own = np.sort(out[:number])
        own = own[np.abs(own) < 1.0]
        np.testing.assert_allclose(own, real, atol=1e-7)


def test_roots_a_little_beyond_the_ends_are_found_and_others_are_not():
    edge = HALF_WIDTH - 1.0
    assert edge == pytest.approx(1e-6, rel=1e-9)
    for root, expected in ((1.0 + 0.5 * edge, 1), (1.0 + 2.0 * edge, 0), (1.0, 1), (-1.0 - 0.5 * edge, 1), (-1.5, 0)):
        assert len(found([-root, 1.0])) == expected
    # Exactly on the lower end of the search.
    np.testing.assert_allclose(found([HALF_WIDTH, 1.0]), [-HALF_WIDTH], rtol=1e-15)


@pytest.mark.parametrize("at", [-0.7, 0.0, 0.4])
def test_extrema_near_zero_are_written_and_others_are_not(at):
    square = np.polynomial.polynomial.polyfromroots([at, at])
    other = np.polynomial.polynomial.polyfromroots([0.9])
    for lift, written in ((0.9e-6, True), (1.1e-6, False), (-0.9e-6, True)):
        p = np.polynomial.polynomial.polymul(square + np.array([lift, 0.0, 0.0]), other)
        size = abs(at - 0.9)
        values = found(p, 1e-6 * size)
        close = np.sort(values[np.abs(values - at) < 2e-3])
        if lift > 0.0:
            np.testing.assert_allclose(close, [at] if written else [], atol=1e-5)
        else:
            np.testing.assert_allclose(close, [at - np.sqrt(-lift), at, at + np.sqrt(-lift)], atol=1e-5)
        assert np.abs(values - 0.9).min() < 1e-14
    # An extremum is as exact as half of the digits of its value.
    touched = found(np.polynomial.polynomial.polymul(square, [1.0, 0.0, 1.0]), 1e-13)
    assert np.abs(touched - at).min() < 1e-8
