"""Closing: how fast, how far, within which limits, from where again."""

import dataclasses
import time

import numpy as np
import pinocchio as pin
import pytest
from closed_chains import CHAINS, NAMED, off
from exchanged_closures import turned
from mechanisms import five_bar

from exo_pin import BeyondLimits, InvalidInput, LoopNotClosed, UnknownName
from exo_pin.chain import ClosedChain
from exo_pin.core import errors


@pytest.fixture(params=CHAINS)
def case(request):
    return CHAINS[request.param]


def test_ten_steps_are_enough_from_0_3_rad_off(case):
    chain, q = case
    rng = np.random.default_rng(0)
    for _ in range(30):
        closed = chain.close(off(chain, q, rng, 0.3), max_iterations=10, restarts=0)
        assert np.abs(chain.residual(closed)).max() <= 1e-12


@pytest.mark.parametrize("tolerance", [1e-2, 1e-6, 1e-10])
def test_every_method_takes_what_is_closed(case, tolerance):
    """However large the tolerance: one that other functions refuse counts as theirs."""
    chain, q = case
    closed = chain.close(off(chain, q, np.random.default_rng(2), 0.02), tolerance=tolerance)
    assert np.abs(chain.residual(closed)).max() <= min(tolerance, 1e-8)
    assert chain.mobility(closed, actuated=()).rank <= chain.row_count
    assert chain.project_velocity(closed, np.ones(chain.model.nv)).shape == (chain.model.nv,)


def test_ten_steps_are_enough_with_the_actuators_held():
    rng = np.random.default_rng(1)
    for name in ("four_bar", "five_bar", "3rrr", "delta", "delta-universal", "delta-rigid", "stewart"):
        chain, q = CHAINS[name]
        hold = chain.roles.actuated
        for _ in range(30):
            start = off(chain, q, rng, 0.3, hold)
            closed = chain.close(start, hold=hold, max_iterations=10, restarts=0)
            assert np.abs(chain.residual(closed)).max() <= 1e-12
            for joint in hold:
                part = chain.configuration_slice(joint)
                np.testing.assert_array_equal(closed[part], start[part])


def test_moving_one_slide_of_the_free_flying_wrist_far_needs_new_starts():
    chain, q = CHAINS["wrist-wrist"]
    slide = chain.roles.actuated[0]
    stuck = 0
    for seed in range(20):
        start = off(chain, q, np.random.default_rng(seed), 0.3, [slide])
        start[chain.configuration_slice(slide)] += 0.05
        try:
            chain.close(start, hold=[slide], restarts=0)
        except LoopNotClosed:
            stuck += 1
        closed = chain.close(start, hold=[slide])
        assert np.abs(chain.residual(closed)).max() <= 1e-12
        np.testing.assert_array_equal(closed, chain.close(start, hold=[slide]))
    assert stuck > 0  # otherwise this test shows nothing


def test_new_starts_do_not_close_what_cannot_close():
    chain, q = CHAINS["five_bar"]
    apart = q.copy()
    apart[0], apart[2] = np.pi, 0.0
    begun = time.process_time()
    with pytest.raises(LoopNotClosed) as caught:
        chain.close(apart, hold=chain.roles.actuated)
    assert time.process_time() - begun < 5.0  # a bound on being caught in a circle, not on speed
    assert caught.value.residual == pytest.approx(0.05, abs=1e-3)
    assert caught.value.residual == pytest.approx(np.abs(chain.residual(caught.value.q)).max())


def limited(joint, lower, upper):
    named = five_bar()
    chain = named.chain()
    index = chain.configuration_slice(joint)
    chain.model.lowerPositionLimit[index] = lower
    chain.model.upperPositionLimit[index] = upper
    return chain, named.q


def test_limits_are_respected():
    # At rest the left crank stands at 126.87°; it may not go there.
    chain, q = limited("left_crank_hinge", -1.0, 2.0)
    assert chain.beyond_limits(q) == ("left_crank_hinge",)
    rng = np.random.default_rng(3)
    for _ in range(20):
        start = off(chain, q, rng, 0.2)
        closed = chain.close(start, respect_limits=True)
        assert chain.beyond_limits(closed) == ()
        assert np.abs(chain.residual(closed)).max() <= 1e-12
    assert 1.9 < chain.close(q, respect_limits=True)[0] <= 2.0
    assert chain.close(q)[0] == q[0]


def test_limits_that_forbid_every_closed_configuration_are_reported():
    chain, q = limited("left_forearm_hinge", -1.0, -0.5)
    hold = chain.roles.actuated
    with pytest.raises(BeyondLimits) as caught:
        chain.close(q, hold=hold, respect_limits=True)
    assert caught.value.joints == ("left_forearm_hinge",)
    np.testing.assert_allclose(caught.value.q, q, atol=1e-10)
    # A held joint outside its limits cannot be brought inside.
    chain, q = limited("left_crank_hinge", -1.0, 2.0)
    with pytest.raises(BeyondLimits, match="left_crank_hinge"):
        chain.close(q, hold=["left_crank_hinge"], respect_limits=True)


def test_endless_hinges_and_quaternions_have_no_limits():
    chain, q = CHAINS["wrist-whole"]
    assert set(chain.beyond_limits(q)) <= set(chain.roles.actuated)
    far = q.copy()
    far[chain.configuration_slice("limb_1_slide")] = 5.0
    assert chain.beyond_limits(far) == ("limb_1_slide",)


def test_axes_that_point_against_each_other_are_not_closed():
    # A hinge's pin put in the wrong way round: the axes are parallel, but it is half a turn off.
    _, q = CHAINS["3rrr"]
    urdf = NAMED["3rrr"].urdf
    closures = NAMED["3rrr"].closures

    first = closures.closures[0]
    wrong = dataclasses.replace(first, placement_a=turned(first.placement_a, (1.0, 0.0, 0.0, 0.0)))
    flipped = ClosedChain.from_urdf(urdf, dataclasses.replace(closures, closures=(wrong, *closures.closures[1:])))
    assert np.abs(flipped.residual(q)).max() == pytest.approx(np.pi)
    with pytest.raises(LoopNotClosed):
        flipped.close(q)


def test_a_distance_closure_with_coinciding_points_opens_up():
    chain, q = CHAINS["loop-distance"]
    (closure,) = chain.closures
    ends = [chain.placement(q, closure.frame_a), chain.placement(q, closure.frame_b)]
    assert chain.residual(q) == pytest.approx(0.0, abs=1e-15)

    # Put both ends at one point of the world.
    local = ends[1].actInv(ends[0] * pin.SE3(np.eye(3), np.array(closure.placement_a.translation)))
    here = dataclasses.replace(
        closure, placement_b=dataclasses.replace(closure.placement_b, translation=tuple(local.translation))
    )
    joined = ClosedChain.from_urdf(
        NAMED["loop-distance"].urdf, dataclasses.replace(chain.description, closures=(here,))
    )
    assert joined.residual(q) == pytest.approx(-0.3, abs=1e-12)
    assert np.isfinite(joined.constraint_jacobian(q)).all()
    assert np.abs(joined.residual(joined.close(q))).max() <= 1e-12


@pytest.mark.parametrize("bad", [{"tolerance": 0.0}, {"tolerance": np.nan}, {"tolerance": -1.0}])
def test_bad_settings_are_refused(bad):
    chain, q = CHAINS["five_bar"]
    with pytest.raises(InvalidInput):
        chain.close(q + 0.1, **bad)
    with pytest.raises(UnknownName):
        chain.close(q, hold=["elbow"])


def test_a_stack_is_closed_as_its_samples_are(case):
    chain, q = case
    rng = np.random.default_rng(3)
    hold = list(chain.roles.actuated)[:1]
    starts = np.array([q, *(off(chain, q, rng, 0.2, hold) for _ in range(11))])
    for options in ({}, {"hold": hold}, {"tolerance": 1e-9, "restarts": 0}):
        alone = np.array([chain.close(start, **options) for start in starts])
        np.testing.assert_allclose(chain.close(starts, **options), alone, rtol=0, atol=1e-14)


def test_samples_that_do_not_close_are_named_and_spoil_no_other(capsys):
    chain, q = CHAINS["five_bar"]
    rng, cranks = np.random.default_rng(4), chain.velocity_indices(chain.roles.actuated)
    starts = np.array([off(chain, q, rng, 0.1) for _ in range(300)])
    whole = chain.close(starts, hold=chain.roles.actuated, progress=True)
    assert "closing" in capsys.readouterr().err
    # The tips of the cranks are too far from each other.
    starts[np.ix_([7, 280], cranks)] = 3.1, 0.0
    with pytest.raises(errors.SamplesFailed, match="2 of 300 samples failed: sample 7: the loops stay open") as caught:
        chain.close(starts, hold=chain.roles.actuated)
    assert list(caught.value.failures) == [7, 280]
    assert np.isnan(caught.value.result[[7, 280]]).all()
    others = np.setdiff1d(np.arange(300), [7, 280])
    np.testing.assert_array_equal(caught.value.result[others], whole[others])
    with pytest.raises(InvalidInput, match="finite"):
        chain.close(np.full((3, chain.model.nq), np.nan))
    assert chain.close(np.zeros((0, chain.model.nq))).shape == (0, chain.model.nq)


@pytest.mark.parametrize("name", ["restarts", "max_iterations"])
@pytest.mark.parametrize("count", [-1, 2.5, True, None])
def test_counts_of_steps_are_whole(name, count):
    chain, q = CHAINS["five_bar"]
    with pytest.raises(InvalidInput, match=f"expected {name} to be a whole number of 0 or more"):
        chain.close(q, **{name: count})
    assert np.abs(chain.residual(chain.close(q, **{name: np.int64(0)}))).max() < 1e-12
