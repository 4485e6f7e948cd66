"""The plant in time: from instant to instant at which the controller, a fault or a sample asks for a stop."""

from __future__ import annotations

from ....core.errors import InvalidInput, SolverFailed
from ....core.progress import track
from ..run import Run
from ..state import PlantState
from .minimal_simulation import MinimalMotion
from .scenario import Loop, RunInstant, Scenario


class PlantSimulation:
    """A motion, its controller and its record."""

    def __init__(self, scenario: Scenario) -> None:
        self.motion = MinimalMotion(scenario.plant, scenario.start, scenario.rtol)
        self.scenario, self.loop = scenario, Loop(scenario)

    def go(self) -> str:
        """Move from the first instant to the last, and return the status."""
        before = None
        for instant in track(self.scenario.instants, "simulating", self.scenario.progress):
            if before is not None:
                stopped = self.motion.advance(self.loop.schedule.pieces(before, instant.time))
                if stopped:
                    return stopped
            wrong = self._at(instant)
            if wrong and before is None:
                raise InvalidInput(wrong)
            if wrong:
                return f"stopped at {instant.time:.6g} s: {wrong}"
            before = instant.time
        return "completed"

    def _at(self, instant: RunInstant) -> str:
        """Call the controller and record where that is due; return what was wrong with the controller, or nothing."""
        loop, motion, time = self.loop, self.motion, instant.time
        q, y = motion.kinematics()
        now = loop.snapshot(time, q, y, motion.step) if instant.sample or instant.control else None
        wrong = loop.command(time, q, y) if instant.control else ""
        flows = loop.act(time)
        if now is not None and (instant.sample or wrong):
            loop.record(now, flows)
        return wrong

    def run(self) -> Run:
        """See :meth:`exo_pin.control.plant.plant.Plant.simulate`."""
        status = self.go()
        return self.loop.run(status, self.motion.steps)

    def stepped(self) -> PlantState:
        """See :meth:`exo_pin.control.plant.plant.Plant.step`."""
        status = self.go()
        if status != "completed":
            raise SolverFailed("step of the plant", float("inf"), status)
        return self.loop.snapshots[-1].state(self.scenario.plant.motors)
