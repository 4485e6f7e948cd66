"""Fixtures that tests of several rooms use."""

import os
import pickle
import sys
import tomllib
from fcntl import LOCK_EX, flock
from pathlib import Path

import pytest
from scenes import PERSON

import exo_pin as ep
from exo_pin.chain import write_closures
from exo_pin.core import compiled
from exo_pin.thesis import ledger

FOLDER = Path(__file__).parent

# Tests start many processes, and rewriting the asserts of all files takes a quarter of a minute: what Python compiles
# is kept, as kernels are, also where the environment says otherwise.
sys.dont_write_bytecode = False
os.environ.pop("PYTHONDONTWRITEBYTECODE", None)


def pytest_collection_modifyitems(items):
    """Put tests of package and thesis as a whole last: by then kernels are compiled, and no two processes do it.

    Those of chains are first: of two processes, one compiles their dynamics while the other compiles devices.
    """
    chains = FOLDER / "chain"
    items.sort(key=lambda item: (item.path.parent in (FOLDER, FOLDER / "thesis"), chains not in item.path.parents))
    slow = {} if "TEST_TIMES" in os.environ else tomllib.loads((FOLDER / "slow_tests.toml").read_text(encoding="utf-8"))
    mark_of = {name: mark for mark, names in slow.items() for name in names}
    for item in items:
        if item.nodeid in mark_of:
            item.add_marker(mark_of[item.nodeid])
        if "ledger_rows" in getattr(item, "fixturenames", ()):
            item.add_marker(pytest.mark.full)  # the whole ledger takes a quarter of a minute


@pytest.fixture(scope="session", autouse=True)
def _compiled():
    """Run kernels compiled, unless the environment says otherwise: what users run most, and faster."""
    with pytest.MonkeyPatch.context() as patch, compiled.mode(os.environ.get("EXO_PIN_COMPILE") or "compiled"):
        patch.setenv("EXO_PIN_COMPILE", os.environ.get("EXO_PIN_COMPILE") or "compiled")
        yield


@pytest.fixture
def plain():
    """Run kernels as they are written: for tests that call small ones, which compiling would take longer than."""
    with compiled.mode("plain"):
        yield


@pytest.fixture(autouse=True)
def _no_open_figures():
    """Close what a test drew: pyplot keeps figures until then."""
    yield
    if "matplotlib.pyplot" in sys.modules:
        sys.modules["matplotlib.pyplot"].close("all")


@pytest.fixture
def robot(tmp_path):
    """Write a named mechanism as a URDF with its closures file and return the URDF's path."""

    def written(named):
        (tmp_path / "mine.urdf").write_text(named.urdf)
        write_closures(named.closures, tmp_path / "mine.closures.toml")
        return tmp_path / "mine.urdf"

    return written


@pytest.fixture(scope="module")
def exo():
    """The prototype on a person."""
    return ep.load("prototype").worn_by(PERSON)


@pytest.fixture(scope="session")
def ledger_rows(tmp_path_factory):
    """The ledger of the thesis, computed once, by whichever process of the run needs it first."""
    if "PYTEST_XDIST_WORKER" not in os.environ:
        return ledger()
    path = tmp_path_factory.getbasetemp().parent / "ledger"
    with path.open("ab+") as file:
        flock(file, LOCK_EX)
        file.seek(0)
        stored = file.read()
        rows = pickle.loads(stored) if stored else ledger()
        if not stored:
            file.write(pickle.dumps(rows))
    return rows


@pytest.fixture
def no_human(monkeypatch):
    """As if example-robot-data were not installed."""
    from exo_pin.view.figure import figure as human_figure

    monkeypatch.setattr(human_figure, "_shares", lambda: iter(()))
