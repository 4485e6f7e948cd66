"""What single limbs have to do, and where single limbs can be."""

import numpy as np
import pytest
from scipy.spatial.transform import Rotation

import exo_pin as ep
from exo_pin.core.errors import InvalidInput, MissingData
from exo_pin.workspace import BodyShape, Criteria, limb_places, limb_table
from exo_pin.workspace.limb_table import fork_tilt, smallest_cone

BODY = BodyShape.from_height(1.75)
ARM = ep.Arm.from_anthropometry(1.75, 75, sex="male")
LIMITS = Criteria(least_tension=5.0, largest_shoulder_force=120.0, body=BODY, least_gap=0.012)


def cone(half, count, seed):
    """Directions in a cone of given half opening about a random axis, some of them on its edge."""
    rng = np.random.default_rng(seed)
    angle = np.concatenate([rng.uniform(0.0, half, count), [half] * 20])
    around = rng.uniform(0.0, 2.0 * np.pi, len(angle))
    around[-20:] = np.linspace(0.0, 2.0 * np.pi, 20)
    rows = np.stack([np.sin(angle) * np.cos(around), np.sin(angle) * np.sin(around), np.cos(angle)], axis=-1)
    turn = Rotation.random(rng=rng)
    return turn.apply(rows), turn.apply([0.0, 0.0, 1.0])


@pytest.mark.parametrize("half", [0.02, 0.5, 1.5])
def test_smallest_cone(half):
    directions, axis = cone(half, 3000, 1)
    found, opening = smallest_cone(directions)
    assert opening == pytest.approx(half, abs=1e-6)
    np.testing.assert_allclose(found, axis, atol=1e-4)


def test_smallest_cone_of_few_directions():
    # Three axes: the cone about (1, 1, 1).
    axis, opening = smallest_cone(np.eye(3))
    np.testing.assert_allclose(axis, np.full(3, 3**-0.5), atol=1e-12)
    assert np.cos(opening) == pytest.approx(3**-0.5)
    assert smallest_cone(np.array([[0.0, 0.0, 1.0]]))[1] == pytest.approx(0.0, abs=1e-6)
    assert smallest_cone(np.vstack([np.eye(3), -np.eye(3)]))[1] == np.pi


def test_fork_across_the_directions_needs_no_tilt():
    around = np.linspace(0.0, 2.0 * np.pi, 500)
    level = np.stack([np.cos(around), np.sin(around), np.zeros(500)], axis=-1)
    turn = Rotation.random(rng=np.random.default_rng(2))
    axis, tilt = fork_tilt(turn.apply(level))
    assert tilt < np.radians(4.0)
    assert abs(axis @ turn.apply([0.0, 0.0, 1.0])) > np.cos(np.radians(4.0))
    # Directions 0.6 rad out of the plane on both sides need that tilt.
    both = np.concatenate([level * np.cos(0.6) + [0, 0, np.sin(0.6)], level * np.cos(0.6) - [0, 0, np.sin(0.6)]])
    assert 0.6 - 1e-9 < fork_tilt(both)[1] < 0.6 + np.radians(4.0)


def test_limb_table_adds_up_to_the_workspace():
    exo = ep.load("four-cables")
    found = exo.workspace(10.0, LIMITS)
    table = limb_table(exo.mechanism, found)
    np.testing.assert_array_equal(table["used_from_m"], found.lengths[found.inside].min(axis=0))
    np.testing.assert_array_equal(table["force_to_N"], found.tensions[found.inside].max(axis=0))
    assert (table["used_from_m"] >= table["stroke_from_m"]).all()
    assert (table["used_to_m"] <= table["stroke_to_m"]).all()
    gaps = np.stack([table[f"gap_{name}_m"] for name in ("arm", "torso", "limbs")], axis=-1)
    np.testing.assert_allclose(gaps.min(axis=0), found.gaps[found.inside].min(axis=0), atol=1e-12)
    # A pair has one distance, so the least one occurs twice.
    assert np.sort(gaps[:, 2])[0] == pytest.approx(np.sort(gaps[:, 2])[1])
    with pytest.raises(InvalidInput, match="workspace of 3 limbs, got one of 4"):
        limb_table(ep.load("prototype").mechanism, found)
    with pytest.raises(InvalidInput, match="poses inside"):
        limb_table(exo.mechanism, exo.workspace(20.0, LIMITS.replace(largest_shoulder_force=0.1)))


def places(family, far, **options):
    actuator = ep.Actuator(family, pull_limit=400.0, push_limit=400.0 if family == "linear" else None)
    return limb_places(actuator, ARM, Criteria(body=BODY), (0.12, far), count=2048, step=30.0, **options)


def test_every_limb_of_a_design_that_works_passes():
    """The necessary condition is necessary: at the places of a design's own limbs nothing fails."""
    exo = ep.load("four-cables")
    for a, b in zip(exo.geometry.base_points, exo.geometry.platform_points, strict=True):
        radius, drop = np.hypot(b[0], b[1]), -b[2]
        near = [(value - 1e-6, value + 1e-6) for value in (np.linalg.norm(a), radius, drop)]
        # Only the two directions are drawn: of many some come close to the design's.
        found = limb_places(exo.limbs[0].actuator, ARM, Criteria(body=BODY), *near, count=2048, step=30.0)
        assert found.best_share > 0.8
        directions = found.base_points / np.linalg.norm(found.base_points, axis=1)[:, None]
        assert (directions @ a / np.linalg.norm(a)).max() > 0.9


def test_longer_muscles_fit_at_more_places():
    near, far = places("pneumatic muscle", 0.3), places("pneumatic muscle", 0.8)
    assert near.within_stroke < far.within_stroke
    assert near.passing == 0.0
    assert near.held == 0.0
    assert far.best_share > 0.8
    assert (far.shares >= 0.8).all()
    # A cable takes any length, so only clearance is left.
    assert places("cable", 0.3).passing > 0.01


def test_the_best_share_is_that_of_any_place_whether_or_not_it_passes():
    strict, lenient = places("pneumatic muscle", 0.3), places("pneumatic muscle", 0.3, share=1e-6)
    assert len(strict.shares) == 0
    assert strict.best_share == lenient.best_share == lenient.shares.max()
    assert strict.best_share > 0.5


def test_limbs_that_push_hold_what_pulling_ones_do_not():
    cable, linear = places("cable", 0.5, share=0.9), places("linear", 0.5, share=0.9)
    assert linear.within_stroke < cable.within_stroke
    assert 0.0 < linear.held <= 1.0
    assert str(linear.examined) in str(linear)


def test_places_are_drawn_within_their_bounds_and_the_seed_decides():
    first, again = places("cable", 0.4, seed=3), places("cable", 0.4, seed=3)
    np.testing.assert_array_equal(first.base_points, again.base_points)
    radius = np.linalg.norm(first.base_points, axis=1)
    assert ((radius >= 0.12) & (radius <= 0.4)).all()
    assert ((first.platform_points[:, 2] <= -0.08) & (first.platform_points[:, 2] >= -0.28)).all()
    right = limb_places(
        ep.Actuator("cable", pull_limit=400.0), ARM.mirrored(), Criteria(body=BodyShape.from_height(1.75, "right")),
        (0.12, 0.4), count=2048, step=30.0, side="right", seed=3,
    )  # fmt: skip
    np.testing.assert_allclose(right.base_points * [1, -1, 1], first.base_points, atol=1e-12)


def test_places_need_a_body_and_a_share():
    with pytest.raises(MissingData, match="body"):
        limb_places(ep.Actuator("cable"), ARM, Criteria())
    with pytest.raises(InvalidInput, match="share"):
        limb_places(ep.Actuator("cable"), ARM, Criteria(body=BODY), share=1.5)
    wrong = ({"count": 2.5}, {"count": "many"}, {"seed": -1}, {"base_radius": (0.5, 0.1)}, {"platform_radius": (-1, 1)})
    for options in wrong:
        with pytest.raises(InvalidInput, match=f"expected {next(iter(options))}"):
            limb_places(ep.Actuator("cable"), ARM, Criteria(body=BODY), **options)


@pytest.mark.full
@pytest.mark.parametrize(("far", "passing", "held"), [(0.4, 0, 0.0), (0.5, 11, 0.286)])
def test_no_muscles_in_line_on_a_frame_of_half_a_metre(far, passing, held):
    """The figures of docs/workspace.md: 65,536 places of a limb."""
    arm = ep.load("four-cables").arm
    found = limb_places(ep.Actuator("pneumatic muscle"), arm, Criteria(body=BODY), (0.12, far), count=65_536)
    assert len(found.shares) == passing
    assert found.held == pytest.approx(held, abs=5e-4)
