"""Motors of a plant: winches, linear actuators, motors in joints. Estimates, each with its unit and its basis."""

from __future__ import annotations

from abc import ABC, abstractmethod
from dataclasses import dataclass, field, fields
from typing import Any

import numpy as np

from ...core.errors import InvalidInput
from ...core.errors.checked import checked
from ...core.validation import as_positive, set_positive

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
    stiffness : float or None
        Of the gear between motor and joint, N m/rad or N/m. With it the inertia is that of the motor beyond a spring;
        None for a motor that acts on its joint without one, which has no play.
    damping_time : float
        Damping over stiffness of the gear, s.
    play : float or None
        Backlash of the gear, end to end, rad or m; None for that which the device's drives state, else none.

    Raises
    ------
    InvalidInput
        If a number is out of its range, or a gear has play or stiffness and what it lacks of stiffness and inertia.

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
    stiffness: float | None = estimate(None, "N m/rad or N/m", "no data of the gear: rigid")
    damping_time: float = estimate(5e-4, "s", "some per cent of critical damping where arm and drive vibrate")
    play: float | None = estimate(None, "rad or m", "that of the device's drives; none where they state none")

    def __post_init__(self) -> None:
        check_estimates(self)
        if self.play and self.stiffness is None:
            raise InvalidInput("expected the stiffness of a gear with play: within it the motor turns by itself")
        if self.stiffness is not None and not self.inertia:
            raise InvalidInput("expected the inertia of a motor beyond a gear that gives way, got none")

    @property
    def brake_force(self) -> float:
        """Effort of the brake, N m or N."""
        return self.brake_effort

    @property
    def mass(self) -> float:
        """Inertia carried over to the joint, kg m² or kg."""
        return self.inertia

    def series_stiffness(self, longest: float) -> float:
        """Stiffness of the gear, N m/rad or N/m, whatever the range of the joint.

        Parameters
        ----------
        longest : float
            End of the joint's range, rad or m.

        Returns
        -------
        float
            Infinite without one.

        Examples
        --------
        >>> from exo_pin.control import JointMotor
        >>> JointMotor(inertia=0.05, stiffness=2e3).series_stiffness(1.5), JointMotor().series_stiffness(1.5)
        (2000.0, inf)
        """
        return np.inf if self.stiffness is None else self.stiffness
