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


@pytest.mark.parametrize("side", [1.0, -1.0])
def test_from_the_centre_alone_a_search_would_end_at_a_saddle(side):
    """Two peaks on the ball, either side of where the force grows at its centre, and none of the directions asked."""
    up = side * np.cross(SKEW, [0.1, 0.9, -0.3])
    up /= np.linalg.norm(up)
    worst, least = searched(lambda x: 40.0 + 2.0 * x @ up + 30.0 * (x @ SKEW) ** 2)
    assert worst.magnitude == pytest.approx(70.0 + 2.0**2 / 120.0, rel=1e-6)
    assert abs(worst.offset @ SKEW) == pytest.approx(RADIUS * np.sqrt(1.0 - (1.0 / 30.0) ** 2), rel=1e-3)
    assert least == pytest.approx(38.0, rel=1e-6)


def test_a_search_may_run_into_offsets_without_an_answer_and_loses_its_hold_anywhere():
    grows = lambda x: 40.0 * np.exp(x @ SKEW)  # noqa: E731
    worst, _ = searched(grows, answered=lambda x: x @ SKEW < 0.99)
    assert worst.magnitude == np.inf
    assert worst.offset @ SKEW >= 0.99 * RADIUS
    worst, _ = searched(grows, held=lambda x: x @ SKEW > -0.99)
    assert worst.magnitude == pytest.approx(40.0 * np.e)
    assert not worst.holds


def test_a_pocket_is_found_although_forces_elsewhere_are_larger():
    """By the determinant alone: |F_s| leads away from it, where no two answers are more than a few newtons apart."""
    pocket = lambda x: 2.0 * (((x - 0.9 * SKEW) ** 2).sum(axis=1) - 0.05**2)  # noqa: E731
    worst, _ = searched(lambda x: 1e-3 / np.abs(pocket(x)) + 40.0 - 20.0 * x @ SKEW, pocket)
    np.testing.assert_allclose(worst.offset, RADIUS * 0.85 * SKEW, atol=1e-5 * RADIUS)
    assert worst.magnitude == np.inf


def test_one_direction_that_is_not_held_is_noticed():
    worst, _ = searched(lambda x: 40.0 + 5.0 * x @ SKEW, held=lambda x: x @ [-1.0, 0.0, 0.0] < 0.999)
    assert worst.magnitude == pytest.approx(45.0)
    assert not worst.holds


def test_the_nearest_offset_of_unbounded_forces_lies_on_a_curved_surface():
    """Near the centre, where it is steep, or about a pocket that no direction hits; else forces stay bounded."""
    steep = lambda x: 1.0 - (40.0 * x @ SKEW) ** 3  # noqa: E731
    pocket = lambda x: 2.0 * (((x - 0.9 * SKEW) ** 2).sum(axis=1) - 0.05**2)  # noqa: E731
    for determinant, distance in ((steep, 0.025), (pocket, 0.85)):
        worst, _ = searched(lambda x, determinant=determinant: 1.0 / np.abs(determinant(x)), determinant)
        np.testing.assert_allclose(worst.offset, RADIUS * distance * SKEW, atol=1e-5 * RADIUS)
        assert worst.magnitude == np.inf
        assert np.isnan(worst.shoulder_force).all()
        assert not worst.holds
        worst, _ = searched(lambda x: 40.0 + x @ SKEW, determinant)
        assert worst.magnitude == pytest.approx(41.0)
        assert worst.holds
