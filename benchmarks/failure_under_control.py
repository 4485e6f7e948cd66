"""A drive fails while the device holds a pose: is the arm still held, how far does it drop, and with what force.

    python benchmarks/failure_under_control.py [--person] [poses] [design ...]

Poses are drawn over the range of daily life, held in statics. The run begins in the pose, under the model-based
controller; after 0.5 s each drive in turn fails, or all lose their current, or the sensor of the arm's orientation goes
for good. *Noticed*: a drive counts as lost that its electronics report after 50 ms, or whose motor is 10 mm from its
limb; the others share its load (``FeedbackGains.lost_beyond``, ``fault_aware``), or let the arm down in 2 s
(``lower_in``), which counts as held where it then hangs. Static: the others hold the pose within their limits. The
force of the cuff is what the device does on the arm; of relaxed muscles the joint gets F_s. With --person a man of
1.75 m and 75 kg wears the design, and the force in his joint is computed whose muscles make what the device does not:
in the held pose, and the most. The table stands on docs/evidence/machine_in_motion.md.
"""

from __future__ import annotations

import argparse
import warnings
from collections.abc import Mapping
from dataclasses import replace
from pathlib import Path
from types import MappingProxyType
from typing import Any, NamedTuple

import numpy as np
from scipy.spatial.transform import Rotation

import exo_pin as ep
from exo_pin.control import Experiment, Imu, Turn, options_for
from exo_pin.control.controllers.model_controller import gains_for
from exo_pin.load_case import ADL_BOX
from exo_pin.workspace import limb_loss

ROOT = Path(__file__).parents[1]
DESIGNS = ("four-linear-actuators-worn", "four-linear-actuators", "four-cables-worn", "six-cables")
#: When something fails and how long the run takes, s; the error up to which the arm counts as held, degrees.
_START, _END, _HELD = 0.5, 3.5, 5.0
_NOTICED: dict[str, Any] = {"lost_beyond": 0.01, "fault_aware": True}


class _Rule(NamedTuple):
    """A fault, how the controller is told of it, and of how many drives it is."""

    words: str
    kind: str | None
    gains: Mapping[str, Any] = MappingProxyType({})
    all_drives: bool = False


RULES = (
    _Rule("torn, not noticed", "torn"),
    _Rule("torn, load shared", "torn", _NOTICED),
    _Rule("torn, let down", "torn", _NOTICED | {"lower_in": 2.0}),
    _Rule("no current, brake", "no current"),
    _Rule("jam", "jam"),
    _Rule("encoder lost", "encoder loss", _NOTICED),
    _Rule("half of the supply", "supply drop"),
    _Rule("power cut, brakes", "no current", all_drives=True),
    _Rule("arm sensor lost", None, all_drives=True),
)


def failed(
    exo: ep.ShoulderExo, pose: Rotation, rule: _Rule, limbs: list[int], person: ep.Person | None
) -> tuple[float, ...]:
    """What follows: error at the end, degrees, and eight more.

    Largest error, degrees; time until it stays within that of a held pose, s; peaks of |F_s| and of the cuff's force,
    N; depth of the device in the body, mm; fastest turn of the arm, degrees a second; the joint's force as held and
    at most, N, NaN without a person.
    """
    device, kind = exo.moved_record, rule.kind
    faults = () if kind is None else tuple(ep.Fault(kind, k, start=_START, reported_after=0.05) for k in limbs)
    experiment = Experiment(
        "failed", "failed", device, Turn(pose, np.array([0.0, 0.0, 1e-9]), _START), "model", options_for(device),
        duration=_END, faults=faults, feedback=replace(gains_for(device), **rule.gains),
        imu=Imu(lost=((_START, _END + 1.0),)) if kind is None else None,
    )  # fmt: skip
    found = experiment.run()
    run, after = found.run, found.run.times >= _START
    error = np.degrees(run.rotations.magnitude() if "lower_in" in rule.gains else found.error)
    off = np.flatnonzero(error > _HELD)
    settled = max(run.times[off[-1]] - _START, 0.0) if off.size else 0.0
    felt = np.full(1, np.nan)
    if person is not None:
        felt = np.asarray(exo.joint_contact_of_run(found, person).magnitude)
    some = run.rotations[after][:: max(1, int(after.sum()) // 40)]
    return (
        float(error[-1]), float(np.degrees(found.error[after]).max()), float(settled),
        float(np.linalg.norm(found.shoulder_force[after], axis=1).max()),
        float(np.linalg.norm(run.cuff_wrench[after, :3], axis=1).max()),
        1e3 * max(0.0, -float(np.nan_to_num(exo.device.gaps(some.as_matrix()).least[:, :2], nan=np.inf).min())),
        float(np.degrees(np.linalg.norm(run.angular_velocity[after], axis=1)).max()),
        float(felt[0]), float(np.fmax.reduce(felt)),
    )  # fmt: skip


def main(count: int, designs: tuple[str, ...], person: ep.Person | None) -> None:
    """Print a row for each design and rule."""
    warnings.simplefilter("ignore")
    print("| design | fault | in statics | held | drop: median, 95 %, most | time ", end="")
    print("| peak F_s, cuff | in the body | fastest | joint: held, most |")
    low, high = np.array(ADL_BOX.intervals).T
    for design in designs:
        exo = ep.load(design if design in ep.presets() else ROOT / "urdf" / f"{design}.urdf")
        exo = exo if person is None else exo.worn_by(person)
        drawn = exo.pose(*np.random.default_rng(5).uniform(low, high, (8 * count, 3)).T)
        # Held by the device itself: not by a wearer who helps.
        inside = np.flatnonzero(exo.reaction(drawn).can_hold)[:count]
        poses, drives = drawn[inside], range(len(exo.device.drives))
        statics = limb_loss(exo.device, exo.workspace(poses, ep.Criteria(names=("forces",))))["held"].mean()
        for rule in RULES:
            sets = [list(drives)] if rule.all_drives else [[k] for k in drives]
            found = np.array([failed(exo, pose, rule, limbs, person) for pose in poses for limbs in sets])
            held = found[:, 0] <= _HELD
            drop, time, force, cuff, depth, speed, before, felt = found.T[1:]
            same = rule.kind == "torn" and "lower_in" not in rule.gains
            print(
                f"| {design} | {rule.words} | {f'{100 * statics:.0f} %' if same else '-'} "
                f"| {100 * held.mean():.0f} % of {len(held)} | {np.median(drop):.1f}, {np.percentile(drop, 95):.0f}, "
                f"{drop.max():.0f}° | {np.percentile(time[held], 95) if held.any() else np.nan:.2f} s "
                f"| {force.max():.0f}, {cuff.max():.0f} N | {depth.max():.0f} mm | {speed.max():.0f}°/s "
                f"| {before.max():.0f}, {felt.max():.0f} N |",
                flush=True,
            )


if __name__ == "__main__":
    asked = argparse.ArgumentParser()
    asked.add_argument("poses", nargs="?", type=int, default=6)
    asked.add_argument("designs", nargs="*", default=DESIGNS)
    asked.add_argument("--person", action="store_true")
    words = asked.parse_args()
    main(words.poses, tuple(words.designs), ep.Person(1.75, 75, "male") if words.person else None)
