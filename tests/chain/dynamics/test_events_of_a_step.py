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


def step(position, speed, limits=None, friction=0.0):
    """The time of the first change in a step from 0 to 1 s."""
    state = slide(0.0, friction, limits=limits or (-np.inf, np.inf))._state
    rates = Rates(state, np.zeros(1), None, base=np.array([BASE]))
    rules = StopRules(limits_of(state.model) if limits else None, 0.0)
    found = EventIntegration(rates, rules)
    start = Instant(np.array([position(0.0)]), np.array([speed(0.0)]), 0.0, 0.0)
    if limits or friction:
        _, rates.mode, _ = settled(rates, 0.0, start, rules, {})
        found._floor = np.minimum(rules.gaps(state, start.q)[0], 0.0) - 1e-13
    return found._change(lambda time: np.array([position(time) - BASE, speed(time), 0.0, 0.0]), 0.0, 1.0)


@pytest.mark.parametrize(("limits", "at"), [((-9.0, 0.6), 0.6), ((-9.0, 1.5), None)])
def test_a_stop_ends_the_mode_where_it_is_reached(limits, at):
    change = step(lambda time: time, lambda time: 1.0, limits)
    assert change == (None if at is None else pytest.approx(at, abs=1e-12))


@pytest.mark.parametrize("sign", [1.0, -1.0])
def test_sliding_ends_where_it_turns(sign):
    change = step(lambda time: 0.0, lambda time: sign * (0.45 - time), friction=3.0)
    assert change == pytest.approx(0.45, abs=1e-9)
    change = step(lambda time: 0.0, lambda time: sign * (1.45 - time), friction=3.0)
    assert change is None


def test_very_short_steps_are_counted_from_none_and_from_step_to_step(monkeypatch):
    told = []

    def counted(solver, instant, short):
        told.append((short, taken(solver, instant, short) + 3))
        return told[-1][1]

    monkeypatch.setattr(event_integration, "taken", counted)
    found = slide(0.3).simulate([0.0], [0.0], [0.0, 0.3])
    assert len(told) == found.steps > 1
    assert [before for before, _ in told] == [0, *(after for _, after in told[:-1])]
