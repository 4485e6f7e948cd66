"""The numbers and columns of a tracking, with units in their names."""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np

from ...core.validation import FloatArray
from .tracking_report import ANGLES, drive_kinds

if TYPE_CHECKING:
    from .tracking import Tracking

#: Units that end the keys of a summary, as they are written in text.
_UNITS = {"deg": "°", "N_m": "N m", "N": "N", "J": "J", "W": "W", "g": "g"}


#: Columns of drives that slide or turn in a joint, whose efforts are positive towards larger coordinates.
_OF_JOINTS = {
    ("length_{}_m", "slide"): "position_{}_m",
    ("length_{}_m", "turn"): "angle_{}_rad",
    ("tension_{}_N", "slide"): "force_{}_N",
    ("tension_{}_N", "turn"): "moment_{}_N_m",
    ("drive_position_{}_m", "turn"): "drive_position_{}_rad",
    ("motor_force_{}_N", "turn"): "motor_moment_{}_N_m",
}


def labelled(key: str) -> str:
    """A key of :meth:`.Tracking.summary` in words, with its unit after a comma."""
    ends = ((key.removesuffix(f"_{unit}"), written) for unit, written in _UNITS.items() if key.endswith(f"_{unit}"))
    words = next((f"{name}, {unit}" for name, unit in ends), key)
    return words.replace("_", " ").replace("F s", "F_s")


def summary_of(tracking: Tracking) -> dict[str, float]:
    """See :meth:`.Tracking.summary`."""
    main, wanted = tracking.angles()[:, tracking.main_angle], tracking.angles(wanted=True)[:, tracking.main_angle]
    force, run, ahead = np.linalg.norm(tracking.shoulder_force, axis=1), tracking.run, wanted - wanted[0]
    # Backward, too: an extension, or an arm that is lowered.
    way = -1.0 if ahead[np.abs(ahead).argmax()] < 0.0 else 1.0
    numbers = {
        "start_deg": float(main[0]),
        "end_deg": float(main[-1]),
        "wanted_end_deg": float(wanted[-1]) + 0.0,
        "furthest_deg": float(way * (way * main).max()),
        "end_error_deg": float(np.degrees(tracking.error[-1])),
        "rms_error_deg": float(np.degrees(tracking.rms_error())),
        "reachable_share": float(tracking.reachable.mean()),
        "rms_error_reachable_deg": float(np.degrees(tracking.rms_error(tracking.reachable))),
        "peak_F_s_N": float(force.max()),
        "mean_F_s_N": float(force.mean()),
        "end_F_s_N": float(force[-1]),
    }
    kinds = np.array(drive_kinds(run.plant))
    if (kinds == "limb").any() or not kinds.size:
        numbers["peak_tension_N"] = float(run.tensions[:, kinds == "limb"].max(initial=0.0))
    for kind, key in (("slide", "peak_drive_force_N"), ("turn", "peak_drive_moment_N_m")):
        if (kinds == kind).any():
            numbers[key] = float(np.abs(run.tensions[:, kinds == kind]).max())
    if any(drive.word == "actuator" for drive in run.plant.drives):
        numbers["peak_push_N"] = float(np.maximum(-run.tensions, 0.0).max())
    numbers["tension_work_J"] = _gain(run.tension_work)
    if run.plant.supply is not None:
        numbers["air_energy_J"] = _gain(tracking.air_energy)
        numbers["air_used_g"] = 1e3 * _gain(run.air_used)
    if run.plant.motors.any():
        numbers["electric_energy_J"] = _gain(run.electric_energy)
        numbers["peak_electric_W"] = float(run.electric_power.sum(axis=1).max())
    span = float(tracking.times[-1] - tracking.times[0])
    return numbers | {"mean_power_W": _gain(tracking.energy_in) / span if span > 0.0 else 0.0}


def _gain(series: FloatArray) -> float:
    """What has come since the run's own beginning, of all drives together."""
    return float(series[-1].sum() - series[0].sum())


def columns_of(tracking: Tracking) -> dict[str, FloatArray]:
    """See :meth:`.Tracking.columns`."""
    table: dict[str, FloatArray] = {"time_s": tracking.times}
    for wanted, prefix in ((True, "wanted_"), (False, "")):
        for name, values in zip(ANGLES, tracking.angles(wanted).T, strict=True):
            table[f"{prefix}{name.replace(' ', '_')}_deg"] = values
    table["error_deg"] = np.degrees(tracking.error)
    run = tracking.run
    series: tuple[tuple[str, FloatArray], ...] = (
        ("length_{}_m", run.lengths), ("wanted_ratio_{}", tracking.wanted_ratios), ("ratio_{}", tracking.ratios),
        ("command_{}", run.commands), ("tension_{}_N", run.tensions),
    )  # fmt: skip
    if not run.plant.motors.all():
        series += (("pressure_{}_Pa", run.pressures),)
    if run.plant.motors.any():
        series += (
            ("drive_position_{}_m", run.drive_positions), ("motor_force_{}_N", run.motor_forces),
            ("electric_power_{}_W", run.electric_power),
        )  # fmt: skip
    kinds = drive_kinds(run.plant)
    for name, values in series:
        own = (_OF_JOINTS.get((name, kind), name) for kind in kinds)
        table |= {column.format(i): part for i, (column, part) in enumerate(zip(own, values.T, strict=True), 1)}
    vectors = (
        ("angular_velocity_{}_rad_s", run.angular_velocity), ("F_s_{}_N", tracking.shoulder_force),
        ("angular_acceleration_{}_rad_s2", run.angular_acceleration),
        ("shoulder_moment_{}_N_m", run.friction_moment + run.stop_moment),
    )  # fmt: skip
    for name, values in vectors:
        table |= {name.format(axis): part for axis, part in zip("xyz", values.T, strict=True)}
    table |= {
        "F_s_N": np.linalg.norm(tracking.shoulder_force, axis=1),
        "kinetic_energy_J": run.kinetic_energy,
        "potential_energy_J": run.potential_energy,
        "tension_work_J": run.tension_work.sum(axis=1),
        "shoulder_loss_J": run.shoulder_loss,
        "energy_in_J": tracking.energy_in,
    }
    return table
