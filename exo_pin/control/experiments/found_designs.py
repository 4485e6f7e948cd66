"""Experiments with the designs that the search found: cables on winches, linear actuators, cables that muscles pull.

The arm is a man's. References begin and end at rest, unlike those of the thesis, whose speed jumps: a drive that is
stiff would answer the jump with a blow. The shoulder has no friction, as none of a person's is known here.
"""

from __future__ import annotations

from collections.abc import Callable

from ...design import preset
from ..plant.faults import Fault
from ..plant.options import PlantOptions
from ..trajectories.reference import Trajectory
from ..trajectories.tasks import abduction, daily_task, flexion
from .experiment import Experiment

__all__ = ["FOUND_DESIGNS", "FOUND_MAKERS"]

#: Presets, and what verdicts call them.
FOUND_DESIGNS = {
    "four-cables": "four cables on winches",
    "four-linear-actuators": "four linear actuators",
    "three-linear-actuators": "three linear actuators",
    "four-muscle-cables": "four cables that muscles pull",
}
#: Of the hand-to-mouth-like task, s.
_TASK_TIME = 20.0
#: Second at which a drive fails.
_FAILURE = 2.5

_MOVEMENTS: dict[str, tuple[str, Callable[[], Trajectory]]] = {
    "abduction": ("abduction", lambda: abduction(law="minimum_jerk")),
    "flexion": ("flexion", lambda: flexion(law="minimum_jerk")),
    "hand-to-mouth": ("hand-to-mouth-like task", lambda: daily_task("feeding", _TASK_TIME)),
}
_FAULTS: dict[str, tuple[str, Fault]] = {
    "four-cables-torn": ("cable 1 breaks", Fault("torn", 0, start=_FAILURE)),
    "four-cables-no-current": ("motor 1 without current", Fault("no current", 0, start=_FAILURE)),
    "four-cables-slipping-brake": (
        "motor 1 without current, brake slips", Fault("slipping brake", 0, start=_FAILURE, brake_force=20.0),
    ),
}  # fmt: skip
_SOURCE = "design of the workspace search (docs/workspace.md); drives are estimates"


def _made(name: str, design: str, movement: str, words: str = "", faults: tuple[Fault, ...] = ()) -> Experiment:
    title, reference = _MOVEMENTS[movement]
    source = _SOURCE if movement != "hand-to-mouth" else f"{_SOURCE}; the task is synthetic"
    whole = f"{title}, {FOUND_DESIGNS[design]}" + (f", {words}" if words else "")
    return Experiment(name, whole, preset(design), reference(), "model", PlantOptions(), faults=faults, source=source)


def _maker(design: str, movement: str) -> Callable[[str], Experiment]:
    return lambda name: _made(name, design, movement)


def _failing(words: str, fault: Fault) -> Callable[[str], Experiment]:
    return lambda name: _made(name, "four-cables", "abduction", words, (fault,))


#: Makers of the experiments, by name.
FOUND_MAKERS: dict[str, Callable[[str], Experiment]] = {
    f"{design}-{movement}": _maker(design, movement) for design in FOUND_DESIGNS for movement in _MOVEMENTS
} | {name: _failing(*given) for name, given in _FAULTS.items()}
