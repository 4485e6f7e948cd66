"""``exo-pin track``, ``thesis`` and ``warm-up``: the machine in motion, the published numbers, and compiling ahead."""

from __future__ import annotations

import contextlib
import sys
import warnings
from dataclasses import dataclass, replace
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any, Literal

import numpy as np

from ..core.conventions import shoulder_rotation
from ..core.errors import InvalidInput, MissingExtra
from ..core.optional_packages import require_extra
from ..core.schema import document
from ..core.tables import aligned
from ..design import DEFAULT_PRESET, Wearer
from ..exo.loading import load
from ..exo.shoulder_exo import ShoulderExo
from ..load_case import Load
from ..reaction import SPLITS
from ..thesis.rows import Row
from . import options
from .command import Files, writes
from .options.recording_options import ReadAs

if TYPE_CHECKING:
    from ..control import Experiment, Tracking
    from ..thesis.all_rows import Section

#: Texts of a row of the thesis.
_TEXTS = ("source", "quantity", "unit", "verdict", "reading", "note")


@dataclass(frozen=True)
class TrackSummary:
    """A run of the machine along a movement.

    Attributes
    ----------
    experiment : str
        Its name.
    status : str
        How it ended.
    verdict : str
        How well the arm followed.
    cautions : list of str
        What to mind.
    findings : list of str
        What was seen.
    numbers : dict of str to float
        By name, which ends in the unit.
    """

    experiment: str
    status: str
    verdict: str
    cautions: list[str]
    findings: list[str]
    numbers: dict[str, float]


@dataclass(frozen=True)
class MissingRow:
    """A printed number that has no row.

    Attributes
    ----------
    section, about, printed, reason : str
        Where it stands, what it is, how it is printed, and why it has no row.
    count : int
        How many numbers, 1.
    """

    section: str
    about: str
    printed: str
    count: int
    reason: str


@dataclass(frozen=True)
class Thesis:
    """Numbers of the thesis beside computed ones.

    Attributes
    ----------
    rows : list of Row
        One a number, each in its own unit.
    without_row : list of MissingRow
        Numbers without one.
    """

    rows: list[Row]
    without_row: list[MissingRow]


@writes(".csv", ".xlsx", ".json", plot="everything over time; as a page an animation", also=(".html",))
def track(
    design: options.Design = DEFAULT_PRESET,
    /,
    *,
    side: options.Side = None,
    trajectory: Annotated[str, options.called("NAME|FILE")] = "abduction",
    experiment: Annotated[str | None, options.called("NAME")] = None,
    list: bool = False,
    controller: Literal["pi", "model"] | None = None,
    supply: options.Bar | None = None,
    play: options.Millimetres | None = None,
    lost_imu: Annotated[str | None, options.called("FROM,TO")] = None,
    fault: Annotated[options.Texts, options.called("KIND,LIMB,START")] = (),
    lost_beyond: options.Millimetres | None = None,
    lower_in: options.Seconds | None = None,
    worn: options.Worn = options.Worn(),
    read_as: ReadAs = ReadAs(),
    no_progress: bool = False,
    files: Files = Files(),
) -> None:
    """Simulate the built machine with drives, sensor and controller.

    A design along a movement, or an experiment of the thesis by name. With --person it also computes the contact force
    in this wearer's shoulder joint; a design carries the wearer's arm, a dummy its own.

    Parameters
    ----------
    trajectory : str
        Abduction, flexion, or a recording (exo-pin reaction --help lists what is read).
    experiment : str, optional
        An experiment of --list, which has a design of its own.
    list : bool
        List the experiments.
    controller : str, optional
        One PI controller for each limb (pi), or a model-based controller (model) (default: as in the
        experiment; of a redundant design that measures more than lengths model, else pi).
    supply : float, optional
        Gauge pressure of the air for muscles, bar (default: as in the experiment).
    play : float, optional
        Backlash between each winch or linear actuator and its limb, end to end, mm (default: as the design states, else
        none).
    lost_imu : str, optional
        Interval without readings of the inertial sensor, s.
    fault : tuple of str
        Kind (torn, burst, stuck-open, stuck-shut, no-current, jam, encoder-loss or supply-drop), number of the limb
        from 1, or all, and time in s; may be repeated.
    lost_beyond : float, optional
        The controller model counts a limb as torn whose motor is this far from it, mm, and shares its
        load (default: never).
    lower_in : float, optional
        Once a limb counts as torn the others let the arm down to where it hangs, in this time, s (default: never).
    no_progress : bool
        Show no bar (none is shown in a pipe or file).

    Examples
    --------
    exo-pin track --list
    exo-pin track four-cables --trajectory examples/lift.csv --out run.csv --plot run.png
    exo-pin track --experiment held-abduction --controller model --plot run.html
    exo-pin track prototype --trajectory examples/lift.csv --fault burst,3,1
    exo-pin track four-linear-actuators-worn --fault torn,1,1 --lost-beyond 10 --lower-in 3
    """
    from ..control import Fault, Imu, experiments
    from ..control import experiment as named
    from ..control.controllers.model_controller import gains_for
    from ..control.experiments.tracking_table import labelled

    if list:
        print("\n".join(f"{name:38} {named(name).title}" for name in experiments()))
        return
    if worn.person is not None:
        require_extra("person")
    if design in experiments():
        raise InvalidInput(f"{design!r} is no design: exo-pin track --experiment {design}")
    if design.endswith(".csv"):
        raise InvalidInput(f"expected the design first: exo-pin track DESIGN --trajectory {design}")
    if experiment is None:
        chosen = _of_design(design, side, trajectory, worn, read_as)
    else:
        chosen = named(experiment)
        if design != DEFAULT_PRESET:
            raise InvalidInput(f"an experiment has a design of its own: leave out {design} or --experiment")
        own = {"trajectory": trajectory != "abduction", "side": side, **options.given(read_as)}
        options.refuse("an experiment has a design and a movement of its own", **own)
        if worn.person is None:
            options.refuse("--person was not given", **options.given(worn))
    changes: dict[str, Any] = {} if controller is None else {"controller": controller}
    if supply is not None:
        from ..muscle.valve.flow import Supply

        if chosen.plant.supply is None:
            raise InvalidInput(f"--supply is for pneumatic muscles, and {chosen.mechanism.name} has none")
        changes["supply"] = Supply(1e5 * supply)
    if play is not None:
        if not any(hasattr(drive, "play") for drive in chosen.plant.drives):
            raise InvalidInput(f"--play is for winches and linear actuators, and {chosen.mechanism.name} has none")
        changes["play"] = 1e-3 * play
    if lost_imu is not None:
        start, end = options.numbers(lost_imu, "2 numbers with a comma between them for --lost-imu", 2)
        changes["imu"] = Imu(lost=((start, end),))
    if fault:
        count = chosen.plant.count
        texts = [text.replace(",all,", f",{limb},", 1) for text in fault for limb in _limbs(text, count)]
        changes["faults"] = tuple(Fault.from_text(text, count) for text in texts)
    chosen = chosen.replace(**changes)
    asked = {"lost_beyond": None if lost_beyond is None else 1e-3 * lost_beyond, "lower_in": lower_in}
    noticing: dict[str, Any] = {name: value for name, value in asked.items() if value is not None}
    if noticing:
        if chosen.controller != "model":
            word = "--lost-beyond" if lost_beyond is not None else "--lower-in"
            raise InvalidInput(f"{word} is for the controller that knows the plant: --controller model")
        gains = chosen.feedback or gains_for(chosen.mechanism)
        chosen = chosen.replace(feedback=replace(gains, **noticing))
    progress = not no_progress and sys.stderr is not None and sys.stderr.isatty()
    for text in chosen.foreseen:
        options.caution(text)
    tracking = chosen.run(progress)
    exo = ShoulderExo.from_device(chosen.mechanism)
    felt = {}
    if worn.person is not None:
        felt = exo.joint_contact_of_run(tracking, worn.muscles(), progress).summary()
    report: dict[str, Any] = {"experiment": chosen.name, "status": tracking.run.status, "verdict": tracking.verdict}
    report |= {"cautions": tracking.cautions, "findings": tracking.findings}
    files.deliver(
        "\n".join([str(tracking), *(f"{labelled(key):26} {value:.4g}" for key, value in felt.items())]),
        tracking,
        data=lambda: document(TrackSummary, {**report, "numbers": {**tracking.summary(), **felt}}),
        exo=exo,
        page=lambda: _recording(exo, tracking),
    )


def _of_design(design: str, side: options.Side, trajectory: str, worn: options.Worn, read_as: ReadAs) -> Experiment:
    """A design along a movement, with the arm of the person.

    A dummy, whose moving part has no person's arm, stays as it is.
    """
    from ..control import Experiment, options_for, reference_of
    from ..control.experiments.catalogue import REFERENCES

    exo = load(design, side=side)
    arm = exo.device.arm
    if arm is None and worn.person is None:
        raise InvalidInput(f"{exo.name} has no arm to move: give --person")
    if worn.person is None or arm is None or arm.person is not None:
        exo = worn.on(exo)
    if trajectory in REFERENCES:
        options.refuse("--trajectory names no recording", **options.given(read_as))
    name, reference = Path(trajectory).stem, reference_of(trajectory, exo.side, read_as.options)
    moved = exo.moved_record
    return Experiment(name, f"{name}, {exo.name}", moved, reference, options=options_for(moved))


def _limbs(fault: str, count: int) -> range:
    """Limbs, from 1, that a fault on the command line is of; one where it names its own."""
    return range(1, count + 1) if ",all," in fault else range(1)


def _recording(exo: ShoulderExo, tracking: Tracking) -> Any:
    from ..view import Scene
    from ..view.scene.scene_recording import record_run

    return record_run(Scene(exo), tracking.run)


@writes(".json", ".csv", ".xlsx")
def thesis(
    *,
    section: Annotated[str | None, options.called("LABEL")] = None,
    all: bool = False,
    reasons: bool = False,
    files: Files = Files(),
) -> None:
    """Count the numbers that the thesis prints, chapter by chapter, beside what is computed here, with a verdict.

    Every number has a row, or a reason why it cannot be computed.

    Parameters
    ----------
    section : str, optional
        Only this section and those inside it, such as 5.1.2, 3 or D.
    all : bool
        Print every row; without it long tables are summed up.
    reasons : bool
        List the printed numbers that have no row, with the reason.

    Examples
    --------
    exo-pin thesis
    exo-pin thesis --section 5.1.2
    exo-pin thesis --all
    """
    from ..thesis import condensed, ledger, ledger_table
    from ..thesis.all_rows import printed_index, sections_named, summary

    sections = printed_index() if section is None else sections_named(section, printed_index())
    everything = ledger()
    chosen = {id(row) for each in sections for entry in each.entries for row in entry.select(everything)}
    rows = [row for row in everything if id(row) in chosen]
    parts = ["\n".join(aligned(summary(sections, rows), words=1))]
    parts += [ledger_table(rows) if all else condensed(rows)] if rows else []
    if reasons or section is not None:
        parts.append(_reasons(sections))
    else:
        parts.append("--section LABEL shows one section, --reasons the numbers that have no row")
    files.deliver(
        "\n\n".join(part for part in parts if part),
        data=lambda: document(Thesis, _as_data(sections, rows)),
        columns=lambda: {name: [getattr(row, name) for row in rows] for name in _TEXTS},
    )


def _without_row(sections: list[Section]) -> list[tuple[Section, Any]]:
    """Sections and entries of numbers without a row."""
    return [(section, entry) for section in sections for entry in section.entries if entry.reason]


def _reasons(sections: list[Section]) -> str:
    lines = [
        f"{section.label}: {entry.about}: {entry.printed or f'{entry.cells} numbers'}: {entry.reason}"
        for section, entry in _without_row(sections)
    ]
    return "\n".join(["Numbers without a row, and why:", *lines]) if lines else ""


def _as_data(sections: list[Section], rows: list[Row]) -> dict[str, Any]:
    """Every row, and every number without one."""
    names = ("about", "printed", "count", "reason")
    return {
        "rows": rows,
        "without_row": [
            {"section": section.label, **{name: getattr(entry, name) for name in names}}
            for section, entry in _without_row(sections)
        ],
    }


def warm_up() -> None:
    """Compile all numerical functions now, so that later commands need not wait.

    It takes one to three minutes, once; nothing else changes.

    Examples
    --------
    exo-pin warm-up
    """
    from ..core.compiled import compilations, kernels, mode
    from ..workspace import Criteria

    exo, cables = load("prototype"), load("four-cables")
    rigid = [name for name, law in SPLITS.items() if not law.determines_sides]
    many = shoulder_rotation(np.linspace(20.0, 60.0, 3), 10.0, 5.0, degrees=True)
    with mode("compiled"):
        # A pose and a stack of poses compile apart.
        for pose in (many[0], many):
            state = exo.inverse_kinematics(pose)
            x, y = state.base_theta_x, state.base_theta_y
            exo.forward_kinematics(state.lengths)
            for angles in ({"theta_x": x}, {"theta_y": y}, {"theta_x": x, "theta_y": y}):
                exo.forward_kinematics_from_base_angles(**angles)
            exo.jacobian(pose)
            exo.singularity(pose)
            for split in rigid:
                exo.reaction(pose, split=split)
                exo.reaction(pose, split=split, limits="pull")
            exo.reaction(pose, constraint_bounds="actuator", split="minimal")
        for split in rigid:
            exo.reaction_map(many, split=split)
        chain = exo.chain
        q, v = chain.close(chain.neutral()), np.zeros(chain.model.nv)
        chain.mobility(q)
        chain.inverse_dynamics(q, v, v)
        wearer = Wearer(1.75, 75, "male")
        criteria = Criteria(largest_shoulder_force=100.0, wearers=(wearer,))
        for each in (exo, cables):
            each.workspace(40.0, criteria)
            each.workspace(many, criteria, Load(np.ones(3)))
            for controller in ("pi", "model"):
                each.track("abduction", controller, duration=0.02)
        # Suggestions, margins and twins, too; its pictures need an extra, which may be missing.
        with contextlib.suppress(MissingExtra), warnings.catch_warnings():
            warnings.simplefilter("ignore")
            load(DEFAULT_PRESET).report(wearer)
    ready = sum(each.is_ready for each in kernels())
    print(f"{ready} kernels are ready; {compilations()} functions were compiled now")
