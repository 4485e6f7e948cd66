r"""What the best designs reach under each limit of a person who sits, and under all of them at once.

    python benchmarks/front_of_limits.py [step]

Limits: a weakest rate of 0.8 mm/°; no twin; clear by 3 mm of two men of 1.755 and 1.87 m whose upper arm has 418 mm
(95th percentile, ANSUR II) under a jacket of 5 mm, with an elbow from 0 to 130°, and of a chair's back of 420 mm; |F_s|
at most 250 N; held while any one limb gives no force; a frame within 120 mm of the back and below the top of the head.
Poses are the daily box with extension to -20°. *Wide* is the best that searches under rate, clearance and |F_s| found:
the command below, its joints then rounded to 1 mm. No design meets all: the table names the limit without which
most poses would come in, and stands on docs/evidence/designs_found.md.

    exo-pin optimise --limbs 4 --family linear --pull 600 --device prototype --person 1.755,85,male,418 --clothing 5 \
        --fits 1.87,111,male,418 --elbow-range 0,130 --obstacle chair --obstacle wall:120 --obstacle ceiling:0 \
        --shoulder-force 250 --least-rate 0.8 --base-radius 120:700 --arm-radius 75:180 --drop 60:230 \
        --seed 2 --budget 24000 --run-length 8000 --step 8 --out wide.toml
"""

from __future__ import annotations

import sys
import warnings
from dataclasses import replace

import numpy as np

import exo_pin as ep
from exo_pin.design.obstacles import obstacle
from exo_pin.load_case import ADL_BOX

#: Joints on the frame and on the cuff, strokes, mm.
WIDE = (
    ((-212, 650, 52), (-230, 338, -567), (-225, 531, 284), (-222, 200, -508)),
    ((-60, 99, -227), (-108, -5, -216), (-144, 104, -95), (-151, 16, -63)),
    ((431, 761), (459, 818), (440, 745), (423, 721)),
)
MEN = tuple(ep.Wearer(*size, "male", arm_girth=0.418, clothing=0.005) for size in ((1.755, 85), (1.87, 111)))
LIMITS = {
    "rate": ep.Criteria(("accuracy",), least_rate=0.8e-3 * 180.0 / np.pi),
    "no twin": ep.Criteria(("twins",), least_twin_angle=np.radians(10.0)),
    "stroke, forces": ep.Criteria(("stroke", "forces", "shoulder_force"), largest_shoulder_force=250.0),
    "clear": ep.Criteria(("clearance",), least_gap=0.003, obstacles=("chair",)),
    "one limb lost": ep.Criteria(("limb_loss",), least_moment_without_limb=0.0),
}


def designs() -> dict[str, ep.ShoulderExo]:
    """The presets of linear actuators, and the wide frame."""
    found = {name: ep.load(name) for name in ("four-linear-actuators-worn", "four-linear-actuators")}
    base, cuff, strokes = (1e-3 * np.array(part, dtype=float) for part in WIDE)
    drive, own = ep.Actuator("linear", pull_limit=600.0, push_limit=600.0), found["four-linear-actuators-worn"]
    limbs = [
        ep.Limb("SPS", stroke=ep.Stroke(long, short / long, 1.0, 0.0), actuator=drive)
        for short, long in strokes.tolist()
    ]
    return found | {"wide": own.replace(geometry=ep.WristGeometry(base, cuff), limbs=limbs)}


def main(step: float) -> None:
    """Print a row for each design: shares of the poses by limit, and of all together, %."""
    warnings.simplefilter("ignore")
    box = [(-20.0, ADL_BOX.intervals[0][1]), *ADL_BOX.intervals[1:]]
    axes = [np.arange(low, high + 1e-9, step) for low, high in box]
    print(f"| design | {' | '.join(LIMITS)} | all | behind the back, above the head | limited by |")
    for name, exo in designs().items():
        worn = exo.worn_by(MEN[0])
        poses = worn.pose(*(each.ravel() for each in np.meshgrid(*axes)))
        inside = {}
        for words, limit in LIMITS.items():
            own = (
                limit
                if words in ("rate", "no twin")
                else replace(limit, wearers=MEN, elbow_range=(0.0, np.radians(130)))
            )
            inside[words] = worn.workspace(poses, own).inside
        every = np.all(list(inside.values()), axis=0)
        # The limit without which most poses come in.
        gain = {
            words: np.all([each for other, each in inside.items() if other != words], axis=0).mean() for words in inside
        }
        points = worn.geometry.base_points
        back, head = obstacle("wall", MEN[0])[0], obstacle("ceiling", MEN[0])[0]
        behind = 1e3 * max(0.0, -(points[:, 0].min() - (back[0] + back[6])))
        above = 1e3 * (points[:, 2].max() - (head[2] - head[6]))
        shares = " | ".join(f"{100.0 * each.mean():.1f}" for each in inside.values())
        limiting = max(gain, key=gain.__getitem__)
        print(
            f"| {name} | {shares} | {100.0 * every.mean():.1f} | {behind:.0f}, {above:+.0f} mm "
            f"| {limiting} ({100.0 * gain[limiting]:.1f} without) |",
            flush=True,
        )


if __name__ == "__main__":
    main(float(sys.argv[1]) if len(sys.argv) > 1 else 10.0)
