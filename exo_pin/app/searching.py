"""A search for a better design, in a process of its own: started, watched and stopped from the page."""

from __future__ import annotations

import multiprocessing
import tempfile
import threading
import warnings
from collections.abc import Callable, Mapping
from dataclasses import dataclass
from multiprocessing.connection import Connection
from pathlib import Path
from typing import Any

from ..core.errors import ExoPinError
from ..exo.shoulder_exo import ShoulderExo
from ..workspace.optimisation.optimise import optimise
from .pose_map import begin

#: Designs in all after each look, and of one run.
_BUDGETS, _RUN = (48, 96, 192, 384, 768), 48
#: Steps of the grids on which designs are judged, degrees.
_STEP = 15.0


@dataclass(frozen=True)
class Found:
    """What a search knows so far.

    Attributes
    ----------
    designs : int
        Designs that were tried.
    index, start : float
        Share of the poses of daily life that meet all criteria: of the best design, and of the one it began with.
    values : dict of str to float
        Dimensions of the best, in the units that their names end in.
    refusal : str
        Why there is no search.
    """

    designs: int = 0
    index: float = 0.0
    start: float = 0.0
    values: Mapping[str, float] | None = None
    refusal: str = ""

    @property
    def words(self) -> str:
        """In a sentence."""
        if self.refusal:
            return self.refusal
        shares = f"{100.0 * self.index:.1f} % of the daily poses meet all criteria, {100.0 * self.start:.1f} % before"
        return f"{self.designs} designs tried: {shares}."


def look(exo: ShoulderExo, bounds: Mapping[str, tuple[float, float]], budget: int, storage: Path) -> Found:
    """Go on with a search within bounds until so many designs are tried, and tell the best.

    Strokes stay as they are, so that the dimensions alone say what the design is.
    """
    found = optimise(
        exo, bounds, seed=0, budget=budget, run_length=_RUN, refine=True, fit_strokes=False, storage=storage,
        step=_STEP, finer_step=_STEP,
    )  # fmt: skip
    best, before = found.best_candidate, found.start
    device = best.design.device
    known = {own.name: (device.value_of(own) or 0.0) / own.size for own in device.parameters(bounds)}
    values = {name: round(float(value), 1) for name, value in known.items()}
    return Found(found.evaluations, best.index, best.index if before is None else before.index, values)


def _run(exo: ShoulderExo, bounds: Mapping[str, tuple[float, float]], told: Connection) -> None:
    begin()
    warnings.simplefilter("ignore")
    with tempfile.TemporaryDirectory(prefix="exo_pin_search_") as folder:
        try:
            for budget in _BUDGETS:
                told.send(look(exo, bounds, budget, Path(folder, "study.db")))
        except ExoPinError as error:
            told.send(Found(refusal=str(error)))


class Search:
    """The search of a page, one at a time.

    Parameters
    ----------
    show : callable
        Gets what is known after each look, and None at the end, in another thread.
    """

    def __init__(self, show: Callable[[Found | None], None]) -> None:
        self._show = show
        self._process: Any = None

    @property
    def works(self) -> bool:
        """Whether it is going on."""
        return self._process is not None

    def start(self, exo: ShoulderExo, bounds: Mapping[str, tuple[float, float]]) -> None:
        """Begin with a design, and vary dimensions within bounds."""
        self.stop()
        context = multiprocessing.get_context("spawn")
        mine, its = context.Pipe(duplex=False)
        process = context.Process(target=_run, args=(exo, dict(bounds), its), daemon=True)
        process.start()
        its.close()
        self._process = process
        threading.Thread(target=self._follow, args=(process, mine), name="exo_pin search", daemon=True).start()

    def stop(self) -> None:
        """End it; what it has found is known."""
        process, self._process = self._process, None
        if process is not None:
            process.terminate()

    def _follow(self, process: Any, mine: Connection) -> None:
        with mine:
            try:
                while True:
                    found = mine.recv()
                    if process is self._process:
                        self._show(found)
            except EOFError:
                process.join()
        if process is self._process:
            self._process = None
            self._show(None)
