"""Which designs of a search are reported: judged on the full grid by the objectives that were asked for.

A search judges on few poses; what is best there may be worse on the full grid than another run, or than the start.
"""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any

import numpy as np

from ...core.records import Record
from ..criteria import Criteria
from ..device_values import mass_of
from ..query import workspace
from .contact_objective import ContactObjective
from .merit import OBJECTIVES, Evaluation, judged
from .search_poses import Centre


class FullGrid(Record):
    """Merit and objectives of a design on the full grid.

    Parameters
    ----------
    criteria : Criteria
        What a pose must meet; those of a grid ("connected") count here.
    centres : tuple of CentreOffset, CentrePath or None
        Every pose counts once with each; the index is the least of them.
    weights : dict of str to float
        Of the objectives beside the coverage, in the merit.
    contact : ContactObjective, optional
        Needed for the objective "contact_force", which is that of its own poses.
    step : float
        Of the grid, degrees.
    """

    def __init__(
        self,
        criteria: Criteria,
        centres: tuple[Centre, ...],
        weights: dict[str, float],
        contact: ContactObjective | None = None,
        step: float = 4.0,
    ) -> None:
        self._criteria, self._centres, self._weights, self._contact = criteria, centres, weights, contact
        self._step = step

    def evaluate(self, mechanism: Any) -> Evaluation:
        """Merit and objectives of a design as it is."""
        found = [workspace(mechanism, self._step, self._criteria, centre_offset=centre) for centre in self._centres]
        margins = {name: np.concatenate([each.margins[name].ravel() for each in found]) for name in found[0].margins}
        force = np.concatenate([each.magnitude.ravel() for each in found])
        others = {
            "contact_force": float("nan") if self._contact is None else self._contact.exact(mechanism),
            "device_mass": mass_of(mechanism),
        }
        share = np.full(force.size, 1.0 / force.size)
        merit, objectives = judged(margins, force, share, self._criteria, others, self._weights)
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

    if objectives == ("index",):
        return [min(numbers, key=by_index)] if designs else []
    if len(objectives) == 1:
        return [min(numbers, key=lambda number: (designs[number].merit, is_run[number]))] if designs else []
    from ...study import non_dominated

    table = {name: np.array([each.objectives[name] for each in designs]) for name in objectives}
    largest = [name for name in objectives if OBJECTIVES[name]]
    smallest = [name for name in objectives if not OBJECTIVES[name]]
    on_front = np.flatnonzero(non_dominated(table, largest, smallest)).tolist()
    # Without a pose inside, forces and margins are NaN.
    return sorted(on_front or [min(numbers, key=by_index)], key=by_index)
