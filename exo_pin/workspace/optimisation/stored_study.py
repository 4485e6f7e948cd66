"""Runs of a search in Optuna's storage: in memory, in a SQLite file, or in any database that Optuna knows.

A trial of the study is one run of CMA-ES (:class:`.Descent`). Making and ending a trial takes much longer than
evaluating a design (0.1 s against some milliseconds), so single designs are not trials. The state of a run is stored
after every generation, together with the time and with the worker who makes it. A worker that finds a run whose worker
has not been heard of for :data:`STALE` seconds takes it up from there: the end of a worker costs the designs of one
generation, those that were being evaluated. A worker that was only slow, and whose run was taken over, finds that out
when it stores the next generation, and leaves the run to the other.

A storage is data: everything in it is JSON, whose version, keys, shapes and ranges are checked when it is read, so that
it can come from anybody. Whatever a storage does wrong is a :class:`StorageUnusable`.

Assumption: the clocks of the machines agree to some seconds.
"""

from __future__ import annotations

import json
import os
import time
import uuid
from collections.abc import Iterator
from contextlib import contextmanager
from importlib import import_module
from os import PathLike
from typing import Any, NamedTuple

import numpy as np

from ...core.errors import InvalidInput, MissingExtra, StorageUnusable
from ...core.errors.base import echo
from ...core.files.toml_tables import TomlTable
from ...core.optional_packages import optional
from ...core.records import OneProcess
from .merit import GENERATION, OBJECTIVES, as_point

#: Version of what is stored; a study of another one is refused.
_FORMAT = 1
#: Seconds after which a silent run is taken for abandoned.
STALE = 30.0


class SearchRun(NamedTuple):
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
        file of exactly that name.
    name : str
        Of the study in the storage.
    objectives : tuple of str
        By which runs are compared.
    description : dict
        What the study searches. A study that was stored with another description is refused.
    count : int
        Variables of the search.
    length : int
        Designs of a run.

    Raises
    ------
    MissingExtra
        If Optuna is not installed.
    StorageUnusable
        If the storage cannot be used or holds something else, from here and from every method.
    InvalidInput
        If the study searches something else.
    """

    _instead = "open the storage again by its URL"

    def __init__(
        self,
        storage: str | PathLike[str] | None,
        name: str,
        objectives: tuple[str, ...],
        description: dict[str, Any],
        count: int,
        length: int,
    ) -> None:
        self._optuna = optional("optimise", "optuna")
        self._optuna.logging.set_verbosity(self._optuna.logging.WARNING)
        self._storage, self._objectives, self._worker = storage, objectives, uuid.uuid4().hex
        self._count, self._length, self._most = count, length, length + GENERATION
        if not isinstance(name, str) or not name:
            raise InvalidInput(f"expected the name of a study, got {echo(name)}")
        with self.watched():
            self._study = self._optuna.create_study(
                storage=None if storage is None else _url(storage),
                study_name=name,
                load_if_exists=True,
                directions=["maximize" if OBJECTIVES[objective] else "minimize" for objective in objectives],
                sampler=self._optuna.samplers.RandomSampler(),
            )
            text = json.dumps({"format": _FORMAT, **description}, sort_keys=True)
            before = self._study.user_attrs.get("description")
            if before is None:
                self._study.set_user_attr("description", text)
            found = _object(before or text)
            if found.get("format") != _FORMAT:
                raise InvalidInput(f"the study {name!r} was stored by another version of exo_pin; choose another name")
        if before not in (None, text):
            raise InvalidInput(
                f"the study {name!r} searches something else: {_difference(found, json.loads(text))}; choose another "
                "name or storage"
            )

    @contextmanager
    def watched(self) -> Iterator[None]:
        """Turn whatever the storage does in a block into a :class:`StorageUnusable`."""
        try:
            yield
        except (StorageUnusable, MissingExtra):
            raise
        except Exception as error:
            raise StorageUnusable(self._storage, _reason(error)) from error

    def take(self, budget: int) -> tuple[Any, dict[str, Any] | None] | None:
        """A run to work on, and its stored state if another worker has left it; None if others work on all there is.

        Parameters
        ----------
        budget : int
            Designs of the whole study.
        """
        with self.watched():
            running, now, state = self._running(), time.time(), None
            # A time in the future is no sign of life: it would keep the run from everybody.
            silent = [trial for trial in running if not abs(now - _heard(trial)) <= STALE]
            if silent:
                live = self._optuna.trial.Trial(self._study, silent[0]._trial_id)
                state = _progress(silent[0]).get("state")
                if state is not None:
                    self._evaluations(TomlTable(state, None, "state"))
            elif self.room(budget) > len(running) * self._length:
                live = self._study.ask()
            else:
                return None
            self._store(live, state)
            return live, state

    def checkpoint(self, trial: Any, state: dict[str, Any]) -> bool:
        """Store the state of a run; False if another worker has taken it over, and then nothing is stored."""
        with self.watched():
            if not self._is_mine(trial):
                return False
            self._store(trial, state)
            return True

    def room(self, budget: int, trial: Any = None) -> int:
        """Designs left of a budget, in whole generations, to all or to a run beside others; the first has one."""
        runs = self.runs()
        left = (budget - sum(run.evaluations for run in runs)) // GENERATION * GENERATION
        others = 0 if trial is None else sum(each.number != trial.number for each in self._running())
        return (left if runs else max(left, GENERATION)) - others * self._length

    def finish(self, trial: Any, run: SearchRun) -> None:
        """Store the end of a run, unless another worker has taken it over."""
        with self.watched():
            if not self._is_mine(trial):
                return
            record = run._asdict()
            del record["number"]
            record["objectives"] = {name: value for name, value in run.objectives.items() if not np.isnan(value)}
            trial.set_user_attr("result", json.dumps(record))
            trial.set_user_attr("progress", "")
            values = [run.objectives[name] for name in self._objectives]
            outcome: Any = {"values": values}
            if np.isnan(values).any():
                outcome = {"state": self._optuna.trial.TrialState.FAIL}
            self._study.tell(trial, **outcome, skip_if_finished=True)

    def runs(self) -> list[SearchRun]:
        """All finished runs, by number."""
        with self.watched():
            trials = self._study.get_trials(deepcopy=False)
            return [self._run(each) for each in trials if each.state.is_finished() and each.user_attrs.get("result")]

    def _run(self, trial: Any) -> SearchRun:
        """The record of a finished run, checked."""
        table = TomlTable(_object(trial.user_attrs["result"]), None, f"run {trial.number}")
        given = table.required_table("objectives")
        objectives = {name: given.quantity("number", name, required=False) for name in OBJECTIVES}
        index = objectives["index"]
        if index is not None and not -1e-9 <= index <= 1.0 + 1e-9:
            raise given.error(f"expected a share from 0 to 1, got {index:g}", "index")
        for name, value in objectives.items():
            if name.endswith("_force") and value is not None and value < 0.0:
                raise given.error(f"expected a force of zero or more, got {value:g}", name)
        known = {name: np.nan if value is None else value for name, value in objectives.items()}
        point, merit = as_point(table, "point", self._count), table.quantity("number", "merit")
        run = SearchRun(trial.number, point.tolist(), merit, known, self._evaluations(table))
        given.finish()
        table.finish()
        return run

    def _evaluations(self, table: TomlTable) -> int:
        done = table.integer("evaluations")
        if not 1 <= done <= self._most:
            raise table.error(f"expected 1 to {self._most} designs, got {echo(done)}", "evaluations")
        return done

    def _running(self) -> list[Any]:
        states = (self._optuna.trial.TrialState.RUNNING,)
        return list(self._study.get_trials(deepcopy=False, states=states))

    def _is_mine(self, trial: Any) -> bool:
        return any(
            each.number == trial.number and _progress(each).get("worker") == self._worker for each in self._running()
        )

    def _store(self, trial: Any, state: dict[str, Any] | None) -> None:
        # One row for the three: a reader never sees the state of one worker beside the name of another.
        record = {"state": state, "beat": time.time(), "worker": self._worker}
        trial.set_user_attr("progress", json.dumps(record))


def _url(storage: str | PathLike[str]) -> str:
    """URL of a storage, for Optuna."""
    if isinstance(storage, str) and "://" in storage:
        return storage
    if not isinstance(storage, str | PathLike) or not isinstance(path := os.fspath(storage), str) or not path:
        raise InvalidInput("expected the path of a file or the URL of a database")
    path = os.path.abspath(path)
    if not os.path.isdir(folder := os.path.dirname(path)):
        raise InvalidInput(f"there is no folder {folder!r:.200}; make it first")
    if os.path.exists(path) and not os.path.isfile(path):
        raise InvalidInput("expected a file, this is a folder, pipe or device")
    engine: Any = import_module("sqlalchemy.engine")
    url: str = engine.URL.create("sqlite", database=path).render_as_string()
    if engine.make_url(url).database != path:
        raise InvalidInput("SQLAlchemy changes this name; use letters and digits only")
    # Optuna fills in what stands between braces.
    return url.replace("{", "{{").replace("}", "}}")


def _object(text: Any) -> dict[str, Any]:
    """A stored JSON object; what is null is left out, as in TOML, whose reader checks it."""
    found = json.loads(text, object_hook=lambda pairs: {k: value for k, value in pairs.items() if value is not None})
    if not isinstance(found, dict):
        raise InvalidInput(f"expected a JSON object, got {echo(text)}")
    return found


def _progress(trial: Any) -> dict[str, Any]:
    """State, time and worker as last stored; empty of a trial that was only just made."""
    text = trial.user_attrs.get("progress")
    return _object(text) if text else {}


def _heard(trial: Any) -> float:
    """When the worker of a trial was last heard of, seconds since the epoch."""
    return float(_progress(trial).get("beat", trial.datetime_start.timestamp()))


def _reason(error: BaseException) -> str:
    """What is behind an error of Optuna or SQLAlchemy, in one line."""
    while error.__cause__ is not None:
        error = error.__cause__
    line = next(iter(str(error).splitlines()), "")
    return line if isinstance(error, InvalidInput) else f"{type(error).__name__}: {line}"


def _difference(old: dict[str, Any], new: dict[str, Any]) -> str:
    changed = [key for key in sorted({*old, *new}) if old.get(key) != new.get(key)]
    return ", ".join(f"{key} was {echo(old.get(key))} and is {echo(new.get(key))}" for key in changed)
