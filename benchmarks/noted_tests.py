"""A plugin of pytest that notes by which statements of some modules each test comes, in a run that is made anyway.

    EXO_PIN_NOTED=FOLDER pytest -p noted_tests

FOLDER/modules.txt names the modules; each process that runs tests leaves a file of what it has noted there, which
``mutants.py --noted FOLDER`` reads.
"""

from __future__ import annotations

import builtins
import importlib
import json
import os
import time
from collections import defaultdict
from collections.abc import Iterable
from pathlib import Path
from typing import Any

from mutant_places import NOTE, Noting, parsed, path_of, replace_code

#: Name of the variable of the environment that says where notes are kept.
FOLDER = "EXO_PIN_NOTED"


class Notes:
    """Time of each test, s of the processor, and the statements that it comes by: (file, line)."""

    def __init__(self) -> None:
        self.took: dict[str, float] = {}
        self.failed: list[str] = []
        self.places: dict[str, set[tuple[str, int]]] = defaultdict(set)
        self._hits: set[tuple[str, int]] = set()

    def begin(self, modules: Iterable[str]) -> None:
        """Note from here on what functions of modules run."""
        setattr(builtins, NOTE, self._hits.add)
        for module in modules:
            # One that is loaded later, when it is needed, would be traced and changed nowhere.
            importlib.import_module(module)
            replace_code(path_of(module), Noting(path_of(module)).visit(parsed(path_of(module))))

    def add(self, report: Any) -> None:
        """What has run belongs to a test, or to its file: a fixture may serve all tests of it."""
        owner = report.nodeid.partition("::")[0] if report.when == "setup" else report.nodeid
        self.places[owner] |= self._hits
        self._hits.clear()

    def write(self, path: Path) -> None:
        """As a file of JSON."""
        places = {owner: sorted(places) for owner, places in self.places.items() if places}
        path.write_text(json.dumps({"took": self.took, "noted": places, "failed": self.failed}))


class _Noted:
    """Notes of one process of a run."""

    def __init__(self, folder: Path) -> None:
        self._folder, self._notes, self._passed, self._begun = folder, Notes(), True, 0.0

    def pytest_collection_finish(self) -> None:
        self._notes.begin((self._folder / "modules.txt").read_text().split())

    def pytest_runtest_logstart(self) -> None:
        self._begun, self._passed = time.process_time(), True

    def pytest_runtest_logfinish(self, nodeid: str) -> None:
        if self._passed:
            self._notes.took[nodeid] = time.process_time() - self._begun

    def pytest_runtest_logreport(self, report: Any) -> None:
        self._passed &= report.passed
        self._notes.add(report)

    def pytest_sessionfinish(self) -> None:
        if self._notes.took:
            self._notes.write(self._folder / f"{os.getpid()}.json")


def pytest_configure(config: Any) -> None:
    """Note in processes that run tests: all but the one that hands them out."""
    runs = hasattr(config, "workerinput") or not getattr(config.option, "numprocesses", None)
    if FOLDER in os.environ and runs:
        config.pluginmanager.register(_Noted(Path(os.environ[FOLDER])))
        # Tests that run tests note nothing.
        os.environ.pop("PYTEST_ADDOPTS", None)
