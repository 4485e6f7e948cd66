"""Experiments by name: Section 5.4, what Sections 5.4.3 and 6.2 suggest, designs of the search; and variants."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import replace
from functools import partial
from importlib.resources import files
from os import PathLike

import numpy as np
from scipy.spatial.transform import Rotation

from ...core.errors import InvalidInput
from ...core.errors.base import echo
from ...core.files.toml_tables import TomlTable, read_toml
from ...core.validation import as_choice, require_type
from ...design import Mechanism, WristGeometry, preset
from ...device import Device
from ...load_case import Movement, RecordingOptions
from ..imu import PRINTED_DRIFT, Imu
from ..plant.contractions import Contractions
from ..plant.faults import Fault
from ..plant.options import PlantOptions
from ..trajectories.paths import AnglePath, abduction, daily_task, flexion
from ..trajectories.reference import OrientationSpline, Reference, Trajectory, read_reference
from .experiment import Experiment

#: End fittings of a limb with as much muscle as its joints leave room for, m: an assumption, two short yokes.
SHORT_FITTING = 0.025
#: Hole of the fourth muscle, degrees from the x axis. Figure 5-6 shows one without a number; of the holes every 10° it
#: is the one with which muscles that are long enough for both tests of 5.4.1 hold most of the abduction test.
ADDED_ANGLE = 160.0
#: Where the centre of mass of the arm is that hangs outward, m in {O_B}. By Table 5-4 (22.7 mm) the arm without muscles
#: would hang at -6.8° of abduction, and its unit stops it at -5°. The dummy hung at +8.8°: what it carried there is not
#: printed. Between the two, at 6.2°, lies a singular pose.
OUTWARD = -0.04


def _longer(mechanism: Mechanism, poses: Rotation) -> Mechanism:
    """Muscles as long as the limbs are at most in some poses, less short end fittings; Section 5.4.1 asks for them."""
    most = Contractions(mechanism).lengths(poses).max(axis=0) - SHORT_FITTING
    limbs = []
    for limb, length in zip(mechanism.limbs, most.tolist(), strict=True):
        assert limb.stroke is not None
        limbs.append(replace(limb, stroke=replace(limb.stroke, nominal_length=length, end_fitting=SHORT_FITTING)))
    return mechanism.replace(limbs=limbs, name=f"{mechanism.name}, longer muscles")


def _with_fourth_muscle(mechanism: Mechanism) -> Mechanism:
    """One more muscle, of the kind of the last one, in another hole of the circles of base and cuff, as of (4-2)."""
    own, x, y = mechanism.geometry, np.cos(np.radians(ADDED_ANGLE)), np.sin(np.radians(ADDED_ANGLE))
    base, cuff = own.base_points, own.platform_points
    # The base's circle lies across the y axis, the cuff's across the arm.
    of_base, of_cuff = np.hypot(*base[0, [0, 2]]), np.hypot(*cuff[0, :2])
    base = np.vstack([base, [of_base * x, base[0, 1], of_base * y]])
    cuff = np.vstack([cuff, [of_cuff * x, of_cuff * y, cuff[0, 2]]])
    # On the same circles, so that the frames of the joints that were there stay.
    geometry = WristGeometry(base, cuff, own.base_axis, own.platform_axis, own.neutral)
    limbs = [*mechanism.limbs, mechanism.limbs[-1]]
    return mechanism.replace(geometry=geometry, limbs=limbs, name=f"{mechanism.name}, fourth muscle")


def _hung_outward(mechanism: Mechanism) -> Mechanism:
    """The arm's centre of mass towards the body."""
    arm = mechanism.require_arm("another centre of mass")
    centre = arm.centre_of_mass * [1.0, 0.0, 1.0] + [0.0, OUTWARD, 0.0]
    return mechanism.replace(arm=replace(arm, centre_of_mass=centre), name=f"{mechanism.name}, arm hung outward")


#: Friction of the dummy's shoulder unit, N m s/rad and N m: not printed. Estimates: a tenth of critical damping for an
#: arm that swings at 6.6 rad/s, and two per cent of the moment of the horizontal arm.
VISCOUS, COULOMB = 0.04, 0.02
#: References by name.
REFERENCES: dict[str, Callable[..., Reference]] = {"abduction": abduction, "flexion": flexion}
#: Duration of the hand-to-mouth-like task, s.
TASK_TIME = 20.0


def reference_of(
    given: Reference | Movement | str | PathLike[str], side: str = "left", reading: RecordingOptions | str | None = None
) -> Reference:
    """A reference from what a user gives: itself, a movement, "abduction" or "flexion", or a recording.

    Parameters
    ----------
    given : Reference, Movement, str or path-like
        What the user gives.
    side : {"left", "right"}
        Side of the body.
    reading : RecordingOptions or str, optional
        Of a recording, as in :func:`exo_pin.read_movement`.

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
    if isinstance(given, str) and given in REFERENCES:
        return REFERENCES[given](side=side)
    if isinstance(given, str | PathLike):
        return read_reference(given, side, reading=reading)
    if isinstance(given, Movement):
        return OrientationSpline.of_movement(given)
    if not isinstance(given, Reference):
        raise InvalidInput(f'expected a reference, movement, "abduction", "flexion" or a recording, got {echo(given)}')
    return given


def options_for(mechanism: Mechanism | Device) -> PlantOptions:
    """Options of a design that comes without: with the shoulder unit's friction where muscles turn the dummy's.

    A design with cables or linear actuators gets :class:`PlantOptions`, without friction in the shoulder.

    Parameters
    ----------
    mechanism : Mechanism or Device
        The design, or any device.

    Returns
    -------
    PlantOptions

    Examples
    --------
    >>> from exo_pin.control import options_for
    >>> [options_for(ep.load(name).mechanism).shoulder_coulomb > 0.0 for name in ("prototype", "four-cables")]
    [True, False]
    """
    require_type("mechanism", mechanism, Mechanism | Device, "a Mechanism or Device")
    families = {limb.actuator.family for limb in mechanism.limbs if limb.actuator is not None}
    if families & {"cable", "linear"} or not families:
        return PlantOptions()
    return PlantOptions(shoulder_viscous=VISCOUS, shoulder_coulomb=COULOMB)


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
    return _longer(mechanism, poses)


def _long_for_task(mechanism: Mechanism) -> Mechanism:
    return _longer(mechanism, _task().movement(10.0).poses)


#: What the file of experiments calls changes of a design, and movements.
_CHANGES: dict[str, Callable[[Mechanism], Mechanism]] = {
    "outward": _hung_outward,
    "fourth muscle": _with_fourth_muscle,
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
