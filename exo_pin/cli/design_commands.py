"""``exo-pin presets``, ``check``, ``export``, ``calibrate``, ``sweep`` and ``compare``: designs and their data."""

from __future__ import annotations

import warnings
from collections.abc import Sequence
from pathlib import Path
from typing import Annotated, Any, Literal

from cyclopts import Parameter

from ..calibration import calibrate as calibrated
from ..calibration.calibrate_device import JOINTS
from ..calibration.length_model import UNITS
from ..control import read_run
from ..core.errors import InvalidInput, SuspectMeasurements
from ..core.files import as_file_stem, write_text
from ..core.tables import filled
from ..design import DEFAULT_PRESET, preset, preset_file
from ..design import presets as names_of_presets
from ..design.parameters.names import assigned
from ..exo.loading import load, load_designs
from ..exo.models import EXPORTS
from ..exo.shoulder_exo import ShoulderExo
from ..person.on_person import ON_PERSON
from ..study import StudyTable, adl_box
from ..study import compare as compared
from ..study import sweep as swept
from ..wrist_chain import PARTS
from . import options
from .command import Files, writes
from .options.recording_options import ReadAs, RecordedMotion

Step = Annotated[
    options.Degrees, Parameter(help="Without poses: step of the grid over the box of daily activities, degrees.")
]


@writes(".toml", json=False)
def presets(name: Annotated[str | None, options.called("NAME")] = None, /, *, files: Files = Files()) -> None:
    """List the designs that come with the package. Each name can be used wherever a command takes a design.

    With a name, print the file of that design, as a start for your own.

    Parameters
    ----------
    name : str, optional
        Print the file of this design, as a start for your own.

    Examples
    --------
    exo-pin presets
    exo-pin presets four-linear-actuators --out mine.toml
    """
    if name is None:
        options.refuse("a list of names is not a design", out=files.out)
        width = max(map(len, names_of_presets()))
        print("\n".join(f"{each:{width}}  {preset(each).title}" for each in names_of_presets()))
    else:
        text = preset_file(name)
        files.deliver(text.rstrip("\n"), save=lambda path: write_text(path, text))


@writes(".json")
def check(
    design: options.Design = DEFAULT_PRESET,
    /,
    *,
    side: options.Side = None,
    leave_out: options.LeaveOut = (),
    files: Files = Files(),
) -> int:
    """Check that a design or a robot is consistent.

    Loops close, Jacobians agree with finite differences, masses and inertias are possible. The exit status is 1 if a
    check fails.

    Examples
    --------
    exo-pin check examples/device.toml
    exo-pin check urdf/dummy-shoulder.urdf
    """
    exo = load(design, side=side, leave_out=leave_out)
    report = exo.check()
    files.deliver(report, report, exo=exo)
    return 0 if report.passed else 1


@writes(".urdf", ".xml", ".sdf", json=False)
def export(
    design: options.Design = DEFAULT_PRESET,
    /,
    *,
    side: options.Side = None,
    worn: options.Worn = options.Worn(),
    part: Annotated[str, Parameter(choices=tuple(PARTS))] = "whole",
    on_person: Annotated[str | None, options.called("FILE")] = None,
    cuff: Literal["weld", "spring"] = "weld",
    locked: Annotated[options.Texts, options.called("NAME")] = (),
    bones_only: bool = False,
    files: Files = Files(),
) -> int:
    """Write a design for other programs, in the format of the ending: .urdf, .xml (MJCF) or .sdf.

    Links without mass get small masses that the file marks as assumed, because simulators need them. With --on-person
    one MJCF holds a musculoskeletal person who wears the device.

    Parameters
    ----------
    part : str
        What to write: limbs and shoulder (whole), the limbs alone (wrist), the shoulder alone, or limbs and a free arm
        (floating).
    on_person : str, optional
        MJCF of the person, with the bodies of MyoArm; myoarm for that of the package myo_sim (extra person).
    cuff : str
        On the person: part of the humerus (weld), or held by the stiffness of the design's cuff (spring).
    locked : tuple of str
        On the person: joints that are taken out, scapula, elbow or wrist; may be repeated.
    bones_only : bool
        On the person: without muscles, damping and armature.

    Examples
    --------
    exo-pin export four-cables --out four-cables.xml
    exo-pin export four-cables --on-person myoarm --locked elbow --locked wrist --out worn.xml
    exo-pin export examples/device.toml --person 1.75,75,male --out device.urdf
    """
    if on_person is None:
        options.refuse("--on-person was not given", cuff=cuff != "weld", locked=locked, bones_only=bones_only)
    else:
        options.refuse(
            "--on-person has a body of its own, and the whole device", **options.given(worn), part=part != "whole"
        )
    exo = worn.load(design, side)
    if on_person is None:
        path = files.out or Path(f"{as_file_stem(exo.name)}.urdf")
        written = exo.export(path, part)
        said = [EXPORTS[path.suffix.lower()], written.statement]
    else:
        path = files.out or Path(f"{as_file_stem(exo.name)}-on-person.xml")
        person = None if on_person == "myoarm" else on_person
        written = exo.export_on_person(path, person, cuff, locked, bones_only)
        said = [ON_PERSON, written.statement]
    print("\n".join([*map(str, written), *(filled(text) for each in said if each for text in each.splitlines())]))
    return int(bool(written.lost))


@writes(".toml", json=False)
def calibrate(
    design: options.Design,
    measured: Annotated[str, options.called("CSV")],
    /,
    *,
    side: options.Side = None,
    unknowns: Annotated[str, options.called("NAMES")] = ",".join(JOINTS),
    length_noise: options.Millimetres | None = None,
    tolerance: Annotated[options.Texts, options.called("NAME=SIZE")] = (),
    read_as: ReadAs = ReadAs(),
    files: Files = Files(),
) -> None:
    """Find joint centres and offsets of a device from measured poses and limb lengths, with their standard deviations.

    Begins with what was taken as known and lengths cannot show, such as how the sensors are mounted, and what an error
    of it does. Lists what the measurements cannot determine, and the other devices that fit equally well.

    Parameters
    ----------
    measured : str
        Columns of orientations (as of reaction --trajectory), length_1_mm, ...
    unknowns : str
        What to find, with commas between, of base_points, platform_points, length_offsets, length_scale, base_offset,
        cuff_offset, torso_mounting, arm_mounting.
    length_noise : float, optional
        Standard deviation of a length, mm (default: found from the data).
    tolerance : tuple of str
        Standard deviation of what is known before, mm, degrees or % (of the scale), such as base_points=1 of the
        design or torso_mounting=2 of a sensor; may be repeated. What is not unknown is known to it.

    Examples
    --------
    exo-pin calibrate three-linear-actuators examples/measured.csv --length-noise 0.3 --out calibrated.toml
    """
    if design.endswith(".csv"):
        raise InvalidInput(f"expected the design first: exo-pin calibrate DESIGN {design}")
    nominal = load(design, side=side)
    names = [name.strip() for name in unknowns.split(",")]
    with warnings.catch_warnings():
        if any(name.endswith("mounting") for name in names):
            # Orientations of sensors, which are not those of an arm: lengths say what they are.
            warnings.simplefilter("ignore", SuspectMeasurements)
        run = read_run(measured, nominal.side, read_as.options)
    if length_noise is not None and not length_noise > 0.0:
        raise InvalidInput(f"expected --length-noise in mm, above zero, got {length_noise:g}")
    found = calibrated(
        run.poses,
        run.lengths,
        nominal,
        unknowns=names,
        length_noise=None if length_noise is None else 1e-3 * length_noise,
        tolerances=dict(_tolerance(text) for text in tolerance),
    )
    beside = [name.replace("_", " ") for name in found.model.unknowns if name not in JOINTS]
    note = f"The design holds the joints. Found besides, and no part of it: {', '.join(beside)}." if beside else ""
    files.deliver(f"{found}\n{note}".rstrip(), save=found.exo.save)


def _tolerance(text: str) -> tuple[str, float]:
    """Name and SI value of one --tolerance."""
    name, (value,) = options.named_numbers(text, "--tolerance NAME=SIZE", 1)
    return name, value / UNITS.get(name, ("", 1.0))[1]


def _poses(
    exo: ShoulderExo,
    pose: options.Pose,
    way: options.Way,
    recording: RecordedMotion,
    step: float,
    limits: str,
    split: str | None,
) -> dict[str, Any]:
    """Poses, limits and split of a study."""
    query: dict[str, Any] = {"limits": options.limits_of(limits)} | ({} if split is None else {"split": split})
    if recording:
        options.refuse("a movement has poses of its own", to=way.to)
        poses, motion = recording.asked(exo, pose)
        return query | {"poses": poses, "motion": motion}
    if way.to is not None:
        return query | {"poses": exo.pose(*way.angles(pose).T)}
    return query | {"poses": pose.of(exo) if any(pose.angles) else adl_box(step, exo.side)}


@writes(".csv", ".xlsx", ".json", plot="peak of the shoulder force of every design")
def sweep(
    design: options.Design = DEFAULT_PRESET,
    /,
    *,
    vary: Annotated[options.Texts, options.called("NAME=VALUES")],
    side: options.Side = None,
    pose: options.Pose = options.Pose(),
    way: options.Way = options.Way(),
    recording: RecordedMotion = RecordedMotion(),
    worn: options.Worn = options.Worn(),
    limits: options.LimitsText = "design",
    step: Step = 10.0,
    split: options.Split | None = None,
    payload_at: Annotated[str | None, options.called("X,Y,Z")] = None,
    muscles: options.Muscled = None,
    progress: options.Progress = False,
    files: Files = Files(),
) -> None:
    """Vary one or more parameters of a design and rank the results by the poses that they hold.

    One row for each combination, over a grid of poses of daily activities or the poses that are given.

    Parameters
    ----------
    vary : tuple of str
        A parameter with its unit, and its values: r_A_mm=100:160:4 (low:high:count), cuff_height_mm=180,220,
        A[1].radius_mm=150,180, scale=0.9,1, pull_limit_N=100,200, payload_kg=0,2, lean_forward_deg=0,30 or
        limb_kind=UPU,SPS; repeat it for every combination.
    payload_at : str, optional
        Needed with payload_kg: where it is held, m, in the arm frame, such as 0,0,-0.6.
    muscles : bool, optional
        First the force in the joint with the wearer's own muscles, over the held of at most 100 poses, at rest
        (default: with --person, if the extra 'person' is installed, and of no movement and no payload_kg).

    Examples
    --------
    exo-pin sweep four-cables --vary cuff_height_mm=180:220:3 --vary scale=0.9,1 --step 20 --out table.csv
    exo-pin sweep --vary A[1].radius_mm=150:200:3 --step 20 --plot peak.png
    exo-pin sweep prototype --vary r_A_mm=100,130 --vary alpha_A[2]_deg=50,60,70 --step 20 --out table.csv

    Notes
    -----
    parameters, each for one limb with [i] or without for all; the names are those of ep.sweep and of optimise --vary:
      cuff_height_mm, scale, A[i].radius_mm, A[i].azimuth_deg, A[i].elevation_deg, B[i].radius_mm, B[i].azimuth_deg,
      B[i].drop_mm, nominal_length[i]_mm, end_fitting[i]_mm, pull_limit[i]_N, push_limit[i]_N, least_tension[i]_N,
      limb_kind, payload_kg, lean_forward_deg, lean_left_deg
      of joints on circles: r_A_mm, r_B_mm, h_A_mm, h_B_mm, alpha[i]_deg, alpha_A[i]_deg, alpha_B[i]_deg
    columns of the table:
      contact_N ...      with --person: force in the joint, median, largest, and without the device, N, and relief
      peak, p95, median  shoulder force |F_s| without muscles over the poses that can be held, N
      can_hold           share of the poses that are known to be held
      holdable           share of the poses that are held as far as limits are known
      pull_only          share that limbs which only pull can hold
      least_margin       smallest distance from a singular pose, dimensionless; it depends on the grid
      one_side           share on the more frequent side of the singular surface
      reach              share in which every limb is within its stroke
      A dash: not known for this design.
    """
    exo = worn.load(design, side)
    place = None if payload_at is None else options.numbers(payload_at, "numbers for --payload-at")
    query = _poses(exo, pose, way, recording, step, limits, split)
    counted = options.counts_muscles(muscles, worn, bool(recording) or place is not None)
    table = swept(exo, assigned(vary), progress=progress, payload_at=place, joint=counted, **query)
    above = _as_it_stands(exo, table)
    files.deliver(f"{above}\n{table}" if above else table, table, exo=exo)


def _as_it_stands(exo: ShoulderExo, table: StudyTable) -> str:
    """The values that the varied dimensions have in the design itself, in their units."""
    found = []
    for name in table:
        try:
            (named,) = exo.device.parameters([name])
            value = exo.device.value_of(named)
        except InvalidInput:
            continue
        if value is not None:
            found.append(f"{named.full_name} {value / named.size:.4g}")
    return f"{exo.name} as it is: {', '.join(found)}" if found else ""


@writes(
    ".csv",
    ".xlsx",
    ".json",
    plot="what ranks the designs, the best on top; with --detailed: all that tells the designs apart",
)
def compare(
    design: options.Design = DEFAULT_PRESET,
    *others: str,
    side: options.Side = None,
    pose: options.Pose = options.Pose(),
    way: options.Way = options.Way(),
    recording: RecordedMotion = RecordedMotion(),
    worn: options.Worn = options.Worn(),
    limits: options.LimitsText = "design",
    step: Step = 10.0,
    split: options.Split | None = None,
    muscles: options.Muscled = None,
    detailed: Annotated[bool, options.needs("person")] = False,
    progress: options.Progress = False,
    files: Files = Files(),
) -> None:
    """Compare designs on one arm over the same poses.

    The box of daily activities, the poses that are given, or a movement. All are worn by --person, else by who wears
    the first design; designs for the other side are mirrored. The one that holds more poses ranks first; between
    equals, the one with the lower peak of the shoulder force in the poses that all hold. Equal designs share a rank.
    With --detailed the table compares kinds of devices in more columns.

    Parameters
    ----------
    others : str
        The designs to compare it with. Any of these may be a .csv file with one design a row: its column design names a
        preset or a file, its others parameters as those of sweep --vary, such as r_A_mm.
    muscles : bool, optional
        First the force in the joint with the wearer's own muscles, over the held of at most 100 poses, at rest
        (default: with --person, if the extra 'person' is installed, and of no movement).
    detailed : bool
        Which kind for what, some seconds a design: poses clear of the wearer's body, singular poses, a failed drive,
        efforts and strokes, moving mass, contact force with the wearer's muscles, 10 mm off the centre (needs the extra
        'person').

    Examples
    --------
    exo-pin compare four-cables four-linear-actuators
    exo-pin compare four-cables four-linear-actuators --abduction 30 --to 90,30,0 --poses 4 --out both.csv
    exo-pin compare four-cables examples/device.toml --trajectory examples/lift.csv
    exo-pin compare four-cables urdf/serial-y-x-z.urdf urdf/spherical-3rrr.urdf --person 1.755,85,male --step 20
    exo-pin compare four-cables urdf/spherical-3rrr.urdf --person 1.755,85,male --step 20 --detailed --plot which.png
    """
    groups: list[Sequence[ShoulderExo]] = [
        load_designs(name, side) if name.endswith(".csv") else [load(name, side=side)] for name in (design, *others)
    ]
    exo, *rest = [each for group in groups for each in group]
    exo = worn.on(exo)
    query = _poses(exo, pose, way, recording, step, limits, split)
    person = None if worn.person is None else worn.size
    counted = options.counts_muscles(muscles, worn, bool(recording) or detailed)
    table = compared(exo, *rest, **query, person=person, joint=counted, detailed=detailed, progress=progress)
    files.deliver(table, table, exo=exo)
