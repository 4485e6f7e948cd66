"""The drives of a design's limbs: pneumatic muscles, in line or over a tackle; cables on winches, linear actuators."""

from __future__ import annotations

from abc import ABC, abstractmethod
from dataclasses import dataclass, replace
from functools import reduce
from typing import Any, ClassVar

import numpy as np
from numpy.typing import ArrayLike
from scipy.spatial.transform import Rotation

from ...core.errors import MissingData
from ...core.validation import FloatArray, as_finite, as_rotation, require_type
from ...design import Limb, Mechanism, preset, presets
from ...muscle.io.model_files import muscle_model
from ...muscle.laws.force_laws import ChouHannaford
from ...muscle.laws.friction import ConstantFriction, LoadDependentFriction
from ...muscle.laws.static import BAR, StaticModel
from .equations.drive_kernels import COLUMNS, MOTOR_COLUMNS
from .options import MotorParameters, PlantOptions


class Contractions:
    """Contraction ratios of the muscles of a design.

    Parameters
    ----------
    mechanism : Mechanism
        Every limb with a stroke and its end fitting.

    Attributes
    ----------
    nominal, fittings : ndarray
        l_0 and e, shape (n,), m.

    Raises
    ------
    MissingData
        If a stroke or an end fitting is not known.

    Examples
    --------
    >>> from exo_pin.control import Contractions
    >>> contractions = Contractions(ep.load("prototype").mechanism)
    >>> (1e3 * contractions.nominal).round(1), (1e3 * contractions.fittings).round(1)  # mm
    (array([150., 250., 250.]), array([126., 154., 154.]))
    """

    def __init__(self, mechanism: Mechanism) -> None:
        require_type("mechanism", mechanism, Mechanism, "a Mechanism")
        spans, lacking = [], []
        for i, limb in enumerate(mechanism.limbs, 1):
            stroke, tackle = limb.stroke, None if limb.actuator is None else limb.actuator.tackle
            if stroke is None or stroke.end_fitting is None:
                lacking.append(f"stroke with end_fitting of limb {i}")
            elif tackle is None:
                spans.append((stroke.nominal_length + stroke.end_fitting, stroke.nominal_length))
            else:
                longest = stroke.nominal_length * stroke.longest + stroke.end_fitting
                spans.append((longest, tackle.ratio * tackle.muscle_length))
        if lacking:
            raise MissingData(lacking, "a contraction ratio", mechanism.name)
        self._uncontracted, self.nominal = np.array(spans).T
        self.fittings = self._uncontracted - self.nominal
        self._base = np.array(mechanism.geometry.base_points)
        self._platform = np.array(mechanism.geometry.platform_points)

    def lengths(self, poses: Rotation) -> FloatArray:
        """Limb lengths, shape (..., n), m, of poses of shape (...).

        Parameters
        ----------
        poses : Rotation
            Shape (...).

        Returns
        -------
        ndarray
            Shape (..., n), m.

        Examples
        --------
        >>> from exo_pin.control import Contractions
        >>> exo = ep.load("prototype")
        >>> pose = exo.pose(flexion=25)
        >>> bool(np.allclose(Contractions(exo.mechanism).lengths(pose), exo.inverse_kinematics(pose).lengths))  # m
        True
        """
        matrices = as_rotation("poses", poses).as_matrix()
        turned = self._platform @ np.swapaxes(matrices, -1, -2)
        return np.asarray(np.linalg.norm(turned - self._base, axis=-1))

    def ratios(self, lengths: ArrayLike) -> FloatArray:
        """Contraction ratios, shape (..., n), of limb lengths in m; below zero where a muscle would be stretched.

        Parameters
        ----------
        lengths : array_like
            Shape (..., n), m.

        Returns
        -------
        ndarray
            Shape (..., n).

        Examples
        --------
        >>> from exo_pin.control import Contractions
        >>> exo = ep.load("prototype")
        >>> contractions = Contractions(exo.mechanism)
        >>> contractions.ratios(contractions.fittings + 0.9 * contractions.nominal).round(9)
        array([0.1, 0.1, 0.1])
        """
        given = as_finite("lengths", lengths, (len(self.nominal),), stack=True)
        return np.asarray((self._uncontracted - given) / self.nominal)


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
    word: str
    shortest: float
    longest: float
    least_tension: float

    @abstractmethod
    def row(self) -> FloatArray:
        """Parameters as the equations read them: a row of the table of muscles or of that of motor drives."""

    def spans(self, length: Any) -> Any:
        """Whether a length of the limb in m, or each of several, is within its stroke."""
        return (length >= self.shortest - _ROUND) & (length <= self.longest + _ROUND)


@dataclass(frozen=True)
class MotorDrive(LimbDrive):
    """A winch or a linear actuator, seen along the limb.

    Attributes
    ----------
    parameters : MotorParameters
        Of motor and transmission.
    pull_limit, push_limit : float
        Greatest forces of the limb by the design, N; the motor's own limit is the larger of the two, either way.
    """

    is_motor: ClassVar[bool] = True
    parameters: MotorParameters
    pull_limit: float
    push_limit: float

    @property
    def pushes(self) -> bool:
        """Whether it can push."""
        return self.word == "actuator"

    @property
    def force_limit(self) -> float:
        """Of the motor, N."""
        return max(self.pull_limit, self.push_limit)

    @property
    def stiffness(self) -> float:
        """Of the limb between drive and arm, N/m."""
        return self.parameters.series_stiffness(self.longest)

    def row(self) -> FloatArray:
        """See :meth:`LimbDrive.row`."""
        own = self.parameters
        # Some columns are parameters as they stand.
        values = vars(own) | {
            "present": 1.0,
            "inverse_mass": 1.0 / own.mass,
            "force_limit": self.force_limit,
            "stall_force": own.stall_ratio * self.force_limit,
            "stiffness": self.stiffness,
            "damping": own.damping_time * self.stiffness,
            "pushes": float(self.pushes),
            "shortest": self.shortest,
            "longest": self.longest,
        }
        return np.array([values[name] for name in MOTOR_COLUMNS])


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


def has_motor(limb: Limb) -> bool:
    """Whether the actuator of a limb is a winch or a linear actuator, by its family; otherwise it has muscles."""
    actuator = limb.actuator
    return actuator is not None and actuator.family != "pneumatic muscle" and actuator.tackle is None


def drives_of(mechanism: Mechanism, options: PlantOptions) -> tuple[LimbDrive, ...]:
    """The drive of each limb, by the family of its actuator.

    A pneumatic muscle is in line with its limb. A cable is pulled by pneumatic muscles if its actuator has a tackle,
    and by a winch otherwise. The numbers that a design does not have come from the options.

    Raises
    ------
    MissingData
        If an actuator, a force law or limit, a stroke or an end fitting is not known.
    """
    found, missing = _made(mechanism, options)
    if missing:
        complete = [name for name in presets() if not _made(preset(name), options)[1]]
        raise MissingData(missing, "a plant", mechanism.name, f"presets with all of it: {', '.join(complete)}")
    return tuple(found)


def _made(mechanism: Mechanism, options: PlantOptions) -> tuple[list[LimbDrive], list[str]]:
    """The drives of the limbs that have one, and what the others lack."""
    found: list[LimbDrive] = []
    missing: list[str] = []
    for i, limb in enumerate(mechanism.limbs):
        try:
            found.append((_motor_drive if has_motor(limb) else _muscle_drive)(limb, f"limbs[{i}]", options))
        except MissingData as error:
            missing += error.missing
    return found, missing


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
    return MotorDrive(word, *_ends(limb.stroke), taut, parameters, actuator.pull_limit, actuator.push_limit)


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
