"""A list of hazards after the public headings of ISO 13482:2014, beside what a report computes for each.

The headings of clause 5 are public; the text of the standard is not quoted. The standard is for personal care robots
and excludes medical devices. Misalignment and unintended motion stand first because users of exoskeletons named them
first (10.1186/s12984-023-01191-y).
"""

from __future__ import annotations

import math

from .content import shown, worst
from .record import DesignReport, Hazard

SOURCE = (
    "After the public headings of ISO 13482:2014, which excludes medical devices; no assessment after ISO 14971. Where "
    "the middle column is empty, nothing was computed."
)
#: Headings for which nothing is computed, and what a file of hazards needs instead.
_NOTHING = (
    ("Start-up, stopping, wrong decisions", "software, stop function, sensors"),
    ("Energy: battery, charging, stored in springs and air", "electrics, pneumatics, release of springs"),
    ("Static electricity, interference, emissions", "electrics, noise, heat"),
    ("Environment and awareness", "training, bystanders, places of use"),
)
#: A turn, degrees, above which it means nothing.
_LOST = 30.0


def hazards_of(report: DesignReport) -> tuple[Hazard, ...]:
    """The hazards of a report, with numbers from its fields.

    Parameters
    ----------
    report : DesignReport
        Its fields without hazards.
    """
    tasks, drives = report.tasks, report.drives
    joint, bare = (worst([getattr(task, name) for task in tasks]) for name in ("joint_N", "joint_without_N"))
    peak = worst([task.joint_peak_N for task in tasks])
    least = -worst([-drive.held_without_percent for drive in drives])
    missing = worst([drive.missing_without_Nm for drive in drives])
    share = worst([drive.share_percent for drive in drives if not math.isnan(drive.speed)])
    apart, clear = (report.criteria_percent.get(name, math.nan) for name in ("singularity", "clearance"))
    rows = [
        (
            "Misalignment of joints",
            _misaligned(report),
            worst((report.off_by_10_mm_N, report.off_on_cuff_N)),
            "how the device shifts in use",
        ),
        (
            "Stress of the joint",
            f"in the joint at most {shown(joint)} N in the middle of a task ({shown(bare)} N without), peak "
            f"{shown(peak)} N",
            joint,
            "injured, subluxed or spastic shoulders; repetition",
        ),
        (
            "Unintended motion, instability",
            f"{shown(apart)} % of poses are away from singular ones, where drives lose the arm",
            apart,
            "faults of control; mechanical end stops",
        ),
        (
            "Loss of a drive",
            f"the others hold {shown(least)} % or more of the poses; {shown(missing)} N m missing at worst",
            least,
            "how fast the arm sinks; brakes",
        ),
        ("Error of position", _error(report), report.weakest_rate, "sensors, play, calibration"),
        (
            "Moving parts, shape",
            f"clear of the wearer and of itself in {shown(clear)} % of poses; "
            + (
                f"least distance {shown(report.clear_mm)} mm"
                if report.clear_mm >= 0.0
                else f"in the others parts pass up to {shown(-report.clear_mm)} mm into one another or the wearer"
            ),
            report.clear_mm,
            "edges, hair and fingers; bystanders",
        ),
        ("Pressure on the arm", _pressed(report), report.cuff_pull_N, "peaks, skin, duration; harness on the trunk"),
        (
            "Wrong size",
            ", ".join(f"{fit.name}: {shown(fit.inside_percent)} % of poses meet all criteria" for fit in report.fits),
            worst([fit.inside_percent for fit in report.fits]),
            "adjustment, weight on the trunk",
        ),
        (
            "Overload, durability",
            f"largest share of a limit {shown(share)} %",
            share,
            "fatigue, wear, heat, duty cycle",
        ),
    ]
    found = [Hazard(name, text if value == value else "", open_) for name, text, value, open_ in rows]
    return (*found, *(Hazard(name, "", open_) for name, open_ in _NOTHING))


def _misaligned(report: DesignReport) -> str:
    """What 10 mm between the centres do."""
    if math.isfinite(report.off_by_10_mm_N):
        return f"centre 10 mm off changes the force on the head by {shown(report.off_by_10_mm_N)} N"
    return f"centre 10 mm off: a stiff cuff does not follow; on a soft one {shown(report.off_on_cuff_N)} N more or less"


def _error(report: DesignReport) -> str:
    """What an error of the drives does."""
    unit = report.weakest_rate_unit.partition("/")[0]
    one = f"1{unit}" if unit == "°" else f"1 {unit}"
    if report.weakest_rate * _LOST < 1.0:
        return f"in the worst poses the drives do not place the arm: {one} turns it by more than {_LOST:.0f}°"
    return f"{one} of the drives turns the arm by {shown(1.0 / report.weakest_rate)}° at worst"


def _pressed(report: DesignReport) -> str:
    """What the cuff does to the arm."""
    text = f"cuff pulls at most {shown(report.cuff_pull_N)} N along the arm"
    pressure = report.cuff_pressure_kPa
    return text if math.isnan(pressure) else f"{text}, presses with {shown(pressure)} kPa in the mean over its area"
