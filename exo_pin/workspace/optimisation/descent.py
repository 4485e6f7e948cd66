"""One run of CMA-ES from a start drawn at random, which can be stopped and taken up again.

CMA-ES (N. Hansen, The CMA Evolution Strategy: a Tutorial, arXiv 1604.00772) is the package ``cmaes``. Its state is
small and can be pickled, so a run that is broken off continues where it was stored, with the same numbers to
rounding.
"""

from __future__ import annotations

import base64
import pickle
from collections.abc import Callable
from importlib import import_module
from typing import Any

import numpy as np

from ...core.errors import MissingExtra
from ...core.records import OneProcess
from ...core.validation import FloatArray
from .merit import Merit

__all__ = ["Descent"]

#: First step of a run, as a share of the range of every variable: from a random start, and from a design.
_STEP, _FINE_STEP = 0.3, 0.1
#: Designs of a generation.
_GENERATION = 24


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
    state : str, optional
        Of a run that was broken off: what :meth:`stored` gave.
    start : ndarray, optional
        Point of the unit cube, shape (k,), where to start; drawn at random if left out.
    """

    _instead = "send what stored() gives, and take the run up from there"

    def __init__(
        self,
        merit: Merit,
        weights: dict[str, float],
        seed: tuple[int, ...],
        state: str | None = None,
        start: FloatArray | None = None,
    ) -> None:
        self._merit, self._weights, self._seed = merit, weights, seed
        if state is not None:
            self._search, self.best, self.value, self.done = pickle.loads(base64.b64decode(state))
            return
        try:
            cma: Any = import_module("cmaes")
        except ImportError as error:
            raise MissingExtra("optimise", "cmaes") from error
        numbers = np.random.default_rng(seed)
        count = merit.variables.count
        mean = numbers.uniform(0.0, 1.0, count) if start is None else np.array(start)
        step = _STEP if start is None else _FINE_STEP
        self._search = cma.CMA(mean=mean, sigma=step, seed=int(numbers.integers(2**31)), population_size=_GENERATION)
        self.best, self.value, self.done = mean, np.inf, 0

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
                self.best, self.value = np.array(points[least]), values[least]
            if go_on is not None and not go_on():
                return False
        return True

    def stored(self) -> str:
        """The state as text."""
        return base64.b64encode(pickle.dumps((self._search, self.best, self.value, self.done))).decode()
