"""Measure tests and write which of them run later: python benchmarks/slow_tests.py [--times FILE].

Takes an hour. What takes at least :data:`FULL` seconds goes into ``tests/slow_tests.toml`` as full, and from
:data:`LONG` seconds on as long, besides what is marked so where it stands. Compiling is left out: it would count for
whichever test comes first. FILE keeps the times, one test a line; tests that it has are not measured again.
"""

import argparse
import json
import os
import resource
import subprocess
import sys
import time
from pathlib import Path

import numba.core.event as event
import pytest

ROOT = Path(__file__).resolve().parent.parent
LIST = ROOT / "tests" / "slow_tests.toml"
#: From which on a test is full, and long, s: of the processor, or of waiting where that is more.
FULL, LONG = 0.15, 1.2
#: Never long: the only tests that look at the page of the app, and stored answers, which notice most.
KEPT = ("tests/app/test_page.py", "test_an_answer_is_as_stored")
HEAD = """# Tests that take longer than others: 'python benchmarks/slow_tests.py' measures them and writes this file.
"""


class Compiling(event.Listener):
    """Sums what compiling takes, with all that is compiled for it."""

    def __init__(self):
        self.seconds, self._depth, self._start = 0.0, 0, 0.0

    def on_start(self, event):
        """Start the clock with the first of those that are compiled for one another."""
        self._start = self._start if self._depth else time.process_time()
        self._depth += 1

    def on_end(self, event):
        """Stop it with the first."""
        self._depth -= 1
        self.seconds += 0.0 if self._depth else time.process_time() - self._start


compiling = Compiling()


def clocks():
    """Seconds of the processor and of the clock, without compiling."""
    used = [resource.getrusage(who) for who in (resource.RUSAGE_SELF, resource.RUSAGE_CHILDREN)]
    return [at - compiling.seconds for at in (sum(u.ru_utime + u.ru_stime for u in used), time.monotonic())]


@pytest.hookimpl(wrapper=True)
def pytest_runtest_protocol(item):
    """Write down how long a test takes."""
    before = clocks()
    result = yield
    took = max(after - start for after, start in zip(clocks(), before, strict=True))
    with open(os.environ["TEST_TIMES"], "a", encoding="utf-8") as file:
        mark = "full" if item.get_closest_marker("full") else "quick"
        file.write(f"{took:.2f}\t{mark}\t{item.nodeid}\n")
    return result


def pytest_collection_modifyitems(items):
    """Leave out what has been measured."""
    known = read(Path(os.environ["TEST_TIMES"]))
    items[:] = [item for item in items if item.nodeid not in known]


def read(path):
    """Seconds, and full or quick as marked in the tests, by the name of a test."""
    lines = path.read_text(encoding="utf-8").splitlines() if path.exists() else []
    return {name: (float(seconds), mark) for seconds, mark, name in (line.split("\t", 2) for line in lines)}


def main():
    """Measure and write."""
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("--times", type=Path, default=ROOT / "slow_tests.tsv", help="file that keeps the times")
    path = parser.parse_args().times.resolve()
    more = {"TEST_TIMES": str(path), "PYTEST_PLUGINS": "slow_tests"}
    more["PYTHONPATH"] = os.pathsep.join([str(Path(__file__).parent), os.environ.get("PYTHONPATH", "")])
    # Marks in the tests count; the list, which is made anew, does not.
    command = [sys.executable, "-m", "pytest", "-q", "-n", "2", "--dist", "worksteal", "-m", "not long"]
    if subprocess.run(command, cwd=ROOT, env=os.environ | more).returncode not in (0, 5):
        sys.exit("a test failed: no list is written")
    slow = {"full": [], "long": []}
    for name, (seconds, mark) in sorted(read(path).items()):
        if seconds >= LONG and not any(kept in name for kept in KEPT):
            slow["long"].append(name)
        elif seconds >= FULL and mark == "quick":
            slow["full"].append(name)
    lines = [f"{mark} = {json.dumps(names, indent=4, ensure_ascii=False)}\n" for mark, names in slow.items()]
    LIST.write_text(HEAD + "".join(lines), encoding="utf-8")


if "TEST_TIMES" in os.environ:
    event.register("numba:compile", compiling)
elif __name__ == "__main__":
    main()
