"""Results of a search. Which designs are reported is judged on the full grid by the objectives that were asked for.

A search judges on few poses; what is best there may be worse on the full grid than another run, or than the start.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from typing import TYPE_CHECKING, Any

import numpy as np

from ...core.records import Record
from ...core.results import Result, drawn
from ...core.tables import filled
from ..criteria import Criteria
from ..device_values import mass_of, mass_words
from ..query import workspace
from .merit import OBJECTIVES, Evaluation, judged
from .recheck import Recheck
from .search_poses import Centre, ContactObjective
from .stored_study import SearchRun

if TYPE_CHECKING:
    from matplotlib.figure import Figure

    from ...exo.shoulder_exo import ShoulderExo


def on_full_grid(
    device: Any,
    criteria: Criteria,
    centres: tuple[Centre, ...],
    weights: dict[str, float],
    contact: ContactObjective | None,
    step: float,
) -> Evaluation:
    """Merit and objectives of a device as it is, on the full grid.

    Parameters
    ----------
    device : Device
        The device.
    criteria : Criteria
        What a pose must meet; those of a grid ("connected") count here.
    centres : tuple of CentreOffset, CentrePath or None
        Every pose counts once with each; the index is the least of them.
    weights : dict of str to float
        Of the objectives beside the coverage, in the merit.
    contact : ContactObjective or None
        Needed for the objective "contact_force", which is that of its own poses.
    step : float
        Of the grid, degrees.
    """
    found = [workspace(device, step, criteria, centre_offset=centre) for centre in centres]
    margins = {name: np.concatenate([each.margins[name].ravel() for each in found]) for name in found[0].margins}
    force = np.concatenate([each.magnitude.ravel() for each in found])
    others = {"contact_force": np.nan if contact is None else contact.exact(device), "device_mass": mass_of(device)}
    merit, objectives = judged(margins, force, np.full(force.size, 1.0 / force.size), criteria, others, weights)
    return Evaluation(merit, objectives | {"index": min(each.index for each in found)})


def reported(designs: Sequence[Evaluation], objectives: tuple[str, ...], has_start: bool) -> list[int]:
    """Numbers of the best design by one objective, or of the Pareto front of several.

    By the index alone that of the largest index, then of least merit; by another one that of least merit, in which the
    coverage counts too. The first design is the start if there is one, and goes before a run that is as good.
    """
    numbers = range(len(designs))
    is_run = [not (has_start and number == 0) for number in numbers]

    def by_index(number: int) -> tuple[float, bool, float]:
        return -designs[number].objectives["index"], is_run[number], designs[number].merit

    if len(objectives) == 1:
        key = by_index if objectives == ("index",) else lambda number: (designs[number].merit, is_run[number])
        return sorted(numbers, key=key)[:1]
    from ...study import non_dominated

    table = {name: np.array([each.objectives[name] for each in designs]) for name in objectives}
    largest = [name for name in objectives if OBJECTIVES[name]]
    smallest = [name for name in objectives if not OBJECTIVES[name]]
    on_front = np.flatnonzero(non_dominated(table, largest, smallest)).tolist()
    # Without a pose inside, forces and margins are NaN.
    return sorted(on_front or [min(numbers, key=by_index)], key=by_index)


@dataclass(frozen=True, eq=False)
class Candidate(Record):
    """A design that was found.

    Attributes
    ----------
    design : ShoulderExo
        With fitted strokes.
    run : SearchRun
        That found it; its objectives are those on the coarse poses of the search.
    checks : tuple of Recheck
        On the full grid: one for each offset of the device's centre that the search was given, in that order.
    objectives : dict of str to float
        All objectives on the full grid, by name.
    """

    design: ShoulderExo
    run: SearchRun
    checks: tuple[Recheck, ...]
    objectives: dict[str, float]

    @property
    def check(self) -> Recheck:
        """The first check; the only one of a search with one offset or none."""
        return self.checks[0]

    @property
    def works(self) -> bool:
        """Whether the design works (:attr:`Recheck.works`) by every check."""
        return all(check.works for check in self.checks)

    @property
    def index(self) -> float:
        """Φ on the full grid, the least of all checks."""
        return min(check.workspace.index for check in self.checks)


@dataclass(frozen=True, eq=False)
class Optimised(Result):
    """What a search has found.

    Attributes
    ----------
    front : tuple of Candidate
        Judged on the full grid, with the start of a refinement as one of them: the design of the largest index; by
        another single objective that of least merit, in which the coverage counts, too; of several objectives the
        Pareto front, the largest index first. If no run has values of all objectives, as without a pose inside, the
        design of the largest index, then of least merit.
    runs : tuple of SearchRun
        All runs of the study.
    objectives : tuple of str
        By which they were compared.
    values : tuple of dict of str to float
        Objectives of the runs on the full grid, in the order of ``runs``.
    start : Candidate or None
        The design that a refinement was given, whose run has the number -1. It is among ``front`` where no run is
        better.
    stopped : bool
        Whether the search was interrupted by hand before its budget was used up.
    """

    front: tuple[Candidate, ...]
    runs: tuple[SearchRun, ...]
    objectives: tuple[str, ...]
    values: tuple[dict[str, float], ...]
    start: Candidate | None = None
    stopped: bool = False

    _hidden = frozenset({"front", "start"})

    @property
    def best(self) -> ShoulderExo:
        """The design with the largest Φ on the full grid; with several offsets the largest least one."""
        return self.best_candidate.design

    @property
    def best_candidate(self) -> Candidate:
        """:attr:`best` with its run and its check."""
        return max(self.front, key=lambda candidate: candidate.index)

    @property
    def evaluations(self) -> int:
        """Designs that were evaluated."""
        return sum(run.evaluations for run in self.runs)

    @property
    def spread(self) -> tuple[float, float]:
        """Least and largest share of the full grid that is inside, over the runs and their seeds."""
        shares = [each["index"] for each in self.values]
        return min(shares), max(shares)

    def plot(self) -> Figure:
        """Draw the runs and the front among them.

        Raises
        ------
        MissingExtra
            If matplotlib is not installed.
        """
        return drawn("angle_maps:front_figure", self)

    def __str__(self) -> str:
        runs = "1 run" if len(self.runs) == 1 else f"{len(self.runs)} runs"
        lines = [f"{runs}, {self.evaluations} designs evaluated, {len(self.front)} reported."]
        if len(self.runs) > 1:
            low, high = (100.0 * share for share in self.spread)
            lines.append(f"Inside on the full grid, over the runs: {low:.1f} to {high:.1f} %.")
        if self.stopped:
            lines.append("The search was stopped by hand: this is the best so far.")
        if self.start is not None:
            start, best = 100.0 * self.start.index, 100.0 * self.best_candidate.index
            kept = ", which is the start: no run was better" if self.best_candidate is self.start else ""
            lines.append(f"The start: {start:.1f} % of the full grid. The best: {best:.1f} %{kept}.")
            old, new = self.start.objectives, self.best_candidate.objectives
            others = [name for name in self.objectives if name != "index"]
            lines += [f"{name}: {old[name]:.4g} of the start, {new[name]:.4g} of the best." for name in others]
        for candidate in self.front:
            found = ", ".join(f"{name} {candidate.objectives[name]:.4g}" for name in self.objectives)
            works = ": the design works" if candidate.works else ""
            name = "The start" if candidate.run.number < 0 else f"Run {candidate.run.number}"
            lines += ["", f"{name} ({found} on the full grid){works}."]
            lines += ["\n\n".join(str(check) for check in candidate.checks), filled(mass_words(candidate.design))]
        return "\n".join(lines)
