"""Published multibody problems: error against reference values, energy and CPU time.

::

    python benchmarks/published_problems.py                            # about a minute
    python benchmarks/published_problems.py --speeds 200 --windows 10  # A02 with ten windows

Published times are those of OpenSim 3.2 on an Intel Core i5-4570 (RehabEngGroup/MBSbenchmarksInOpenSim), for the end
time of their own run. CPU times are of the second of two runs, without the compiling of formulas; of the first if it is
long.
"""

import argparse
import sys
import time
from functools import partial
from pathlib import Path

import numpy as np

from exo_pin.core.errors import ExoPinError

sys.path.insert(0, str(Path(__file__).parents[1] / "tests" / "oracles"))

import published_problems as problems

TIMES = np.linspace(0.0, 10.0, 101)


def _windows(N, kind, published=""):
    ends = {"revolute": "hinges", "spherical": "points"}[kind]
    make = partial(problems.parallel_windows, N, kind, np.pi / 2, -1.0, TIMES)
    return f"A02, N = {N}, closed by {ends}", "one angle, 1e-12", make, published


#: Name, what the values are by, maker, and the published time, s, with its end time, s.
ROWS = (
    ("A01, pendulum", "closed form", problems.pendulum, "0.64 (10 s)"),
    _windows(1, "revolute"),
    _windows(1, "spherical"),
    _windows(2, "revolute", "0.46 (10 s)"),
    _windows(2, "spherical", "0.46 (10 s)"),
    ("A03, Andrews' squeezer", "IVP test set", problems.squeezer, "0.38 (0.05 s)"),
    ("A04, Bricard", "derived apart, 6 digits", problems.bricard, "0.26 (10 s)"),
    ("four-bar, diagonal spring", "one angle, 1e-13", problems.diagonal_spring, ""),
    ("A05, flyball governor", "two solvers, 6 digits", problems.governor, ""),
)
LARGE = _windows(40, "spherical")
#: Start speeds of A02, m/s, and the largest error at 10 s that counts as right, m.
SPEEDS, RIGHT = (0.2, 3.0), 1e-3
#: A run that takes longer is timed the first time, s.
LONG = 8.0


def row(name, by, make, published):
    """One row of the table."""
    problem, spent = make(), 0.0
    try:
        for _ in range(2):
            if spent < LONG:
                begun = time.process_time()
                run, error = problem.run()
                spent = time.process_time() - begun
    except ExoPinError as stopped:
        return f"| {name} | {problem.times[-1]:g} | {by} | {type(stopped).__name__} | | | | {published} |"
    crossings = sum(event.kind == "crossing" for event in run.events)
    return (
        f"| {name} | {run.times[-1]:g} | {by} | {error:.1e} | {run.energy_drift:.0e} | {crossings} | {spent:.2f} "
        f"| {published} |"
    )


def counted(N, kind, count):
    """How many of ``count`` start speeds of A02 end right, are refused, and end wrong without a word."""
    right, refused, wrong = 0, [], []
    for speed in np.linspace(*SPEEDS, count):
        problem = problems.parallel_windows(N, kind, np.pi / 2, -speed, TIMES)
        try:
            run, _ = problem.run()
        except ExoPinError as stopped:
            refused.append((round(float(speed), 4), f"{type(stopped).__name__}: {stopped}"))
            continue
        error = np.abs(problem.measured(problem.chain, run.q[-1]) - problem.values[-1]).max()
        right += error < RIGHT
        if error >= RIGHT:
            wrong.append(round(float(speed), 4))
    return right, refused, wrong


def main():
    """Parse and run."""
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("--speeds", type=int, default=100, metavar="COUNT", help="start speeds of A02; 0 for none")
    parser.add_argument("--windows", type=int, default=1, metavar="N", help="windows of these runs")
    parser.add_argument("--large", action="store_true", help="A02 with forty windows, too: minutes")
    options = parser.parse_args()
    print("| problem | end, s | reference | error, m or rad | energy drift | crossings | CPU, s | OpenSim, s |")
    print("| --- | --- | --- | --- | --- | --- | --- | --- |")
    for each in (*ROWS, LARGE) if options.large else ROWS:
        print(row(*each), flush=True)
    if options.speeds < 1:
        return
    print(f"\nA02, N = {options.windows}, {options.speeds} start speeds from {SPEEDS[0]} to {SPEEDS[1]} m/s, 10 s:")
    for kind in ("revolute", "spherical"):
        right, refused, wrong = counted(options.windows, kind, options.speeds)
        print(f"{kind}: right {right}, refused {len(refused)}, wrong without a word {len(wrong)} {wrong or ''}")
        for speed, reason in refused:
            print(f"    {speed} m/s: {reason}")


if __name__ == "__main__":
    main()
