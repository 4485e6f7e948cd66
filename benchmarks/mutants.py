"""Whether the tests of a room notice a wrong sign, bound or number in it: mutants by room, killed or alive.

    python benchmarks/mutants.py numerics wrist --count 40    a seeded sample of each room
    python benchmarks/mutants.py --sample 40                  a seeded sample over all rooms together
    python benchmarks/mutants.py --all                        every mutant of every room: days

A mutant is one small change of one module: another comparison, sign, operator, number, truth value or function; a
statement, keyword or call that is lost; a condition that always holds or never. It is never written to a file.
A room is judged by its own tests alone, or first by these and then by those of the folders ``--beside``; those of the
full run are among them with ``--full``. Mutants of files with kernels are judged in a process that compiles none. The
tests are collected once; a process forked from there runs them all and notes
which statement each runs, and one for each mutant gives the loaded functions its code and runs the tests that come by
the changed statement, the quickest files first. What runs when a module is loaded is changed in a process of its own. A
mutant that takes ten times as long as the tests without it, and at least a minute, counts as killed; so does one that
ends the process. Tests that take more than ``--slowest`` seconds of the processor are left out, and those that come
after ``--budget`` seconds of the processor of others.

``equivalent_mutants.toml`` beside this file lists changes that no test can notice, each with its proof.
"""

# ruff: noqa: D102 - what Python or pytest calls by these names, they describe

from __future__ import annotations

import argparse
import builtins
import contextlib
import functools
import gc
import importlib
import json
import os
import random
import re
import resource
import signal
import sys
import tempfile
import time
import tomllib
from collections import Counter, defaultdict
from collections.abc import Callable
from itertools import accumulate
from pathlib import Path
from typing import Any, NamedTuple

import pytest
from changed_module import passes_reloaded
from mutant_places import NOTE, ROOT, Mutant, Noting, Place, Places, Unchanged, mutants, parsed, replace_code

#: All folders of the package.
ROOMS = tuple(sorted(path.parent.name for path in (ROOT / "exo_pin").glob("*/__init__.py")))
#: No test may take longer than this, s, however quick the tests are without the change.
_LEAST_LIMIT = 60.0
#: A change may ask for any amount of memory; the tests fill less than this, bytes. (A browser reserves more addresses.)
_MEMORY = 12 * 2**30
#: What a test says that was stopped for taking too long.
_TOO_SLOW = "stopped: too slow for the mutants"


class Tally(NamedTuple):
    """Mutants of a room: how many, and those that are alive; of these the ones that are listed as equivalent."""

    room: str
    count: int
    alive: list[str]
    equivalent: list[str]

    @property
    def share(self) -> float:
        """Of the mutants that are not listed as equivalent, those that are killed, in %."""
        told = self.count - len(self.equivalent)
        return 100.0 * (told - len(self.alive)) / max(1, told)

    @property
    def least(self) -> float:
        """Lower end of the one-sided 95 % confidence interval of that share, of Clopper and Pearson, in %."""
        from scipy.stats import beta  # here: it imports NumPy, whose threads are chosen in each process

        told = self.count - len(self.equivalent)
        killed = told - len(self.alive)
        return float(100.0 * beta.ppf(0.05, killed, told - killed + 1)) if killed else 0.0

    def __str__(self) -> str:
        told = self.count - len(self.equivalent)
        killed, share = f"{told - len(self.alive)} of {told}", f"{self.share:.0f} % | {self.least:.0f} %"
        return f"| {self.room} | {killed} | {share} | {len(self.equivalent)} |"


def joined(room: str, parts: list[Tally]) -> Tally:
    """One tally of a room's parts."""
    alive, equivalent = (
        [text for part in parts for text in part.alive],
        [text for part in parts for text in part.equivalent],
    )
    return Tally(room, sum(part.count for part in parts), alive, equivalent)


def tests_of(room: str) -> Path:
    """The folder of the tests of a room, or the nearest above it."""
    folder = ROOT / "tests" / room
    while not any(folder.rglob("test_*.py")):
        folder = folder.parent
    return folder


class Judge:
    """A plugin of pytest: runs the collected tests once for each mutant in place of once."""

    def __init__(self, room: str, chosen: list[Mutant], options: argparse.Namespace) -> None:
        self.tally, self._chosen = Tally(room, 0, [], []), chosen
        self._known, self._slowest, self._budget = known_equivalents(), options.slowest, options.budget
        self._failed, self._stopped, self._hits = False, False, set[tuple[str, int]]()
        self._sources = Unchanged()
        self._noted: dict[str, set[tuple[str, int]]] = defaultdict(set)

    def pytest_runtest_logreport(self, report: Any) -> None:
        self._failed |= report.failed
        # A fixture that was stopped fails in all tests of its file.
        self._stopped |= report.failed and _TOO_SLOW in str(report.longrepr)
        # A fixture may serve all tests of its file.
        owner = report.nodeid.partition("::")[0] if report.when == "setup" else report.nodeid
        self._noted[owner] |= self._hits
        self._hits.clear()

    def pytest_runtestloop(self, session: Any) -> bool:
        self.items = session.items
        # One that is loaded later, when it is needed, would be traced and changed nowhere.
        for module in sorted({mutant.module for mutant in self._chosen}):
            importlib.import_module(module)
        importlib.import_module("numba")  # once, and not in each process
        with tempfile.NamedTemporaryFile() as file:
            ok = self._forked(lambda: self._trace(Path(file.name)), None)
            if not ok:
                raise RuntimeError(f"a test fails without a mutant: {Path(file.name).read_text()}")
            told = json.loads(Path(file.name).read_text())
        self._took: dict[str, float] = told["took"]
        self.items = [item for item in self.items if item.nodeid in self._took]
        self._by_place: dict[tuple[str, int], list[Any]] = defaultdict(list)
        for item in self.items:
            for owner in (item.nodeid, item.nodeid.partition("::")[0]):
                for place in told["noted"].get(owner, ()):
                    if item not in self._by_place[tuple(place)][-1:]:
                        self._by_place[tuple(place)].append(item)
        for mutant in self._chosen:
            self._judge(mutant)
        return True

    def _judge(self, mutant: Mutant) -> None:
        alive = self._is_alive(mutant, tests_of(self.tally.room))
        self._sources.check()
        tally = self.tally = self.tally._replace(count=self.tally.count + 1)
        listed = (str(mutant.path.relative_to(ROOT / "exo_pin")), mutant.place) in self._known
        if alive:
            (tally.equivalent if listed else tally.alive).append(str(mutant))
        if alive is not listed:
            print(f"{'alive' if alive else 'listed as equivalent, but killed'}: {mutant}", flush=True)

    def _is_alive(self, mutant: Mutant, own: Path) -> bool:
        name = str(mutant.path.relative_to(ROOT))
        if mutant.statement:
            items = self._by_place.get((name, mutant.statement), [])
        else:
            places = [items for (path, _), items in self._by_place.items() if path == name]
            items = list(dict.fromkeys(item for found in places for item in found)) or self.items
        total: dict[str, float] = defaultdict(float)
        for item in items:
            total[item.path] += self._took[item.nodeid]
        order = {item: (not item.path.is_relative_to(own), total[item.path], item.path) for item in items}
        items = sorted(items, key=lambda item: (order[item], self._took[item.nodeid]))
        passed = list(accumulate((self._took[item.nodeid] for item in items), initial=0.0))
        items = [item for item, before in zip(items, passed, strict=False) if before <= self._budget]
        limit = max(_LEAST_LIMIT, 10.0 * min(passed[-1], self._budget))
        if not mutant.statement:
            return passes_reloaded(mutant, items, limit)
        return self._forked(lambda: self._run_changed(mutant, items), limit)

    def _run_changed(self, mutant: Mutant, items: list[Any]) -> bool:
        replace_code(mutant.path, Places(mutant.number).visit(parsed(mutant.path)))
        return self._passes(items)

    def _trace(self, file: Path) -> bool:
        def stop(*_: object) -> None:
            raise TimeoutError(_TOO_SLOW)

        setattr(builtins, NOTE, self._hits.add)
        signal.signal(signal.SIGPROF, stop)
        for path in sorted({mutant.path for mutant in self._chosen}):
            replace_code(path, Noting(path).visit(parsed(path)))
        took, were_stopped = {}, False
        for number, item in enumerate(self.items):
            begun = time.process_time()  # other work on the machine does not count
            signal.setitimer(signal.ITIMER_PROF, self._slowest)
            if self._passes([item], *self.items[number + 1 : number + 2]):
                took[item.nodeid] = time.process_time() - begun
            elif signal.getitimer(signal.ITIMER_PROF)[0] > 0.0 and not self._stopped and not were_stopped:
                file.write_text(item.nodeid)
                return False
            else:
                were_stopped = True  # what a stopped test leaves behind may fail others, which are left out, too
            self._failed = self._stopped = False
        signal.setitimer(signal.ITIMER_PROF, 0.0)
        file.write_text(json.dumps({"took": took, "noted": {k: list(v) for k, v in self._noted.items()}}))
        return True

    def _passes(self, items: list[Any], after: Any = None) -> bool:
        for number, item in enumerate(items, start=1):
            following = items[number] if number < len(items) else after
            item.ihook.pytest_runtest_protocol(item=item, nextitem=following)
            if self._failed:
                return False
        return True

    def _forked(self, job: Callable[[], bool], limit: float | None) -> bool:
        """Whether a job returns True, in a process that may end in any way."""
        child = os.fork()
        if child == 0:
            code = 1
            try:
                os.setpgid(0, 0)
                resource.setrlimit(resource.RLIMIT_DATA, (_MEMORY, _MEMORY))
                nowhere = os.open(os.devnull, os.O_RDWR)
                for stream in (0, 1, 2):
                    os.dup2(nowhere, stream)
                _forget_results()
                code = 0 if job() else 1
            finally:
                os._exit(code)
        end = None if limit is None else time.monotonic() + limit
        pause = 0.002
        while not (done := os.waitpid(child, os.WNOHANG))[0]:
            if end is not None and time.monotonic() > end:
                os.killpg(child, signal.SIGKILL)
                return os.waitpid(child, 0) is None
            time.sleep(pause)
            pause = min(0.2, 1.5 * pause)
        # Servers and children that the tests had no time to end.
        with contextlib.suppress(ProcessLookupError):
            os.killpg(child, signal.SIGKILL)
        return done[1] == 0


def _forget_results() -> None:
    """Let functions that keep results compute them anew, and kernels be made of what their functions have become."""
    from exo_pin.core.compiled import kernels

    for thing in gc.get_objects():
        if isinstance(thing, functools._lru_cache_wrapper) and (thing.__module__ or "").startswith("exo_pin"):
            thing.cache_clear()
    if os.environ["NUMBA_DISABLE_JIT"] == "1":
        for kernel in kernels():
            kernel.forget()


def known_equivalents() -> dict[tuple[str, Place], str]:
    """Proof of each change that is listed as equivalent, by file of the package and place."""
    listed = tomllib.loads(Path(__file__).with_name("equivalent_mutants.toml").read_text(encoding="utf-8"))["mutant"]
    return {
        (one["file"], Place(one["function"], one["kind"], one["change"], nth)): one["proof"]
        for one in listed
        for nth in one["nth"]
    }


def chosen_mutants(room: str, options: argparse.Namespace) -> list[Mutant]:
    """Mutants of a room, a seeded sample or all."""
    chosen = [mutant for mutant in mutants(room) if re.search(options.match, str(mutant))]
    if options.all:
        return chosen
    return random.Random(f"{room} {options.seed}").sample(chosen, min(options.count, len(chosen)))


def judged(room: str, chosen: list[Mutant], options: argparse.Namespace) -> Tally:
    """Judge mutants of a room; to be called once in a process."""
    judge = Judge(room, chosen, options)
    # pytest reads the line of each frame, and a test that the timer stops may be at none.
    arguments = ["-q", "-s", "-n", "0", "-p", "no:cacheprovider", "--tb=native", "--rootdir", str(ROOT)]
    folders = [str(tests_of(room)), *(str(ROOT / "tests" / name) for name in options.beside)]
    code = pytest.main([*arguments, *(["-m", "not long"] if options.full else []), *folders], plugins=[judge])
    if code != pytest.ExitCode.OK:
        raise RuntimeError(f"the mutants of {room} could not be judged: {code}")
    return judge.tally


def _in_own_process(room: str, chosen: list[Mutant], options: argparse.Namespace, compiles: bool) -> Tally:
    ours, theirs = os.pipe()
    sys.stdout.flush()
    child = os.fork()
    if child == 0:
        try:
            os.environ |= {"NUMBA_DISABLE_JIT": str(int(not compiles)), "OMP_NUM_THREADS": "1"}
            os.write(theirs, json.dumps(judged(room, chosen, options)).encode())
        finally:
            sys.stdout.flush()
            os._exit(0)
    os.close(theirs)
    with open(ours, encoding="utf-8") as pipe:
        text = pipe.read()
    os.waitpid(child, 0)
    if not text:
        raise SystemExit(1)
    return Tally(*json.loads(text))


def _has_kernels(mutant: Mutant) -> bool:
    return "\n@kernel" in mutant.path.read_text(encoding="utf-8")


def main() -> None:
    """Print the mutants that are alive, and the share of the killed ones by room."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("rooms", nargs="*", default=ROOMS, help="folders of the package")
    parser.add_argument("--count", type=int, default=20, help="mutants of each room (default 20)")
    parser.add_argument("--sample", type=int, help="mutants of all rooms together, in place of so many of each")
    parser.add_argument("--seed", type=int, default=0, help="of the sample")
    parser.add_argument("--all", action="store_true", help="every mutant")
    parser.add_argument("--full", action="store_true", help="with the tests of the full run")
    parser.add_argument("--match", default="", help="only mutants whose line in the list matches this expression")
    parser.add_argument("--slowest", type=float, default=20.0, help="longest test, s of the processor (default 20)")
    parser.add_argument("--beside", nargs="*", default=[], help="folders of tests beside the room's own, such as study")
    parser.add_argument(
        "--budget", type=float, default=120.0, help="of the tests of one mutant, s of the processor (default 120)"
    )
    parser.add_argument("--least", type=float, default=0.0, help="share, in %%, that is to be killed in each room")
    options = parser.parse_args()
    os.chdir(ROOT)
    sys.path.insert(0, str(ROOT))
    counts = Counter(room for room in options.rooms for _ in range(options.count))
    if options.sample is not None:
        places = [room for room in options.rooms for _ in mutants(room)]
        counts = Counter(random.Random(options.seed).sample(places, options.sample))
    tallies = []
    for room, options.count in sorted(counts.items()):
        chosen = chosen_mutants(room, options)
        parts = [
            _in_own_process(room, own, options, compiles)
            for compiles in (True, False)
            if (own := [mutant for mutant in chosen if _has_kernels(mutant) is not compiles])
        ]
        tallies.append(joined(room, parts))
        print(tallies[-1], flush=True)
    lax = [tally.room for tally in tallies if tally.share < options.least]
    print(
        "\n| room | killed | share | at least, 95 % | equivalent |\n| --- | --- | --- | --- | --- |", *tallies, sep="\n"
    )
    if lax:
        raise SystemExit(f"less than {options.least:g} % killed: {', '.join(lax)}")


if __name__ == "__main__":
    main()
