"""Which parameters of a plant the source does not print, and where their values come from."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, fields, replace

import numpy as np

from ...design import Mechanism
from ...muscle.valve.supply import ValveUnit
from .drives import Drive, MotorDrive, MuscleDrive
from .options import PlantOptions


@dataclass(frozen=True)
class Assumption:
    """A parameter that is an estimate.

    Attributes
    ----------
    name : str
        Field of :class:`PlantOptions`, or key of the mechanism.
    value : str
        With its unit.
    basis : str
        Where the value comes from; "given" if it is an option that is not the default.
    """

    name: str
    value: str
    basis: str

    def __str__(self) -> str:
        return f"{self.name} = {self.value}: {self.basis}"


def assumptions_of(mechanism: Mechanism, drives: Sequence[Drive], options: PlantOptions) -> tuple[Assumption, ...]:
    """Every estimated parameter of a plant, those of the design first."""
    design = [
        Assumption(f"limbs[{i}].stroke.end_fitting", f"{1e3 * limb.stroke.end_fitting:g} mm",
                   "not printed; from the muscle lengths that Section 5.4 remarks on, which disagree: 105 to 147 mm "
                   "for limb 1, 150 to 158 mm for limbs 2 and 3 of the prototype")
        for i, limb in enumerate(mechanism.limbs)
        if limb.stroke is not None
        if limb.stroke.end_fitting is not None
        if f"limbs[{i}].stroke.end_fitting" in mechanism.estimated
    ]  # fmt: skip
    found = [*design]
    if any(isinstance(drive, MuscleDrive) for drive in drives):
        found += [*_air(drives, options), *_muscles(mechanism, options)]
    if any(isinstance(drive, MuscleDrive) and drive.over_tackle for drive in drives):
        found.append(
            Assumption("pulley_friction", f"{options.pulley_friction:g} of the muscle's pull",
                       "estimate: the tackle and an exit pulley, two to three sheaves on ball bearings")
        )  # fmt: skip
    for word, name in (("cable", "winch"), ("actuator", "linear_actuator")):
        pairs = zip(mechanism.limbs, drives, strict=True)
        motors = [limb.actuator for limb, drive in pairs if isinstance(drive, MotorDrive) and drive.word == word]
        if motors:
            # The design's speed limits take the place of the estimate.
            limited = all(motor is not None and motor.speed_limit is not None for motor in motors)
            found += _motor(name, options, ("no_load_speed",) if limited else ())
    return tuple(_as_given(each, options) for each in (*found, *_shoulder(mechanism, options)))


def _as_given(assumption: Assumption, options: PlantOptions) -> Assumption:
    """The basis of an option that is not the default is that somebody gave it; of motor drives by each number."""
    usual, (first, *part) = PlantOptions(), assumption.name.split(".")
    now, before = ([getattr(each, name, None) for name in first.split(", ")] for each in (options, usual))
    if first in ("winch", "linear_actuator"):
        now, before = ([getattr(value, part[0]) for value in values] for values in (now, before))
    return assumption if now == before else replace(assumption, basis="given")


def _air(drives: Sequence[Drive], options: PlantOptions) -> list[Assumption]:
    greatest = max(drive.supply_pressure for drive in drives if isinstance(drive, MuscleDrive))
    supply = greatest if options.supply is None else options.supply.pressure
    source = "the highest safe pressure of the muscles (Appendix A); the prototype's supply is not printed"
    given = (options.valves,) if isinstance(options.valves, ValveUnit) else options.valves
    units = list(dict.fromkeys(given))
    return [
        Assumption("supply", f"{supply / 1e5:g} bar", source),
        Assumption("valves", "; ".join(_paths(unit) for unit in units),
                   "not printed; a small solenoid valve, and a restrictor through which a muscle of 250 mm "
                   "fills in about a second, several times faster than the experiments of Section 5.4"),
        Assumption("valves.layout", ", ".join(dict.fromkeys(unit.layout for unit in units)),
                   'printed as "three way two port", which is no valve; 3/2-way is meant'),
        Assumption("polytropic_exponent", f"{options.polytropic_exponent:g}",
                   "no model of the air is printed; isothermal, as the muscles' walls are thin and the motions take "
                   "seconds"),
        Assumption("dead_volume", f"{1e6 * options.dead_volume:g} cm³", "half a metre of tube with a bore of 2.5 mm"),
        Assumption("volume of the muscles", "V = L (b² - L²)/(4 π n²)",
                   "(3-2) to (3-4), with thread and turns fitted to Tables 3-1 and 3-2 (fitted-chou-hannaford)"),
    ]  # fmt: skip


def _paths(unit: ValveUnit) -> str:
    return ", ".join(
        f"{name} C = {1e8 * valve.conductance:g} dm³/(s bar), b = {valve.critical_ratio:g}"
        for name, valve in (("fill", unit.fill), ("vent", unit.vent), ("restrictor", unit.restrictor))
        if valve is not None
    )


def _muscles(mechanism: Mechanism, options: PlantOptions) -> list[Assumption]:
    friction = "none" if options.muscle_friction is None else repr(options.muscle_friction)
    spring = "none" if options.series_spring is None else f"{options.series_spring:g} N/m"
    pulled = [limb.actuator for limb in mechanism.limbs if limb.actuator is not None]
    laws = [law for a in pulled if (law := a.force_law if a.tackle is None else a.tackle.force_law) is not None]
    damping = "none" if options.muscle_damping is None else repr(options.muscle_damping)
    found = [
        Assumption("force law", f"that of the 300 mm muscle at equal strain ({', '.join(dict.fromkeys(laws))})",
                   "Tables 3-1 to 3-3; no other length was measured"),
        Assumption("braid_stiffness", f"{options.braid_stiffness:g} N/m for 300 mm",
                   "least squares through zero of the six stretched states of Table A-1, without air"),
        Assumption("muscle_damping", damping, "(3-30), of the 300 mm muscle: no scaling with length is known"),
        Assumption("muscle_friction", friction, "(3-16) is for a hung weight and a 300 mm muscle; off unless given"),
        Assumption("series_spring", spring, "Section 6.2 proposes one without a figure"),
    ]  # fmt: skip
    if options.muscle_friction is not None:
        found.append(
            Assumption("presliding", f"{1e3 * options.presliding:g} mm", "estimate, below 0.1 % of the length")
        )
    return found


def _motor(name: str, options: PlantOptions, replaced: tuple[str, ...]) -> list[Assumption]:
    """The parameters of winches or linear actuators, but those ``replaced``, each with what it is an estimate for."""
    given = getattr(options, name)
    return [
        Assumption(f"{name}.{item.name}", f"{getattr(given, item.name):g} {item.metadata['unit']}".rstrip(),
                   f"estimate: {item.metadata['basis']}")
        for item in fields(given)
        if item.name not in replaced
    ]  # fmt: skip


def _shoulder(mechanism: Mechanism, options: PlantOptions) -> list[Assumption]:
    found = [
        Assumption("shoulder_viscous", f"{options.shoulder_viscous:g} N m s/rad", "not printed; off unless given"),
        Assumption("shoulder_coulomb", f"{options.shoulder_coulomb:g} N m", "not printed; off unless given"),
    ]
    if options.shoulder_coulomb > 0.0:
        found.append(
            Assumption("shoulder_presliding", f"{options.shoulder_presliding:g} rad", "estimate, a tenth of a degree")
        )
    if mechanism.shoulder.half_diagonal is not None and not options.second_flange:
        arm = mechanism.require_arm("a plant")
        weight = arm.mass * float(np.linalg.norm(mechanism.gravity) * np.linalg.norm(arm.centre_of_mass))
        found.append(
            Assumption("stop_stiffness, stop_damping",
                       f"{options.stop_stiffness:g} N m/rad, {options.stop_damping:g} N m s/rad",
                       f"not printed; the largest moment of the weight, {weight:.2g} N m, turns the unit by "
                       f"{np.degrees(weight / options.stop_stiffness):.2g} degrees beyond its end")
        )  # fmt: skip
    return found
