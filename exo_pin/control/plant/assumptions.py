"""Which parameters of a plant the source does not print, and where their values come from."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, fields, replace
from typing import Any

import numpy as np

from ...design import Mechanism
from ...muscle.valve.flow import ValveUnit
from .drives import LimbDrive, MotorDrive, MuscleDrive
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


def assumptions_of(mechanism: Mechanism, drives: Sequence[LimbDrive], options: PlantOptions) -> tuple[Assumption, ...]:
    """Every estimated parameter of a plant, those of the design first."""
    found = _fittings(mechanism)
    muscles = [drive for drive in drives if isinstance(drive, MuscleDrive)]
    if muscles:
        found += _supply(muscles, options)
        found += _estimates(options, ["polytropic_exponent", "dead_volume"])
        found += _laws(mechanism)
        names = ["braid_stiffness", "muscle_damping", "muscle_friction", "series_spring"]
        found += _estimates(options, [*names, *(["presliding"] if options.muscle_friction is not None else [])])
    if any(drive.over_tackle for drive in muscles):
        found += _estimates(options, ["pulley_friction"])
    for word, name in (("cable", "winch"), ("actuator", "linear_actuator")):
        pairs = zip(mechanism.limbs, drives, strict=True)
        motors = [limb.actuator for limb, drive in pairs if isinstance(drive, MotorDrive) and drive.word == word]
        if motors:
            # The design's speed limits take the place of the estimate.
            limited = all(motor is not None and motor.speed_limit is not None for motor in motors)
            own = getattr(options, name)
            names = [item.name for item in fields(own) if not (limited and item.name == "no_load_speed")]
            estimates = _estimates(own, names, "estimate: ")
            found += [replace(each, name=f"{name}.{each.name}") for each in estimates]
    return (*found, *_shoulder(mechanism, options))


def _estimates(record: Any, names: Sequence[str], head: str = "") -> list[Assumption]:
    """Fields of the options or of motor drives; the basis of one that is not the default is that somebody gave it."""
    known, found = {item.name: item for item in fields(record)}, []
    for name in names:
        value, said = getattr(record, name), known[name].metadata
        words = "none" if value is None else repr(value)
        if isinstance(value, float):
            words = f"{said['scale'] * value:g} {said['unit']}".rstrip()
        basis = f"{head}{said['basis']}" if value == known[name].default else "given"
        found.append(Assumption(name, words, basis))
    return found


def _fittings(mechanism: Mechanism) -> list[Assumption]:
    return [
        Assumption(f"limbs[{i}].stroke.end_fitting", f"{1e3 * limb.stroke.end_fitting:g} mm",
                   "not printed; from the muscle lengths that Section 5.4 remarks on, which disagree: 105 to 147 mm "
                   "for limb 1, 150 to 158 mm for limbs 2 and 3 of the prototype")
        for i, limb in enumerate(mechanism.limbs)
        if limb.stroke is not None
        if limb.stroke.end_fitting is not None
        if f"limbs[{i}].stroke.end_fitting" in mechanism.estimated
    ]  # fmt: skip


def _supply(muscles: Sequence[MuscleDrive], options: PlantOptions) -> list[Assumption]:
    greatest = max(drive.supply_pressure for drive in muscles)
    supply = greatest if options.supply is None else options.supply.pressure
    source = "the highest safe pressure of the muscles (Appendix A); the prototype's supply is not printed"
    given = (options.valves,) if isinstance(options.valves, ValveUnit) else options.valves
    units, usual = list(dict.fromkeys(given)), options.valves == PlantOptions().valves
    paths = "not printed; a small solenoid valve, and a restrictor through which a muscle of 250 mm fills in about a "
    paths += "second, several times faster than the experiments of Section 5.4"
    layout = 'printed as "three way two port", which is no valve; 3/2-way is meant'
    layouts = ", ".join(dict.fromkeys(unit.layout for unit in units))
    return [
        Assumption("supply", f"{supply / 1e5:g} bar", source if options.supply is None else "given"),
        Assumption("valves", "; ".join(_paths(unit) for unit in units), paths if usual else "given"),
        Assumption("valves.layout", layouts, layout if usual else "given"),
    ]


def _paths(unit: ValveUnit) -> str:
    return ", ".join(
        f"{name} C = {1e8 * valve.conductance:g} dm³/(s bar), b = {valve.critical_ratio:g}"
        for name, valve in (("fill", unit.fill), ("vent", unit.vent), ("restrictor", unit.restrictor))
        if valve is not None
    )


def _laws(mechanism: Mechanism) -> list[Assumption]:
    pulled = [limb.actuator for limb in mechanism.limbs if limb.actuator is not None]
    laws = [law for a in pulled if (law := a.force_law if a.tackle is None else a.tackle.force_law) is not None]
    return [
        Assumption("volume of the muscles", "V = L (b² - L²)/(4 π n²)",
                   "(3-2) to (3-4), with thread and turns fitted to Tables 3-1 and 3-2 (fitted-chou-hannaford)"),
        Assumption("force law", f"that of the 300 mm muscle at equal strain ({', '.join(dict.fromkeys(laws))})",
                   "Tables 3-1 to 3-3; no other length was measured"),
    ]  # fmt: skip


def _shoulder(mechanism: Mechanism, options: PlantOptions) -> list[Assumption]:
    found = _estimates(options, ["shoulder_viscous", "shoulder_coulomb"])
    if options.shoulder_coulomb > 0.0:
        found += _estimates(options, ["shoulder_presliding"])
    if mechanism.shoulder.half_diagonal is not None and not options.second_flange:
        arm = mechanism.require_arm("a plant")
        weight = arm.mass * float(np.linalg.norm(mechanism.gravity) * np.linalg.norm(arm.centre_of_mass))
        beyond = np.degrees(weight / options.stop_stiffness)
        ends = _estimates(options, ["stop_stiffness", "stop_damping"])
        basis = f"not printed; the largest moment of the weight, {weight:.2g} N m, turns the unit by {beyond:.2g} "
        basis += "degrees beyond its end"
        given = any(each.basis == "given" for each in ends)
        value = ", ".join(each.value for each in ends)
        found.append(Assumption("stop_stiffness, stop_damping", value, "given" if given else basis))
    return found
