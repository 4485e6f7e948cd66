"""Poses that a remedy suggests, typed in again: held, clear of the wearer and within the range of motion.

    python benchmarks/suggestions.py [count]

Poses are drawn over and beyond the range of daily life; for those that a design does not hold, the text of the remedy
is read, and its whole degrees are asked again. The table stands on docs/evidence/machine_in_motion.md.
"""

from __future__ import annotations

import re
import sys
import warnings

import numpy as np

import exo_pin as ep
from exo_pin.load_case.case import beyond_motion

#: Designs that are asked, and the box of angles that poses are drawn from, degrees.
DESIGNS = (
    "four-linear-actuators-worn", "four-cables-worn", "four-linear-actuators", "four-cables", "three-linear-actuators",
    "six-cables", "four-muscle-cables",
)  # fmt: skip
LEAST, MOST = (-40.0, -30.0, -60.0), (160.0, 120.0, 110.0)


def main(count: int) -> None:
    """Ask each design so often, and print a row for each."""
    warnings.simplefilter("ignore")
    print(f"{'design':28}{'suggested':>10}{'held':>7}{'clear':>7}{'in range':>10}{'twins':>7}{'none found':>12}")
    totals = np.zeros(6, dtype=int)
    for design in DESIGNS:
        exo, rng, row = ep.load(design), np.random.default_rng(7), np.zeros(6, dtype=int)
        while row[0] < count // len(DESIGNS) + 1:
            pose = exo.pose(*rng.uniform(LEAST, MOST))
            if exo.reaction(pose).held:
                continue
            text = str(exo.remedy(pose))
            said = re.search(r"away: flexion (-?\d+)°, abduction (-?\d+)°, internal rotation (-?\d+)°", text)
            if said is None:
                row[5] += 1
                continue
            again = exo.pose(*map(float, said.groups()))
            answer = exo.reaction(again)
            fine = (
                bool(answer.held),
                not answer.clearance < 0.0,
                not beyond_motion(again.as_matrix()[None], exo.side)[0],
            )
            row[:5] += 1, *map(int, fine), int("looks the same" in text)
        print(f"{design:28}{row[0]:10}{row[1]:7}{row[2]:7}{row[3]:10}{row[4]:7}{row[5]:12}", flush=True)
        totals += row
    print(f"{'all':28}{totals[0]:10}{totals[1]:7}{totals[2]:7}{totals[3]:10}{totals[4]:7}{totals[5]:12}")


if __name__ == "__main__":
    main(int(sys.argv[1]) if len(sys.argv) > 1 else 500)
