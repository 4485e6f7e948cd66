"""The pages of a report as sections of text and tables, made from the fields of its record and nothing else."""

from __future__ import annotations

import math
from collections.abc import Sequence
from typing import TYPE_CHECKING, NamedTuple

import numpy as np
from numpy.typing import ArrayLike

from ..core.tables import WIDTH, aligned, filled, in_blocks, screen_width, three_digits
from ..workspace import CRITERIA

if TYPE_CHECKING:
    from .record import DesignReport

__all__: list[str] = []

#: Criteria in plain words, where their own are those of the field.
_CRITERIA = {
    "stroke": "within the travel of the drives",
    "singularity": "away from poses where drives lose the arm",
    "connected": "reached from rest without such a pose",
    "forces": "held by the drives",
    "clearance": "clear of the wearer and of itself",
    "evaluated": "within the data of the springs",
    "shoulder_range": "within the range of the shoulder",
}


def shown(value: float) -> str:
    """A number with three significant digits, without exponent."""
    if not math.isfinite(value):
        return "–"
    return three_digits(float(f"{value:.3g}")) if abs(value) >= 5e-4 else "0"


def ends(low: float, high: float) -> str:
    """Two ends of a range."""
    return "–" if not (math.isfinite(low) or math.isfinite(high)) else f"{shown(low)} to {shown(high)}"


def worst(values: ArrayLike) -> float:
    """The largest of those that are known, else NaN."""
    given = np.asarray(values, dtype=float)
    known = given[np.isfinite(given)]
    return float(known.max()) if known.size else math.nan


class PagePart(NamedTuple):
    """A part of a page: a title, sentences, a table whose first columns are words, and where its numbers are from.

    ``widths`` are those of the columns, relative to one another.
    """

    title: str
    texts: Sequence[str] = ()
    head: Sequence[str] = ()
    rows: Sequence[Sequence[str]] = ()
    source: str = ""
    widths: Sequence[float] = ()
    words: int = 1


def verdict_words(report: DesignReport) -> str:
    """What the device does over the daily range and in the joint."""
    if not report.drives:
        text = "It supports the arm, and the wearer holds it: it has no drives."
    elif report.held_percent > 0.0:
        text = f"It holds {shown(report.held_percent)} % of {report.poses} poses of the daily range of motion"
        text += f"; {shown(report.inside_percent)} % meet all criteria that could be checked."
    elif report.criteria_percent.get("singularity") == 0.0:
        text = (
            f"It goes to none of {report.poses} poses of the daily range of motion. A device that turns the arm about "
        )
        text += "fewer than three axes has poses of its own, which the three postures here may be."
    else:
        text = f"It holds none of {report.poses} poses of the daily range of motion."
    known = [task for task in report.tasks if math.isfinite(task.joint_N)]
    if known:
        task = max(known, key=lambda each: each.joint_N)
        text += f" In the joint of this person {shown(task.joint_N)} N with the device and "
        text += f"{shown(task.joint_without_N)} N without, in the middle of {task.name}."
    return text


def head_words(report: DesignReport) -> tuple[str, str]:
    """Title of the report, and a line below it."""
    who = report.person or "no person named"
    return report.title, f"{report.side.capitalize()} shoulder. Worn by: {who}."


def foot_words(report: DesignReport) -> str:
    """Version and hashes."""
    text = f"exo_pin {report.version}   design {report.design_hash[:16]}"
    return f"{text}   file {report.file} {report.file_hash[:16]}" if report.file else text


def sections_of(report: DesignReport) -> list[PagePart]:
    """All sections in their order."""
    hazards = [[each.name, each.computed, each.not_computed] for each in report.hazards]
    head, widths = ("hazard", "computed", "not computed"), (2.0, 4.0, 2.6)
    return [
        _postures(report),
        _tasks(report),
        _workspace(report),
        _drives(report),
        _fit(report),
        PagePart("Hazards", (), head, hazards, report.hazard_source, widths, 3),
        PagePart("What was assumed", report.assumed),
        PagePart("What was not checked", report.not_checked),
    ]


def _postures(report: DesignReport) -> PagePart:
    head = ["posture", "holds", "in the joint, N", "without device, N", "without muscles, N", "of it out, N", "up, N",
            "forward, N"]  # fmt: skip
    rows = [
        [each.name, each.holds, *map(shown, (each.joint_N, each.joint_without_N, each.push_N, each.push_out_N,
                                            each.push_up_N, each.push_forward_N))]
        for each in report.postures
    ]  # fmt: skip
    if any(each.left_to_wearer_Nm for each in report.postures):
        head.append("left to wearer, N m")
        rows = [[*row, shown(each.left_to_wearer_Nm)] for row, each in zip(rows, report.postures, strict=True)]
    texts = [f"{each.name.capitalize()}: {each.reason}" for each in report.postures if each.reason]
    source = (
        "In the joint: contact force of socket and head with the wearer's own muscles. Without muscles: what arm and "
        "device alone press on the head, and its parts along the socket: out of it (distraction) or, if negative, into "
        "it. Computed at rest."
    )
    return PagePart(
        "Force on the shoulder in three postures", texts, head, rows, source, (2.6, *[1.2] * (len(head) - 1)), 2
    )


def _tasks(report: DesignReport) -> PagePart:
    head = ["daily tasks", "poses", "held, %", "in the joint, N", "peak, N", "without device, N", "relief at most, %",
            "without muscles, N"]  # fmt: skip
    rows = [
        [each.name, str(each.poses), *map(shown, (each.held_percent, each.joint_N, each.joint_peak_N,
                                                  each.joint_without_N, each.relief_percent, each.push_N))]
        for each in report.tasks
    ]  # fmt: skip
    source = "Medians over the held poses on a grid. Ranges: " + "; ".join(each.source for each in report.tasks) + "."
    return PagePart("Force in the joint over daily tasks", (), head, rows, source, (3.2, 0.7, *[1.0] * 6))


def _workspace(report: DesignReport) -> PagePart:
    words = _CRITERIA if report.drives else _CRITERIA | {"stroke": "within the travel of the joints"}
    rows = [[words.get(name, CRITERIA[name].words), shown(share)] for name, share in report.criteria_percent.items()]
    rows.append(["all together", shown(report.inside_percent)])
    return PagePart(
        "Range of motion", (), (f"share of {report.poses} poses that are", "%"), rows, report.daily_range, (3.0, 1.0)
    )


def _drives(report: DesignReport) -> PagePart:
    if not report.drives:
        return PagePart("What to buy", ["No drives: springs or the frame carry what they carry."])
    head = ["drive", "most pull", "most push", "limits pull / push", "share of limit, %", "speed", "power, W",
            "moves over", "travel of design", "mass, kg", "held without it, %"]  # fmt: skip
    rows = []
    for k, each in enumerate(report.drives, start=1):
        turns = each.unit == "N m"
        scale, mark = (180.0 / math.pi, "°") if turns else (1e3, "mm")
        rows.append(
            [
                f"{k}  {each.name} ({each.kind}, {each.unit})",
                shown(each.pull),
                shown(each.push),
                f"{shown(each.limit_pull)} / {shown(each.limit_push)}",
                shown(each.share_percent),
                _with_unit(each.speed * scale, f"{mark}/s"),
                shown(each.power_W),
                _moves(scale * each.used_from, scale * each.used_to, mark),
                _moves(scale * each.stroke_from, scale * each.stroke_to, mark),
                shown(each.mass_kg),
                shown(each.held_without_percent),
            ]
        )
    source = (
        f"Over {report.drives_over}, at rest; speed and power while the arm turns at "
        f"{shown(report.arm_speed_deg_s)} °/s about its worst axis (assumed), without acceleration and friction. Pull "
        "is positive effort. Held without it: share of the poses inside that the others hold. Limits and travel: the "
        f"design. Device on the arm {shown(report.device_on_arm_kg)} kg, other moving links "
        f"{shown(report.device_links_kg)} kg (– is not in the design)."
    )
    return PagePart(
        "What to buy, and what if a drive fails",
        (),
        head,
        rows,
        source,
        (2.4, 0.9, 0.9, 1.4, 1.1, 1.45, 1.1, 2.0, 2.0, 0.9, 1.1),
    )


def _moves(low: float, high: float, unit: str) -> str:
    return f"{ends(low, high)}{'' if unit == '°' else ' '}{unit}" if math.isfinite(low) or math.isfinite(high) else "–"


def _fit(report: DesignReport) -> PagePart:
    unit = report.weakest_rate_unit
    rows = [
        ["accuracy: travel of the drives per degree of the arm, worst axis", _with_unit(report.weakest_rate, unit)],
        ["accuracy: share of poses that the drives cannot tell from another", _with_unit(report.twins_percent, "%")],
        ["least distance to the wearer and between limbs", _with_unit(report.clear_mm, "mm")],
        ["largest pull of the cuff along the arm", _with_unit(report.cuff_pull_N, "N")],
        ["largest mean pressure of the cuff", _with_unit(report.cuff_pressure_kPa, "kPa")],
        ["change of the force on the head, device 10 mm off", _off(report)],
        *(
            [
                f"{fit.name}: poses held; poses that meet all criteria",
                f"{shown(fit.held_percent)}; {shown(fit.inside_percent)} %",
            ]
            for fit in report.fits
        ),
    ]
    source = (
        "Over the poses of the table of drives; – is not known. Persons: 5th percentile of women and 95th of "
        "men, ANSUR II; same device, not adjusted. Negative distance: parts pass into one another."
    )
    return PagePart("Accuracy, body and sizes", (), ("what", "value"), rows, source, (3.0, 1.0))


def _with_unit(value: float, unit: str) -> str:
    return f"{shown(value)} {unit}" if math.isfinite(value) else "–"


def _off(report: DesignReport) -> str:
    if math.isfinite(report.off_by_10_mm_N) or not math.isfinite(report.off_on_cuff_N):
        return _with_unit(report.off_by_10_mm_N, "N")
    return f"cannot follow; on a soft cuff {shown(report.off_on_cuff_N)} N"


def as_text(report: DesignReport) -> str:
    """The report for a terminal."""
    title, below = head_words(report)
    parts = [f"{title}\n{filled(below)}", filled(report.verdict)]
    for section in sections_of(report):
        lines = [section.title, *map(filled, section.texts), *_printed(section)]
        parts.append("\n".join([*lines, *([filled(section.source)] if section.source else [])]))
    return "\n\n".join([*parts, foot_words(report)])


def _printed(section: PagePart) -> list[str]:
    """A table for a terminal: in blocks where it is wide, as sentences where all of its columns are words."""
    if not section.rows:
        return []
    if section.words == len(section.head):
        return [
            filled(f"{name}: {computed or 'nothing computed'}. Not computed: {others}.")
            for name, computed, others in section.rows
        ]
    blocks = in_blocks([section.head, *section.rows], screen_width(WIDTH))
    return [line for block in blocks for line in aligned(block, words=1)]
