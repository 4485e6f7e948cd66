"""From a design and its options to the tables that the compiled equations read."""

from __future__ import annotations

import numpy as np
from numpy.typing import ArrayLike

from ....core.errors import InvalidInput, MissingData
from ....core.validation import FloatArray
from ....design import Mechanism
from ....load_case import Load
from ....muscle.io.published import muscle_model
from ....muscle.laws.friction import ConstantFriction, LoadDependentFriction
from ....muscle.laws.literature import ChouHannaford
from ....muscle.laws.static import BAR, StaticModel
from ....muscle.valve.supply import Supply
from ..options import PlantOptions
from .muscle_kernels import COLUMNS
from .plant_kernels import AIR, SHOULDER, Tables

__all__ = ["muscles_of", "plant_tables", "supply_of"]

#: Powers of strain and pressure up to which a law is looked for among polynomials, and the error allowed, N.
_POWERS, _ERROR = (6, 3), 1e-8
#: Whose thread gives the volume of the air.
_THREAD = "fitted-chou-hannaford"
#: Nominal length of the muscle whose braid has the stated stiffness, m.
_BRAID_LENGTH = 0.3


def muscles_of(mechanism: Mechanism) -> list[StaticModel]:
    """Static laws of the limbs' muscles, scaled to their lengths.

    Raises
    ------
    MissingData
        If a limb has no muscle with a force law, or its stroke or end fitting is not known.
    """
    missing, found = [], []
    for i, limb in enumerate(mechanism.limbs):
        actuator, stroke = limb.actuator, limb.stroke
        if actuator is None or actuator.force_law is None:
            missing.append(f"limbs[{i}].actuator.force_law")
        elif stroke is None or stroke.end_fitting is None:
            missing.append(f"limbs[{i}].stroke.end_fitting")
        else:
            found.append(muscle_model(actuator.force_law, stroke.nominal_length))
    if missing:
        raise MissingData(missing, "a plant with pneumatic muscles", mechanism.name)
    return found


def supply_of(mechanism: Mechanism, options: PlantOptions) -> Supply:
    """The supply: that of the options, or one that holds the highest pressure of the design's actuators."""
    if options.supply is not None:
        return options.supply
    pressures = [limb.actuator.supply_pressure for limb in mechanism.limbs if limb.actuator is not None]
    return Supply(max(p for p in pressures if p is not None))


def plant_tables(mechanism: Mechanism, options: PlantOptions, load: Load | None) -> Tables:
    """The tables of a plant.

    Raises
    ------
    MissingData
        If something is not known.
    InvalidInput
        If the load is not one constant force, or a law is no polynomial.
    """
    arm = mechanism.require_arm("a plant", inertia=True)
    assert arm.inertia is not None
    muscles, c = muscles_of(mechanism), arm.centre_of_mass
    inertia = arm.inertia + arm.mass * (c @ c * np.eye(3) - np.outer(c, c))
    force, point = _constant_force(load)
    geometry = mechanism.geometry
    return Tables(
        _own(geometry.base_points), _own(geometry.platform_points), _own(c), _own(mechanism.gravity), float(arm.mass),
        _own(inertia), _own(np.asarray(np.linalg.inv(inertia))), force, point, _laws(muscles),
        _rows(mechanism, muscles, options), _shoulder(mechanism, options), _air(supply_of(mechanism, options), options),
    )  # fmt: skip


def _own(array: ArrayLike) -> FloatArray:
    """A contiguous writable copy: the kernels are compiled for one kind of array."""
    return np.array(array, dtype=float, order="C")


def _constant_force(load: Load | None) -> tuple[FloatArray, FloatArray]:
    if load is None:
        return np.zeros(3), np.zeros(3)
    if not isinstance(load, Load):
        raise InvalidInput(f"expected load to be a Load, got {type(load).__name__}")
    force, at, moment = (np.asarray(value, dtype=float) for value in (load.force, load.at, load.moment))
    if force.ndim > 1 or at.ndim > 1 or moment.any() or load.frame != "base":
        raise InvalidInput('expected one force without a couple, frame="base": the load of a plant is constant in time')
    return _own(force), _own(at)


def _laws(muscles: list[StaticModel]) -> FloatArray:
    """Coefficients, shape (n, I, J), N, by powers of strain and of pressure in bar."""
    tables = [_polynomial(model) for model in muscles]
    shape = np.max([table.shape for table in tables], axis=0)
    return np.array([np.pad(t, [(0, s - k) for s, k in zip(shape, t.shape, strict=True)]) for t in tables])


def _polynomial(model: StaticModel) -> FloatArray:
    """A law as a polynomial in strain and bar, without powers that it does not have.

    The laws of this package are polynomials, written in several ways. The coefficients are found from values on a grid
    and checked on another, which leaves laws of any class open.
    """
    (rows, columns), length = _POWERS, model.length
    strain = 0.225 * (1.0 - np.cos(np.pi * (np.arange(2 * rows) + 0.5) / (2 * rows)))
    bar = 2.5 * (1.0 - np.cos(np.pi * (np.arange(2 * columns) + 0.5) / (2 * columns)))
    at, pressure = np.meshgrid(strain, bar, indexing="ij")
    values = np.asarray(model.unchecked_force(at * length, pressure * BAR))
    basis = (np.vander(strain, rows, increasing=True), np.vander(bar, columns, increasing=True))
    table = np.linalg.pinv(basis[0]) @ values @ np.linalg.pinv(basis[1]).T
    size = np.abs(table) * np.outer(0.45 ** np.arange(rows), 5.0 ** np.arange(columns))
    table[size < 1e-11 * max(1.0, float(size.max()))] = 0.0
    other, second = np.meshgrid(np.linspace(0.0, 0.4, 9), np.linspace(0.0, 4.5, 7), indexing="ij")
    fitted = np.polynomial.polynomial.polyval2d(other, second, table)
    error = np.abs(fitted - model.unchecked_force(other * length, second * BAR)).max()
    if not error < _ERROR:
        raise InvalidInput(
            f"expected a static law that is a polynomial in contraction and pressure, got {model.name!r}, "
            f"which is not, by {error:.2g} N; fit one with exo_pin.muscle.identify_static"
        )
    used = np.argwhere(table != 0.0).max(axis=0, initial=0) + 1
    return np.array(table[: used[0], : used[1]])


def _rows(mechanism: Mechanism, muscles: list[StaticModel], options: PlantOptions) -> FloatArray:
    thread = muscle_model(_THREAD)
    assert isinstance(thread, ChouHannaford)
    table = np.zeros((len(muscles), len(COLUMNS)))
    for row, model, limb in zip(table, muscles, mechanism.limbs, strict=True):
        assert limb.stroke is not None
        assert limb.stroke.end_fitting is not None
        line = model.validity.capability_line
        intercept = float(line(np.array(0.0)))
        slope = float(line(np.array(BAR))) - intercept if np.isfinite(intercept) else 0.0
        share = thread.reference_length / model.length
        values = {
            "nominal_length": model.length,
            "end_fitting": limb.stroke.end_fitting,
            "capability_slope": slope,
            "capability_intercept": intercept if np.isfinite(intercept) else 1e9,
            "braid_stiffness": options.braid_stiffness * _BRAID_LENGTH / model.length,
            "presliding": options.presliding if options.muscle_friction is not None else 1.0,
            "spring_stiffness": options.series_spring or 0.0,
            "thread": thread.braid_length / share,
            "turns": thread.turns / share,
            "dead_volume": options.dead_volume,
        }
        if options.muscle_damping is not None:
            values |= {"damping_1": options.muscle_damping.D_1 * BAR, "damping_2": options.muscle_damping.D_2 * BAR}
        values |= _friction(options)
        row[:] = [values.get(name, 0.0) for name in COLUMNS]
    return table


def _friction(options: PlantOptions) -> dict[str, float]:
    law = options.muscle_friction
    if isinstance(law, ConstantFriction):
        return {"friction": law.force}
    if isinstance(law, LoadDependentFriction):
        terms = {"friction_2": law.N_2 * BAR, "friction_1": law.N_1 * BAR, "friction_0": law.N_0 * BAR}
        return terms | {"friction_load": law.load / BAR}
    return {}


def _shoulder(mechanism: Mechanism, options: PlantOptions) -> FloatArray:
    joint = mechanism.shoulder
    ends = joint.abduction_centre is not None and joint.half_diagonal is not None and not options.second_flange
    values = {
        "viscous": options.shoulder_viscous,
        "coulomb": options.shoulder_coulomb,
        "presliding": options.shoulder_presliding if options.shoulder_coulomb > 0.0 else 1.0,
        "stops": float(ends),
        "stop_centre": joint.abduction_centre or 0.0,
        "stop_half": joint.half_diagonal or 0.0,
        "side": 1.0 if mechanism.side == "left" else -1.0,
        "stop_stiffness": options.stop_stiffness,
        "stop_damping": options.stop_damping,
    }
    return np.array([values[name] for name in SHOULDER])


def _air(supply: Supply, options: PlantOptions) -> FloatArray:
    values = {"exponent": options.polytropic_exponent, "supply": supply.absolute}
    if supply.regulator is not None and supply.volume is not None:
        values |= {
            "regulator": supply.regulator.conductance,
            "regulator_ratio": supply.regulator.critical_ratio,
            "manifold": supply.volume,
        }
    return np.array([values.get(name, 0.0) for name in AIR])
