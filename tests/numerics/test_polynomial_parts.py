"""Roots at ends, double roots and extrema near zero, and how many values the search of a root takes."""

import numpy as np
import pytest

from exo_pin.numerics.polynomial import HALF_WIDTH, _bracketed, _value, roots_and_touches

pytestmark = pytest.mark.usefixtures("plain")


def found(p, touch=0.0):
    out = np.full(16, np.nan)
    count = roots_and_touches(np.array(p, dtype=float), len(p) - 1, touch, out)
    assert np.isnan(out[count:]).all()
    return out[:count]


@pytest.mark.parametrize("degree", range(1, 9))
def test_separate_roots_are_found_to_rounding(degree):
    rng = np.random.default_rng(120 + degree)
    for _ in range(10):
        roots = (
            np.linspace(-0.95, 0.95, degree) + rng.uniform(-0.05, 0.05, degree) if degree > 1 else rng.uniform(-1, 1, 1)
        )
        p = rng.normal() * np.polynomial.polynomial.polyfromroots(roots)
        error = np.abs(found(p) - np.sort(roots))
        slopes = np.abs(np.polynomial.polynomial.polyval(roots, np.polynomial.polynomial.polyder(p)))
        assert (error <= 1e-15 * np.abs(p).sum() / slopes + 2e-15).all()
    assert _value(p, degree, 0.3) == pytest.approx(np.polynomial.polynomial.polyval(0.3, p), rel=1e-13)


def test_roots_a_little_beyond_the_ends_are_found_and_others_are_not():
    edge = HALF_WIDTH - 1.0
    assert edge == pytest.approx(1e-6, rel=1e-9)
    for root, expected in ((1.0 + 0.5 * edge, 1), (1.0 + 2.0 * edge, 0), (1.0, 1), (-1.0 - 0.5 * edge, 1), (-1.5, 0)):
        assert len(found([-root, 1.0])) == expected
    # Exactly on the lower end of the search.
    np.testing.assert_allclose(found([HALF_WIDTH, 1.0]), [-HALF_WIDTH], rtol=1e-15)


def test_leading_coefficients_may_be_zero():
    np.testing.assert_allclose(found([-0.06, 0.1, 1.0, 0.0, 0.0, 0.0]), [-0.3, 0.2], atol=1e-15)
    np.testing.assert_array_equal(np.unique(found([0.0, 0.0, 0.0, 2.0])), [0.0])
    assert len(found([1.0, 0.0, 0.0])) == 0


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


def test_a_root_between_bounds_is_found_in_few_values():
    """Newton's method in a bracket: about as many as digits double, from the middle or where Newton leaves it."""
    rng = np.random.default_rng(121)
    for _ in range(20):
        roots = np.sort(rng.uniform(-1.0, 1.0, 3))
        if np.diff(roots).min() < 0.1:
            continue
        p = np.polynomial.polynomial.polyfromroots(roots)
        slope = np.polynomial.polynomial.polyder(p)
        low, high = 0.5 * (roots[0] + roots[1]), 0.5 * (roots[1] + roots[2])
        at_low = np.polynomial.polynomial.polyval(low, p)
        assert _bracketed(p, slope, 3, low, high, at_low, 1e-15) == pytest.approx(roots[1], abs=1e-13)
        rough = _bracketed(p, slope, 3, low, high, at_low, 1e-2)
        assert abs(rough - roots[1]) < 1e-2
    # A root in the middle is found at once, also one of a flat polynomial, whose slope is zero there.
    assert _bracketed(np.array([0.0, 0.0, 0.0, 1.0]), np.array([0.0, 0.0, 3.0]), 3, -1.0, 1.0, -1.0, 1e-15) == 0.0
    flat = _bracketed(np.array([-1e-3, 0.0, 0.0, 1.0]), np.array([0.0, 0.0, 3.0]), 3, -1.0, 1.0, -1.0, 1e-15)
    assert flat == pytest.approx(0.1, rel=1e-13)


def test_brackets_close_by_newtons_steps(monkeypatch):
    """Of octics and all their derivatives: about fifty roots, of eight values on average; by halving, of a hundred."""
    used, asked = _bracketed.plain.__globals__, []
    value = used["_value"]

    def noted(*arguments):
        asked.append(arguments[2])
        return value(*arguments)

    monkeypatch.setitem(used, "_value", noted)
    rng = np.random.default_rng(24)
    for _ in range(30):
        p = rng.normal(size=9)
        exact = np.roots(p[::-1])
        exact = np.sort(exact[np.abs(exact.imag) < 1e-9].real)
        np.testing.assert_allclose(np.sort(found(p)), exact[np.abs(exact) < 1.0], atol=1e-9)
    assert len(asked) < 30 * 350


def test_a_root_ends_where_newtons_step_is_below_rounding(monkeypatch):
    """Also where the last value makes it an end of its bracket: halving on from there takes fifty values more."""
    used, asked = _bracketed.plain.__globals__, []
    value = used["_value"]
    monkeypatch.setitem(used, "_value", lambda *given: asked.append(1) or value(*given))
    rng = np.random.default_rng(25)
    for _ in range(150):
        p, (low, high) = rng.normal(size=rng.integers(3, 10)), np.sort(rng.uniform(-1.0, 1.0, 2))
        slope, of_ends = np.polynomial.polynomial.polyder(p), np.polynomial.polynomial.polyval([low, high], p)
        if of_ends[0] * of_ends[1] > 0.0:
            continue
        for exact in (1e-15, 1e-8):
            asked.clear()
            root = _bracketed(p, slope, len(p) - 1, low, high, of_ends[0], exact)
            assert low <= root <= high
            assert len(asked) <= 30
            error = 2.0 * exact * np.abs(slope).sum() + 1e-15 * np.abs(p).sum()
            assert abs(np.polynomial.polynomial.polyval(root, p)) <= error
    # A step that leaves the bracket within the accuracy ends on the bracket's end.
    for end, ends in ((0.3, (0.3, 0.9)), (-0.3, (-0.9, -0.3))):
        p = np.array([-(end - np.sign(end) * 1e-9), 1.0])
        assert _bracketed(p, p[1:], 1, *ends, -1.0, 1.0) == end


@pytest.mark.parametrize("root", [-0.5, 0.25])
def test_double_roots_where_a_value_is_exactly_zero_are_roots_once(root):
    """Without extrema: the double one from the fence on which it lies, beside single ones on either side."""
    for other in ([-0.875], [0.75], []):
        p = np.polynomial.polynomial.polyfromroots([root, root, *other])
        np.testing.assert_allclose(np.sort(found(p, -1.0)), np.sort([root, *other]), atol=1e-15)
        np.testing.assert_allclose(np.sort(found(p, 0.0)), np.sort([root, root, *other]), atol=1e-15)


def test_values_of_one_are_no_zeros():
    """At either end of the search, and on a fence between: 4 t³ - 3 t is one at -1/2 and 1, minus one at 1/2 and -1."""
    for sign in (1.0, -1.0):
        for p in ([1.0, sign], [sign * (1.0 - HALF_WIDTH), sign], [1.0, sign * 2.0 / HALF_WIDTH]):
            root = -p[0] / p[1]
            np.testing.assert_allclose(found(p), [root] if abs(root) <= HALF_WIDTH else [], rtol=1e-14, atol=1e-15)
        np.testing.assert_allclose(
            np.sort(found([0.0, -3.0 * sign, 0.0, 4.0 * sign])), [-(0.75**0.5), 0.0, 0.75**0.5], atol=1e-15
        )
    at_high = np.array([1.0 - HALF_WIDTH, 1.0])
    assert _value(at_high, 1, HALF_WIDTH) == 1.0
    at_low = np.array([1.5, 0.5 / HALF_WIDTH])
    assert _value(at_low, 1, -HALF_WIDTH) == 1.0
    assert len(found(at_low)) == 0


@pytest.mark.parametrize("slope", [1.0, -1.0, 0.125, 7.0])
def test_lines_take_one_step_of_newton_and_a_look_at_it(monkeypatch, slope):
    used, asked = _bracketed.plain.__globals__, []
    value = used["_value"]
    monkeypatch.setitem(used, "_value", lambda *given: asked.append(given) or value(*given))
    p = np.array([-0.3 * slope, slope])
    assert _bracketed(p, p[1:], 1, -1.0, 1.0, -1.3 * slope, 1e-15) == pytest.approx(0.3, rel=1e-15)
    assert len([given for given in asked if given[1] == 1]) <= 2


def test_coefficients_beyond_the_degree_are_not_read():
    p = np.array([-0.06, 0.1, 1.0, np.nan, np.nan])
    out = np.full(16, np.nan)
    assert roots_and_touches(p, 2, 0.0, out) == 2
    np.testing.assert_allclose(np.sort(out[:2]), [-0.3, 0.2], atol=1e-15)
    assert np.isnan(out[2:]).all()
