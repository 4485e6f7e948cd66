"""How much the outcome of an experiment depends on each estimated parameter: one run a change."""

from __future__ import annotations

from collections.abc import Callable, Iterable
from dataclasses import fields, replace
from typing import Any

import numpy as np

from ...core.errors import InvalidInput
from ...core.progress import track
from ...core.validation import require_type
from ...muscle.io.model_files import dynamic_model
from ...muscle.valve.flow import ValveUnit
from ...study import StudyTable
from ..controllers.thesis_controller import ContractionController, PIGains, table_5_5_gains
from .catalogue import hung_outward
from .experiment import Experiment
from .tracking import Tracking

#: A change: parameter, its value in words, and what makes the changed experiment.
Change = tuple[str, str, Callable[[Experiment], Experiment]]


def _fitting(limb: int, by: float) -> Change:
    def changed(experiment: Experiment) -> Experiment:
        limbs = list(experiment.mechanism.limbs)
        stroke = limbs[limb].stroke
        if stroke is None or stroke.end_fitting is None:
            raise InvalidInput(f"limb {limb + 1} has no end fitting to change")
        limbs[limb] = replace(limbs[limb], stroke=replace(stroke, end_fitting=stroke.end_fitting + by))
        return experiment.replace(mechanism=experiment.mechanism.replace(limbs=limbs))

    return f"end fitting of limb {limb + 1}", f"{1e3 * by:+g} mm", changed


def _option(name: str, words: str, value: Callable[[Any], Any]) -> Change:
    def changed(experiment: Experiment) -> Experiment:
        now = getattr(experiment.options, name)
        if value(now) == now:
            raise InvalidInput(f"{name} is {words} already")
        return experiment.replace(**{name: value(now)})

    return name.replace("_", " "), words, changed


def _air_paths(factor: float) -> Change:
    def changed(valves: Any) -> ValveUnit:
        if not isinstance(valves, ValveUnit):
            raise InvalidInput("expected one kind of valve for all muscles")
        if valves.restrictor is None:
            raise InvalidInput("these valves have no restrictor to change")
        return replace(
            valves, restrictor=replace(valves.restrictor, conductance=factor * valves.restrictor.conductance)
        )

    return _option("valves", f"restrictor × {factor:g}", changed)


def _supply(pressure: float) -> Change:
    def changed(experiment: Experiment) -> Experiment:
        now = experiment.plant.supply
        if now is None or now.pressure == pressure:
            raise InvalidInput(f"no limb has muscles, or their supply has {pressure / 1e5:g} bar already")
        return experiment.replace(supply=replace(now, pressure=pressure))

    return "supply", f"{pressure / 1e5:g} bar", changed


def _centre(outward: float) -> Change:
    def changed(experiment: Experiment) -> Experiment:
        mechanism = experiment.mechanism
        y = outward if mechanism.side == "left" else -outward
        return experiment.replace(mechanism=hung_outward(mechanism, y).replace(name=mechanism.name))

    return "centre of mass of the arm", f"{1e3 * outward:+g} mm outward", changed


def _mass(factor: float) -> Change:
    def changed(experiment: Experiment) -> Experiment:
        arm = experiment.mechanism.require_arm("a heavier arm")
        inertia = None if arm.inertia is None else factor * arm.inertia
        heavier = replace(arm, mass=factor * arm.mass, inertia=inertia)
        return experiment.replace(mechanism=experiment.mechanism.replace(arm=heavier))

    return "mass and inertia of the arm", f"× {factor:g}", changed


def _gains(words: str, factor: float, times: float) -> Change:
    def changed(experiment: Experiment) -> Experiment:
        if experiment.controller != "pi":
            raise InvalidInput("the gains of Table 5-5 are those of the controller 'pi'")
        layouts = [unit.layout for unit in experiment.plant.units if isinstance(unit, ValveUnit)]
        if len(layouts) < experiment.mechanism.limb_count:
            raise InvalidInput("the gains of Table 5-5 are those of muscles")
        nominal = [limb.stroke.nominal_length for limb in experiment.mechanism.limbs if limb.stroke is not None]
        gains = [PIGains(factor * g.K_c, times * g.T_i) for g in table_5_5_gains(nominal)]
        made = ContractionController(
            experiment.mechanism, experiment.reference, gains=gains, rate=experiment.rate, layout=layouts[0]
        )
        return experiment.replace(controller=made)

    return "gains of Table 5-5", words, changed


#: Changes of every estimate, each to a value that may as well be true.
CHANGES: tuple[Change, ...] = (
    _fitting(0, -0.021), _fitting(0, 0.021), _fitting(1, -0.010), _fitting(1, 0.010), _fitting(2, -0.010),
    _fitting(2, 0.010), _centre(0.0227), _centre(0.0), _centre(-0.0227), _centre(-0.06), _mass(1.5), _supply(3e5),
    _air_paths(0.5), _air_paths(2.0),
    _option("polytropic_exponent", "1.4 (adiabatic)", lambda _: 1.4),
    _option("dead_volume", "× 4", lambda v: 4.0 * v),
    _option("braid_stiffness", "× 1/2", lambda k: 0.5 * k),
    _option("braid_stiffness", "× 2", lambda k: 2.0 * k),
    _option("muscle_damping", "none", lambda _: None),
    _option("muscle_friction", "(3-31)", lambda _: dynamic_model("tang-3-31").friction),
    _option("shoulder_viscous", "none", lambda _: 0.0),
    _option("shoulder_viscous", "× 3", lambda c: 3.0 * c),
    _option("shoulder_coulomb", "none", lambda _: 0.0),
    _option("shoulder_coulomb", "0.2 N m", lambda _: 0.2),
    _option("shoulder_presliding", "× 4", lambda d: 4.0 * d),
    _option("stop_stiffness", "× 1/2", lambda k: 0.5 * k),
    _option("second_flange", "yes", lambda _: True),
    _gains("error in percent × 1/2", 0.5, 1.0),
    _gains("error in percent × 2", 2.0, 1.0),
    _gains("T_i in minutes", 1.0, 60.0),
)  # fmt: skip


def _drive(name: str, factor: float) -> Change:
    """A parameter of winch and linear actuator times a factor, under a controller that does not know it."""

    def changed(experiment: Experiment) -> Experiment:
        options = experiment.options
        parts = {part: getattr(options, part) for part in ("winch", "linear_actuator")}
        own = {
            part: replace(value, **{name: factor * getattr(value, name)})
            for part, value in parts.items()
            if hasattr(value, name) and any(getattr(d, "parameters", None) == value for d in experiment.plant.drives)
        }
        if not own:
            raise InvalidInput(f"no drive of the design has {name}")
        return _believing(experiment, experiment.replace(**own))

    return name.replace("_", " "), f"× {factor:g}", changed


def _believing(experiment: Experiment, changed: Experiment) -> Experiment:
    """The changed experiment with the controller of the one that was."""
    return changed.replace(controller=experiment.made_controller(experiment.plant))


def _heavier(factor: float) -> Change:
    name, words, heavier = _mass(factor)
    return name, words, lambda e: _believing(e, heavier(e))


#: The same for designs with motors; the controller keeps believing the estimates.
MOTOR_CHANGES: tuple[Change, ...] = (
    _heavier(1.2), _drive("coulomb", 0.0), _drive("coulomb", 3.0), _drive("viscous", 3.0),
    _drive("load_friction", 3.0), _drive("rotor_inertia", 4.0), _drive("axial_stiffness", 0.2),
    _drive("stiffness", 0.1), _drive("damping_time", 0.25), _drive("presliding", 4.0), _drive("no_load_speed", 0.5),
    _drive("stall_ratio", 0.5),
    _option("shoulder_viscous", "0.3 N m s/rad", lambda _: 0.3),
)  # fmt: skip


def sensitivity(experiment: Experiment, changes: Iterable[Change] | None = None, progress: bool = False) -> StudyTable:
    """Run an experiment as it is, and once for each change of an estimated parameter.

    Parameters
    ----------
    experiment : Experiment
        Which one.
    changes : iterable of Change, optional
        Parameter, value in words, and a function from experiment to changed experiment; :data:`CHANGES` if left out, or
        :data:`MOTOR_CHANGES` for a design with motors. A change that does not fit the experiment (one with which it
        cannot start, too), or changes nothing in it, is left out.
    progress : bool
        Whether to show a bar.

    Returns
    -------
    StudyTable
        One row a run: ``parameter``, ``value``, ``start_deg``, ``furthest_deg`` and ``end_deg`` of the main angle,
        ``rms_error_deg``, ``peak_F_s_N``, ``end_F_s_N``, and ``status``; with faults ``fault_F_s_N``, the peak from
        the first fault on. The first row is the experiment itself.

    Examples
    --------
    >>> from exo_pin.control import sensitivity
    >>> doubled = ("friction", "doubled", lambda experiment: experiment.replace(shoulder_coulomb=0.04))  # N m
    >>> table = sensitivity(ep.experiment("abduction").replace(duration=0.1), [doubled])
    >>> table["parameter"].tolist(), table["start_deg"].round(1)  # it starts where it hangs, whatever rubs
    (['as estimated', 'friction'], array([-5.4, -5.4]))
    """
    require_type("experiment", experiment, Experiment, "an Experiment")
    standard = MOTOR_CHANGES if experiment.plant.motors.any() else CHANGES
    chosen = list(standard if changes is None else changes)
    rows = [_row("as estimated", "", experiment.run())]
    for name, words, change in track(chosen, "changing", progress):
        try:
            changed = change(experiment)
            if _is_another(experiment, changed):
                rows.append(_row(name, words, changed.run()))
        except InvalidInput:
            continue
    return StudyTable(rows)


def fault_band(experiment: Experiment, progress: bool = False) -> tuple[float, float]:
    """Least and greatest peak of |F_s| from the first fault on, N, over the estimates of the plant.

    Parameters
    ----------
    experiment : Experiment
        With faults.
    progress : bool
        Whether to show a bar.

    Returns
    -------
    least, greatest : float
        Over the runs of :func:`sensitivity`: one estimate changed at a time. No bounds of what can happen.

    Raises
    ------
    InvalidInput
        If the experiment has no fault.

    Examples
    --------
    >>> from exo_pin.control import fault_band
    >>> torn = ep.experiment("abduction").replace(duration=0.1, faults=(ep.Fault("torn", 0, 0.05),))
    >>> least, greatest = fault_band(torn)  # N
    >>> bool(least <= torn.run().run.reaction().magnitude.max() <= greatest)
    True
    """
    require_type("experiment", experiment, Experiment, "an Experiment")
    if not experiment.faults:
        raise InvalidInput("expected an experiment with faults: replace(faults=...) adds them")
    return band_of(sensitivity(experiment, progress=progress))


def band_of(table: StudyTable) -> tuple[float, float]:
    """The same from the table of an experiment with faults."""
    forces = table["fault_F_s_N"]
    return float(np.nanmin(forces)), float(np.nanmax(forces))


def _is_another(experiment: Experiment, changed: Experiment) -> bool:
    """Whether a change has changed anything: motors have no air, and a shoulder without ends has no stops."""
    if experiment.mechanism is not changed.mechanism:
        return True
    own = [item.name for item in fields(Experiment) if item.name not in ("mechanism", "options")]
    if any(getattr(experiment, name) != getattr(changed, name) for name in own):
        return True
    before, after = experiment.plant, changed.plant
    if before.units != after.units or before.supply != after.supply:
        return True
    tables: Any = zip(before.tables, after.tables, strict=True)
    return not all(np.array_equal(one, other) for one, other in tables)


def _row(name: str, words: str, tracking: Tracking) -> dict[str, Any]:
    numbers = tracking.summary()
    keys = ("start_deg", "furthest_deg", "end_deg", "rms_error_deg", "peak_F_s_N", "end_F_s_N")
    row: dict[str, Any] = {"parameter": name, "value": words}
    row |= {key: float(np.round(numbers[key], 6)) for key in keys}
    faults = tracking.experiment.faults
    if faults:
        after = tracking.times >= min(fault.start for fault in faults)
        force = np.linalg.norm(tracking.shoulder_force[after], axis=1)
        row["fault_F_s_N"] = float(np.round(force.max(), 6)) if force.size else float("nan")
    return row | {"status": tracking.run.status}
