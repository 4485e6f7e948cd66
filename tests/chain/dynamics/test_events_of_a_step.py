"""Events within one step whose motion is given: which are noticed, in which order, and when."""

import numpy as np
import pytest
from rubbing_chains import slide

from exo_pin.chain.dynamics.integration import Instant, Rates, taken
from exo_pin.chain.dynamics.nonsmooth import event_integration
from exo_pin.chain.dynamics.nonsmooth.event_integration import EventIntegration
from exo_pin.chain.dynamics.nonsmooth.settling import StopRules, settled
from exo_pin.chain.structure.motion_axes import limits_of

pytestmark = pytest.mark.usefixtures("plain")

BASE = 0.25


def event_of(function, direction=0, terminal=False):
    def event(time, q, v):
        return function(time, q[0], v[0])

    event.direction, event.terminal = direction, terminal
    return event


def step(position, speed, events=(), limits=None, friction=0.0):
    """The first change and the events of a step from 0 to 1 s."""
    state = slide(0.0, friction, limits=limits or (-np.inf, np.inf))._state
    rates = Rates(state, np.zeros(1), None, base=np.array([BASE]))
    rules = StopRules(limits_of(state.model) if limits else None, 0.0)
    found = EventIntegration(rates, rules, events)
    start = Instant(np.array([position(0.0)]), np.array([speed(0.0)]), 0.0, 0.0)
    if limits or friction:
        _, rates.mode, _ = settled(rates, 0.0, start, rules, {})
        found._floor = np.minimum(rules.gaps(state, start.q)[0], 0.0) - 1e-13
    return found._first(lambda time: np.array([position(time) - BASE, speed(time), 0.0, 0.0]), 0.0, 1.0, start)


@pytest.mark.parametrize("direction", [-1, 0, 1])
@pytest.mark.parametrize("rises", [True, False])
def test_a_crossing_counts_in_its_direction(direction, rises):
    sign = 1.0 if rises else -1.0
    crossing = event_of(lambda time, q, v: sign * (q - 0.7), direction)
    change, own = step(lambda time: time, lambda time: 1.0, [crossing])
    assert change is None
    if direction * sign < 0.0:
        assert own == []
        return
    (event,) = own
    assert (event.kind, event.joints, event.number) == ("event", (), 0)
    assert event.time == pytest.approx(0.7, abs=1e-12)


def test_events_come_in_the_order_of_their_times_until_a_terminal_one():
    at = (0.9, 0.52, 0.55, 0.3)
    events = [event_of(lambda time, q, v, k=k: q - at[k], terminal=k == 2) for k in range(4)]
    change, own = step(lambda time: time, lambda time: 1.0, events)
    assert [event.number for event in own] == [3, 1, 2]
    np.testing.assert_allclose([event.time for event in own], [0.3, 0.52, 0.55], atol=1e-12)
    assert (change.number, change.terminal) == (2, True)
    assert change.time == own[-1].time


def test_a_value_that_begins_at_zero_has_passed_and_one_that_ends_there_passes():
    ends = event_of(lambda time, q, v: time - 1.0)
    begins = event_of(lambda time, q, v: time)
    touches = event_of(lambda time, q, v: max(time, 0.5) - 0.5)
    _, own = step(lambda time: time, lambda time: 1.0, [ends, begins, touches])
    assert [(event.number, event.time) for event in own] == [(0, 1.0)]


def test_events_are_told_of_position_and_speed():
    fast = event_of(lambda time, q, v: v - 0.8)
    far = event_of(lambda time, q, v: q - 0.5 * 0.6**2)
    _, own = step(lambda time: 0.5 * time**2, lambda time: time, [fast, far])
    assert [event.number for event in own] == [1, 0]
    np.testing.assert_allclose([event.time for event in own], [0.6, 0.8], atol=1e-12)


@pytest.mark.parametrize(("limits", "at"), [((-9.0, 0.6), 0.6), ((-9.0, 1.5), None)])
def test_a_stop_ends_the_mode_where_it_is_reached(limits, at):
    seen = event_of(lambda time, q, v: q - 0.4), event_of(lambda time, q, v: q - 0.9)
    change, own = step(lambda time: time, lambda time: 1.0, seen, limits)
    if at is None:
        assert change is None
        assert len(own) == 2
        return
    assert (change.number, change.terminal) == (-1, False)
    assert change.time == pytest.approx(at, abs=1e-12)
    assert [event.number for event in own] == [0]


@pytest.mark.parametrize("sign", [1.0, -1.0])
def test_sliding_ends_where_it_turns(sign):
    change, _ = step(lambda time: 0.0, lambda time: sign * (0.45 - time), friction=3.0)
    assert change.time == pytest.approx(0.45, abs=1e-9)
    change, _ = step(lambda time: 0.0, lambda time: sign * (1.45 - time), friction=3.0)
    assert change is None


@pytest.mark.parametrize("end", [1e-3, 0.3])
def test_every_step_is_counted_and_looked_at_from_its_start_in_eight_parts(end):
    seen, chain = [], slide(0.3)
    found = chain.simulate([0.0], [0.0], [0.0, end], events=lambda time, q, v: seen.append(time) or 1.0)
    assert len(seen) == 9 * found.steps
    times = np.reshape(seen, (-1, 9))
    np.testing.assert_allclose(np.diff(times, axis=1), np.diff(times, axis=1)[:, :1] * np.ones(8), rtol=1e-6)
    np.testing.assert_array_equal(times[1:, 0], times[:-1, -1])
    assert (times[0, 0], times[-1, -1]) == (0.0, end)
    assert found.q[-1, 0] == pytest.approx(-0.5 * 9.81 * np.sin(0.3) * end**2)


def test_very_short_steps_are_counted_from_none_and_from_step_to_step(monkeypatch):
    told = []

    def counted(solver, instant, short):
        told.append((short, taken(solver, instant, short) + 3))
        return told[-1][1]

    monkeypatch.setattr(event_integration, "taken", counted)
    found = slide(0.3).simulate([0.0], [0.0], [0.0, 0.3])
    assert len(told) == found.steps > 1
    assert [before for before, _ in told] == [0, *(after for _, after in told[:-1])]


@pytest.mark.parametrize("at", [0.0, 0.3, 0.999, 1.0])
def test_bisection_finds_the_first_time_at_which_something_has_passed(at):
    found = EventIntegration._located(lambda time: time >= at, 0.0, 1.0)
    assert at <= found <= at + 1e-15
