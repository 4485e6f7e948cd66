"""Real roots of polynomials on [-1, 1], which forward kinematics and the nearest singular pose rest on."""

import numpy as np
import pytest

from exo_pin.numerics.polynomial import roots_and_touches


def found(p):
    out = np.empty(32)
    return np.sort(out[: roots_and_touches(np.array(p, dtype=float), len(p) - 1, 0.0, out)])


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
