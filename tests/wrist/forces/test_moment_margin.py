"""Moments that limbs can supply against the convex hull of all corners, linear programs and relaxed limits."""

import itertools

import numpy as np
import pytest
from scipy.optimize import linprog
from scipy.spatial import ConvexHull

import exo_pin as ep
from exo_pin.wrist.forces.wrench_feasibility import force_bounds, moment_margin

pytestmark = pytest.mark.usefixtures("plain")


def margin_of(arms, moment, lower, upper):
    n = len(arms)
    direction, low, high = np.empty(3), np.empty(n), np.empty(n)
    return moment_margin(arms, moment, lower, upper, direction, low, high), direction, low, high


@pytest.mark.parametrize("n", [3, 4, 5])
def test_margins_are_distances_from_the_faces_of_the_hull(n):
    rng, seen = np.random.default_rng(92), set()
    for _ in range(15):
        arms, lower = rng.normal(size=(n, 3)), rng.uniform(-1.0, 0.5, n)
        upper = lower + rng.uniform(0.1, 2.0, n)
        moment = rng.uniform(lower - 0.2, upper + 0.2) @ arms
        margin, direction, _, _ = margin_of(arms, moment, lower, upper)
        corners = np.array([np.array(f) @ arms for f in itertools.product(*zip(lower, upper, strict=True))])
        room = -(ConvexHull(corners).equations @ np.append(moment, 1.0))
        assert margin == pytest.approx(room.min(), rel=1e-9, abs=1e-9)
        normal = ConvexHull(corners).equations[room.argmin(), :3]
        np.testing.assert_allclose(direction, normal, atol=1e-9)
        seen.add(bool(margin > 0.0))
    assert seen == {True, False}


@pytest.mark.parametrize("n", [3, 4, 5])
def test_missing_limits_are_rays(n):
    rng, seen = np.random.default_rng(93), set()
    for _ in range(25):
        arms, moment = rng.normal(size=(n, 3)), rng.normal(size=3)
        lower = np.where(rng.random(n) < 0.2, -np.inf, rng.uniform(-1.0, 0.5, n))
        upper = np.where(rng.random(n) < 0.4, np.inf, np.maximum(lower, -1.0) + rng.uniform(0.1, 2.0, n))
        margin, direction, _, _ = margin_of(arms, moment, lower, upper)
        limits = np.stack([lower, upper], axis=1)
        assert (margin >= 0.0) == (linprog(np.zeros(n), A_eq=arms.T, b_eq=moment, bounds=limits).status == 0)
        if np.isfinite(margin):
            # As much further moment along the axis of least margin is held, and no more.
            for more, held in ((0.999, True), (1.001, False)):
                further = moment + direction * (margin * more if margin > 0.0 else margin / more)
                assert (
                    linprog(np.zeros(n), A_eq=arms.T, b_eq=further, bounds=limits).status == 0
                ) == held or margin < 0.0
        else:
            assert np.isnan(direction).all()
        seen.add((bool(margin >= 0.0), bool(np.isfinite(margin))))
    assert {(True, True), (False, True)} <= seen


@pytest.mark.parametrize("n", [3, 5])
def test_reliefs_are_the_least_changes_of_one_limit_that_hold(n):
    rng, seen = np.random.default_rng(94), set()
    for _ in range(25):
        arms, lower, upper = rng.normal(size=(n, 3)), np.zeros(n), rng.uniform(0.2, 2.0, n)
        moment = rng.uniform(lower - 0.2, upper + 0.2) @ arms
        margin, _, low, high = margin_of(arms, moment, lower, upper)
        if margin >= 0.0:
            assert (low == 0.0).all()
            assert (high == 0.0).all()
            continue
        for k in range(n):
            for relief, side in ((low[k], -1.0), (high[k], 1.0)):
                seen.add(bool(np.isfinite(relief)))
                for share, held in ((1.0 + 1e-9, True), (1.0 - 1e-6, False)):
                    step = (relief if np.isfinite(relief) else 1e6) * share * np.eye(n)[k]
                    wider = (lower - step, upper) if side < 0.0 else (lower, upper + step)
                    found = margin_of(arms, moment, *wider)[0]
                    assert (found >= -1e-12) == (held and bool(np.isfinite(relief))), (relief, share, found)
    assert seen == {True, False}


def test_parallel_limbs_span_no_face():
    arms = np.array([[1.0, 0.0, 0.0], [2.0, 1e-13, 0.0], [0.0, 1.0, 0.0], [0.0, 0.0, 1.0]])
    margin, direction, _, _ = margin_of(arms, np.zeros(3), -np.ones(4), np.ones(4))
    assert margin == pytest.approx(1.0, rel=1e-12)
    assert abs(direction[0]) < 1e-12
    # Two limbs in one plane hold no moment across it: the margin is zero, or minus what is missing.
    flat = np.array([[1.0, 0.0, 0.0], [0.0, 1.0, 0.0]])
    assert margin_of(flat, np.zeros(3), -np.ones(2), np.ones(2))[0] == 0.0
    assert margin_of(flat, np.array([0.3, 0.2, 0.25]), -np.ones(2), np.ones(2))[0] == -0.25


@pytest.mark.parametrize(
    ("lower", "upper", "error", "message"),
    [
        (np.nan, 1.0, ep.InvalidInput, "NaN"),
        (0.0, np.nan, ep.InvalidInput, "NaN"),
        (np.inf, np.inf, ep.InvalidInput, "below"),
        (-np.inf, -np.inf, ep.InvalidInput, "above"),
        (0.0, 1e300, ep.InvalidInput, "infinite or at most"),
        (-1e300, 0.0, ep.InvalidInput, "infinite or at most"),
        (np.zeros(4), 1.0, ep.InvalidInput, "broadcast"),
        (0.0, np.zeros((3, 3)), ep.InvalidInput, "broadcast"),
        ([0.0, np.nan, 0.0], 1.0, ep.InvalidInput, "NaN"),
        (0.0, [1.0, np.nan, 1.0], ep.InvalidInput, "NaN"),
        ([0.0, np.inf, 0.0], np.inf, ep.InvalidInput, "below"),
        (-np.inf, [1.0, -np.inf, 1.0], ep.InvalidInput, "above"),
        (0.0, [1.0, 1e300, 1.0], ep.InvalidInput, "infinite or at most"),
        ([0.0, -1e300, 0.0], 1.0, ep.InvalidInput, "infinite or at most"),
        ("low", 1.0, ep.InvalidInput, "limits"),
        ([0.0, 2.0, 0.0], 1.0, ep.InfeasibleBounds, "1"),
    ],
)
def test_bounds_that_are_none_are_refused(lower, upper, error, message):
    with pytest.raises(error, match=message):
        force_bounds("limits", lower, upper, (2,), 3)


def test_bounds_are_spread_over_the_stack():
    low, high = force_bounds("limits", -1.0, [1.0, np.inf, 3.0], (2, 2), 3)
    np.testing.assert_array_equal(low, np.full((4, 3), -1.0))
    np.testing.assert_array_equal(high, np.tile([1.0, np.inf, 3.0], (4, 1)))
    assert force_bounds("limits", 1.0, 1.0, (), 3)[0].shape == (1, 3)


def test_limbs_whose_bounds_cross_in_any_pose_are_named_once():
    lower, upper = np.zeros((4, 3)), np.ones((4, 3))
    lower[1, 2] = lower[3, 2] = 2.0
    with pytest.raises(ep.InfeasibleBounds) as told:
        force_bounds("limits", lower, upper, (4,), 3)
    assert told.value.limbs == (2,)


@pytest.mark.parametrize("size", [1e-4, 1e4])
@pytest.mark.parametrize("tilt", [0.0, 1e-10])
def test_margins_have_no_unit_of_length(size, tilt):
    """A limb without a limit that leaves a face by 1e-10 of its arm holds any moment across it, one in the face none.

    Two arms that differ by as much span a face.
    """
    arms = np.array([[1.0, 0.0, 0.0], [0.0, 1.0, 0.0], [0.6, 0.8, tilt], [0.0, 0.0, -1.0]])
    lower, upper = np.array([-np.inf, -np.inf, 0.0, 0.0]), np.array([np.inf, np.inf, np.inf, 1.0])
    moment = np.array([0.7, 0.5, 0.3])
    margin, direction, _, high = margin_of(arms, moment, lower, upper)
    scaled, along, _, higher = margin_of(size * arms, size * moment, lower, upper)
    assert scaled == pytest.approx(size * margin, rel=1e-6)
    np.testing.assert_allclose(along, direction, atol=1e-9)
    np.testing.assert_allclose(higher, high, rtol=1e-6)
    # Upwards there is the third limb alone; downwards the fourth, with a moment of 1.
    assert margin == pytest.approx(1.3 if tilt > 0.0 else -0.3, rel=1e-9)
    near = np.array([[1.0, 0.0, 0.0], [1.0, 1e-10, 0.0], [0.0, 0.0, 1.0], [0.0, 0.0, -1.0]])
    ours, theirs = (
        margin_of(factor * near, factor * np.array([0.5, 0.2, 0.0]), np.zeros(4), np.ones(4))[0]
        for factor in (1.0, size)
    )
    assert theirs == pytest.approx(size * ours, rel=1e-4)
    assert ours == pytest.approx(-0.2, rel=1e-4)
    # Above the plane of the two is what the third cannot hold: no other face tells.
    for factor in (1.0, size):
        above = margin_of(factor * near, factor * np.array([0.5, 0.0, 1.5]), np.zeros(4), np.ones(4))[0]
        assert above == pytest.approx(-0.5 * factor, rel=1e-4)
