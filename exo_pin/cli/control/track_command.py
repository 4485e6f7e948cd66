"""``exo-pin track``: the machine in motion under a controller, with results to files."""

from __future__ import annotations

import argparse
import json
import sys
from dataclasses import replace
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np

from ...core.errors import InvalidInput, UnknownName
from ...core.files import write_figure
from ...core.validation import as_choice
from .. import add_file, add_flag, add_number, add_repeated
from ..options.option_values import numbers, require_ending
from ..options.query_options import add_person, person_arm, wearer

if TYPE_CHECKING:
    from ...control import Experiment, Fault, Tracking
    from ...exo.shoulder_exo import ShoulderExo

__all__ = ["add_commands"]

#: Movements for any design.
MOVEMENTS = ("abduction", "flexion")
#: Samples a second of the wearer's contact force; each takes some milliseconds.
_CONTACT_RATE = 5.0
#: Highest supply pressure, bar.
_HIGHEST = 20.0


def add_commands(commands: Any) -> None:
    """Register the commands of this module."""
    parser = commands.add_parser("track")
    parser.add_argument(
        "study",
        nargs="?",
        metavar="EXPERIMENT|FILE",
        help="name of an experiment (--list), or a CSV file of orientations",
    )
    add_flag(parser, "--list", "list the experiments")
    parser.add_argument(
        "--design",
        metavar="PRESET|FILE",
        help="design for abduction, flexion or the movement of a FILE (default: prototype)",
    )
    parser.add_argument(
        "--controller",
        choices=("pi", "model"),
        help="pi: each limb by itself; model: the one that knows the plant (default: as in the experiment)",
    )
    add_flag(parser, "--flange", "with the second flange bearing of Section 5.4.3")
    add_number(parser, "--supply", "BAR", "gauge pressure of the air for muscles, bar (default: as in the experiment)")
    parser.add_argument("--lost-imu", metavar="FROM,TO", help="no reading of the inertial sensor, s")
    add_number(parser, "--drift", "DEG_S", "drift of the inertial sensor, degrees a second (default 0)")
    add_number(parser, "--noise", "DEG", "noise of the inertial sensor, degrees (default 0)")
    add_number(parser, "--delay", "S", "delay of the inertial sensor, s (default 0)")
    parser.add_argument("--seed", type=int, default=0, help="seed of the noise (default 0)")
    add_repeated(
        parser,
        "--fault",
        "KIND,LIMB,START",
        "torn, burst, stuck-open, stuck-shut or no-current, number of the limb from 1, time in s; may be repeated",
    )
    add_flag(parser, "--sensitivity", "run it again with every estimated parameter changed, as a table")
    add_person(
        parser,
        "contact force in that wearer's shoulder joint too; a --design carries their arm, a dummy its own",
    )
    add_flag(parser, "--no-progress", "show no bar (none is shown in a pipe or file)")
    add_flag(parser, "--json", "print JSON")
    add_file(parser, "--out", "everything over time, or the table, as CSV")
    add_file(parser, "--plot", "page of plots: PNG, SVG or PDF")
    add_file(parser, "--html", "animation, a page that opens without a network")
    parser.set_defaults(run=_track)


def _track(options: argparse.Namespace) -> int:
    from ...control import experiment, experiments, fault_band, sensitivity
    from ...control.experiments.sensitivity import band_of
    from ...control.experiments.tracking import labelled

    if options.list:
        for name in experiments():
            print(f"{name:38} {experiment(name).title}")
        return 0
    if options.study is None:
        raise InvalidInput("expected an experiment or a file: exo-pin track --list names the experiments")
    require_ending("--out", options.out, ".csv")
    require_ending("--html", options.html, ".html", ".htm")
    single = ("plot", "html", "person", "json")
    extra = [f"--{name}" for name in single if getattr(options, name)] if options.sensitivity else []
    if extra:
        raise InvalidInput(f"--sensitivity prints a table of many runs: leave out {', '.join(extra)}")
    for name in ("out", "plot", "html"):
        path = getattr(options, name)
        if path is not None and not path.parent.is_dir():
            raise InvalidInput(f"cannot write --{name} {path}: there is no folder {path.parent}, make it first")
    chosen = _experiment(options)
    progress = _shows_progress(options)
    if options.sensitivity:
        table = sensitivity(chosen, progress=progress)
        print(chosen.title)
        if chosen.faults:
            print("After the fault |F_s| reaches {:.0f} to {:.0f} N over these runs.".format(*band_of(table)))
        print(table)
        if options.out is not None:
            table.to_csv(options.out)
            print(options.out)
        return 0
    tracking = chosen.run(progress)
    if chosen.faults:
        tracking = replace(tracking, fault_band=fault_band(chosen, progress))
    contact = None if options.person is None else _contact(options, tracking)
    if options.json:
        summary = tracking.summary() | (contact or {})
        finite = {key: value if np.isfinite(value) else None for key, value in summary.items()}
        report = {"experiment": chosen.name, "status": tracking.run.status, "verdict": tracking.verdict}
        said = {"fault_band_N": tracking.fault_band, "cautions": tracking.cautions, "findings": tracking.findings}
        print(json.dumps({**report, **said, **finite}, indent=2))
    else:
        print(tracking)
        for key, value in (contact or {}).items():
            print(f"{labelled(key):26} {value:.4g}")
    return _deliver(options, tracking)


def _shows_progress(options: argparse.Namespace) -> bool:
    """Whether there is somebody to show a bar to."""
    return not options.no_progress and sys.stderr is not None and sys.stderr.isatty()


def _deliver(options: argparse.Namespace, tracking: Tracking) -> int:
    """Write the files that were asked for."""
    said = (lambda path: None) if options.json else print
    if options.out is not None:
        tracking.to_csv(options.out)
        said(options.out)
    if options.plot is not None:
        from ...view.plots.force_plots import use_file_backend

        use_file_backend()
        write_figure(options.plot, tracking.plot())
        said(options.plot)
    if options.html is not None:
        from ...exo.shoulder_exo import ShoulderExo
        from ...view import Scene
        from ...view.scene.run_recording import record_run

        scene = Scene(ShoulderExo.from_mechanism(tracking.experiment.mechanism))
        record_run(scene, tracking.run).save(options.html)
        said(options.html)
    return 0


def _experiment(options: argparse.Namespace) -> Experiment:
    """The experiment that the options describe."""
    from ...control import Experiment, experiment, experiments, options_for, reference_of
    from ...control.trajectories.orientation_spline import read_reference
    from ...exo.shoulder_exo import load

    if options.study in MOVEMENTS and options.design is not None:
        exo = _carried(load(options.design), options)
        reference = reference_of(options.study, exo.side)
        title = f"{options.study}, {exo.mechanism.name}"
        chosen = Experiment(options.study, title, exo.mechanism, reference, options=options_for(exo.mechanism))
    elif options.study in experiments():
        if options.design is not None:
            raise InvalidInput("--design is for abduction, flexion or a file's movement: an experiment has its own")
        chosen = experiment(options.study)
    elif Path(options.study).suffix.lower() == ".csv":
        exo = _carried(load(options.design or "prototype"), options)
        reference = read_reference(options.study, exo.side)
        name = Path(options.study).stem
        chosen = Experiment(name, name, exo.mechanism, reference, options=options_for(exo.mechanism))
    else:
        raise UnknownName("experiment", options.study, experiments())
    changes: dict[str, Any] = {} if options.controller is None else {"controller": options.controller}
    if options.flange:
        if chosen.mechanism.shoulder.half_diagonal is None:
            raise InvalidInput(f"--flange is for the dummy's shoulder unit, and {chosen.mechanism.name} has none")
        changes["second_flange"] = True
    if options.supply is not None:
        from ...muscle.valve.supply import Supply

        if not 0.0 < options.supply <= _HIGHEST:
            raise InvalidInput(f"expected --supply in bar, above 0 and up to {_HIGHEST:g}, got {options.supply:g}")
        if chosen.plant.supply is None:
            raise InvalidInput(f"--supply is for pneumatic muscles, and {chosen.mechanism.name} has none")
        changes["supply"] = Supply(1e5 * options.supply)
    imu = _imu(options)
    if imu is not None:
        changes["imu"] = imu
    if options.fault:
        count, duration = chosen.mechanism.limb_count, chosen.reference.duration
        changes["faults"] = tuple(_fault(text, count, duration) for text in options.fault)
    return chosen.replace(**changes)


def _carried(exo: ShoulderExo, options: argparse.Namespace) -> ShoulderExo:
    """The design with the arm of the person; a dummy, whose moving part has no person's arm, stays as it is."""
    arm = exo.mechanism.arm
    if arm is None and options.person is None:
        raise InvalidInput(f"{exo.name} has no arm to move: give --person")
    dummy = arm is not None and arm.person is None
    return exo if options.person is None or dummy else exo.worn_by(person_arm(options))


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
        given["lost"] = (tuple(_two_numbers("--lost-imu", options.lost_imu)),)
    return Imu(seed=options.seed, **given) if given else None


def _fault(text: str, count: int, duration: float) -> Fault:
    """The fault that a text describes, of one of ``count`` limbs in a run of ``duration`` seconds."""
    from ...control import Fault

    kinds = {
        "burst": ("burst", -1.0), "torn": ("torn", -1.0), "stuck-open": ("stuck valve", 1.0),
        "stuck-shut": ("stuck valve", -1.0), "no-current": ("no current", -1.0),
    }  # fmt: skip
    kind, _, rest = text.partition(",")
    name, command = kinds[as_choice("fault", kind, kinds)]
    limb, start = _two_numbers("--fault KIND", rest)
    if limb not in range(1, count + 1):
        raise InvalidInput(f"expected a limb from 1 to {count} in --fault {text}, got {limb:g}")
    if not 0.0 <= start < duration:
        raise InvalidInput(
            f"expected a start from 0 to {duration:g} s in --fault {text}, when the run ends; got {start:g}"
        )
    return Fault(name, int(limb) - 1, start, command=command)  # type: ignore[arg-type]


def _two_numbers(option: str, text: str) -> list[float]:
    return numbers(text, f"2 numbers with a comma between them for {option}", 2)


def _contact(options: argparse.Namespace, tracking: Tracking) -> dict[str, float]:
    """Contact force of the wearer's shoulder joint along the run, with the run's tensions."""
    from ...exo.shoulder_exo import ShoulderExo
    from ...load_case import Motion

    exo = ShoulderExo.from_mechanism(tracking.experiment.mechanism)
    run, count = tracking.run, len(tracking.times)
    rows = slice(None, None, max(round((count - 1) / max(tracking.times[-1] * _CONTACT_RATE, 1.0)), 1))
    found = exo.joint_contact(
        run.rotations[rows],
        wearer(options),
        forces=run.tensions[rows],
        motion=Motion(run.angular_velocity[rows], run.angular_acceleration[rows]),
        outside="mark",
        progress=_shows_progress(options),
    )
    alone = found.without_device
    assert alone is not None
    # What has no result counts nowhere; without any there is no number.
    with_device, without = (
        force[np.isfinite(force)] if np.isfinite(force).any() else np.array([np.nan])
        for force in (found.magnitude, alone.magnitude)
    )
    return {
        "peak_contact_N": float(with_device.max()),
        "mean_contact_N": float(with_device.mean()),
        "mean_contact_without_device_N": float(without.mean()),
    }
