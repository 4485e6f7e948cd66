"""The plant in time: from instant to instant at which a valve, the controller, a fault or a sample asks for a stop."""

from __future__ import annotations

from collections.abc import Iterator

import numpy as np

from ....core.errors import InvalidInput
from ....core.progress import track
from ....core.validation import FloatArray
from ..equations.integrator import DONE, TOO_SMALL, advance
from ..equations.plant_kernels import Tables
from ..run import Run
from .drive_schedule import SAME, DriveSchedule
from .scenario import Instant, Loop, Scenario, first_state

__all__ = ["simulate_minimal"]

#: Units of the state in which its tolerances are equal: rad, rad/s, Pa, 1, J, kg, m, m/s.
_UNITS = {
    "turn": 1.0, "speed": 1.0, "pressure": 1e4, "bristle": 1.0, "energy": 1.0, "air": 1e-5, "position": 0.1,
    "drive speed": 0.1,
}  # fmt: skip
_FIRST_STEP = 1e-5


def _tolerances(tables: Tables, rtol: float) -> FloatArray:
    """Absolute tolerances of the state, shape (size,)."""
    u, n, motors = _UNITS, len(tables.base), tables.motors[:, 0]
    parts = [(3, "turn"), (3, "speed"), (n, "pressure"), (n + 3, "bristle"), (1, "pressure"), (3 * n + 1, "energy")]
    parts += [(2, "air"), (n, "drive speed"), (n, "energy")]
    atol = rtol * np.concatenate([np.full(count, u[name]) for count, name in parts])
    atol[6 : 6 + n][motors > 0.0] = rtol * u["position"]
    return atol


def simulate_minimal(scenario: Scenario) -> Run:
    """See :meth:`exo_pin.control.plant.plant.Plant.simulate`."""
    plant, start = scenario.plant, scenario.start
    if not plant.mechanism.limbs_are_massless:
        raise InvalidInput('minimal coordinates are for massless limbs, and these have mass: use method="chain"')
    q, y, loop = start.orientation.as_quat(), first_state(plant, start), Loop(scenario)
    atol = _tolerances(plant.tables, scenario.rtol)
    status, step, steps, before, flows = "completed", _FIRST_STEP, 0, 0.0, loop.schedule.flows(0.0)
    for instant in track(_instants(scenario, loop.schedule), "simulating", scenario.progress):
        time = instant.time
        if time > 0.0:
            ended, taken, step, left = advance(plant.tables, flows, q, y, time - before, step, scenario.rtol, atol)
            steps += taken
            if ended != DONE:
                reason = "steps would have to be too small" if ended == TOO_SMALL else "the motion is not finite"
                status = f"stopped at {time - left:.6g} s: {reason}"
                break
        before = time
        flows = loop.at(instant, q, y)
    return loop.run(status, steps)


def _instants(scenario: Scenario, schedule: DriveSchedule) -> Iterator[Instant]:
    """Those known beforehand, and those at which a valve switches."""
    time = 0.0
    for instant in scenario.instants():
        while instant.time > 0.0 and (switch := schedule.next_switch(time)) < instant.time - SAME:
            time = switch
            yield Instant(time)
        time = instant.time
        yield instant
