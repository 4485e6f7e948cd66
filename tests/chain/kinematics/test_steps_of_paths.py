"""Steps along a path that loops follow: how many, when they are halved, and when they end; and edges of certainty."""

import numpy as np
import pytest
from mechanisms import five_bar, sliders

from exo_pin import InvalidInput, LoopNotClosed
from exo_pin.chain import CLOSED
from exo_pin.chain.dynamics.equations.equations_of_motion import CERTAIN, EXACT, STILL
from exo_pin.chain.dynamics.equations.motion_kernels import NUMBERS, ORDINARY, is_certain
from exo_pin.chain.kinematics import closing as paths
from exo_pin.chain.kinematics.closing import follow
from exo_pin.chain.kinematics.rank import RESOLVED

pytestmark = pytest.mark.usefixtures("plain")


class Line:
    """Configurations on a straight line in time, off the guesses by what is chosen, which fail where told to."""

    def __init__(self, fails=lambda fraction, start: False, jump=lambda fraction: 0.0):
        self.asked, self.fails, self.jump, self.done = [], fails, jump, 0.0

    def __call__(self, fraction, guess):
        self.asked.append(fraction)
        if self.fails(fraction, self.done):
            raise LoopNotClosed(guess, 1.0, 3)
        found = np.full(4, fraction + self.jump(fraction))
        if np.abs(found - guess).max() <= 0.5:
            self.done = fraction
        return found


def following(reach, line):
    state = five_bar().chain()._state
    return follow(state, np.zeros(4), reach, line)


@pytest.mark.parametrize(
    ("reach", "steps"), [(0.0, 1), (0.05, 1), (0.1, 1), (0.1001, 2), (0.35, 4), (1.0, 10), (3.14, 32)]
)
def test_a_path_takes_steps_of_at_most_a_tenth(reach, steps):
    line = Line()
    # One step of a whole unit is a jump; those of a fine path are not.
    if steps < 2:
        line = Line(jump=lambda fraction: -0.7 * fraction)
    found = following(reach, line)
    np.testing.assert_allclose(line.asked, np.arange(1, steps + 1) / steps, atol=1e-12)
    assert line.asked[-1] == 1.0
    np.testing.assert_allclose(found, 0.3 if steps < 2 else 1.0)


def test_a_step_that_fails_is_halved_and_the_ones_after_it_stay_so():
    line = Line(fails=lambda fraction, start: fraction - start > 0.3)
    following(0.2, line)
    np.testing.assert_allclose(line.asked, [0.5, 0.25, 0.5, 0.75, 1.0])


@pytest.mark.parametrize(("jump", "halved"), [(0.49, False), (0.51, True)])
def test_a_correction_of_half_a_radian_may_have_changed_the_branch(jump, halved):
    """The second step of four is off its guess, which has the rate of the first."""
    line = Line(
        jump=lambda fraction: jump if 0.4 < fraction < 0.6 and 0.5 in line.asked[-1:] and len(line.asked) < 3 else 0.0
    )
    try:
        following(0.4, line)
    except LoopNotClosed:
        pytest.fail("ended")
    assert (0.375 in line.asked) == halved


@pytest.mark.parametrize("length", [0.1, 10.0])
@pytest.mark.parametrize("share", [0.49, 0.51])
def test_corrections_of_slides_count_in_characteristic_lengths(length, share):
    state, asked = sliders(length).chain()._state, []

    def correct(target, guess):
        asked.append(target)
        return guess + (share * state.topology.length if len(asked) == 1 else 0.0)

    follow(state, np.zeros(3), 0.0, correct)
    assert asked[:2] == ([1.0] if share < 0.5 else [1.0, 0.5])


def test_a_path_ends_after_twelve_halvings():
    line = Line(fails=lambda fraction, start: True)
    with pytest.raises(LoopNotClosed):
        following(0.2, line)
    np.testing.assert_allclose(line.asked, 0.5 * 0.5 ** np.arange(13))


@pytest.mark.parametrize("far", [0.05, -0.35, 0.61])
def test_given_joints_go_their_way_in_equal_steps(far, monkeypatch):
    """Of two hinges the one that turns further counts; the path itself is that of the closed loop."""
    named = five_bar()
    chain, seen = named.chain(), []
    closing = paths.nearest_closed
    monkeypatch.setattr(paths, "nearest_closed", lambda state, q, *more: seen.append(q) or closing(state, q, *more))
    end = chain.forward_kinematics(
        named.q[[0, 2]] + [0.3 * far, far], named.q, ["left_crank_hinge", "right_crank_hinge"]
    )
    steps = int(np.ceil(abs(far) / 0.1))
    assert len(seen) == steps
    way = np.outer(np.arange(1, steps + 1) / steps, [0.3 * far, far])
    np.testing.assert_allclose(np.array(seen)[:, [0, 2]], named.q[[0, 2]] + way, atol=1e-12)
    np.testing.assert_allclose(end, chain.close(end, hold=["left_crank_hinge", "right_crank_hinge"]), atol=1e-12)


@pytest.mark.parametrize("length", [0.1, 10.0])
def test_slides_go_in_steps_of_a_tenth_of_the_characteristic_length(length, monkeypatch):
    named = sliders(length)
    chain, seen = named.chain(), []
    closing = paths.nearest_closed
    monkeypatch.setattr(paths, "nearest_closed", lambda state, q, *more: seen.append(q) or closing(state, q, *more))
    end = chain.forward_kinematics([0.35 * chain.characteristic_length], named.q, ["slide_both"])
    assert len(seen) == 4
    moved = [end[chain.configuration_slice(f"slide_{name}")][0] for name in ("x", "y", "both")]
    np.testing.assert_allclose(moved, 0.35 * chain.characteristic_length * np.array([0.6, 0.8, 1.0]), rtol=1e-9)


def test_positions_need_joints():
    named = five_bar()
    chain = named.chain()
    with pytest.raises(InvalidInput, match="joints="):
        chain.forward_kinematics([0.0], named.q, joints=[])


@pytest.mark.parametrize(
    ("place", "value", "certain"),
    [
        (0, CLOSED, True), (0, 1.01 * CLOSED, False), (4, STILL, True), (4, 1.01 * STILL, False), (5, STILL, True),
        (5, 1.01 * STILL, False), (3, 0.99 * ORDINARY, True), (3, ORDINARY, False), (3, np.nan, False),
        (8, EXACT, True), (8, 1.01 * EXACT, False), (9, 1.01 * CERTAIN, True), (9, CERTAIN, False), (2, 9e9, True),
    ],
)  # fmt: skip
def test_a_motion_is_certain_within_each_limit(place, value, certain):
    numbers = np.zeros(NUMBERS)
    numbers[9] = 1.0
    numbers[place] = value
    assert is_certain(numbers, 0.0) == certain
    assert not is_certain(numbers, 1e-6)


def test_limits_of_certainty_are_those_that_are_told():
    """At the square root a singular value's error by closed loops, CLOSED over itself, is RESOLVED of it."""
    assert pytest.approx(RESOLVED * CERTAIN) == CLOSED / CERTAIN
    assert (CLOSED, RESOLVED, EXACT, ORDINARY) == (1e-8, 1e-3, 1e-7, 1e6)
    assert pytest.approx(1e-9) == STILL
