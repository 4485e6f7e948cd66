"""``exo-pin track``: the machine in motion under a controller, with results to files."""

from __future__ import annotations

import argparse
import json
import sys
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np

from ...core.errors import InvalidInput
from ...core.results import plain
from ...exo.loading import load
from ...exo.shoulder_exo import ShoulderExo
from .. import deliver
from ..options.query_options import numbers, person_size, wearer

if TYPE_CHECKING:
    from ...control import Experiment, Tracking


def run_track(options: argparse.Namespace) -> int:
    """Answer ``exo-pin track`` and return its exit status."""
    from ...control import experiment, experiments
    from ...control.experiments.tracking_report import labelled

    if options.list:
        for name in experiments():
            print(f"{name:38} {experiment(name).title}")
        return 0
    chosen = _experiment(options)
    progress = not options.no_progress and sys.stderr is not None and sys.stderr.isatty()
    tracking = chosen.run(progress)
    exo = ShoulderExo.from_mechanism(chosen.mechanism)
    contact = None if options.person is None else exo.joint_contact_of_run(tracking, wearer(options), progress)
    felt = {} if contact is None else contact.summary()
    report: dict[str, Any] = {"experiment": chosen.name, "status": tracking.run.status, "verdict": tracking.verdict}
    report |= {"cautions": tracking.cautions, "findings": tracking.findings}
    page = options.plot is not None and options.plot.suffix.lower() == ".html"
    deliver(
        options,
        "\n".join([str(tracking), *(f"{labelled(key):26} {value:.4g}" for key, value in felt.items())]),
        json=lambda: json.dumps(plain({**report, **tracking.summary(), **felt}), indent=2),
        save=tracking.to_csv,
        figure=tracking.plot,
        page=(lambda: _recording(exo, tracking)) if page else None,
    )
    return 0


def _recording(exo: ShoulderExo, tracking: Tracking) -> Any:
    from ...view import Scene
    from ...view.scene.scene_recording import record_run

    return record_run(Scene(exo), tracking.run)


def _experiment(options: argparse.Namespace) -> Experiment:
    """The experiment that the options describe."""
    from ...control import Experiment, experiment, experiments, options_for, reference_of

    if options.design in experiments():
        raise InvalidInput(f"{options.design!r} is no design: exo-pin track --experiment {options.design}")
    if options.design.endswith(".csv"):
        raise InvalidInput(f"expected the design first: exo-pin track DESIGN --trajectory {options.design}")
    if options.experiment is not None:
        chosen = experiment(options.experiment)
    else:
        given = load(options.design, side=options.side)
        _ = given.track  # a device that is not a wrist says here why it has none
        exo = _carried(given, options)
        name, reference = Path(options.trajectory).stem, reference_of(options.trajectory, exo.side)
        options_of = options_for(exo.mechanism)
        chosen = Experiment(name, f"{name}, {exo.name}", exo.mechanism, reference, options=options_of)
    changes: dict[str, Any] = {} if options.controller is None else {"controller": options.controller}
    if options.flange:
        if chosen.mechanism.shoulder.half_diagonal is None:
            raise InvalidInput(f"--flange is for the dummy's shoulder unit, and {chosen.mechanism.name} has none")
        changes["second_flange"] = True
    if options.supply is not None:
        from ...muscle.valve.flow import Supply

        if chosen.plant.supply is None:
            raise InvalidInput(f"--supply is for pneumatic muscles, and {chosen.mechanism.name} has none")
        changes["supply"] = Supply(1e5 * options.supply)
    imu = _imu(options)
    if imu is not None:
        changes["imu"] = imu
    if options.fault:
        from ...control import Fault

        changes["faults"] = tuple(Fault.from_text(text, chosen.mechanism.limb_count) for text in options.fault)
    return chosen.replace(**changes)


def _carried(exo: ShoulderExo, options: argparse.Namespace) -> ShoulderExo:
    """The design with the arm of the person; a dummy, whose moving part has no person's arm, stays as it is."""
    arm = exo.mechanism.arm
    if arm is None and options.person is None:
        raise InvalidInput(f"{exo.name} has no arm to move: give --person")
    dummy = arm is not None and arm.person is None
    return exo if options.person is None or dummy else exo.worn_by(person_size(options))


def _imu(options: argparse.Namespace) -> Any:
    """The inertial sensor, if an option is about it."""
    from ...control import Imu

    given: dict[str, Any] = {}
    for name, unit in (("noise", "degrees"), ("drift", "degrees a second"), ("delay", "s")):
        value = getattr(options, name)
        if value is None:
            continue
        if name != "drift" and not value >= 0.0:
            raise InvalidInput(f"expected --{name} in {unit}, zero or more, got {value:g}")
        given[name] = value if unit == "s" else np.radians(value)
    if options.lost_imu is not None:
        given["lost"] = (tuple(numbers(options.lost_imu, "2 numbers with a comma between them for --lost-imu", 2)),)
    return Imu(seed=options.seed, **given) if given else None
