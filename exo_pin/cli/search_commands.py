"""``exo-pin workspace`` and ``optimise``: which poses a design reaches and holds, and a search for more."""

from __future__ import annotations

import shlex
from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Annotated, Any, Literal

import numpy as np
from cyclopts import Parameter

from ..core.errors import InvalidInput
from ..core.optional_packages import require_extra
from ..core.tables import filled, newtons
from ..design import ACTUATOR_FAMILIES, DEFAULT_PRESET, Arm
from ..design.io.mechanism_reading import law_of
from ..design.parameters.names import assigned
from ..exo.loading import load
from ..exo.shoulder_exo import ShoulderExo
from ..study.detailed_figures import JOINT_POSES, joint_figures
from ..workspace import limb_loss as loss_of_limbs
from ..workspace import limb_sheet, starting_design
from ..workspace import limb_table as table_of_limbs
from ..workspace import optimise as searched
from ..workspace.limb_table import limb_loss_words
from ..workspace.optimisation import OBJECTIVES
from ..workspace.optimisation.starting_designs import joints_and_variables, starting_actuator
from ..workspace.summary import workspace_document
from . import options
from .command import Files, Words, writes
from .options.criteria_options import Judged

#: In place of a design whose moving part rides on the arm: the cuff that each design's own joints ask for.
_BY_GEOMETRY = "geometry"
Interval = Annotated[str | None, options.called("LOW:HIGH")]


@writes(".json", ".csv", ".xlsx", ".npz", plot="the poses inside and outside")
def workspace(
    design: options.Design = DEFAULT_PRESET,
    /,
    *,
    side: options.Side = None,
    worn: options.Worn = options.Worn(),
    offset: options.Offset = None,
    moving_centre: options.MovingCentre = False,
    judged: Judged = Judged(),
    step: options.Degrees = 4.0,
    posture: options.Posture = (),
    one_by_one: bool = False,
    limb_table: bool = False,
    limb_loss: bool = False,
    draw: Literal["slices", "ball"] = "slices",
    muscles: options.Muscled = None,
    files: Files = Files(),
) -> None:
    """List which poses of a grid a design reaches, holds and keeps safe, and how many poses each criterion excludes.

    Parameters
    ----------
    step : float
        Step of the grid of poses, degrees.
    one_by_one : bool
        Also print how many poses are lost as the criteria are added one by one.
    limb_table : bool
        Also print lengths, forces, gaps and joint angles of every limb over the poses inside.
    limb_loss : bool
        Also print how many of the poses inside are still held when one limb fails.
    draw : str
        What --plot shows: slices, or the ball of rotations.
    muscles : bool, optional
        Also print the force in the joint with the wearer's own muscles, over at most 100 of the poses inside, at rest
        (default: with --person, if the extra 'person' is installed, and the device's centre is the shoulder's).

    Examples
    --------
    exo-pin workspace four-cables
    exo-pin workspace examples/device.toml --person 1.75,75,male --step 10 --out inside.csv --plot slices.png
    exo-pin workspace four-cables-worn --person 1.75,75,male --moving-centre
    """
    exo = worn.load(design, side)
    centre = options.centre_of(offset, moving_centre, exo)
    found = exo.workspace(step, judged.of(exo), centre_offset=centre, posture=options.posture_of(posture))
    inside = found.poses[found.inside]
    joint: dict[str, float] = {}
    if len(inside) and options.counts_muscles(muscles, worn, centre is not None or bool(posture)):
        joint = joint_figures(exo, inside, {})
    parts = [_joint_words(joint, len(inside)), str(found), *([str(found.one_by_one())] if one_by_one else [])]
    if limb_table:
        options.refuse("--limb-table prints a table", json=files.json)
        parts.append(limb_sheet(exo.device, table_of_limbs(exo.device, found)))
    if limb_loss:
        options.refuse("--limb-loss prints a table", json=files.json)
        left = loss_of_limbs(exo.device, found)
        parts += [str(left), filled(limb_loss_words(left))]

    def figure() -> Any:
        from ..view.plots import rotation_ball, workspace_slices

        return rotation_ball(found) if draw == "ball" else workspace_slices(found)

    asked = {"centre_offset_mm": list(offset or (0.0, 0.0, 0.0)), "moving_centre": moving_centre}
    files.deliver(
        "\n\n".join(part for part in parts if part),
        found,
        data=lambda: workspace_document(found, asked | joint),
        exo=exo,
        figure=figure,
    )


def _joint_words(joint: dict[str, float], count: int) -> str:
    """The force in the joint over poses inside, which leads where a person is named."""
    if not np.isfinite(joint.get("contact_N", np.nan)):
        return ""
    return filled(
        f"In the joint of the wearer, with their own muscles: {newtons(joint['contact_N'])} N with the device (largest "
        f"{newtons(joint['peak_contact_N'])} N), {newtons(joint['contact_without_N'])} N without: medians over "
        f"{min(count, JOINT_POSES)} of the poses inside, at rest."
    )


@options.group
@dataclass(frozen=True)
class Start:
    """The design that a search begins with.

    Attributes
    ----------
    limbs : int, optional
        Begin with a new design of this number of limbs (4).
    family : str, optional
        Begin with a new design with actuators of this family (cable).
    pull : float, optional
        Greatest pull of a limb, N (default: as in the design, of a new one 400).
    push : float, optional
        Greatest push of linear actuators, N (default: as --pull).
    travel : float, optional
        Greatest travel of a limb, mm (default: that of its family).
    force_law : str, optional
        Force law of pneumatic muscles, instead of --pull: a parameter file, or a name (exo-pin muscle force --help).
    supply : float, optional
        Gauge pressure with --force-law, bar (default 4).
    device : str, optional
        Design whose moving mass is added to the person's arm, such as prototype; or geometry: a cuff estimated from
        each design's joints.
    """

    limbs: Annotated[int | None, options.called("N")] = None
    family: Annotated[str | None, Parameter(choices=tuple(ACTUATOR_FAMILIES))] = None
    pull: options.Newtons | None = None
    push: options.Newtons | None = None
    travel: options.Millimetres | None = None
    force_law: Annotated[str | None, options.called("NAME|FILE")] = None
    supply: options.Bar | None = None
    device: Annotated[str | None, options.called("PRESET|FILE")] = None

    @property
    def is_new(self) -> bool:
        """Whether an option asks for a new design."""
        return any((self.limbs, self.family, self.force_law, self.device))

    def load(
        self, design: str | None, side: Literal["left", "right"] | None, worn: options.Worn, name: str
    ) -> ShoulderExo:
        """The design to start from."""
        travel = None if self.travel is None else 1e-3 * self.travel
        if design is not None or not self.is_new:
            of_new = {key: getattr(self, key) for key in ("limbs", "family", "force_law", "device", "supply")}
            options.refuse("a new design has no file", **of_new)
            exo = worn.load(design or DEFAULT_PRESET, side)
            given = {"pull_limit": self.pull, "push_limit": self.push, "travel_limit": travel}
            limits = {key: value for key, value in given.items() if value is not None}
            return ShoulderExo.from_device(exo.device.with_dimensions(**limits)) if limits else exo
        if worn.person is None:
            raise InvalidInput("without a design give --person HEIGHT,MASS,SEX, whose arm the limbs are to hold")
        if self.force_law is None:
            options.refuse("--force-law was not given", supply=self.supply)
        supply = None if self.supply is None else 1e5 * self.supply
        law = None if self.force_law is None else law_of(self.force_law)
        actuator = starting_actuator(self.family or "cable", self.pull, self.push, law, supply, travel)
        is_known = self.device not in (None, _BY_GEOMETRY)
        on, device = side or "left", load(str(self.device)).mechanism if is_known else None
        arm = Arm.of_wearer(worn.size)
        arm = arm.mirrored() if device is None and on == "right" else arm
        return ShoulderExo.from_mechanism(starting_design(actuator, arm, self.limbs or 4, on, name, device))


@writes(".toml", ".json", plot="the runs and the front, by the first two objectives")
def optimise(
    design: Annotated[str | None, options.called("DESIGN")] = None,
    /,
    *,
    side: options.Side = None,
    worn: options.Worn = options.Worn(),
    start: Start = Start(),
    offset: options.Offset = None,
    moving_centre: options.MovingCentre = False,
    fixed_centre: bool = False,
    judged: Judged = Judged(),
    vary: Annotated[options.Texts, options.called("NAME=LOW:HIGH")] = (),
    base_radius: Interval = None,
    arm_radius: Interval = None,
    drop: Interval = None,
    step: options.Degrees = 4.0,
    objective: Annotated[tuple[str, ...], Parameter(choices=tuple(OBJECTIVES))] = (),
    seed: Annotated[int, options.called("N")] = 0,
    budget: Annotated[int, options.called("N")] = 60000,
    run_length: Annotated[int, options.called("N")] = 12000,
    refine: bool = False,
    storage: Annotated[str | None, options.called("FILE|URL")] = None,
    name: Annotated[str, options.called("NAME")] = "study",
    progress: options.Progress = False,
    files: Files = Files(),
    words: Words = (),
) -> None:
    """Search for a design that reaches and holds as many poses as it can.

    The search is stored, can be continued, and may be shared by several workers; the result is checked.

    Parameters
    ----------
    design : str, optional
        Design to start from (default: four-linear-actuators-worn, or with --limbs or --family a new one).
    fixed_centre : bool
        With --moving-centre: every pose counts twice, with the moving centre and with one that stays.
    vary : tuple of str
        Such as r_A_mm=50:180, A[1].radius_mm=120:250, nominal_length[1]_mm=200:500 (default: all joints of a wrist
        free); of another device its dimensions, such as joint[NAME].x_mm=-20:20.
    base_radius : str, optional
        Distance of free joints on the torso from the shoulder, mm (default 120:250).
    arm_radius : str, optional
        Distance of free joints on the arm from its axis, mm (default 50:140).
    drop : str, optional
        How far free joints on the arm are below the shoulder, mm (default 80:280).
    step : float
        Step of the grid of the check, degrees; a second one is half as wide. Other devices than wrists take wider ones.
    objective : tuple of str
        What to improve; repeat it for a Pareto front (default index).
    seed : int
        Seed of the random numbers.
    budget : int
        Number of designs to evaluate.
    run_length : int
        Number of designs in a run from one start.
    refine : bool
        Start from the design itself, with small steps.
    storage : str, optional
        SQLite file or database in which the study is stored.
    name : str
        Name of the study and of the design that is written.

    Examples
    --------
    exo-pin optimise --limbs 4 --family cable --person 1.75,75,male --budget 20000 --progress --out best.toml
    exo-pin optimise four-cables --refine --vary cuff_height_mm=150:250 --budget 200 --run-length 200
    """
    require_extra("optimise")
    exo = start.load(design, side, worn, name)
    wearer = worn.muscles(side=exo.side) if "contact_force" in objective and worn.person is not None else None
    if fixed_centre and not moving_centre:
        raise InvalidInput("--fixed-centre belongs to --moving-centre; without it the centre is fixed anyway")
    bounds = {"base_radius": base_radius, "platform_radius": arm_radius, "drop": drop}
    intervals = {key: None if text is None else _interval(key, text) for key, text in bounds.items()}
    found = searched(
        exo,
        joints_and_variables(exo.device, assigned(vary), refine, **intervals),
        objectives=objective or ("index",),
        constraints=judged.of(exo),
        person=wearer,
        # Offsets of the device's centre with which designs are judged.
        centre_offset=tuple(
            options.centre_of(offset, moves, exo) for moves in ((False, True) if fixed_centre else (moving_centre,))
        ),
        seed=seed,
        budget=budget,
        run_length=run_length,
        cuff_by_geometry=start.device == _BY_GEOMETRY,
        refine=refine,
        step=step,
        finer_step=0.5 * step,
        storage=storage,
        name=name,
        progress=progress,
    )
    command = _command(words, None if design or start.is_new else DEFAULT_PRESET)

    def save(path: Path) -> None:
        # The best first; of several objectives the whole front, numbered in the order in which it is printed.
        others = found.front if len(found.front) > 1 else ()
        for number, candidate in enumerate((found.best_candidate, *others)):
            best, where = candidate.design, path if not number else path.with_stem(f"{path.stem}-{number}")
            sources = {**best.device.sources, "mechanism": f"found by: {command}"}
            best.replace(name=name, sources=sources).save(where)

    files.deliver(found, found, save=save, exo=exo)


def _command(words: Sequence[str], design: str | None) -> str:
    """The command that finds the same design again, whatever the storage and files; with ``design`` if it has none."""
    kept, left = ["exo-pin", "optimise", *([] if design is None else [design])], iter(words)
    for word in left:
        option, has_value, _ = word.partition("=")
        if option in ("--storage", "--name", "--out", "--plot"):
            if not has_value:
                next(left, None)
        elif option not in ("--progress", "--json"):
            kept.append(word)
    return shlex.join(kept)


def _interval(name: str, text: str) -> tuple[float, float]:
    """Bounds in m of LOW:HIGH in mm."""
    low, high = options.numbers(text, f"{name} LOW:HIGH in mm", 2, separator=":")
    return 1e-3 * low, 1e-3 * high
