"""Poses that presets are driven to and hold: does the arm settle, and was it said before the run where it does not.

    python benchmarks/held_poses.py [--lengths] [--play MM] [poses] [design ...]

Poses are drawn over the range of daily life, held in statics where the design can, reached from rest in 4 s, and held
for 3 s, under the default controller, or with --lengths under the one that sees the lengths alone (pi). With --play
each limb has so much of it in all. "steady" are those that settle and do not swing beyond it in the last half second,
"most" the largest error there. Tables stand on docs/evidence/machine_in_motion.md.
"""

from __future__ import annotations

import argparse
import warnings

import numpy as np

import exo_pin as ep
from exo_pin.control import Experiment, Turn, options_for
from exo_pin.control.experiments.tracking_report import default_controller
from exo_pin.load_case import ADL_BOX

#: Presets whose drives are known.
DESIGNS = (
    "four-linear-actuators-worn", "four-linear-actuators", "four-cables-worn", "four-cables", "six-cables",
    "three-linear-actuators", "four-muscle-cables", "prototype",
)  # fmt: skip
#: Error at the end, degrees, up to which the arm counts as settled.
_SETTLED = 1.0
#: Poses that are drawn for one that is held.
_TRIES = 30


def held(design: str, count: int, controller: str | None, play: float | None) -> tuple[int, int, int, int, list[float]]:
    """Runs, those that settle, were warned of, both; those steady, median and largest error, degrees."""
    exo, rng = ep.load(design), np.random.default_rng(11)
    low, high = np.array(ADL_BOX.intervals).T
    settled, warned = np.zeros(count, dtype=bool), np.zeros(count, dtype=bool)
    errors, most = np.full(count, np.nan), np.full(count, np.nan)
    for k in range(count):
        poses = exo.pose(*rng.uniform(low, high, (_TRIES, 3)).T)
        # One that its drives hold in statics; the last that was drawn of a design that holds none.
        pose = poses[int(np.append(np.flatnonzero(exo.reaction(poses).held), _TRIES - 1)[0])]
        reach = Turn(exo.pose(), pose.as_rotvec(), 4.0)
        options = options_for(exo.mechanism).replace(play=play)
        run = Experiment("held", "held", exo.mechanism, reach, controller, options, duration=7.0)
        warned[k] = bool(run.foreseen)
        try:
            error = np.degrees(run.run().error)
            errors[k], most[k] = error[-1], error[-50:].max()
        except ep.ExoPinError:  # it cannot even start there
            errors[k], warned[k] = np.inf, True
        settled[k] = errors[k] <= _SETTLED
    ends = [float((most <= _SETTLED).sum()), float(np.median(errors)), float(np.nanmax(most))]
    return count, int(settled.sum()), int(warned.sum()), int((warned & settled).sum()), ends


def main(count: int, designs: tuple[str, ...], lengths_alone: bool, play: float | None) -> None:
    """Print a row for each design, and what of the warnings was false."""
    warnings.simplefilter("ignore")
    names = f"{'settled':>9}{'not, not said':>15}{'said':>6}{'said, settled':>15}"
    names += f"{'steady':>8}{'median, °':>11}{'most, °':>9}"
    print(f"{'design':28}{'controller':>11}{names}")
    given, false, runs = "pi" if lengths_alone else None, 0, 0
    for design in designs:
        total, settled, warned, both, (steady, middle, most) = held(design, count, given, play)
        silent = total - settled - (warned - both)
        name = given or default_controller(ep.load(design).mechanism)
        cells = f"{settled:9}{silent:15}{warned:6}{both:15}{steady:8.0f}{middle:11.2f}{most:9.2f}"
        print(f"{design:28}{name:>11}{cells}", flush=True)
        false, runs = false + both, runs + total
    print(f"warned of though it settles: {false} of {runs} runs, {false / max(1, runs):.1%}")


if __name__ == "__main__":
    asked = argparse.ArgumentParser()
    asked.add_argument("poses", nargs="?", type=int, default=60)
    asked.add_argument("designs", nargs="*", default=DESIGNS)
    asked.add_argument("--lengths", action="store_true")
    asked.add_argument("--play", type=float, help="mm")
    words = asked.parse_args()
    main(words.poses, tuple(words.designs), words.lengths, None if words.play is None else 1e-3 * words.play)
