"""The drives of a design's limbs: pneumatic muscles, in line or over a tackle; cables on winches, linear actuators."""

from __future__ import annotations

from abc import ABC, abstractmethod
from collections.abc import Callable, Sequence
from dataclasses import dataclass, replace
from functools import reduce
from typing import Any, ClassVar

import numpy as np

from ...core.errors import MissingData
from ...core.validation import FloatArray
from ...design import preset, presets
from ...muscle.io.model_files import muscle_model
from ...muscle.laws.force_laws import ChouHannaford
from ...muscle.laws.friction import ConstantFriction, LoadDependentFriction
from ...muscle.laws.static import BAR, StaticModel
from .equations.drive_kernels import COLUMNS, MOTOR_COLUMNS
from .motor_options import JointMotor, MotorParameters
from .options import PlantOptions

#: By how much a length may be beyond a stroke, m.
_ROUND = 1e-6
#: Whose thread gives the volume of the air.
THREAD = "fitted-chou-hannaford"
#: Nominal length of the muscle whose braid has the stated stiffness, m.
_BRAID_LENGTH = 0.3
#: Tension that keeps a cable taut, N: that of the search which found the shipped designs.
LEAST_TENSION = 5.0


@dataclass(frozen=True)
class LimbDrive(ABC):
    """The drive of one limb.

    =============== ==================================== =======================================================
    part            pneumatic muscle                     winch or linear actuator
    =============== ==================================== =======================================================
    state           pressure, friction                   length let out, its rate, friction
    command         of its valves, -1 vents, 1 fills     force of the motor over its limit, 1 pulls in
    tension         static law, damping, friction        spring and damper in series, a cable only pulls
    energy in       compressed air                       electric energy
    energy stored   in the air (not counted)             in the moving drive, the stretched limb and the stops
    =============== ==================================== =======================================================

    Attributes
    ----------
    word : str
        What it is called in verdicts: "muscle", "cable", "actuator".
    shortest, longest : float
        Ends of the limb's stroke, joint to joint, m.
    least_tension : float
        That a controller keeps, N: a cable shall stay taut. Zero for a drive that need not be.
    """

    is_motor: ClassVar[bool] = False
    #: Whether it acts on its coordinate without a spring between.
    is_direct: ClassVar[bool] = False
    word: str
    shortest: float
    longest: float
    least_tension: float

    @property
    def pushes(self) -> bool:
        """Whether it can push."""
        return False

    @property
    def damping_ratio(self) -> float:
        """Damping of the drive's mass on the limb's spring, over critical damping; zero where there is no such mass."""
        return 0.0

    @abstractmethod
    def row(self) -> FloatArray:
        """Parameters as the equations read them: a row of the table of muscles or of that of motor drives."""

    def spans(self, length: Any) -> Any:
        """Whether a length of the limb in m, or each of several, is within its stroke."""
        return (length >= self.shortest - _ROUND) & (length <= self.longest + _ROUND)


@dataclass(frozen=True)
class MotorDrive(LimbDrive):
    """A winch or a linear actuator, seen along the limb; or a motor in a joint beyond a gear that gives way.

    Attributes
    ----------
    parameters : MotorParameters or JointMotor
        Of motor and transmission.
    pull_limit, push_limit : float
        Greatest forces of the limb by the design, N, or efforts along the coordinate, N m; the motor's own limit is the
        larger of the two, either way.
    no_load_speed : float
        m/s or rad/s; infinite where it is not known.
    play : float
        Between drive and limb, end to end, m or rad.
    of_joint : bool
        Whether its effort is positive towards larger coordinates.
    """

    is_motor: ClassVar[bool] = True
    parameters: MotorParameters | JointMotor
    pull_limit: float
    push_limit: float
    no_load_speed: float
    play: float = 0.0
    of_joint: bool = False

    @property
    def pushes(self) -> bool:
        """Whether it can push."""
        return self.word != "cable"

    @property
    def force_limit(self) -> float:
        """Of the motor, N."""
        return max(self.pull_limit, self.push_limit)

    @property
    def stiffness(self) -> float:
        """Of the limb between drive and arm, N/m."""
        return self.parameters.series_stiffness(self.longest)

    @property
    def damping_ratio(self) -> float:
        """See :attr:`LimbDrive.damping_ratio`."""
        return 0.5 * self.parameters.damping_time * float(np.sqrt(self.stiffness / self.parameters.mass))

    @property
    def limits(self) -> tuple[float, float]:
        """Least and greatest tension, N."""
        return -self.push_limit, self.pull_limit

    @property
    def brake_force(self) -> float:
        """Of the brake that closes when the current fails, N."""
        return self.parameters.brake_force

    def holding(self, command: float) -> float:
        """What its brake holds in service, N: it is open."""
        return 0.0

    def demand(self, command: float) -> float:
        """Force that a command asks for, N."""
        return self.force_limit * command

    def row(self) -> FloatArray:
        """See :meth:`LimbDrive.row`."""
        # Columns that get no value here are parameters as they are given.
        own, limit = dict(vars(self.parameters)), self.force_limit
        stall, speed = own["stall_ratio"] * limit, self.no_load_speed
        if isinstance(self.parameters, JointMotor):
            own["stop_stiffness"] = limit / self.parameters.stop_depth
            own["stop_damping"] = self.parameters.stop_time * own["stop_stiffness"]
        own |= {
            "present": 1.0,
            "inverse_mass": 1.0 / self.parameters.mass,
            "force_limit": limit,
            "stall_force": stall,
            "no_load_speed": speed,
            "stiffness": self.stiffness,
            "damping": own["damping_time"] * self.stiffness,
            "pushes": float(self.pushes),
            "shortest": self.shortest,
            "longest": self.longest,
            # Of a motor whose speed is not known the loss in the windings is not known.
            "copper": speed / stall if np.isfinite(speed) else 0.0,
            "along": 1.0 if self.of_joint else -1.0,
            "play": self.play,
        }
        return np.array([own[name] for name in MOTOR_COLUMNS])


@dataclass(frozen=True)
class DirectDrive(LimbDrive):
    """A geared motor in a joint, a source of tension on a cable, or a brake; efforts have the drive's own sign.

    Attributes
    ----------
    parameters : JointMotor
        Of motor and gear.
    lower, upper : float
        Least and greatest effort, N m or N; both zero for a brake.
    speed_limit : float
        At which no effort is left, rad/s or m/s; infinite where it is not known.
    of_joint : bool
        Whether its effort is positive towards larger coordinates; a tension is towards smaller ones.
    holds : float
        What a brake holds while its command is below a half, N m or N.
    """

    is_motor: ClassVar[bool] = True
    is_direct: ClassVar[bool] = True
    parameters: JointMotor
    lower: float
    upper: float
    speed_limit: float
    of_joint: bool
    holds: float = 0.0

    @property
    def pushes(self) -> bool:
        """Whether it can push."""
        return self.lower < 0.0 or self.word == "brake"

    @property
    def force_limit(self) -> float:
        """The larger of the two limits, N m or N."""
        return max(self.upper, -self.lower)

    @property
    def brake_force(self) -> float:
        """Of the brake that closes when the current fails, N m or N."""
        return self.holds or self.parameters.brake_force

    @property
    def limits(self) -> tuple[float, float]:
        """Least and greatest effort, N m or N."""
        return self.lower - self.holds, self.upper + self.holds

    @property
    def stiffness(self) -> float:
        """Of what stands between drive and joint: infinite."""
        return np.inf

    def demand(self, command: float) -> float:
        """Effort that a command asks for: the share of the greatest one, or of the least one if it is negative."""
        return (-self.lower if command < 0.0 < -self.lower else self.upper) * command

    def holding(self, command: float) -> float:
        """What a brake holds, N m or N: it is open from a command of a half on."""
        return self.holds if command < 0.5 else 0.0

    @property
    def copper(self) -> float:
        """Loss of the windings over the effort squared, W/(N m)² or W/N²; zero of a motor whose speed is not known."""
        stall = self.parameters.stall_ratio * self.force_limit
        return self.speed_limit / stall if np.isfinite(self.speed_limit) and stall > 0.0 else 0.0

    def row(self) -> FloatArray:
        """What its electric power is made of; the equations of limbs have no part in it."""
        own = {"copper": self.copper, "along": 1.0 if self.of_joint else -1.0}
        return np.array([own.get(name, 0.0) for name in MOTOR_COLUMNS])


@dataclass(frozen=True)
class MuscleDrive(LimbDrive):
    """Pneumatic muscles.

    Attributes
    ----------
    model : StaticModel
        Static law of one muscle, scaled to its length.
    taut_length : float
        Length of the limb at which the muscle is as long as at rest, m.
    supply_pressure : float
        Greatest gauge pressure, Pa.
    options : PlantOptions
        Friction, damping, braid, dead volume.
    ratio : float
        Of the tackle; 1 in line.
    count : int
        Muscles side by side.
    """

    model: StaticModel
    taut_length: float
    supply_pressure: float
    options: PlantOptions
    ratio: float = 1.0
    count: int = 1

    @property
    def over_tackle(self) -> bool:
        """Whether the limb is a cable over pulleys."""
        return self.word == "cable"

    def row(self) -> FloatArray:
        """See :meth:`LimbDrive.row`."""
        model, options = self.model, self.options
        thread = muscle_model(THREAD)
        assert isinstance(thread, ChouHannaford)
        line = model.validity.capability_line
        intercept = float(line(np.array(0.0)))
        slope = float(line(np.array(BAR))) - intercept if np.isfinite(intercept) else 0.0
        share = thread.reference_length / model.length
        pulleys = options.pulley_friction if self.over_tackle else 0.0
        rubs = options.muscle_friction is not None or pulleys > 0.0
        values = {
            "nominal_length": model.length,
            "end_fitting": self.taut_length - model.length,
            "capability_slope": slope,
            "capability_intercept": intercept if np.isfinite(intercept) else 1e9,
            "braid_stiffness": options.braid_stiffness * _BRAID_LENGTH / model.length,
            "presliding": options.presliding if rubs else 1.0,
            "spring_stiffness": options.series_spring or 0.0,
            "thread": thread.braid_length / share,
            "turns": thread.turns / share,
            "dead_volume": options.dead_volume,
            "ratio": self.ratio,
            "count": float(self.count),
            "pulley_friction": pulleys,
        }
        if options.muscle_damping is not None:
            values |= {"damping_1": options.muscle_damping.D_1 * BAR, "damping_2": options.muscle_damping.D_2 * BAR}
        values |= _friction(options)
        return np.array([values.get(name, 0.0) for name in COLUMNS])


def _friction(options: PlantOptions) -> dict[str, float]:
    law = options.muscle_friction
    if isinstance(law, ConstantFriction):
        return {"friction": law.force}
    if isinstance(law, LoadDependentFriction):
        terms = {"friction_2": law.N_2 * BAR, "friction_1": law.N_1 * BAR, "friction_0": law.N_0 * BAR}
        return terms | {"friction_load": law.load / BAR}
    return {}


def drives_of(parts: Sequence[Any], name: str, options: PlantOptions) -> tuple[LimbDrive, ...]:
    """The drive of each limb, or of each drive and brake of a device, by the family of its actuator.

    A pneumatic muscle is in line with its limb. A cable is pulled by pneumatic muscles if its actuator has a tackle,
    and by a winch otherwise. The numbers that a design does not have come from the options. A drive of a device that
    has no actuator acts within the limits of its effort.

    Raises
    ------
    MissingData
        If an actuator, a force law or limit, a stroke or an end fitting is not known.
    """
    found, missing = _made(parts, options)
    if missing:
        complete = [known for known in presets() if not _made(preset(known).limbs, options)[1]]
        raise MissingData(missing, "a plant", name, f"presets with all of it: {', '.join(complete)}")
    return tuple(found)


def _made(parts: Sequence[Any], options: PlantOptions) -> tuple[list[LimbDrive], list[str]]:
    """The drives of the limbs that have one, and what the others lack."""
    found: list[LimbDrive] = []
    missing: list[str] = []
    for i, part in enumerate(parts):
        actuator = getattr(part, "actuator", None)
        make: Callable[[Any, str, PlantOptions], LimbDrive] = _muscle_drive
        if not hasattr(part, "actuator"):
            make = _brake
        elif actuator is not None and actuator.family != "pneumatic muscle" and actuator.tackle is None:
            make = _motor_drive
        elif actuator is None and hasattr(part, "route"):
            make = _direct_drive
        try:
            found.append(make(part, f"limbs[{i}]", options))
        except MissingData as error:
            missing += error.missing
    return found, missing


def _direct_drive(part: Any, place: str, options: PlantOptions) -> LimbDrive:
    """The motor of a drive without an actuator."""
    motor, (low, high), (short, long) = options.joint_motor, part.effort_range, part.length_range
    of_joint = part.joint is not None and not part.pulls
    given = np.nan if motor.limit is None else motor.limit
    low, high = (own if np.isfinite(own) else end for own, end in ((low, -given), (high, given)))
    if np.isnan(low) or np.isnan(high):
        raise MissingData([f"limits of the drive {part.name!r} (PlantOptions(joint_motor=JointMotor(limit=...)))"],
                          "a plant")  # fmt: skip
    word = "cable" if part.route is not None else "motor" if of_joint else "actuator"
    ends = (-np.inf if np.isnan(short) else short, np.inf if np.isnan(long) else long)
    speed = np.inf if part.speed_limit is None else part.speed_limit
    if of_joint and motor.stiffness is not None:
        play = (part.play or 0.0) if motor.play is None else motor.play
        return MotorDrive(word, *ends, 0.0, motor, high, -low, speed, play, of_joint)
    least = max(low, 0.0) if part.route is not None else 0.0
    return DirectDrive(word, *ends, least, motor, low, high, speed, of_joint)


def _brake(part: Any, place: str, options: PlantOptions) -> LimbDrive:
    """A brake in a joint."""
    if part.limit is None:
        raise MissingData([f"limit of the brake {part.name!r}"], "a plant")
    return DirectDrive("brake", -np.inf, np.inf, 0.0, options.joint_motor, 0.0, 0.0, np.inf, True, part.limit)


def _require(limb: Any, place: str, query: str, *paths: str) -> None:
    """Raise MissingData if something of a limb is not known, named as a part of ``place``."""
    known = [reduce(lambda part, name: getattr(part, name, None), path.split("."), limb) for path in paths]
    missing = [f"{place}.{path}" for path, value in zip(paths, known, strict=True) if value is None]
    if missing:
        raise MissingData(missing, query)


def _ends(stroke: Any) -> tuple[float, float]:
    """Shortest and longest length of a limb, m."""
    short, long = (stroke.nominal_length * share + stroke.end_fitting for share in (stroke.shortest, stroke.longest))
    return short, long


def _motor_drive(limb: Any, place: str, options: PlantOptions) -> LimbDrive:
    """The winch or the linear actuator of a limb."""
    paths = ("stroke.end_fitting", "actuator.pull_limit", "actuator.push_limit")
    _require(limb, place, "a plant with motors", *paths)
    actuator, is_cable = limb.actuator, limb.actuator.family == "cable"
    parameters: MotorParameters = options.winch if is_cable else options.linear_actuator
    if actuator.speed_limit is not None:
        parameters = replace(parameters, no_load_speed=actuator.speed_limit)
    word, taut = "cable" if is_cable else "actuator", parameters.least_tension
    play = (limb.play or 0.0) if options.play is None else options.play
    limits = actuator.pull_limit, actuator.push_limit
    return MotorDrive(word, *_ends(limb.stroke), taut, parameters, *limits, parameters.no_load_speed, play)


def _muscle_drive(limb: Any, place: str, options: PlantOptions) -> LimbDrive:
    """The muscles of a limb."""
    tackle = getattr(limb.actuator, "tackle", None)
    paths = ("stroke.end_fitting",) if tackle is not None else ("actuator.force_law", "stroke.end_fitting")
    _require(limb, place, "a plant with pneumatic muscles", *paths)
    short, long = _ends(limb.stroke)
    if tackle is not None:
        model = muscle_model(tackle.force_law, tackle.muscle_length)
        pressure, ratio, count = tackle.supply_pressure, tackle.ratio, tackle.count
        return MuscleDrive("cable", short, long, LEAST_TENSION, model, long, pressure, options, ratio, count)
    nominal = limb.stroke.nominal_length
    model, taut = muscle_model(limb.actuator.force_law, nominal), nominal + limb.stroke.end_fitting
    return MuscleDrive("muscle", short, long, 0.0, model, taut, limb.actuator.supply_pressure, options)
