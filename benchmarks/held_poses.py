"""Poses that presets are driven to and hold: does the arm settle, and was it said before the run where it does not.

    python benchmarks/held_poses.py [--lengths] [poses] [design ...]

Poses are drawn over the range of daily life, held in statics where the design can, reached from rest in 4 s, and held
for 3 s, under the default controller, or with --lengths under the one that sees the lengths alone (pi). Tables stand
on docs/evidence/machine_in_motion.md.
"""

from __future__ import annotations

import sys
import warnings

import numpy as np

import exo_pin as ep
from exo_pin.control import Experiment, Turn, options_for
from exo_pin.control.experiments.foresight import default_controller
from exo_pin.load_case import ADL_BOX

DESIGNS = (
    "four-linear-actuators-worn", "four-linear-actuators", "four-cables-worn", "four-cables", "six-cables",
    "three-linear-actuators", "four-muscle-cables", "prototype", "optimised-table-5-3", "optimised-table-c-2",
)  # fmt: skip
#: Error at the end, degrees, up to which the arm counts as settled.
_SETTLED = 1.0
#: Poses that are drawn for one that is held.
_TRIES = 30


def held(design: str, count: int, controller: str | None = None) -> tuple[int, int, int, int, float]:
    """Runs, those that settle, that were warned of, warned of though they settle; and the median error, degrees."""
    exo, rng = ep.load(design), np.random.default_rng(11)
    low, high = np.array(ADL_BOX.intervals).T
    settled, warned = np.zeros(count, dtype=bool), np.zeros(count, dtype=bool)
    errors = np.full(count, np.nan)
    for k in range(count):
        poses = exo.pose(*rng.uniform(low, high, (_TRIES, 3)).T)
        # One that its drives hold in statics; the last that was drawn of a design that holds none.
        pose = poses[int(np.append(np.flatnonzero(exo.reaction(poses).held), _TRIES - 1)[0])]
        reach = Turn(exo.pose(), pose.as_rotvec(), 4.0)
        run = Experiment("held", "held", exo.mechanism, reach, controller, options_for(exo.mechanism), duration=7.0)
        warned[k] = bool(run.foreseen)
        try:
            errors[k] = np.degrees(run.run().error[-1])
        except ep.ExoPinError:  # it cannot even start there
            errors[k], warned[k] = np.inf, True
        settled[k] = errors[k] <= _SETTLED
    return count, int(settled.sum()), int(warned.sum()), int((warned & settled).sum()), float(np.median(errors))


def main(count: int, designs: tuple[str, ...], lengths_alone: bool) -> None:
    """Print a row for each design, and what of the warnings was false."""
    warnings.simplefilter("ignore")
    names = f"{'settled':>9}{'not, not said':>15}{'said':>6}{'said, settled':>15}{'median, °':>11}"
    print(f"{'design':28}{'controller':>11}{names}")
    given, false, runs = "pi" if lengths_alone else None, 0, 0
    for design in designs:
        total, settled, warned, both, middle = held(design, count, given)
        silent = total - settled - (warned - both)
        name = given or default_controller(ep.load(design).mechanism)
        print(f"{design:28}{name:>11}{settled:9}{silent:15}{warned:6}{both:15}{middle:11.2f}", flush=True)
        false, runs = false + both, runs + total
    print(f"warned of though it settles: {false} of {runs} runs, {false / max(1, runs):.1%}")


if __name__ == "__main__":
    words = [word for word in sys.argv[1:] if word != "--lengths"]
    main(int(words[0]) if words else 60, tuple(words[1:]) or DESIGNS, "--lengths" in sys.argv)
