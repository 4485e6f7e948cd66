"""The worst offset of forces in closed form, given in radii of the ball: curved ones, unbounded ones, ones that end."""

from types import SimpleNamespace

import numpy as np
import pytest

from exo_pin.uncertainty.offset_search import worst_offset

RADIUS = 0.015
#: More than 14° from each of the 26 directions that are asked first.
SKEW = np.array([0.9, 0.38, 0.2]) / np.linalg.norm([0.9, 0.38, 0.2])
WAY = np.array([3.0, -2.0, 6.0])


def unknown(x):
    return np.full(len(x), np.nan)


def constant(x):
    return np.ones(len(x))


def searched(size, determinant=unknown, answered=None, held=None):
    """The worst offset and the least |F_s|, N, of forces ``size`` along WAY."""
    asked = []

    def answers(offsets):
        asked.append(offsets)
        x = offsets / RADIUS
        ok = np.ones(len(x), dtype=bool) if answered is None else answered(x)
        with np.errstate(divide="ignore"):
            force = np.where(ok, size(x), np.nan)[:, None] * WAY / 7.0
        return SimpleNamespace(
            shoulder_force=force, magnitude=np.linalg.norm(force, axis=1), determinant=determinant(x), has_answer=ok,
            held=ok if held is None else held(x),
        )  # fmt: skip

    worst, least = worst_offset(answers, RADIUS)
    assert worst.radius == RADIUS
    np.testing.assert_array_equal(asked[0], RADIUS * np.array([np.zeros(3), *worst.directions]))
    own = np.linalg.norm(answers(asked[0][1:]).shoulder_force, axis=1)
    np.testing.assert_array_equal(worst.magnitudes, own)
    assert max(np.abs(x).max() for x in asked) < 1.001 * RADIUS
    return worst, least


@pytest.mark.parametrize("determinant", [constant, unknown])
def test_forces_that_grow_one_way_are_least_and_largest_on_the_ball(determinant):
    worst, least = searched(lambda x: 40.0 * np.exp(x @ SKEW), determinant)
    assert (least, worst.magnitude) == pytest.approx((40.0 / np.e, 40.0 * np.e), rel=1e-6)
    np.testing.assert_allclose(worst.offset, RADIUS * SKEW, atol=1e-3 * RADIUS)
    np.testing.assert_allclose(worst.shoulder_force, worst.magnitude * WAY / 7.0, rtol=1e-12)
    assert worst.holds


@pytest.mark.parametrize("peak", [0.6 * SKEW, -0.3 * SKEW])
def test_a_peak_within_the_ball_is_found(peak):
    worst, least = searched(lambda x: 20.0 + 30.0 * np.exp(-2.0 * ((x - peak) ** 2).sum(axis=1)), constant)
    far = 1.0 + np.linalg.norm(peak)
    assert (least, worst.magnitude) == pytest.approx((20.0 + 30.0 * np.exp(-2.0 * far**2), 50.0), rel=1e-5)
    np.testing.assert_allclose(worst.offset, RADIUS * peak, atol=5e-3 * RADIUS)


@pytest.mark.parametrize("distance", [0.3, 0.985, 1.02])
def test_forces_are_unbounded_where_the_ball_reaches_a_singular_plane(distance):
    """The plane at 0.985 cuts off a cap that none of the first offsets is in."""

    def determinant(x):
        return -4e-3 * (1.0 - x @ SKEW / distance)

    worst, _ = searched(lambda x: 1.0 / np.abs(determinant(x)), determinant)
    assert worst.holds is (distance > 1.0)
    if distance > 1.0:
        assert worst.magnitude == pytest.approx(250.0 / (1.0 - 1.0 / distance), rel=1e-4)
    else:
        assert worst.magnitude == np.inf
        assert np.isnan(worst.shoulder_force).tolist() == [True] * 3
    np.testing.assert_allclose(worst.offset, RADIUS * min(distance, 1.0) * SKEW, atol=1e-3 * RADIUS)


def test_a_small_singular_sphere_between_the_first_offsets_is_found_at_its_nearest_point():
    middle = 0.6 * SKEW

    def determinant(x):
        return ((x - middle) ** 2).sum(axis=1) / 0.05**2 - 1.0

    worst, _ = searched(lambda x: 5.0 / np.abs(determinant(x)), determinant)
    assert worst.magnitude == np.inf
    np.testing.assert_allclose(worst.offset, RADIUS * 0.55 * SKEW, atol=1e-6 * RADIUS)


def test_a_determinant_of_zero_without_a_load_that_way_is_no_bound():
    worst, least = searched(lambda x: 40.0 + 10.0 * x @ SKEW, lambda x: 1.0 - x @ SKEW / 0.4)
    assert (least, worst.magnitude) == pytest.approx((30.0, 50.0), rel=1e-6)
    assert worst.holds


@pytest.mark.parametrize(("determinant", "nearest"), [(constant, 0.5), (unknown, 1.0)])
def test_the_nearest_offset_without_an_answer_is_named(determinant, nearest):
    """Inside the ball offsets are asked first only where an answer is quick."""
    axis = np.array([0.0, 0.0, -1.0])
    worst, least = searched(lambda x: 40.0 + 10.0 * x[:, 2], determinant, lambda x: x @ axis < 0.45)
    assert worst.magnitude == np.inf
    assert np.linalg.norm(worst.offset) == pytest.approx(RADIUS * nearest)
    assert worst.offset @ axis > 0.45 * RADIUS
    assert np.isnan(worst.magnitudes).sum() == 9
    assert least == pytest.approx(40.0, rel=0.2)
    assert not worst.holds


def test_a_search_may_run_into_offsets_without_an_answer_and_loses_its_hold_anywhere():
    grows = lambda x: 40.0 * np.exp(x @ SKEW)  # noqa: E731
    worst, _ = searched(grows, answered=lambda x: x @ SKEW < 0.99)
    assert worst.magnitude == np.inf
    assert worst.offset @ SKEW >= 0.99 * RADIUS
    worst, _ = searched(grows, held=lambda x: x @ SKEW > -0.99)
    assert worst.magnitude == pytest.approx(40.0 * np.e)
    assert not worst.holds
