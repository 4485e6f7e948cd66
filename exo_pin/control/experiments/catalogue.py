"""Experiments by name: those of Section 5.4, what Sections 5.4.3 and 6.2 suggest, and the designs of the search."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import replace as changed
from os import PathLike

import numpy as np
from scipy.spatial.transform import Rotation

from ...core.errors import InvalidInput
from ...core.validation import as_choice
from ...design import Arm, Mechanism, preset
from ..plant.faults import Fault
from ..plant.options import PlantOptions
from ..sensors.imu import PRINTED_DRIFT, Imu
from ..trajectories.angle_path import AnglePath
from ..trajectories.orientation_spline import read_reference
from ..trajectories.reference import Reference, Trajectory
from ..trajectories.tasks import abduction, daily_task, flexion
from .designs import with_fourth_muscle, with_longer_muscles
from .experiment import Experiment
from .found_designs import FOUND_MAKERS

__all__ = ["experiment", "experiments", "hung_outward", "options_for", "prototype_options", "reference_of"]

#: Friction of the dummy's shoulder unit, N m s/rad and N m: not printed. Estimates: a tenth of critical damping for an
#: arm that swings at 6.6 rad/s, and two per cent of the moment of the horizontal arm.
VISCOUS, COULOMB = 0.04, 0.02
#: Where the centre of mass of a left arm is in :func:`hung_outward`, m.
OUTWARD = -0.04
#: Of the hand-to-mouth-like task, s.
TASK_TIME = 20.0


def reference_of(given: Reference | str | PathLike[str], side: str = "left") -> Reference:
    """A reference from what a user gives: itself, "abduction" or "flexion", or a CSV file of orientations.

    Raises
    ------
    InvalidInput
        If it is none of these; FileFormatError if a file cannot be read.
    """
    if given == "abduction":
        return abduction(side=side)
    if given == "flexion":
        return flexion(side=side)
    if isinstance(given, str | PathLike):
        return read_reference(given, side)
    if not isinstance(given, Reference):
        raise InvalidInput(f'expected a reference, "abduction", "flexion" or a CSV file, got {given!r:.60}')
    return given


def prototype_options(second_flange: bool = False) -> PlantOptions:
    """Air as :class:`PlantOptions` estimates it, and friction of the shoulder unit."""
    return PlantOptions(shoulder_viscous=VISCOUS, shoulder_coulomb=COULOMB, second_flange=second_flange)


def options_for(mechanism: Mechanism) -> PlantOptions:
    """Options of a design that comes without: :func:`prototype_options` where muscles turn the dummy's shoulder unit.

    A design with cables or linear actuators gets :class:`PlantOptions`, without friction in the shoulder.
    """
    if not isinstance(mechanism, Mechanism):
        raise InvalidInput(f"expected mechanism to be a Mechanism, got {type(mechanism).__name__}")
    families = {limb.actuator.family for limb in mechanism.limbs if limb.actuator is not None}
    return PlantOptions() if families & {"cable", "linear"} else prototype_options()


def hung_outward(mechanism: Mechanism, y: float | None = None) -> Mechanism:
    """The same design with the arm's centre of mass at another y in {O_B}, m, so that it hangs further out or in.

    Without ``y`` it lies 40 mm towards the body: y = -40 mm of a left shoulder, 40 mm of a right one.

    By Table 5-4 (y = 22.7 mm) the arm without muscles would hang at -6.8° of abduction, and its unit stops it at -5°.
    The dummy hung at +8.8°: what it carried there is not printed. Between the two, at 6.2°, lies a singular pose.
    """
    if not isinstance(mechanism, Mechanism):
        raise InvalidInput(f"expected mechanism to be a Mechanism, got {type(mechanism).__name__}")
    arm = mechanism.require_arm("another centre of mass")
    inward = OUTWARD if mechanism.side == "left" else -OUTWARD
    centre = np.array([arm.centre_of_mass[0], inward if y is None else y, arm.centre_of_mass[2]])
    moved = Arm(arm.mass, centre, arm.inertia, arm.device, arm.body_mass)
    return mechanism.replace(arm=moved, name=f"{mechanism.name}, arm hung outward")


def _prototype() -> Mechanism:
    return preset("prototype")


def _outward() -> Mechanism:
    return hung_outward(_prototype())


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


def _longer(mechanism: Mechanism) -> Mechanism:
    poses = _both_tests()
    return with_longer_muscles(mechanism, poses)


def _both_tests() -> Rotation:
    """Poses of the abduction and of the flexion test."""
    times = np.linspace(0.0, 5.0, 26)
    return Rotation.concatenate([abduction()(times).orientation, flexion()(times).orientation])


def _made(
    name: str,
    title: str,
    mechanism: Mechanism,
    reference: Trajectory,
    source: str,
    second_flange: bool = False,
    imu: Imu | None = None,
    faults: tuple[Fault, ...] = (),
) -> Experiment:
    options = prototype_options(second_flange)
    return Experiment(name, title, mechanism, reference, options=options, source=source, imu=imu, faults=faults)


_PRELIMINARY = "thesis Section 5.4.1, Figures 5-11 to 5-14"
_STRATEGY = "thesis Section 5.4.3"
_TASK_SOURCE = (
    "thesis Section 5.4.2; the measured trajectory is not printed, so the task is synthetic, within the published "
    "range of feeding"
)
_BEYOND = "the centre of mass is assumed, so that the arm starts beyond the singular pose at 6.2 degrees of abduction"

#: Makers of the experiments, by name.
_MAKERS: dict[str, Callable[[str], Experiment]] = {
    "abduction": lambda n: _made(n, "abduction test", _prototype(), abduction(), _PRELIMINARY),
    "flexion": lambda n: _made(n, "flexion test", _prototype(), flexion(), _PRELIMINARY),
    "hand-to-mouth": lambda n: _made(n, "hand-to-mouth-like task", _prototype(), _task(), _TASK_SOURCE),
    "abduction-outward": lambda n: _made(
        n, "abduction test, arm hung outward", _outward(), abduction(), f"{_PRELIMINARY}; {_BEYOND}"
    ),
    "flexion-outward": lambda n: _made(
        n, "flexion test, arm hung outward", _outward(), flexion(), f"{_PRELIMINARY}; {_BEYOND}"
    ),
    "hand-to-mouth-outward": lambda n: _made(
        n, "hand-to-mouth-like task, arm hung outward", _outward(), _task(), f"{_TASK_SOURCE}; {_BEYOND}"
    ),
    "abduction-flange": lambda n: _made(
        n, "abduction test, second flange", _outward(), abduction(), f"{_STRATEGY}; {_BEYOND}", second_flange=True
    ),
    "flexion-flange": lambda n: _made(
        n, "flexion test, second flange", _outward(), flexion(), f"{_STRATEGY}; {_BEYOND}", second_flange=True
    ),
    "hand-to-mouth-flange": lambda n: _made(
        n, "hand-to-mouth-like task, second flange", _outward(), _task(), f"{_STRATEGY}; {_BEYOND}", second_flange=True
    ),
    "abduction-long": lambda n: _made(
        n, "abduction test, longer muscles", _longer(_outward()), abduction(), f"{_STRATEGY}; {_BEYOND}"
    ),
    "flexion-long": lambda n: _made(
        n, "flexion test, longer muscles", _longer(_outward()), flexion(), f"{_STRATEGY}; {_BEYOND}"
    ),
    "abduction-four": lambda n: _made(
        n, "abduction test, fourth muscle", with_fourth_muscle(_outward()), abduction(), f"{_STRATEGY}; {_BEYOND}"
    ),
    "abduction-four-long": lambda n: _made(
        n, "abduction test, four longer muscles", _longer(with_fourth_muscle(_outward())), abduction(),
        f"{_STRATEGY}; {_BEYOND}",
    ),
    "hand-to-mouth-four-long": lambda n: _made(
        n, "hand-to-mouth-like task, four longer muscles",
        with_longer_muscles(with_fourth_muscle(_outward()), _task().movement(10.0).orientations), _task(),
        f"{_STRATEGY}; {_TASK_SOURCE}; {_BEYOND}",
    ),
    "held-abduction": lambda n: _made(
        n, "abduction through poses that the muscles hold", _outward(), _held_path(), _BEYOND
    ),
    "held-abduction-four-long": lambda n: _made(
        n, "abduction from 12 to 70°, four longer muscles", _longer(with_fourth_muscle(_outward())), _raised(), _BEYOND
    ),
    "held-abduction-lost-imu": lambda n: _made(
        n, "abduction through held poses, inertial sensor lost", _outward(), _held_path(), _BEYOND,
        imu=Imu(drift=PRINTED_DRIFT, lost=((3.0, 4.0),)),
    ),
    "held-abduction-burst": lambda n: _made(
        n, "abduction through held poses, muscle 3 bursts", _outward(), _held_path(), _BEYOND,
        faults=(Fault("burst", 2, start=4.0),),
    ),
    "held-abduction-stuck-valve": lambda n: _made(
        n, "abduction through held poses, valve 3 stuck open", _outward(), _held_path(), _BEYOND,
        faults=(Fault("stuck valve", 2, start=3.0, command=1.0),),
    ),
    **FOUND_MAKERS,
}  # fmt: skip


def experiments() -> list[str]:
    """Names for :func:`experiment`."""
    return list(_MAKERS)


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
    """
    made = _MAKERS[as_choice("experiment", name, _MAKERS)](name)
    return made if controller is None else changed(made, controller=controller)  # type: ignore[arg-type]
