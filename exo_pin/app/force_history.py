"""Forces along a recorded movement, and their plot over time."""

from __future__ import annotations

import warnings
from collections.abc import Sequence
from typing import Any

import numpy as np

from ..exo.shoulder_exo import ShoulderExo
from ..load_case import Motion, Movement
from ..person import Person
from ..view.colours import BLACK, BLUE, ORANGE

#: Most samples of a plot.
_MOST = 400
#: Mark of a sample that is not held.
_CROSS = "path://M0 1L1 0L5 4L9 0L10 1L6 5L10 9L9 10L5 6L1 10L0 9L4 5Z"


def history(exo: ShoulderExo, movement: Movement, person: Person | None) -> dict[str, Any]:
    """Forces along a movement: words, and times (s), |F_s| and joint force (N) and whether it is held of some samples.

    Of a long movement each sample is that with the largest |F_s| of its stretch.
    """
    warnings.simplefilter("ignore")  # a process of its own; doubts stand in the words
    found = exo.follow(movement)
    answer = found.reaction
    size = np.where(answer.has_answer, answer.magnitude, np.nan)
    parts = np.array_split(np.arange(len(size)), min(len(size), _MOST))
    rows = np.array([part[np.nan_to_num(size[part], nan=-1.0).argmax()] for part in parts])
    held = answer.held if exo.device.holds_alone else answer.has_answer
    joint = np.full(len(rows), np.nan)
    if person is not None:
        own = movement.motion
        motion = Motion(own.angular_velocity[rows], own.angular_acceleration[rows])
        poses = movement.poses[rows]
        contact = exo.joint_contact(poses, person, exo.reaction(poses, motion), motion, outside="mark")
        joint = np.where(contact.has_result, contact.magnitude, np.nan)
    words = " ".join(str(found).split("\n\n")[0].split("\n"))
    times = movement.times[rows] - movement.times[0]
    lines = (times, size[rows], joint)
    return {"words": words, "held": held[rows].tolist(), "lines": [[_plain(value) for value in line] for line in lines]}


def _plain(value: float) -> float | None:
    return None if np.isnan(value) else round(float(value), 3)


def plot_of(names: Sequence[str], known: Sequence[dict[str, Any] | None]) -> dict[str, Any]:
    """Forces of one or more designs over time, as a chart of ECharts: whole lines of F_s, broken ones of the joint."""
    series: list[dict[str, Any]] = [{"id": "now", "type": "line", "data": []}]
    for name, colour, found in zip(names, (BLUE, ORANGE), known, strict=False):
        if found is None:
            continue
        times, *lines = found["lines"]
        of = f"{name}: " if len(names) > 1 else ""
        for kind, what, values in zip(("solid", "dashed"), ("arm and device", "in the joint"), lines, strict=True):
            if any(value is not None for value in values):
                series.append({
                    "type": "line", "name": f"{of}{what}", "data": [*zip(times, values, strict=True)],
                    "symbol": "none", "animation": False, "itemStyle": {"color": colour},
                    "lineStyle": {"type": kind, "width": 2, "color": colour},
                })  # fmt: skip
        # The first of a run, and some of the others.
        runs = (row for row, held in enumerate(found["held"]) if not held and (row % 10 == 0 or found["held"][row - 1]))
        crosses = [[times[row], lines[0][row] or 0.0] for row in runs]
        series.append({
            "type": "scatter", "name": f"{of}not held", "data": crosses, "animation": False, "silent": True,
            "symbol": _CROSS, "symbolSize": 9, "itemStyle": {"color": BLACK},
        })  # fmt: skip
    shown = [
        {"name": each["name"], "itemStyle": {"opacity": int(each["type"] == "scatter")}}
        for each in series[1:]
        if each["data"]
    ]
    return {
        "grid": {"left": 48, "right": 14, "top": 40, "bottom": 24},
        "legend": {"data": shown, "type": "scroll", "top": 0, "left": 110, "right": 14},
        "tooltip": {"trigger": "axis"},
        "xAxis": {"type": "value", "name": "s", "nameGap": 4, "max": "dataMax", "splitLine": {"show": False}},
        "yAxis": {"type": "value", "name": "force, N", "min": 0, "splitNumber": 3, "nameGap": 10},
        "series": series,
    }
