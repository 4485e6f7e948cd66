"""How stiff is the arm that a controller shall hold like a spring: pushes in twenty directions.

    python benchmarks/impedance.py [design ...]

The controller is ``control.impedance``; a constant couple pushes the arm that rests at 30° of flexion and 20° of
abduction, and after 2 s its stiffness is the couple over the turn along it. Friction of the drives holds a part of the
couple: what the spring does not. Drives at their limit or the end of their range are named. docs/howto/control.md has
the result.
"""

from __future__ import annotations

import sys
import warnings
from dataclasses import replace
from pathlib import Path

import numpy as np
from scipy.spatial.transform import Rotation

import exo_pin as ep
from exo_pin import control

ROOT = Path(__file__).parents[1]
#: Design, stiffness asked for, N m/rad, and damping, N m s/rad; whether its drives have dry friction.
DESIGNS = (
    ("serial-y-x-z", 40.0, 12.0, False),
    ("six-cables", 20.0, 3.0, True),
    ("four-linear-actuators-worn", 20.0, 3.0, True),
)
_COUPLE, _END, _PUSHES, _AT_LIMIT = 10.0, 2.0, 20, 0.999


def pushed(
    exo: ep.ShoulderExo, stiffness: float, damping: float, couple: np.ndarray, rubs: bool = True
) -> tuple[float, str]:
    """Stiffness that a push finds, N m/rad, and the drive that was at its limit, if one was."""
    pose = exo.pose(30.0, 20.0)
    # Rotors behind gears: a damper at 100 Hz needs inertia.
    options = control.options_for(exo.moved_record).replace(joint_motor=control.JointMotor(inertia=0.3))
    if not rubs:
        smooth = {"coulomb": 0.0, "load_friction": 0.0}
        options = options.replace(
            winch=replace(options.winch, **smooth), linear_actuator=replace(options.linear_actuator, **smooth)
        )
    plant = ep.Plant(exo, options, wearer=control.Push(ep.Load(np.zeros(3), couple)))

    def still(t: float) -> control.ReferenceState:
        return control.ReferenceState(pose, np.zeros(3), np.zeros(3))

    controller = control.impedance(plant, still, stiffness, damping)
    least, greatest = plant.force_limits(plant.contractions.lengths(pose))
    start = plant.held(pose, controller.plans.tensions(pose, None, greatest, least, None).tensions)
    run = plant.simulate(controller, _END, start, rtol=1e-5)
    turn = (run.rotations[-1] * pose.inv()).as_rotvec()
    full = np.abs(run.commands[-1]) > _AT_LIMIT
    left = [min(x - own.shortest, own.longest - x) for x, own in zip(run.lengths[-1], plant.drives, strict=True)]
    names = ", ".join(
        f"drive {k + 1} at its {'limit' if full[k] else 'end'}" for k in np.flatnonzero(full | (np.array(left) < 1e-3))
    )
    return float(couple @ turn / (turn @ turn)), names if run.status == "completed" else run.status


def main() -> None:
    """Print a row for each design."""
    warnings.simplefilter("ignore")
    chosen = [own for own in DESIGNS if own[0] in sys.argv[1:]] or DESIGNS
    axes = Rotation.random(_PUSHES, rng=1).apply([0.0, 0.0, 1.0])
    print(
        "| design | asked | found without friction: median, least, most | within 5 % | friction holds: median, most |"
    )
    print("| --- | --- | --- | --- | --- |")
    for name, stiffness, damping, rubs in chosen:
        file = ROOT / "urdf" / f"{name}.urdf"
        exo = ep.load(file if file.exists() else name)
        pairs = [pushed(exo, stiffness, damping, _COUPLE * axis, False) for axis in axes]
        found = np.array([pair[0] for pair in pairs])
        good, held = int((np.abs(found / stiffness - 1.0) < 0.05).sum()), "-"
        if rubs:
            more = [pushed(exo, stiffness, damping, _COUPLE * axis) for axis in axes]
            pairs += more
            # The couple's component along the turn, less the spring's moment.
            couples = np.array([_COUPLE * (1.0 - stiffness / pair[0]) for pair in more])
            held = f"{np.median(couples):.1f}, {couples.max():.1f} N m"
        limits = "; ".join(sorted({pair[1] for pair in pairs if pair[1]}))
        print(
            f"| {name} | {stiffness:g} N m/rad | {np.median(found):.2f}, {found.min():.2f}, {found.max():.2f} "
            f"| {good} of {len(found)} | {held} |{' ' + limits if limits else ''}",
            flush=True,
        )


if __name__ == "__main__":
    main()
