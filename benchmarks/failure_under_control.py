"""One limb tears while the device holds a pose: is the arm still held, how far does it drop, with what force.

    python benchmarks/failure_under_control.py [poses] [design ...]

Poses are drawn over the range of daily life, held in statics. The run begins in the pose, under the model-based
controller, and each limb in turn tears after 0.5 s, or loses its current, with the brake that its drive has. The
controller either knows nothing of it, or counts a drive as torn that is 10 mm from its limb and shares its load among
the others (``FeedbackGains.lost_beyond``). Static: the others hold the pose within their limits, of the same runs.
The table stands on docs/evidence/machine_in_motion.md.
"""

from __future__ import annotations

import sys
import warnings
from dataclasses import replace

import numpy as np
from scipy.spatial.transform import Rotation

import exo_pin as ep
from exo_pin.control import Experiment, Turn, options_for
from exo_pin.control.controllers.model_controller import gains_for
from exo_pin.load_case import ADL_BOX
from exo_pin.workspace import limb_loss

DESIGNS = ("four-linear-actuators-worn", "four-linear-actuators", "six-cables", "four-cables-worn")
#: Fault and what the controller does about it.
RULES = (("torn", np.inf), ("torn", 0.01), ("no current", np.inf))
#: When the limb fails and how long the run takes, s; the error up to which the arm counts as held, degrees.
_START, _END, _HELD = 0.5, 3.5, 5.0


def failed(exo: ep.ShoulderExo, pose: Rotation, fault: str, limb: int, beyond: float) -> tuple[float, ...]:
    """Error at the end and at most, degrees, time until it stays within that of a held pose, s, and peak |F_s|, N."""
    hold = Turn(pose, np.array([0.0, 0.0, 1e-9]), _START)
    run = Experiment(
        "failed", "failed", exo.mechanism, hold, "model", options_for(exo.mechanism), duration=_END,
        faults=(ep.Fault(fault, limb=limb, start=_START),),
        feedback=replace(gains_for(exo.mechanism), lost_beyond=beyond),
    ).run()  # fmt: skip
    after, error = run.run.times >= _START, np.degrees(run.error)
    off = np.flatnonzero(error > _HELD)
    settled = run.run.times[off[-1]] - _START if off.size else 0.0
    force = np.linalg.norm(run.shoulder_force, axis=-1)[after]
    return float(error[-1]), float(error[after].max()), float(settled), float(np.nanmax(force))


def main(count: int, designs: tuple[str, ...]) -> None:
    """Print a row for each design, fault and rule."""
    warnings.simplefilter("ignore")
    print("| design | fault | load shared anew | held in statics | held | drop: median, 95 %, most | time | peak F_s |")
    low, high = np.array(ADL_BOX.intervals).T
    for design in designs:
        exo = ep.load(design)
        drawn = exo.pose(*np.random.default_rng(5).uniform(low, high, (8 * count, 3)).T)
        inside = np.flatnonzero(exo.workspace(drawn, ep.Criteria(names=("stroke", "forces"))).inside)[:count]
        poses = drawn[inside]
        lost = limb_loss(exo.mechanism, exo.workspace(poses, ep.Criteria(names=("forces",))))
        for fault, beyond in RULES:
            found = np.array(
                [failed(exo, pose, fault, limb, beyond) for pose in poses for limb in range(len(exo.limbs))]
            )
            held = found[:, 0] <= _HELD
            drop, time, peak = found[:, 1], found[held, 2], found[:, 3]
            print(
                f"| {design} | {fault} | {'no' if np.isinf(beyond) else 'yes'} | {100 * lost['held'].mean():.0f} % "
                f"| {100 * held.mean():.0f} % of {len(held)} | {np.median(drop):.1f}, {np.percentile(drop, 95):.0f}, "
                f"{drop.max():.0f}° | {np.percentile(time, 95) if held.any() else np.nan:.2f} s | {peak.max():.0f} N |",
                flush=True,
            )


if __name__ == "__main__":
    main(int(sys.argv[1]) if len(sys.argv) > 1 else 15, tuple(sys.argv[2:]) or DESIGNS)
