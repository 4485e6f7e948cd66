"""Runs of a search in Optuna's storage: in memory, in a SQLite file, or in any database that Optuna knows.

A trial of the study is one run of CMA-ES (:mod:`.descent`). Making and ending a trial takes much longer than evaluating
a design (0.1 s against some milliseconds), so single designs are not trials. The state of a run is stored after every
generation, together with the time and with the worker who makes it. A worker that finds a run whose worker has not been
heard of for :data:`STALE` seconds takes it up from there: the end of a worker costs the designs of one generation,
those that were being evaluated. A worker that was only slow, and whose run was taken over, finds that out when it
stores the next generation, and leaves the run to the other.

Assumption: the clocks of the machines agree to some seconds.
"""

from __future__ import annotations

import hashlib
import json
import time
import uuid
from collections.abc import Iterator, Mapping
from importlib import import_module
from os import PathLike, fspath
from typing import Any, NamedTuple

import numpy as np

from ...core.errors import InvalidInput, MissingExtra
from ...core.errors.base import echo
from ...core.records import OneProcess
from ...design.io.mechanism_writing import mechanism_table
from .merit import OBJECTIVES, Merit
from .search_poses import Centre, described

__all__ = ["STALE", "Run", "StoredStudy", "study_description"]

#: Seconds after which a silent run is taken for abandoned.
STALE = 30.0


class Run(NamedTuple):
    """A finished run.

    Attributes
    ----------
    number : int
        Of the run, from 0.
    point : list of float
        Best point of the unit cube.
    merit : float
        Its merit.
    objectives : dict of str to float
        On the poses of the search.
    evaluations : int
        Designs that the run evaluated.
    """

    number: int
    point: list[float]
    merit: float
    objectives: dict[str, float]
    evaluations: int


class StoredStudy(OneProcess):
    """A study whose runs any number of workers share.

    Parameters
    ----------
    storage : str, path-like or None
        None: in memory. A database URL, such as ``sqlite:///study.db`` or ``postgresql://...``; a path becomes a SQLite
        file.
    name : str
        Of the study in the storage.
    objectives : tuple of str
        By which runs are compared.
    description : dict
        What the study searches. A study that was stored with another description is refused.
    """

    _instead = "open the storage again by its URL"

    def __init__(
        self, storage: str | PathLike[str] | None, name: str, objectives: tuple[str, ...], description: dict[str, Any]
    ) -> None:
        try:
            self._optuna: Any = import_module("optuna")
        except ImportError as error:
            raise MissingExtra("optimise", "optuna") from error
        self._optuna.logging.set_verbosity(self._optuna.logging.WARNING)
        url = None if storage is None else fspath(storage)
        if url is not None and "://" not in url:
            url = f"sqlite:///{url}"
        self._study = self._optuna.create_study(
            storage=url,
            study_name=name,
            load_if_exists=True,
            directions=["maximize" if OBJECTIVES[objective] else "minimize" for objective in objectives],
            sampler=self._optuna.samplers.RandomSampler(seed=0),
        )
        self._objectives, self._worker = objectives, uuid.uuid4().hex
        text = json.dumps(description, sort_keys=True)
        before = self._study.user_attrs.get("description")
        if before is None:
            self._study.set_user_attr("description", text)
        elif before != text:
            raise InvalidInput(
                f"the study {name!r} in {url} searches something else: {_difference(before, text)}; choose another "
                "name or storage"
            )

    def take(self, budget: int, length: int) -> tuple[Any, str | None] | None:
        """A run to work on, and its stored state if another worker has left it; None if others work on all there is.

        Parameters
        ----------
        budget : int
            Designs of the whole study.
        length : int
            Designs of a run.
        """
        running, now = self._running(), time.time()
        silent = [trial for trial in running if now - _heard(trial) > STALE]
        if silent:
            live = self._optuna.trial.Trial(self._study, silent[0]._trial_id)
            state = _progress(silent[0]).get("state")
        elif self.evaluations() + len(running) * length < budget:
            live, state = self._study.ask(), None
        else:
            return None
        self._store(live, state)
        return live, state

    def checkpoint(self, trial: Any, state: str) -> bool:
        """Store the state of a run; False if another worker has taken it over, and then nothing is stored."""
        if not self._is_mine(trial):
            return False
        self._store(trial, state)
        return True

    def evaluations(self) -> int:
        """Designs that the finished runs have evaluated."""
        return sum(run.evaluations for run in self.runs())

    def _running(self) -> list[Any]:
        states = (self._optuna.trial.TrialState.RUNNING,)
        return list(self._study.get_trials(deepcopy=False, states=states))

    def _is_mine(self, trial: Any) -> bool:
        return any(
            each.number == trial.number and _progress(each).get("worker") == self._worker for each in self._running()
        )

    def _store(self, trial: Any, state: str | None) -> None:
        # One row for the three: a reader never sees the state of one worker beside the name of another.
        record = {"state": state, "beat": time.time(), "worker": self._worker}
        trial.set_user_attr("progress", json.dumps(record))

    def finish(self, trial: Any, point: list[float], merit: float, objectives: dict[str, float], done: int) -> None:
        """Store the end of a run, unless another worker has taken it over."""
        if not self._is_mine(trial):
            return
        record = {"point": point, "merit": merit, "objectives": objectives, "evaluations": done}
        trial.set_user_attr("result", json.dumps(record))
        trial.set_user_attr("progress", "")
        values = [objectives[name] for name in self._objectives]
        outcome: Any = {"values": values}
        if np.isnan(values).any():
            outcome = {"state": self._optuna.trial.TrialState.FAIL}
        self._study.tell(trial, **outcome, skip_if_finished=True)

    def runs(self) -> Iterator[Run]:
        """All finished runs, by number."""
        for trial in self._study.get_trials(deepcopy=False):
            if trial.state.is_finished() and trial.user_attrs.get("result"):
                record = json.loads(trial.user_attrs["result"])
                yield Run(trial.number, record["point"], record["merit"], record["objectives"], record["evaluations"])


def _progress(trial: Any) -> dict[str, Any]:
    """State, time and worker as last stored; empty of a trial that was only just made."""
    text = trial.user_attrs.get("progress")
    return dict(json.loads(text)) if text else {}


def _heard(trial: Any) -> float:
    """When the worker of a trial was last heard of, seconds since the epoch."""
    return float(_progress(trial).get("beat", trial.datetime_start.timestamp()))


def _difference(before: str, now: str) -> str:
    old, new = json.loads(before), json.loads(now)
    changed = [key for key in sorted({*old, *new}) if old.get(key) != new.get(key)]
    return ", ".join(f"{key} was {echo(old.get(key))} and is {echo(new.get(key))}" for key in changed)


def study_description(
    merit: Merit, objectives: tuple[str, ...], seed: int, run_length: int, refine: bool, centres: tuple[Centre, ...]
) -> dict[str, Any]:
    """What a study searches, to tell it from others."""
    space = merit.variables
    # Its title and sources say where numbers are from; the search does not depend on them.
    design = mechanism_table(space.mechanism.replace(title="", sources={}))
    text = {
        "objectives": objectives,
        "fit_strokes": merit.fit_strokes,
        "data of the design": _digest(design),
        "data of the poses": _digest([merit.poses.orientations.as_matrix().tolist(), merit.poses.weights.tolist()]),
        "design": space.mechanism.name,
        "limbs": space.mechanism.limb_count,
        "variables": dict(zip(space.names, space.bounds.tolist(), strict=True)),
        "poses": len(merit.poses.weights),
        "criteria": repr(merit.criteria),
        "seed": seed,
        "run_length": run_length,
        "start": space.of_design() if refine else "random",
    }
    if centres != (None,):
        text["centre_offset"] = [described(centre) for centre in centres]
    return text if merit.contact is None else {**text, "contact": merit.contact.description()}


def _digest(data: Any) -> str:
    """A short text that other data do not have."""
    return hashlib.sha256(repr(_rounded(data)).encode()).hexdigest()[:12]


def _rounded(data: Any) -> Any:
    """The same to nine decimals, which computers agree on."""
    if isinstance(data, Mapping):
        return {key: _rounded(value) for key, value in data.items()}
    if isinstance(data, list | tuple | np.ndarray):
        return [_rounded(value) for value in data]
    # + 0.0, so that no -0.0 differs from 0.0.
    return round(float(data), 9) + 0.0 if isinstance(data, float) else data
