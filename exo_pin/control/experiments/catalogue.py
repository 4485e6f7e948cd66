"""Experiments by name: Section 5.4, what Sections 5.4.3 and 6.2 suggest, designs of the search; and variants."""

from __future__ import annotations

from collections.abc import Callable
from functools import partial
from importlib.resources import files
from os import PathLike

import numpy as np
from scipy.spatial.transform import Rotation

from ...core.errors import InvalidInput
from ...core.errors.base import echo
from ...core.files.toml_tables import TomlTable, read_toml
from ...core.validation import as_choice, require_type
from ...design import Mechanism, preset
from ..imu import PRINTED_DRIFT, Imu
from ..plant.faults import Fault
from ..plant.options import PlantOptions
from ..trajectories.orientation_spline import read_reference
from ..trajectories.paths import AnglePath, abduction, daily_task, flexion
from ..trajectories.reference import Reference, Trajectory
from .changed_designs import hung_outward, with_fourth_muscle, with_longer_muscles
from .experiment import Experiment

#: Friction of the dummy's shoulder unit, N m s/rad and N m: not printed. Estimates: a tenth of critical damping for an
#: arm that swings at 6.6 rad/s, and two per cent of the moment of the horizontal arm.
VISCOUS, COULOMB = 0.04, 0.02
#: Duration of the hand-to-mouth-like task, s.
TASK_TIME = 20.0


def reference_of(given: Reference | str | PathLike[str], side: str = "left") -> Reference:
    """A reference from what a user gives: itself, "abduction" or "flexion", or a CSV file of orientations.

    Parameters
    ----------
    given : Reference, str or path-like
        What the user gives.
    side : {"left", "right"}
        Side of the body.

    Returns
    -------
    Reference

    Raises
    ------
    InvalidInput
        If it is none of these; FileFormatError if a file cannot be read.

    Examples
    --------
    >>> from exo_pin.control import reference_of
    >>> reference = reference_of("flexion", side="right")
    >>> round(float(np.rad2deg(reference(reference.duration).orientation.magnitude())), 6)  # degrees at the end
    90.0
    """
    if isinstance(given, str) and given in ("abduction", "flexion"):
        return abduction(side=side) if given == "abduction" else flexion(side=side)
    if isinstance(given, str | PathLike):
        return read_reference(given, side)
    if not isinstance(given, Reference):
        raise InvalidInput(f'expected a reference, "abduction", "flexion" or a CSV file, got {echo(given)}')
    return given


def prototype_options() -> PlantOptions:
    """Air as :class:`PlantOptions` estimates it, and friction of the shoulder unit.

    Returns
    -------
    PlantOptions

    Examples
    --------
    >>> from exo_pin.control import prototype_options
    >>> prototype_options().shoulder_coulomb - ep.PlantOptions().shoulder_coulomb  # N m, of the unit's bearings
    0.02
    """
    return PlantOptions(shoulder_viscous=VISCOUS, shoulder_coulomb=COULOMB)


def options_for(mechanism: Mechanism) -> PlantOptions:
    """Options of a design that comes without: :func:`prototype_options` where muscles turn the dummy's shoulder unit.

    A design with cables or linear actuators gets :class:`PlantOptions`, without friction in the shoulder.

    Parameters
    ----------
    mechanism : Mechanism
        The design.

    Returns
    -------
    PlantOptions

    Examples
    --------
    >>> from exo_pin.control import options_for
    >>> [options_for(ep.load(name).mechanism).shoulder_coulomb > 0.0 for name in ("prototype", "four-cables")]
    [True, False]
    """
    require_type("mechanism", mechanism, Mechanism, "a Mechanism")
    families = {limb.actuator.family for limb in mechanism.limbs if limb.actuator is not None}
    return PlantOptions() if families & {"cable", "linear"} else prototype_options()


def _held_path() -> Trajectory:
    """From where the outward arm hangs, through poses that its muscles hold and its unit allows, to 55°."""
    degrees = [[12.5, 12.5, 17.0], [15.0, 22.0, 26.0], [25.0, 55.0, 32.0]]
    title = "abduction through poses that the muscles hold"
    return AnglePath([0.0, 1.5, 6.0], np.radians(degrees), "left", "minimum_jerk", title)


def _raised() -> Trajectory:
    """Plain abduction from where the outward arm with long muscles hangs to 70°."""
    degrees = [[0.0, 12.0, 0.0], [0.0, 70.0, 0.0]]
    return AnglePath([0.0, 10.0], np.radians(degrees), "left", "minimum_jerk", "abduction from 12 to 70 degrees")


def _task() -> Trajectory:
    return daily_task("feeding", TASK_TIME)


def _long_for_tests(mechanism: Mechanism) -> Mechanism:
    """Longer muscles, for the abduction and the flexion test."""
    times = np.linspace(0.0, 5.0, 26)
    poses = Rotation.concatenate([abduction()(times).orientation, flexion()(times).orientation])
    return with_longer_muscles(mechanism, poses)


def _long_for_task(mechanism: Mechanism) -> Mechanism:
    return with_longer_muscles(mechanism, _task().movement(10.0).poses)


#: What the file of experiments calls changes of a design, and movements.
_CHANGES: dict[str, Callable[[Mechanism], Mechanism]] = {
    "outward": hung_outward,
    "fourth muscle": with_fourth_muscle,
    "longer muscles": _long_for_tests,
    "longer muscles for the task": _long_for_task,
}
_MOVEMENTS: dict[str, Callable[[], Trajectory]] = {
    "abduction": abduction,
    "flexion": flexion,
    "smooth abduction": partial(abduction, law="minimum_jerk"),
    "smooth flexion": partial(flexion, law="minimum_jerk"),
    "task": _task,
    "held": _held_path,
    "raised": _raised,
}


def _file() -> tuple[dict[str, TomlTable], dict[str, str]]:
    """The experiments of the file by name, not read yet, and the texts of its sources."""
    root = read_toml(str(files("exo_pin.control.experiments") / "experiments.toml"))
    return {str(entry.text("name")): entry for entry in root.tables("experiment")}, root.mapping("sources")


def _made(name: str, entry: TomlTable, sources: dict[str, str]) -> Experiment:
    mechanism = preset(str(entry.text("design")))
    for change in entry.texts("changes"):
        mechanism = _CHANGES[change](mechanism)
    fault, lost = entry.table("fault"), entry.quantity("number", "lost_s", (2,), required=False)
    made = Experiment(
        name,
        str(entry.text("title")),
        mechanism,
        _MOVEMENTS[str(entry.text("movement"))](),
        entry.text("controller", required=False) or "pi",
        options_for(mechanism).replace(second_flange=entry.flag("second_flange")),
        imu=None if lost is None else Imu(drift=PRINTED_DRIFT, lost=(lost,)),
        faults=() if fault is None else (_fault(fault),),
        source="; ".join(sources[key] for key in entry.texts("sources")),
    )
    entry.finish()
    return made


def _fault(entry: TomlTable) -> Fault:
    given = {
        "start": entry.quantity("number", "start_s"),
        "command": entry.quantity("number", "command", required=False),
        "brake_force": entry.quantity("force", "brake_force", required=False),
    }
    stated = {name: value for name, value in given.items() if value is not None}
    return Fault(entry.text("kind"), entry.integer("limb"), **stated)  # type: ignore[arg-type]


def experiments() -> list[str]:
    """Names for :func:`experiment`.

    Returns
    -------
    list of str

    Examples
    --------
    >>> len(ep.experiments()), "held-abduction" in ep.experiments()
    (34, True)
    """
    return list(_file()[0])


def experiment(name: str, controller: object = None) -> Experiment:
    """An experiment by name.

    Parameters
    ----------
    name : str
        One of :func:`experiments`.
    controller : {"pi", "model"} or callable, optional
        Another controller than the experiment's own.

    Returns
    -------
    Experiment
        Run it with ``.run()``; change it with ``.replace(...)`` first.

    Raises
    ------
    UnknownName
        If there is no such experiment.

    Examples
    --------
    >>> run = ep.experiment("four-cables-abduction", "model").run()
    >>> round(run.summary()["rms_error_deg"], 1)
    0.1
    """
    entries, sources = _file()
    made = _made(name, entries[as_choice("experiment", name, entries)], sources)
    return made if controller is None else made.replace(controller=controller)
