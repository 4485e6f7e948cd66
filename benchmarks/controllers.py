"""Which controller spares the joint most: a person who can do a part of a lift, with cables and linear drives.

    python benchmarks/controllers.py [design ...]

The person follows 40° of flexion in 2 s with at most a share of the moment that the arm's weight takes there, 0.15 s
late, through a passive spring and damper; these numbers are assumptions of this case and stand below. Every controller
has the bar of gravity compensation alone. F_s is of device, weight and motion; the joint's force counts the wearer's
own muscles, which carry what the device leaves (extra person), and their effort is the sum of squared activations. The
table stands on docs/howto/control.md.
"""

from __future__ import annotations

import sys
import warnings
from typing import Any

import numpy as np

import exo_pin as ep
from exo_pin import control
from exo_pin.control.controllers.model_controller import gains_for

DESIGNS = ("four-cables-worn", "four-linear-actuators-worn", "prototype")
#: Who the muscles in the joint are of where the design moves a dummy.
_DUMMY = ep.Wearer(1.75, 75.0, "male")
_SOURCE = "an assumption of this case"
#: Share of the weight's moment that the person can make, delay, s, and length of the lift, s.
_STRENGTH, _DELAY, _LIFT = 0.4, 0.15, 2.0


def person(plant: ep.Plant, reference: Any) -> list[Any]:
    """What the person does."""
    tables = plant.tables
    weight = float(tables.mass * np.linalg.norm(tables.gravity) * np.linalg.norm(tables.centre))
    intent = control.Intent(reference, _STRENGTH * weight, 2.0 * weight, 0.2 * weight, _DELAY)
    return [intent, control.Passive(0.1 * weight, 0.05 * weight, reference(0.0).orientation, source=_SOURCE)]


def rules(plant: ep.Plant, reference: Any) -> dict[str, Any]:
    """The controllers, by name."""
    gains = gains_for(plant.mechanism)
    K, D = gains.stiffness, gains.damping
    return {
        "gravity compensation": control.gravity_compensation(plant),
        "lengths": "pi",
        "impedance": control.impedance(plant, reference, K, D),
        "assist-as-needed": control.assist_as_needed(plant, reference, K, D, 0.05),
        "admittance": control.AdmittanceController(plant, reference, 0.2 * K, K, 0.5 * K),
        "model": "model",
    }


def main() -> None:
    """Print a row for each design and controller."""
    warnings.simplefilter("ignore")
    print("| design | controller | error: rms, most | F_s: mean, most | joint: mean, most | effort | drives: rms |")
    print("| --- | --- | --- | --- | --- | --- | --- |")
    for name in [own for own in DESIGNS if own in sys.argv[1:]] or DESIGNS:
        exo = ep.load(name)
        way = np.radians([[10.0, 10.0, 0.0], [50.0, 10.0, 0.0]])
        reference = control.AnglePath([0.0, _LIFT], way, exo.side, "minimum_jerk")
        plant = ep.Plant(exo, control.options_for(exo.moved_record))
        for rule, controller in rules(plant, reference).items():
            experiment = control.Experiment(
                "case",
                "case",
                exo.moved_record,
                reference,
                controller,
                plant.options,
                wearer=tuple(person(plant, reference)),
            )
            own = experiment.plant
            run = own.simulate(experiment.made_controller(own), _LIFT + 1.0, experiment.start(own), rtol=1e-5)
            error = np.degrees((reference(run.times).orientation * run.rotations.inv()).magnitude())
            force = np.linalg.norm(run.shoulder_force, axis=1)
            drives, size = np.sqrt((run.tensions**2).mean()), own.mechanism.arm.wearer or _DUMMY
            found = exo.joint_contact_of_run(run, ep.Person(size.height, size.mass, size.sex, side=exo.side))
            joint, effort = found.magnitude, 1e3 * float(np.nanmean(found.effort))
            ended = "" if run.status == "completed" else f" {run.status}"
            cells = (
                f"{np.sqrt((error**2).mean()):.1f}, {error.max():.0f}°", f"{force.mean():.0f}, {force.max():.0f} N",
                f"{np.nanmean(joint):.0f}, {np.nanmax(joint):.0f} N", f"{effort:.2f}e-3", f"{drives:.0f} N",
            )  # fmt: skip
            print(f"| {name} | {rule} | {' | '.join(cells)} |{ended}", flush=True)


if __name__ == "__main__":
    main()
