"""Options of a plant and of its motors: estimates, each with its unit and its basis."""

from __future__ import annotations

from abc import ABC, abstractmethod
from collections.abc import Sequence
from dataclasses import dataclass, field, fields, replace
from typing import Any

import numpy as np

from ...core.errors import InvalidInput, UnknownName
from ...core.errors.base import echo
from ...core.errors.checked import checked
from ...core.validation import as_finite, as_positive, require_types, set_positive
from ...muscle.laws.friction import ConstantFriction, Damping, FrictionLaw, LoadDependentFriction
from ...muscle.valve.flow import Supply, Valve, ValveUnit

#: Estimates that may be zero; all others are above it.
_MAY_BE_ZERO = {
    "viscous", "coulomb", "load_friction", "damping_time", "brake_force", "stop_damping", "least_tension",
    "drum_inertia", "routing_length", "screw_inertia", "shoulder_viscous", "shoulder_coulomb", "pulley_friction",
    "inertia", "brake_effort", "play",
}  # fmt: skip


def estimate(value: Any, unit: str, basis: str, scale: float = 1.0) -> Any:
    """A field with a number, in SI, and what :attr:`exo_pin.Plant.assumptions` says of it, there in ``unit``."""
    return field(default=value, metadata={"unit": unit, "basis": basis, "scale": scale})


def check_estimates(record: Any) -> None:
    """Check the numbers of a frozen record, and store them as floats.

    Raises
    ------
    InvalidInput
        If one is out of its range.
    """
    for item in fields(record):
        if "unit" in item.metadata:
            set_positive(record, item.name, zero=item.name in _MAY_BE_ZERO, optional=item.default is None)


@dataclass(frozen=True, kw_only=True)
class MotorParameters(ABC):
    """What winch and linear actuator have in common, all along the limb; every default is an estimate.

    Parameters
    ----------
    rotor_inertia : float
        Of the motor, kg m².
    no_load_speed : float
        Of the limb at full voltage, m/s.
    stall_ratio : float
        Force at full voltage and no speed over the force limit. With ``no_load_speed`` it gives the loss in the copper:
        F² v_0/F_0.
    viscous : float
        Friction over speed, N s/m.
    coulomb : float
        Dry friction, N.
    load_friction : float
        Dry friction over the force of the limb: losses of gear, screw, pulleys. From 1 on the drive locks itself.
    presliding : float
        Displacement over which dry friction builds up, m.
    damping_time : float
        Damping over stiffness of the limb, d/k, s. Far beyond critical damping a run takes long, and warns before.
    brake_force : float
        Of the brake that a spring closes when the current fails, N; zero for none.
    stop_stiffness, stop_damping : float
        Of the ends of the stroke, N/m and N s/m.
    least_tension : float
        That controllers keep, N.

    Raises
    ------
    InvalidInput
        If a number is out of its range.
    """

    rotor_inertia: float = estimate(4.4e-6, "kg m²", "a brushless motor of about 100 W")
    no_load_speed: float = estimate(0.6, "m/s", "the same motor at 7,000 to 8,000 turns a minute")
    stall_ratio: float = estimate(4.0, "", "such motors stall far above the torque that they can give for long")
    viscous: float = estimate(20.0, "N s/m", "drag of bearings and grease: 6 to 9 N at 0.3 m/s")
    coulomb: float = estimate(8.0, "N", "two to four per cent of the force limit")
    load_friction: float = estimate(
        0.1, "", "efficiency of about 0.9 of planetary gear and pulleys, or of a ball screw"
    )
    presliding: float = estimate(2e-4, "m", "below a tenth of a turn of the motor")
    damping_time: float = estimate(5e-4, "s", "some per cent of critical damping where arm and drive vibrate")
    brake_force: float = estimate(500.0, "N", "a brake on the motor's shaft, somewhat above the force limit")
    stop_stiffness: float = estimate(1e5, "N/m", "a rubber buffer: 4 mm at the force limit")
    stop_damping: float = estimate(1e3, "N s/m", "the same buffer, well damped")
    least_tension: float = estimate(0.0, "N", "that of the search which found the designs")

    def __post_init__(self) -> None:
        check_estimates(self)

    @property
    @abstractmethod
    def mass(self) -> float:
        """Inertia of the drive carried over to the limb, kg."""

    @abstractmethod
    def series_stiffness(self, longest: float) -> float:
        """Stiffness in N/m of the limb between drive and arm, for its longest length in m."""


@checked
@dataclass(frozen=True, kw_only=True)
class Winch(MotorParameters):
    """A cable on a drum with gear and motor.

    Parameters
    ----------
    drum_radius : float
        m.
    gear_ratio : float
        Turns of the motor over those of the drum.
    drum_inertia : float
        kg m²; an aluminium disc of 20 mm in radius and width.
    axial_stiffness : float
        E A of the cable, N: a wire rope of 1.5 mm, 55 % of whose circle is metal, with a modulus of 60 GPa.
    routing_length : float
        Of the cable between its exit from the frame and the drum, m.

    Notes
    -----
    Assumptions: the stiffness is that of the longest cable throughout; the cable does not slip on the drum; sheaths and
    pulleys on its way rub in proportion to the tension (``load_friction``).

    Examples
    --------
    >>> from exo_pin.control import Winch
    >>> winch = Winch()
    >>> drum = 60.0 * winch.no_load_speed / (2.0 * np.pi * winch.drum_radius)  # turns a minute
    >>> round(drum * winch.gear_ratio)  # of the motor, without load
    7448
    """

    least_tension: float = estimate(5.0, "N", "that of the search which found the designs")
    drum_radius: float = estimate(0.02, "m", "a drum of 27 diameters of the cable")
    gear_ratio: float = estimate(26.0, "", "400 N from a motor of that size, 0.31 N m for a short time")
    drum_inertia: float = estimate(1.4e-5, "kg m²", "an aluminium disc of 20 mm in radius and width")
    axial_stiffness: float = estimate(5.8e4, "N", "wire rope of 1.5 mm, 55 % metal, modulus 60 GPa")
    routing_length: float = estimate(0.5, "m", "motors on the back plate or behind the wearer")

    @property
    def mass(self) -> float:
        """See :attr:`MotorParameters.mass`."""
        return (self.rotor_inertia * self.gear_ratio**2 + self.drum_inertia) / self.drum_radius**2

    def series_stiffness(self, longest: float) -> float:
        """See ``MotorParameters.series_stiffness``.

        Parameters
        ----------
        longest : float
            Greatest length of the limb, m.

        Returns
        -------
        float
            N/m.

        Examples
        --------
        >>> from exo_pin.control import Winch
        >>> winch = Winch()
        >>> round(1e3 * 100.0 / winch.series_stiffness(0.5), 2)  # mm by which 100 N stretches half a metre of limb
        1.72
        """
        return self.axial_stiffness / (as_positive("longest", longest) + self.routing_length)


@dataclass(frozen=True, kw_only=True)
class LinearActuator(MotorParameters):
    """A ball screw with its motor: it pushes and pulls, and can be driven back.

    Parameters
    ----------
    lead : float
        Travel of the nut in one turn, m.
    screw_inertia : float
        kg m²; a steel screw of 10 mm in diameter and 0.3 m in length.
    stiffness : float
        Of screw, rod, rod ends and their mounts together, N/m.

    Examples
    --------
    >>> from exo_pin.control import LinearActuator
    >>> screw = LinearActuator()
    >>> round(60.0 * screw.no_load_speed / screw.lead)  # turns a minute without load
    7200
    """

    coulomb: float = estimate(15.0, "N", "two to four per cent of the force limit")
    viscous: float = estimate(30.0, "N s/m", "drag of bearings and grease: 6 to 9 N at 0.3 m/s")
    lead: float = estimate(0.005, "m", "a small ball screw, driven without a gear")
    screw_inertia: float = estimate(2.3e-6, "kg m²", "a steel screw of 10 mm in diameter and 0.3 m in length")
    stiffness: float = estimate(1e6, "N/m", "screw, rod ends and mounts in series; 0.4 mm at the force limit")

    @property
    def mass(self) -> float:
        """See :attr:`MotorParameters.mass`."""
        return (self.rotor_inertia + self.screw_inertia) * (2.0 * np.pi / self.lead) ** 2

    def series_stiffness(self, longest: float) -> float:
        """See ``MotorParameters.series_stiffness``.

        Parameters
        ----------
        longest : float
            Greatest length of the limb, m.

        Returns
        -------
        float
            N/m.

        Examples
        --------
        >>> from exo_pin.control import LinearActuator
        >>> screw = LinearActuator()
        >>> screw.series_stiffness(0.3) == screw.series_stiffness(0.6) == screw.stiffness  # N/m, of any length
        True
        """
        return self.stiffness


@dataclass(frozen=True, kw_only=True)
class JointMotor:
    """A geared motor in a joint or on a cable of a device that says no more of it than its limits.

    It acts on the joint's coordinate without a spring between: its inertia is added to that of the joint, and what the
    device's file has of the joint (armature, damping, dry friction) counts besides. N m and rad of a hinge, N and m of
    a slide. A cable's is a source of tension: of these numbers only the limit and the speed count.

    Parameters
    ----------
    limit : float or None
        Greatest effort of drives whose limits the device does not have, N m or N, either way; a cable only pulls.
    inertia : float
        Of rotor and gear, carried over to the joint, kg m² or kg.
    viscous : float
        Friction over speed, N m s/rad or N s/m.
    coulomb : float
        Dry friction, N m or N.
    load_friction : float
        Dry friction over the effort: losses of the gear.
    presliding : float
        Displacement over which dry friction and a closed brake build up, rad or m.
    stall_ratio : float
        Effort at full voltage and no speed over the limit; counts for drives with a speed limit, at which none is left.
    brake_effort : float
        Of the brake that a spring closes when the current fails, N m or N; zero for none.
    stop_depth : float
        By how much the greatest effort presses the joint into the elastic end of its range, rad or m.
    stop_time : float
        Damping over stiffness of that end, s.

    Raises
    ------
    InvalidInput
        If a number is out of its range.

    Examples
    --------
    >>> from exo_pin.control import JointMotor
    >>> motor = JointMotor(inertia=2e-5 * 50.0**2, coulomb=0.5)  # a rotor behind a gear of 50 : 1
    >>> motor.inertia  # kg m²
    0.05
    """

    limit: float | None = estimate(None, "N m or N", "limits are those of the device")
    inertia: float = estimate(0.0, "kg m² or kg", "no data of the motor: that of the joint alone, by the device's file")
    viscous: float = estimate(0.0, "N m s/rad or N s/m", "no data of the motor: that of the joint alone")
    coulomb: float = estimate(0.0, "N m or N", "no data of the motor: that of the joint alone")
    load_friction: float = estimate(0.0, "", "no data of the gear: without loss")
    presliding: float = estimate(2e-3, "rad or m", "a tenth of a degree")
    stall_ratio: float = estimate(4.0, "", "such motors stall far above the effort that they can give for long")
    brake_effort: float = estimate(0.0, "N m or N", "no brake is known")
    stop_depth: float = estimate(0.01, "rad or m", "a rubber buffer: half a degree, or 10 mm, at the greatest effort")
    stop_time: float = estimate(0.01, "s", "the same buffer, well damped")

    def __post_init__(self) -> None:
        check_estimates(self)


def _unit() -> ValveUnit:
    return ValveUnit(Valve(1e-9, 0.3), Valve(1e-9, 0.3), restrictor=Valve(2e-10, 0.5))


@dataclass(frozen=True, kw_only=True)
class PlantOptions:
    """Air, motors, friction and shoulder unit of a plant.

    Every default that the thesis does not print is an estimate, and :attr:`Plant.assumptions` lists it.

    Parameters
    ----------
    supply : Supply or None
        None for a supply that holds the pressure of the actuators of the design.
    valves : ValveUnit or sequence of ValveUnit
        One for all muscles, or one a muscle.
    polytropic_exponent : float
        κ of the air in muscles and manifold, from 1 (isothermal) to 1.4 (adiabatic).
    dead_volume : float
        Of the tube between valve and muscle, m³.
    braid_stiffness : float
        Stiffness of a muscle that is pulled beyond its nominal length, N/m of a muscle of 0.3 m; shorter ones are
        stiffer in proportion.
    muscle_damping : Damping or None
        (3-21); None for none.
    muscle_friction : FrictionLaw or None
        Coulomb friction: :class:`ConstantFriction`, or :class:`LoadDependentFriction`, (3-16) with the pull in place of
        the hung weight. None for none.
    presliding : float
        Displacement over which a muscle's friction builds up, m.
    shoulder_viscous : float
        Moment of viscous friction in the shoulder over angular velocity, N m s/rad.
    shoulder_coulomb : float
        Moment of dry friction in the shoulder, N m.
    shoulder_presliding : float
        Turn over which it builds up, rad.
    second_flange : bool
        Whether the shoulder unit has the flange bearing of Section 5.4.3, so that its range has no end.
    stop_stiffness, stop_damping : float
        Of the ends of the shoulder unit's range, N m/rad and N m s/rad.
    series_spring : float or None
        Stiffness of a spring in series with each muscle (Section 6.2), N/m; None for none.
    pulley_friction : float
        Dry friction of the pulleys between a muscle and its cable over the pull of the muscle.
    winch : Winch
        Of every cable without a tackle.
    linear_actuator : LinearActuator
        Of every linear actuator.
    joint_motor : JointMotor
        Of every drive of a device that states no more than its limits.
    play : float or None
        Backlash between each winch or linear actuator and its limb, end to end, m; None for that which the design
        states (:attr:`exo_pin.Actuator.play`), none where it states none. Of limbs that only pull it is an offset.

    Raises
    ------
    InvalidInput
        If a number is not in its range, or a part has a wrong type.

    Notes
    -----
    The flange bearing is that of thesis Section 5.4.3, the spring that of Section 6.2.

    Source: thesis Table 5-6, Table A-1, Figure 5-20.

    Examples
    --------
    >>> options = ep.PlantOptions(polytropic_exponent=1.4)  # adiabatic air
    >>> options.valves.frequency, ep.PlantOptions().polytropic_exponent  # Hz, as in the thesis; isothermal by default
    (20.0, 1.0)
    """

    supply: Supply | None = None
    valves: ValveUnit | Sequence[ValveUnit] = field(default_factory=_unit)
    polytropic_exponent: float = estimate(
        1.0,
        "",
        "no model of the air is printed; isothermal, as the muscles' walls are thin and the motions take seconds",
    )
    dead_volume: float = estimate(2.5e-6, "cm³", "half a metre of tube with a bore of 2.5 mm", 1e6)
    braid_stiffness: float = estimate(
        2960.0, "N/m for 300 mm", "least squares through zero of the six stretched states of Table A-1, without air"
    )
    muscle_damping: Damping | None = field(
        default=Damping.from_bar(-1.0, 0.802),
        metadata={"basis": "(3-30), of the 300 mm muscle: no scaling with length is known"},
    )
    muscle_friction: FrictionLaw | None = field(
        default=None, metadata={"basis": "(3-16) is for a hung weight and a 300 mm muscle; off unless given"}
    )
    presliding: float = estimate(2e-4, "mm", "estimate, below 0.1 % of the length", 1e3)
    shoulder_viscous: float = estimate(0.0, "N m s/rad", "not printed; off unless given")
    shoulder_coulomb: float = estimate(0.0, "N m", "not printed; off unless given")
    shoulder_presliding: float = estimate(2e-3, "rad", "estimate, a tenth of a degree")
    second_flange: bool = False
    stop_stiffness: float = estimate(100.0, "N m/rad", "not printed")
    stop_damping: float = estimate(1.0, "N m s/rad", "not printed")
    series_spring: float | None = estimate(None, "N/m", "Section 6.2 proposes one without a figure")
    pulley_friction: float = estimate(
        0.05, "of the muscle's pull", "estimate: the tackle and an exit pulley, two to three sheaves on ball bearings"
    )
    winch: Winch = field(default_factory=Winch)
    linear_actuator: LinearActuator = field(default_factory=LinearActuator)
    joint_motor: JointMotor = field(default_factory=JointMotor)
    play: float | None = estimate(None, "mm", "that of the design's drives; none where they state none", 1e3)

    def __post_init__(self) -> None:
        units = (self.valves,) if isinstance(self.valves, ValveUnit) else self.valves
        units = tuple(units) if np.iterable(units) else ()
        if not units or not all(isinstance(unit, ValveUnit) for unit in units):
            raise InvalidInput("expected valves to be a ValveUnit, or a sequence of one a muscle")
        if not isinstance(self.valves, ValveUnit):
            object.__setattr__(self, "valves", units)
        if not isinstance(self.second_flange, bool | np.bool_):
            raise InvalidInput(f"expected second_flange as True or False, got {echo(self.second_flange)}")
        kappa = float(as_finite("polytropic_exponent", self.polytropic_exponent, ()))
        if not 1.0 <= kappa <= 1.4:
            raise InvalidInput(f"expected polytropic_exponent from 1 to 1.4, got {kappa:g}")
        check_estimates(self)
        require_types(
            self,
            supply=Supply | None,
            muscle_damping=Damping | None,
            winch=Winch,
            linear_actuator=LinearActuator,
            joint_motor=JointMotor,
            muscle_friction=ConstantFriction | LoadDependentFriction | None,
        )

    def replace(self, **changes: Any) -> PlantOptions:
        """Return a copy with some fields changed.

        Parameters
        ----------
        **changes
            Fields of the class.

        Returns
        -------
        PlantOptions

        Raises
        ------
        UnknownName
            If a name is no field.

        Examples
        --------
        >>> options = ep.PlantOptions().replace(supply=ep.Supply(5e5))
        >>> round(1e-5 * options.supply.pressure, 9), options.valves == ep.PlantOptions().valves  # bar; the rest stays
        (5.0, True)
        """
        known = {item.name for item in fields(self)}
        for name in changes:
            if name not in known:
                raise UnknownName("field", name, known)
        return replace(self, **changes)
