"""A spastic wearer, a payload that falls, a cable that tears at mid-reach: what the joint gets, by controller.

    python benchmarks/stroke_case.py

Six cables lift the arm of the man of the device's file. His passive and spastic moments are assumptions of this case
and stand below: no measured ones in N m were found. At mid-reach the payload falls, and 0.3 s later the cable tears
that pulls most; the winches' electronics report it after 20 ms. Every controller does the same with a healthy device.
The table stands on docs/howto/control.md.
"""

from __future__ import annotations

import warnings
from pathlib import Path

import numpy as np

import exo_pin as ep
from exo_pin import control

_SOURCE = "an assumption of this case"
#: Length of the reach, s; when payload and cable go, s; error up to which the arm counts as held, degrees.
_END, _DROP, _CUT = 3.0, 1.0, 1.3


def main() -> None:
    """Print a row for each controller, healthy and hurt."""
    warnings.simplefilter("ignore")
    exo = ep.load(Path(__file__).parents[1] / "urdf" / "six-cables.urdf")
    way = np.radians([[10.0, 10.0, 0.0], [50.0, 25.0, 0.0]])
    reach = control.AnglePath([0.0, 2.0], way, exo.side, "minimum_jerk")
    person = (
        control.Passive(2.0, 0.5, reach(0.0).orientation, source=_SOURCE),
        control.Spasticity(0.2, 3.0, 5.0, source=_SOURCE),
    )
    cup = control.Payload(1.0, (0.0, 0.0, -0.55), end=_DROP)
    base = control.FeedbackGains(stiffness=40.0, damping=6.0, integral_time=1.0)
    rules = {
        "feed-forward alone": control.FeedbackGains(stiffness=0.0, damping=0.0, integral_time=np.inf),
        "model": base,
        "model, fault-aware": control.FeedbackGains(40.0, 6.0, 1.0, fault_aware=True),
    }
    limb = int(exo.reaction(reach(_CUT).orientation).closest.actuator_forces.argmax())
    print("| controller | machine | error: rms, most | F_s: mean, most | tensions: rms | back within 5° after |")
    print("| --- | --- | --- | --- | --- | --- |")
    for name, gains in rules.items():
        for hurt in (False, True):
            cut = ep.Fault("torn", limb, start=_CUT, reported_after=0.02)
            run = exo.track(
                reach, "model", duration=_END, feedback=gains, wearer=person, payloads=cup, faults=cut if hurt else ()
            )
            error, force = np.degrees(run.error), np.linalg.norm(run.shoulder_force, axis=1)
            off = np.flatnonzero(error > 5.0)
            back = "never" if off.size and off[-1] == len(error) - 1 else (
                f"{max(run.times[off[-1]] - _CUT, 0.0):.2f} s" if off.size else "at once"
            )  # fmt: skip
            rms = np.sqrt((run.run.tensions**2).mean())
            print(
                f"| {name} | {'cut' if hurt else 'healthy'} | {run.rms_error() * 180 / np.pi:.1f}, {error.max():.0f}° "
                f"| {force.mean():.0f}, {force.max():.0f} N | {rms:.0f} N | {back} |",
                flush=True,
            )


if __name__ == "__main__":
    main()
