"""Results of a search."""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING

from ...core.records import Record
from ...core.results import Result, drawn
from ...core.tables import filled
from ..device_values import mass_words
from .recheck import Recheck
from .stored_study import SearchRun

if TYPE_CHECKING:
    from matplotlib.figure import Figure

    from ...exo.shoulder_exo import ShoulderExo


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
            lines += self._beside_start()
        for candidate in self.front:
            found = ", ".join(f"{name} {candidate.objectives[name]:.4g}" for name in self.objectives)
            works = ": the design works" if candidate.works else ""
            name = "The start" if candidate.run.number < 0 else f"Run {candidate.run.number}"
            lines += ["", f"{name} ({found} on the full grid){works}."]
            lines += ["\n\n".join(str(check) for check in candidate.checks), filled(mass_words(candidate.design))]
        return "\n".join(lines)

    def _beside_start(self) -> list[str]:
        """Further objectives of the best design beside those of the start."""
        if self.start is None:
            return []
        start, best = self.start.objectives, self.best_candidate.objectives
        others = [name for name in self.objectives if name != "index"]
        return [f"{name}: {start[name]:.4g} of the start, {best[name]:.4g} of the best." for name in others]
