"""Energy and loops over ten seconds of free swing, as a table and, with ``--out``, as a picture.

::

    python benchmarks/energy.py --out docs/pictures/energy.png

Planar chains swing under gravity in their plane, with no effort anywhere; the others under their own gravity.
"""

import argparse
import sys
import time
from pathlib import Path

import numpy as np

sys.path.insert(0, str(Path(__file__).parents[1] / "tests" / "oracles"))

SECONDS, COUNT = 10.0, 401
CASES = ("four-bar", "five-bar", "3RRR", "revolute loop", "heavy wrist")
PLANAR = ("four-bar", "five-bar", "3RRR")


def swing(name, seconds):
    """A free swing from rest."""
    from moving_chains import moving

    case = moving(name)
    if name in PLANAR:
        case.chain.model.gravity.linear = np.array([0.0, -9.81, 0.0])
    begun = time.perf_counter()
    result = case.chain.simulate(case.q, 0.0 * case.v, np.linspace(0.0, seconds, COUNT))
    return result, time.perf_counter() - begun


def draw(swings, path):
    """How far the total energy is off."""
    from exo_pin.view.plots.plot_style import LINES, pyplot, tidy

    figure, ax = pyplot().subplots(figsize=(8, 4.5), layout="constrained")
    for (name, result), (colour, dashes) in zip(swings.items(), LINES, strict=False):
        off = np.abs(result.energy - result.energy[0]) / result.kinetic_energy.max()
        ax.semilogy(
            result.times[1:], np.maximum.accumulate(off)[1:], label=name, color=colour, linestyle=dashes, linewidth=1.6
        )
    ax.set(
        xlabel="time, s",
        ylabel="energy error so far / largest kinetic energy",
        xlim=(0.0, SECONDS),
        ylim=(1e-13, 1e-7),
        title="Free swing from rest for 10 s: drift of the total energy",
    )
    tidy(ax)
    figure.legend(loc="outside lower center", ncols=5, frameon=False)
    figure.savefig(path, dpi=200)


def main():
    """Parse and run."""
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("--out", metavar="FILE", help="picture to write")
    parser.add_argument("--coarse", action="store_true", help="half a second: shows that it runs, no result")
    options = parser.parse_args()
    swings = {}
    print(f"{'chain':22}{'energy drift':>14}{'loops open':>13}{'steps':>8}{'time':>9}")
    for name in CASES:
        swings[name], spent = swing(name, 0.5 if options.coarse else SECONDS)
        result = swings[name]
        print(f"{name:22}{result.energy_drift:>14.1e}{result.opening.max():>13.1e}{result.steps:>8}{spent:>7.1f} s")
    if options.out is not None:
        draw(swings, options.out)


if __name__ == "__main__":
    main()
