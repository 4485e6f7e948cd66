"""Every shipped device, presets and 200 random ones at every door: which checks fail, and how long each takes.

::

    python benchmarks/conformance.py                             # all; some hours on one core
    python benchmarks/conformance.py --every 5 --out some.csv    # a fifth of the devices

Runs the checks of tests/device/test_conformance.py, with its random devices. Each line of the table is written when its
check ends, and a second run of the command goes on behind the last line.
"""

import argparse
import csv
import sys
import time
from pathlib import Path

import pytest

CHECKS = Path(__file__).parents[1] / "tests" / "device" / "test_conformance.py"


class Table:
    """Write a line a check, and leave out those that the file has."""

    def __init__(self, path, every):
        self.path, self.every = path, every
        with path.open("a+", newline="") as file:
            file.seek(0)
            self.found = {row[0]: row for row in csv.reader(file)}

    def pytest_collection_modifyitems(self, items):
        """Keep each of so many devices of a check, device by device."""
        devices = list(dict.fromkeys(item.callspec.params["name"] for item in items if hasattr(item, "callspec")))
        kept = dict.fromkeys(devices[:: self.every])
        items[:] = sorted(
            (item for item in items if item.name not in self.found and hasattr(item, "callspec")
             and item.callspec.params["name"] in kept),
            key=lambda item: devices.index(item.callspec.params["name"]),
        )  # fmt: skip

    @pytest.hookimpl(wrapper=True)
    def pytest_runtest_protocol(self, item):
        """Note how long it takes of this process."""
        self.start = time.process_time()
        return (yield)

    def pytest_runtest_logreport(self, report):
        """Write what came of it."""
        if report.when == "call" or report.outcome != "passed":
            crash = getattr(report.longrepr, "reprcrash", None)
            said = " ".join((crash.message if crash else str(report.longrepr or "")).split())[:300]
            row = [report.nodeid.split("::")[-1], report.outcome, f"{time.process_time() - self.start:.1f}", said]
            self.found[row[0]] = row
            with self.path.open("a", newline="") as file:
                csv.writer(file).writerow(row)


def main():
    """Run the checks and print those that fail."""
    parser = argparse.ArgumentParser(description=__doc__.split("\n")[0])
    parser.add_argument("--out", type=Path, default=Path("conformance.csv"), help="table: check, outcome, s, message")
    parser.add_argument("--every", type=int, default=1, help="one device of so many")
    asked = parser.parse_args()
    table = Table(asked.out, asked.every)
    pytest.main([str(CHECKS), "-q", "-m", "full or long or not full", "--tb=short"], plugins=[table])
    rows = list(table.found.values())
    failed = [row for row in rows if row[1] == "failed"]
    for row in failed:
        print(row[0], row[3])
    print(f"{len(rows)} checks, {len(failed)} fail; {sum(float(row[2]) for row in rows):.0f} CPU s")
    sys.exit(bool(failed))


if __name__ == "__main__":
    main()
