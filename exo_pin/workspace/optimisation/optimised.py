"""Results of a search."""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING

from ...core.records import Record
from .recheck import Recheck
from .stored_study import Run

if TYPE_CHECKING:
    from ...exo.shoulder_exo import ShoulderExo

__all__ = ["Candidate", "Optimised"]


@dataclass(frozen=True, eq=False)
class Candidate(Record):
    """A design that was found.

    Attributes
    ----------
    design : ShoulderExo
        With fitted strokes.
    run : Run
        That found it; its objectives are those on the coarse poses of the search.
    check : Recheck
        On the full grid.
    """

    design: ShoulderExo
    run: Run
    check: Recheck


@dataclass(frozen=True, eq=False)
class Optimised(Record):
    """What a search has found.

    Attributes
    ----------
    front : tuple of Candidate
        The design of least merit if there was one objective; else the Pareto front, the largest index first. If no run
        has values of all objectives, as without a pose inside, the design of the largest index, then of least merit.
    runs : tuple of Run
        All runs of the study.
    objectives : tuple of str
        By which they were compared.
    """

    front: tuple[Candidate, ...]
    runs: tuple[Run, ...]
    objectives: tuple[str, ...]

    @property
    def best(self) -> ShoulderExo:
        """The design with the largest Φ on the full grid."""
        return self.best_candidate.design

    @property
    def best_candidate(self) -> Candidate:
        """:attr:`best` with its run and its check."""
        return max(self.front, key=lambda candidate: candidate.check.workspace.index)

    @property
    def evaluations(self) -> int:
        """Designs that were evaluated."""
        return sum(run.evaluations for run in self.runs)

    def __str__(self) -> str:
        lines = [f"{len(self.runs)} runs, {self.evaluations} designs evaluated, {len(self.front)} reported."]
        for candidate in self.front:
            found = ", ".join(f"{name} {candidate.run.objectives[name]:.4g}" for name in self.objectives)
            works = ": the design works" if candidate.check.works else ""
            lines += ["", f"Run {candidate.run.number} ({found} on the poses of the search){works}."]
            lines += [str(candidate.check)]
        return "\n".join(lines)
