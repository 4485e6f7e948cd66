"""Whether the tests of a room notice a wrong sign, bound or number in it: mutants by room, killed or alive.

    python benchmarks/mutants.py numerics wrist --count 40    a seeded sample of each room
    python benchmarks/mutants.py --sample 40                  a seeded sample over all rooms together
    python benchmarks/mutants.py --everywhere --full          a sample of each room, and all tests: hours
    python benchmarks/mutants.py --all                        every mutant of every room: days

A mutant is one small change of one module: another comparison, sign, operator, number, truth value or function; a
statement, keyword or call that is lost; a condition that always holds or never. It is never written to a file.
A room is judged by its own tests alone, or first by these and then by those of the folders ``--beside``, or by all
tests with ``--everywhere``; those of the full run are among them with ``--full``. Mutants of files with kernels are
judged in a process that compiles none, by the room's own tests and those beside. The tests are collected once;
processes forked from there run them all and note which statement each runs, and one for each mutant gives the loaded
functions its code and runs the tests that come by the changed statement, the quickest files first; ``--jobs`` of them
run at once. With ``--children`` the other tests of the room follow, in new processes that load the changed module.
What runs when a module is loaded is changed in a process of its own. A mutant that takes ten times as long
as the tests without it, and at least a minute, counts as killed; so does one that ends the process. Tests that take
more than ``--slowest`` seconds of the processor are left out, and those that come after ``--budget`` seconds of the
processor of others; so are those that fail without a mutant, as some do that want a process of their own, by name.

``equivalent_mutants.toml`` beside this file lists changes that no test can notice, each with its proof.
"""

# ruff: noqa: D102 - what Python or pytest calls by these names, they describe

from __future__ import annotations

import argparse
import contextlib
import functools
import gc
import importlib
import json
import math
import os
import random
import re
import resource
import signal
import sys
import tempfile
import time
import tomllib
import traceback
from collections import Counter, defaultdict
from collections.abc import Callable, Iterable, Iterator
from itertools import accumulate
from pathlib import Path
from typing import Any, NamedTuple

from changed_module import passes_reloaded
from mutant_places import ROOT, Mutant, Place, Places, Unchanged, mutants, parsed, replace_code
from noted_tests import Notes

#: All folders of the package.
ROOMS = tuple(sorted(path.parent.name for path in (ROOT / "exo_pin").glob("*/__init__.py")))
#: No test may take longer than this, s, however quick the tests are without the change.
_LEAST_LIMIT = 60.0
#: A change may ask for any amount of memory; the tests fill less than this, bytes. (A browser reserves more addresses.)
_MEMORY = 12 * 2**30
#: With the processes that tests start, s.
_CHILDREN = 900.0
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

    def __init__(self, chosen: dict[str, list[Mutant]], options: argparse.Namespace) -> None:
        self.tallies = {room: Tally(room, 0, [], []) for room in chosen}
        self._chosen = [(room, mutant) for room, ours in chosen.items() for mutant in ours]
        self._known, self._slowest, self._budget = known_equivalents(), options.slowest, options.budget
        self._jobs = options.jobs
        self._failed, self._stopped, self._notes = False, False, Notes()
        self._sources, self._folder, self._children = Unchanged(), options.noted, options.children

    def pytest_runtest_logreport(self, report: Any) -> None:
        self._failed |= report.failed
        # A fixture that was stopped fails in all tests of its file.
        self._stopped |= report.failed and _TOO_SLOW in str(report.longrepr)
        self._notes.add(report)

    def pytest_runtestloop(self, session: Any) -> bool:
        # One that is loaded later, when it is needed, would be traced and changed nowhere.
        for module in sorted({mutant.module for _, mutant in self._chosen}):
            importlib.import_module(module)
        importlib.import_module("numba")  # once, and not in each process
        told = noted_in(self._folder) if self._folder else self._traced(session.items)
        for test in (test for part in told for test in part["failed"]):
            print(f"left out, for it fails without a mutant: {test}", flush=True)
        self._took: dict[str, float] = {test: took for part in told for test, took in part["took"].items()}
        self.items = [item for item in session.items if item.nodeid in self._took]
        self._by_place: dict[tuple[str, int], list[Any]] = defaultdict(list)
        noted: dict[str, set[tuple[str, int]]] = defaultdict(set)
        for owner, places in (both for part in told for both in part["noted"].items()):
            noted[owner] |= set(map(tuple, places))
        for item in self.items:
            for place in noted[item.nodeid] | noted[item.nodeid.partition("::")[0]]:
                self._by_place[place].append(item)
        passed = at_once((self._job(room, mutant) for room, mutant in self._chosen), self._jobs)
        for (room, mutant), alive in zip(self._chosen, passed, strict=True):
            self._tell(room, mutant, alive)
        return True

    def _tell(self, room: str, mutant: Mutant, alive: bool) -> None:
        self._sources.check()
        tally = self.tallies[room]
        self.tallies[room] = tally = tally._replace(count=tally.count + 1)
        listed = (str(mutant.path.relative_to(ROOT / "exo_pin")), mutant.place) in self._known
        if alive:
            (tally.equivalent if listed else tally.alive).append(str(mutant))
        if alive is not listed:
            print(f"{'alive' if alive else 'listed as equivalent, but killed'}: {mutant}", flush=True)

    def _job(self, room: str, mutant: Mutant) -> tuple[Callable[[], bool], float]:
        """What asks whether a mutant is alive, and how long that may take, s."""
        name = str(mutant.path.relative_to(ROOT))
        if mutant.statement:
            items = self._by_place.get((name, mutant.statement), [])
        else:
            places = [items for (path, _), items in self._by_place.items() if path == name]
            items = list(dict.fromkeys(item for found in places for item in found)) or self.items
        total: dict[str, float] = defaultdict(float)
        for item in items:
            total[item.path] += self._took[item.nodeid]
        own = tests_of(room)
        # Stored answers notice most.
        order = {
            item: (not item.path.is_relative_to(own), "answers" not in item.path.name, total[item.path], item.path)
            for item in items
        }
        items = sorted(items, key=lambda item: (order[item], self._took[item.nodeid]))
        passed = list(accumulate((self._took[item.nodeid] for item in items), initial=0.0))
        items = [item for item, before in zip(items, passed, strict=False) if before <= self._budget]
        limit = max(_LEAST_LIMIT, 10.0 * min(passed[-1], self._budget))
        if not mutant.statement:
            return lambda: passes_reloaded(mutant, items, limit), limit
        if self._children:
            rest = [item for item in self.items if item.path.is_relative_to(own) and item not in items]
            return lambda: self._run_changed(mutant, items) and passes_reloaded(mutant, rest, _CHILDREN), _CHILDREN
        return lambda: self._run_changed(mutant, items), limit

    def _run_changed(self, mutant: Mutant, items: list[Any]) -> bool:
        replace_code(mutant.path, Places(mutant.number).visit(parsed(mutant.path)))
        return self._passes(items)

    def _traced(self, items: list[Any]) -> list[dict[str, Any]]:
        """What each test takes and by which statements it comes, in parts."""
        files = sorted({item.path for item in items})
        parts = [[item for item in items if files.index(item.path) % self._jobs == k] for k in range(self._jobs)]
        with tempfile.TemporaryDirectory() as folder:
            told = [Path(folder) / f"{k}.json" for k in range(self._jobs)]
            jobs = (
                (lambda part=part, file=file: self._trace(part, file), None)
                for part, file in zip(parts, told, strict=True)
            )
            if not all(at_once(jobs, self._jobs)):
                raise RuntimeError("the tests could not be run without a mutant")
            return noted_in(Path(folder))

    def _trace(self, items: list[Any], file: Path) -> bool:
        def stop(*_: object) -> None:
            raise TimeoutError(_TOO_SLOW)

        signal.signal(signal.SIGPROF, stop)
        self._notes.begin(sorted({mutant.module for _, mutant in self._chosen}))
        were_stopped = False
        for number, item in enumerate(items):
            begun = time.process_time()  # other work on the machine does not count
            signal.setitimer(signal.ITIMER_PROF, self._slowest)
            if self._passes([item], *items[number + 1 : number + 2]):
                self._notes.took[item.nodeid] = time.process_time() - begun
            else:
                if signal.getitimer(signal.ITIMER_PROF)[0] > 0.0 and not self._stopped and not were_stopped:
                    self._notes.failed.append(item.nodeid)
                were_stopped = True  # what a stopped test leaves behind may fail others, which are left out, too
            self._failed = self._stopped = False
        signal.setitimer(signal.ITIMER_PROF, 0.0)
        self._notes.write(file)
        return True

    def _passes(self, items: list[Any], after: Any = None) -> bool:
        for number, item in enumerate(items, start=1):
            following = items[number] if number < len(items) else after
            item.ihook.pytest_runtest_protocol(item=item, nextitem=following)
            if self._failed:
                return False
        return True


def at_once(jobs: Iterable[tuple[Callable[[], bool], float | None]], count: int) -> Iterator[bool]:
    """Whether each job returns True within its time, s, in a process that may end in any way; in the jobs' order."""
    running: dict[int, tuple[int, float]] = {}
    done: dict[int, bool] = {}
    left, told = enumerate(jobs), 0
    while True:
        while len(running) < count and (following := next(left, None)) is not None:
            number, (job, limit) = following
            running[_started(job)] = number, time.monotonic() + (math.inf if limit is None else limit)
        if not running:
            return
        time.sleep(0.01)
        for child, (number, end) in list(running.items()):
            ended, status = os.waitpid(child, os.WNOHANG)
            if ended or time.monotonic() > end:
                # Servers and children that the tests had no time to end, too.
                with contextlib.suppress(ProcessLookupError):
                    os.killpg(child, signal.SIGKILL)
                if not ended:
                    os.waitpid(child, 0)
                del running[child]
                done[number] = bool(ended) and status == 0
        while told in done:
            yield done.pop(told)
            told += 1


def _started(job: Callable[[], bool]) -> int:
    """The process of a job, whose code is 0 if the job returns True."""
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
    return child


def _forget_results() -> None:
    """Let functions that keep results compute them anew, and kernels be made of what their functions have become."""
    from exo_pin.core.compiled import kernels

    for thing in gc.get_objects():
        # What is asked for its class may be a proxy of what is gone.
        if type(thing) is functools._lru_cache_wrapper and (thing.__module__ or "").startswith("exo_pin"):
            thing.cache_clear()
    if os.environ.get("NUMBA_DISABLE_JIT") == "1":
        for kernel in kernels():
            kernel.forget()


def noted_in(folder: Path) -> list[dict[str, Any]]:
    """What processes have written of the tests they ran: what each took, and by which statements it came."""
    return [json.loads(path.read_text()) for path in sorted(folder.glob("*.json"))]


def known_equivalents() -> dict[tuple[str, Place], str]:
    """Proof of each change that is listed as equivalent, by file of the package and place."""
    listed = tomllib.loads(Path(__file__).with_name("equivalent_mutants.toml").read_text(encoding="utf-8"))["mutant"]
    return {
        (one["file"], Place(one["function"], one["kind"], one["change"], nth)): one["proof"]
        for one in listed
        for nth in one["nth"]
    }


def mutants_of(room: str, options: argparse.Namespace) -> list[Mutant]:
    """All mutants of a room that are asked for."""
    found = [mutant for mutant in mutants(room) if re.search(options.match, str(mutant))]
    return [mutant for mutant in found if not (options.without_kernels and _has_kernels(mutant))]


def chosen_mutants(room: str, options: argparse.Namespace) -> list[Mutant]:
    """Mutants of a room, a seeded sample or all."""
    chosen = mutants_of(room, options)
    if options.all:
        return chosen
    return random.Random(f"{room} {options.seed}").sample(chosen, min(options.count, len(chosen)))


def judged(chosen: dict[str, list[Mutant]], folders: list[Path], options: argparse.Namespace) -> list[Tally]:
    """Judge mutants of rooms by the tests in folders; to be called once in a process."""
    import pytest  # here: the modules of a sample are asked for where only the package is installed

    judge = Judge(chosen, options)
    # pytest reads the line of each frame, and a test that the timer stops may be at none.
    arguments = ["-q", "-s", "-n", "0", "-p", "no:cacheprovider", "--tb=native", "--rootdir", str(ROOT)]
    code = pytest.main([*arguments, *(["-m", "not long"] if options.full else []), *map(str, folders)], plugins=[judge])
    if code != pytest.ExitCode.OK:
        raise RuntimeError(f"the mutants of {', '.join(chosen)} could not be judged: {code}")
    return list(judge.tallies.values())


def _in_own_process(
    chosen: dict[str, list[Mutant]], folders: list[Path], options: argparse.Namespace, compiles: bool
) -> list[Tally]:
    ours, theirs = os.pipe()
    sys.stdout.flush()
    child = os.fork()
    if child == 0:
        try:
            os.environ |= {"NUMBA_DISABLE_JIT": str(int(not compiles)), "OMP_NUM_THREADS": "1"}
            os.write(theirs, json.dumps(judged(chosen, folders, options)).encode())
        except BaseException:
            traceback.print_exc()
        finally:
            sys.stdout.flush()
            os._exit(0)
    os.close(theirs)
    with open(ours, encoding="utf-8") as pipe:
        text = pipe.read()
    os.waitpid(child, 0)
    if not text:
        raise SystemExit(1)
    return [Tally(*part) for part in json.loads(text)]


def _told(chosen: dict[str, list[Mutant]], options: argparse.Namespace) -> Iterator[Tally]:
    """The tally of each room, as it is known."""
    plain = {room: [one for one in ours if not _has_kernels(one)] for room, ours in chosen.items()}
    parts: dict[str, list[Tally]] = {room: [] for room in chosen}
    if options.everywhere:
        for tally in _in_own_process(plain, [ROOT / "tests"], options, compiles=True):
            parts[tally.room].append(tally)
    for room, ours in chosen.items():
        folders = [tests_of(room), *(ROOT / "tests" / name for name in options.beside)]
        kernels = [one for one in ours if _has_kernels(one)]
        for own, compiles in (([] if options.everywhere else plain[room], True), (kernels, False)):
            if own:
                parts[room] += _in_own_process({room: own}, folders, options, compiles)
        yield joined(room, parts[room])


@functools.cache
def _text(path: Path) -> str:
    return path.read_text(encoding="utf-8")


def _has_kernels(mutant: Mutant) -> bool:
    return "\n@kernel" in _text(mutant.path)


def main() -> None:
    """Print the mutants that are alive, and the share of the killed ones by room."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("rooms", nargs="*", default=ROOMS, help="folders of the package")
    parser.add_argument("--count", type=int, default=20, help="mutants of each room (default 20)")
    parser.add_argument("--sample", type=int, help="mutants of all rooms together, in place of so many of each")
    parser.add_argument("--seed", type=int, default=0, help="of the sample")
    parser.add_argument("--all", action="store_true", help="every mutant")
    parser.add_argument("--without-kernels", action="store_true", help="none of files with kernels")
    parser.add_argument("--full", action="store_true", help="with the tests of the full run")
    parser.add_argument("--match", default="", help="only mutants whose line in the list matches this expression")
    parser.add_argument("--slowest", type=float, default=20.0, help="longest test, s of the processor (default 20)")
    parser.add_argument("--beside", nargs="*", default=[], help="folders of tests beside the room's own, such as study")
    parser.add_argument("--everywhere", action="store_true", help="judge by all tests, but for kernels")
    parser.add_argument(
        "--children", action="store_true", help="then by all tests of the room, changed in processes that they start"
    )
    parser.add_argument("--noted", type=Path, help="folder in which the plugin noted_tests has noted what tests run")
    parser.add_argument("--installed", action="store_true", help="change the package that is installed, not this one")
    parser.add_argument("--modules", action="store_true", help="print the modules of the chosen mutants, and no more")
    parser.add_argument("--jobs", type=int, default=2, help="processes at once (default 2)")
    parser.add_argument(
        "--budget", type=float, default=120.0, help="of the tests of one mutant, s of the processor (default 120)"
    )
    parser.add_argument(
        "--least", type=float, default=0.0, help="share, in %%, to be killed in each room, or of a sample"
    )
    options = parser.parse_args()
    os.chdir(ROOT)
    sys.path[:0] = [] if options.installed else [str(ROOT)]
    counts = Counter(room for room in options.rooms for _ in range(options.count))
    if options.sample is not None:
        places = [room for room in options.rooms for _ in mutants_of(room, options)]
        counts = Counter(random.Random(options.seed).sample(places, options.sample))
    chosen = {}
    for room, options.count in sorted(counts.items()):
        chosen[room] = chosen_mutants(room, options)
    if options.modules:
        print(*sorted({one.module for ours in chosen.values() for one in ours}), sep="\n")
        return
    tallies = []
    for tally in _told(chosen, options):
        tallies.append(tally)
        print(tally, flush=True)
    if options.sample is not None:  # a few of each room say little of it
        tallies = [joined("all", tallies)]
    lax = [tally.room for tally in tallies if tally.share < options.least]
    print(
        "\n| room | killed | share | at least, 95 % | equivalent |\n| --- | --- | --- | --- | --- |", *tallies, sep="\n"
    )
    if lax:
        raise SystemExit(f"less than {options.least:g} % killed: {', '.join(lax)}")


if __name__ == "__main__":
    main()
