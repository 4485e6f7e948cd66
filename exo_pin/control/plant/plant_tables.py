"""From a design and its options to the tables that the compiled equations read.

Which parameters of a plant the source does not print, and where their values come from.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, fields, replace
from typing import Any

import numpy as np
from numpy.typing import ArrayLike

from ...core.errors import InvalidInput
from ...core.validation import FloatArray, require_type
from ...design import WristGeometry
from ...design.actuator import is_law_text
from ...load_case import Load
from ...muscle.io.model_files import muscle_model
from ...muscle.laws.force_laws import PolynomialModel
from ...muscle.laws.static import BAR, StaticModel
from ...muscle.valve.flow import ATMOSPHERE, Supply
from .drives import LimbDrive, MotorDrive, MuscleDrive
from .equations.drive_kernels import AIR, COLUMNS, MOTOR_COLUMNS
from .equations.plant_kernels import SHOULDER, Tables
from .options import PlantOptions

#: Row of the table of muscles of a limb that has none: numbers that no division stumbles over.
NO_MUSCLE = np.array([1.0 if name in ("nominal_length", "presliding", "ratio") else 0.0 for name in COLUMNS])


def supply_of(drives: Sequence[LimbDrive], options: PlantOptions) -> Supply | None:
    """The supply: that of the options, or one that holds the highest pressure of the muscles; None without muscles."""
    pressures = [drive.supply_pressure for drive in drives if isinstance(drive, MuscleDrive)]
    if not pressures:
        return None
    return Supply(max(pressures)) if options.supply is None else options.supply


def plant_tables(
    mechanism: Any,
    geometry: WristGeometry | None,
    drives: Sequence[LimbDrive],
    options: PlantOptions,
    load: Load | None,
    supply: Supply | None,
    soft_cuff: bool,
) -> Tables:
    """The tables of a plant; with a soft cuff the arm is that of the person alone.

    Raises
    ------
    MissingData
        If something is not known.
    InvalidInput
        If the load is not one constant force, or a law is no polynomial.
    """
    arm = mechanism.require_arm("a plant", inertia=True)
    if soft_cuff and arm.person is not None:
        arm = arm.person
    assert arm.inertia is not None
    c = arm.centre_of_mass
    inertia = arm.inertia + arm.mass * (c @ c * np.eye(3) - np.outer(c, c))
    force, point = _constant_force(load)
    # The equations of a closed chain read all but these.
    nowhere = np.zeros((len(drives), 3))
    ends = (nowhere, nowhere) if geometry is None else (geometry.base_points, geometry.platform_points)
    return Tables(
        _own(ends[0]), _own(ends[1]), _own(c), _own(mechanism.gravity), float(arm.mass),
        _own(inertia), _own(np.asarray(np.linalg.inv(inertia))), force, point, _laws(drives),
        _rows(drives, False, NO_MUSCLE), _rows(drives, True, np.zeros(len(MOTOR_COLUMNS))),
        _shoulder(mechanism, options), _air(supply, options),
    )  # fmt: skip


def _own(array: ArrayLike) -> FloatArray:
    """A contiguous writable copy: the kernels are compiled for one kind of array."""
    return np.array(array, dtype=float, order="C")


def _constant_force(load: Load | None) -> tuple[FloatArray, FloatArray]:
    if load is None:
        return np.zeros(3), np.zeros(3)
    require_type("load", load, Load, "a Load")
    force, at, moment = (np.asarray(value, dtype=float) for value in (load.force, load.at, load.moment))
    if force.ndim > 1 or at.ndim > 1 or moment.any() or load.frame != "base":
        raise InvalidInput('expected one force without a couple, frame="base": the load of a plant is constant in time')
    return _own(force), _own(at)


def _rows(drives: Sequence[LimbDrive], motors: bool, other: FloatArray) -> FloatArray:
    """One row a limb; ``other`` for a limb whose drive is of the other kind."""
    rows = [drive.row() if drive.is_motor == motors else other for drive in drives]
    return np.array(rows).reshape(len(drives), len(other))


def _laws(drives: Sequence[LimbDrive]) -> FloatArray:
    """Coefficients, shape (n, I, J), N, by powers of strain and of pressure in bar; zero without a muscle."""
    tables = [_polynomial(d.model) if isinstance(d, MuscleDrive) else np.zeros((1, 1)) for d in drives]
    shape = np.max([table.shape for table in tables], axis=0, initial=1)
    if not tables:
        return np.zeros((0, 1, 1))
    return np.array([np.pad(t, [(0, s - k) for s, k in zip(shape, t.shape, strict=True)]) for t in tables])


def _polynomial(model: StaticModel) -> FloatArray:
    """Coefficients of a law by powers of strain and of pressure in bar."""
    if isinstance(model, PolynomialModel):
        table = np.zeros(np.max(list(model.coefficients), axis=0) + 1)
        for (i, j), value in model.in_bar.items():
            table[i, j] = value * model.reference_length**i
        return table
    # A law of another class may be one, too, such as a table of two rows: more values than coefficients tell.
    strain, bar = np.linspace(0.0, 0.4, 12), np.linspace(0.0, 4.5, 6)
    values = model.unchecked_force(strain[:, None] * model.length, bar * BAR)
    by_strain, by_bar = np.vander(strain, 6, increasing=True), np.vander(bar, 3, increasing=True)
    table = np.round(np.linalg.pinv(by_strain) @ values @ np.linalg.pinv(by_bar).T, 9)
    error = np.abs(by_strain @ table @ by_bar.T - values).max()
    if not error < 1e-8:
        raise InvalidInput(
            f"expected a static law that is a polynomial in contraction and pressure, got {model.name!r}, "
            f"which is not, by {error:.2g} N; fit one with exo_pin.muscle.identify_static"
        )
    return table


def _shoulder(mechanism: Any, options: PlantOptions) -> FloatArray:
    joint = mechanism.shoulder
    values = {
        "viscous": options.shoulder_viscous,
        "coulomb": options.shoulder_coulomb,
        "presliding": options.shoulder_presliding if options.shoulder_coulomb > 0.0 else 1.0,
        "side": 1.0 if mechanism.side == "left" else -1.0,
    }
    if joint.abduction_centre is not None and joint.half_diagonal is not None and not options.second_flange:
        values |= {
            "stops": 1.0,
            "stop_centre": joint.abduction_centre,
            "stop_half": joint.half_diagonal,
            "stop_stiffness": options.stop_stiffness,
            "stop_damping": options.stop_damping,
        }
    return np.array([values.get(name, 0.0) for name in SHOULDER])


def _air(supply: Supply | None, options: PlantOptions) -> FloatArray:
    if supply is None:
        return np.array([ATMOSPHERE if name == "supply" else 0.0 for name in AIR])
    values = {"exponent": options.polytropic_exponent, "supply": supply.absolute}
    if supply.regulator is not None and supply.volume is not None:
        values |= {
            "regulator": supply.regulator.conductance,
            "regulator_ratio": supply.regulator.critical_ratio,
            "manifold": supply.volume,
        }
    return np.array([values.get(name, 0.0) for name in AIR])


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


def assumptions_of(mechanism: Any, drives: Sequence[LimbDrive], options: PlantOptions) -> tuple[Assumption, ...]:
    """Every estimated parameter of a plant, those of the design first."""
    found = _fittings(mechanism)
    muscles = [drive for drive in drives if isinstance(drive, MuscleDrive)]
    if muscles:
        found += _supply(muscles, options)
        found += _estimates(options, ["polytropic_exponent", "dead_volume"])
        found += _law_estimates(mechanism)
        names = ["braid_stiffness", "muscle_damping", "muscle_friction", "series_spring"]
        found += _estimates(options, [*names, *(["presliding"] if options.muscle_friction is not None else [])])
    if any(drive.over_tackle for drive in muscles):
        found += _estimates(options, ["pulley_friction"])
    if any(drive.is_direct or getattr(drive, "of_joint", False) for drive in drives):
        own = [item.name for item in fields(options.joint_motor)]
        found += [replace(each, name=f"joint_motor.{each.name}") for each in _estimates(options.joint_motor, own)]
    for word, name in (("cable", "winch"), ("actuator", "linear_actuator")):
        pairs = zip(mechanism.limbs, drives, strict=False)
        motors = [limb.actuator for limb, drive in pairs if isinstance(drive, MotorDrive) and drive.word == word]
        if motors:
            # The design's speed limits take the place of the estimate.
            limited = all(motor is not None and motor.speed_limit is not None for motor in motors)
            own = getattr(options, name)
            names = [item.name for item in fields(own) if not (limited and item.name == "no_load_speed")]
            estimates = _estimates(own, names, "estimate: ")
            found += [replace(each, name=f"{name}.{each.name}") for each in estimates]
    if any(isinstance(drive, MotorDrive) for drive in drives):
        found += _estimates(options, ["play"])
    return (*found, *_shoulder_estimates(mechanism, options))


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


def _fittings(mechanism: Any) -> list[Assumption]:
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
    unit, usual = options.valves, options.valves == PlantOptions().valves
    paths = "not printed; a small solenoid valve, and a restrictor through which a muscle of 250 mm fills in about a "
    paths += "second, several times faster than the experiments of Section 5.4"
    layout = 'printed as "three way two port", which is no valve; 3/2-way is meant'
    opened = [
        f"{name} C = {1e8 * valve.conductance:g} dm³/(s bar), b = {valve.critical_ratio:g}"
        for name, valve in (("fill", unit.fill), ("vent", unit.vent), ("restrictor", unit.restrictor))
        if valve is not None
    ]
    return [
        Assumption("supply", f"{supply / 1e5:g} bar", source if options.supply is None else "given"),
        Assumption("valves", ", ".join(opened), paths if usual else "given"),
        Assumption("valves.layout", unit.layout, layout if usual else "given"),
    ]


def _law_estimates(mechanism: Any) -> list[Assumption]:
    pulled = [limb.actuator for limb in mechanism.limbs if limb.actuator is not None]
    laws = [law for a in pulled if (law := (a.tackle or a).force_law) is not None]
    named = [law for law in dict.fromkeys(laws) if not is_law_text(law)]
    own = [muscle_model(law) for law in dict.fromkeys(laws) if is_law_text(law)]
    volume = Assumption(
        "volume of the muscles", "V = L (b² - L²)/(4 π n²)",
        "(3-2) to (3-4), with thread and turns fitted to Tables 3-1 and 3-2 (fitted-chou-hannaford)",
    )  # fmt: skip
    found = [
        Assumption("force law", f"that of a muscle of {1e3 * law.reference_length:g} mm at equal strain ({law.name})",
                   law.source or "the design's own")
        for law in own
    ]  # fmt: skip
    if named or not own:
        found.append(
            Assumption("force law", f"that of the 300 mm muscle at equal strain ({', '.join(named)})",
                       "Tables 3-1 to 3-3; no other length was measured")
        )  # fmt: skip
    return [volume, *found]


def _shoulder_estimates(mechanism: Any, options: PlantOptions) -> list[Assumption]:
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
