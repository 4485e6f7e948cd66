"""One run of CMA-ES from a start drawn at random, which can be stopped and taken up again.

CMA-ES (N. Hansen, The CMA Evolution Strategy: a Tutorial, arXiv 1604.00772) is the package ``cmaes``. Its state is a
few arrays of numbers, so a run that is broken off continues where it was stored, with the same numbers to rounding.
"""

from __future__ import annotations

from collections.abc import Callable
from typing import Any

import numpy as np

from ...core.errors import InvalidInput
from ...core.errors.base import echo
from ...core.files.toml_tables import TomlTable
from ...core.optional_packages import optional
from ...core.records import OneProcess
from ...core.validation import FloatArray
from .merit import Merit

#: First step of a run, as a share of the range of every variable: from a random start, and from a design.
_STEP, _FINE_STEP = 0.3, 0.02
#: Designs of a generation.
GENERATION = 24
#: What changes during a search: name in a stored state, attribute of the package's record of itself, largest size.
#: cmaes itself ends a search whose steps exceed 1e4; paths have lengths about the root of the number of variables.
_STATE = {
    "mean": ("_mean", 1e6),
    "step": ("_sigma", 1e4),
    "covariance": ("_c_1d", 1e12),
    "step_path": ("_p_sigma", 1e3),
    "covariance_path": ("_pc", 1e12),
    "recent_values": ("_funhist_values", 1e12),
}


class Descent(OneProcess):
    """A run of CMA-ES.

    Parameters
    ----------
    merit : Merit
        What is made small.
    weights : dict of str to float
        Of the objectives in the merit.
    seed : sequence of int
        Of the run's random numbers.
    state : dict, optional
        Of a run that was broken off: what :meth:`stored` gave.
    start : ndarray, optional
        Point of the unit cube, shape (k,), where to start; drawn at random if left out.

    Raises
    ------
    MissingExtra
        If cmaes is not installed.
    InvalidInput
        If ``state`` is none of a search in so many variables.
    """

    _instead = "send what stored() gives, and take the run up from there"

    def __init__(
        self,
        merit: Merit,
        weights: dict[str, float],
        seed: tuple[int, ...],
        state: dict[str, Any] | None = None,
        start: FloatArray | None = None,
    ) -> None:
        self._merit, self._weights, self._seed = merit, weights, seed
        cma = optional("optimise", "cmaes")
        count = merit.variables.count
        mean = np.random.default_rng(seed).uniform(0.0, 1.0, count) if start is None else np.array(start)
        step = _STEP if start is None else _FINE_STEP
        # Its random numbers start afresh with every generation.
        self._search = cma.CMA(mean=mean, sigma=step, population_size=GENERATION)
        # cmaes does not fill what it has not reached yet, and does not read it.
        self._search._funhist_values.fill(0.0)
        self.best, self.value, self.done = mean, np.inf, 0
        if state is not None:
            self._take_up(TomlTable(state, None, "state"))

    def run(self, budget: int, go_on: Callable[[], bool] | None = None) -> bool:
        """Search until ``budget`` designs have been evaluated in all, or the search has come to rest.

        ``go_on`` is called after every generation; False from it ends the search and is what this method returns.
        """
        while self.done < budget and not self._search.should_stop():
            # The stored state has no random numbers: they start afresh with every generation, by its number.
            self._search.reseed_rng(int(np.random.default_rng((*self._seed, self.done)).integers(2**31)))
            points = [self._search.ask() for _ in range(self._search.population_size)]
            values = self._merit.generation(points, self._weights)
            self._search.tell(list(zip(points, values, strict=True)))
            self.done += len(points)
            least = int(np.argmin(values))
            if values[least] < self.value:
                # CMA-ES knows no bounds: the point of the unit cube that means the same design.
                space = self._merit.variables
                self.best, self.value = np.clip(space.point(space.values(points[least])), 0.0, 1.0), values[least]
            if go_on is not None and not go_on():
                return False
        return True

    def stored(self) -> dict[str, Any]:
        """The state as numbers and lists of numbers."""
        now = self._search.__getstate__()
        numbers = {name: np.asarray(now[attribute]).tolist() for name, (attribute, _) in _STATE.items()}
        return {**numbers, "best": self.best.tolist(), "value": float(self.value), "evaluations": self.done}

    def _take_up(self, state: TomlTable) -> None:
        """Go on from a stored state."""
        now = self._search.__getstate__()
        for name, (attribute, largest) in _STATE.items():
            now[attribute] = state.quantity("number", name, np.shape(now[attribute]))
            if np.abs(now[attribute]).max() > largest:
                raise state.error(f"expected numbers of at most {largest:g} in size", name)
        self.best, self.value = as_point(state, "best", len(self.best)), state.quantity("number", "value")
        self.done = state.integer("evaluations")
        state.finish()
        if self.done < GENERATION or self.done % GENERATION:
            raise state.error(f"expected a multiple of {GENERATION}, got {echo(self.done)}", "evaluations")
        self._search.__setstate__({**now, "_g": self.done // GENERATION})
        if now["_sigma"] <= 0.0 or np.diag(self._search._C).min() <= 0.0:
            raise InvalidInput("state: expected a step and variances above zero")


def as_point(table: TomlTable, key: str, count: int) -> FloatArray:
    """A point of the unit cube in a stored record, shape (count,)."""
    point: FloatArray = table.quantity("number", key, (count,))
    if point.min() < 0.0 or point.max() > 1.0:
        raise table.error("expected numbers from 0 to 1", key)
    return point
