"""The map of the pose's box: the force of every flexion and abduction, computed beside the page by another process."""

from __future__ import annotations

import multiprocessing
import signal
import warnings
from collections.abc import Callable
from concurrent.futures import Future, ProcessPoolExecutor
from functools import cache, partial
from typing import Any

import numpy as np

from ..core.progress import end_with_parent
from ..exo.shoulder_exo import ShoulderExo
from ..view.colours import CIVIDIS
from ..view.scene.panels import ANGLES
from .asked import Asked

#: Degrees between the poses of the map.
_STEP = 10.0
FLEXIONS, ABDUCTIONS = (
    np.arange(low, high + 0.1, _STEP).tolist() for low, high in (ANGLES["flexion"], ANGLES["abduction"])
)
#: Of poses that are not held.
_GREY, _DARK = "#C9CED4", "#1b1f24"


def column_of_map(exo: ShoulderExo, flexion: float, internal_rotation: float) -> list[float | None]:
    """|F_s| at one flexion and each of :data:`ABDUCTIONS`, N; None where the pose is not held or has no answer.

    Of a device that leaves moments to its wearer it is known wherever there is an answer.
    """
    warnings.simplefilter("ignore")  # a process of its own; poses of no person are as good as others here
    answer = exo.reaction(exo.pose(flexion, ABDUCTIONS, internal_rotation))
    counts = answer.held if exo.device.holds_alone else answer.has_answer
    return [float(size) if each else None for size, each in zip(answer.magnitude, counts, strict=True)]


@cache
def workers() -> ProcessPoolExecutor:
    """The process that computes maps, for all pages."""
    return ProcessPoolExecutor(1, multiprocessing.get_context("spawn"), initializer=begin)


def end_workers() -> None:
    """Drop what is not yet computed for any page, and end the process."""
    if workers.cache_info().currsize:
        # An interpreter that ends beside the pool's thread may wake it by a pipe that is closed already.
        workers().shutdown(wait=True, cancel_futures=True)
        workers.cache_clear()


def begin() -> None:
    """Prepare a process that works for the page's."""
    # Ctrl-C is for the server, which then ends it.
    signal.signal(signal.SIGINT, signal.SIG_IGN)
    end_with_parent()


class PoseMap:
    """The map of one page; a new device, person or rotation drops what is not yet computed of the last.

    Parameters
    ----------
    show : callable
        Gets the columns that are known so far, by flexion, in another thread.
    """

    def __init__(self, show: Callable[[dict[float, list[float | None]]], None]) -> None:
        self._show = show
        self._of: Any = None
        self._tasks: list[Future[list[float | None]]] = []

    def ask(self, asked: Asked) -> None:
        """Compute the map of a question, unless it is the last one's."""
        wanted = (asked.anywhere, asked.internal_rotation)
        if wanted == self._of:
            return
        self.close()
        self._of, known = wanted, dict[float, list[float | None]]()
        for flexion in FLEXIONS:
            task = workers().submit(column_of_map, asked.exo, flexion, asked.internal_rotation)
            task.add_done_callback(partial(self._take, wanted, known, flexion))
            self._tasks.append(task)

    def close(self) -> None:
        """Drop what is not yet computed."""
        for task in self._tasks:
            task.cancel()
        self._of, self._tasks = None, []

    def _take(
        self, wanted: Any, known: dict[float, list[float | None]], flexion: float, task: Future[list[float | None]]
    ) -> None:
        if wanted == self._of and not task.cancelled() and task.exception() is None:
            known[flexion] = task.result()
            self._show(dict(known))


def top_of(columns: dict[float, list[float | None]]) -> float:
    """Largest force of a map's scale, N: a few poses near singular ones would take all colours."""
    held = [value for column in columns.values() for value in column if value is not None]
    return max(round(float(np.percentile(held, 95.0))), 1) if held else 1


def chart_of(columns: dict[float, list[float | None]], asked: Asked, top: float) -> dict[str, Any]:
    """The map as a chart of ECharts: colours of |F_s| up to ``top``, N, × where it is not held, a ring at the pose."""
    cells = [
        [i, j, value]
        for i, flexion in enumerate(FLEXIONS)
        for j, value in enumerate(columns.get(flexion, []))
    ]  # fmt: skip
    held = [cell for cell in cells if cell[2] is not None]
    others = [[i, j, 0.0] for i, j, value in cells if value is None]

    def axis(name: str, values: list[float], gap: int) -> dict[str, Any]:
        return {
            "type": "category", "data": [f"{value:.0f}°".replace("-", "−") for value in values], "name": name,
            "nameLocation": "middle", "nameGap": gap, "splitArea": {"show": False},
        }  # fmt: skip

    series = {"type": "heatmap", "animation": False, "progressive": 0}
    scale = {
        "type": "continuous", "min": 0, "max": top, "seriesIndex": 0, "orient": "horizontal",
        "left": "center", "top": 0, "itemHeight": 150, "text": [f"{top:g}", "|F_s|, N   0"],
        "calculable": False, "precision": 0, "inRange": {"color": CIVIDIS},
    }  # fmt: skip
    cross = {"show": True, "formatter": "×", "color": _DARK}
    return {
        "grid": {"left": 62, "right": 12, "top": 40, "bottom": 44},
        "tooltip": {"formatter": "{c}"},
        "xAxis": axis("flexion", FLEXIONS, 26),
        "yAxis": axis("abduction", ABDUCTIONS, 44),
        "visualMap": scale,
        "series": [
            series | {"name": "held", "data": held},
            series | {"name": "not held", "data": others, "itemStyle": {"color": _GREY}, "label": cross},
            *rings_at(asked),
        ],
    }


def rings_at(asked: Asked) -> list[dict[str, Any]]:
    """A ring at the pose, black on white, as series of the map's chart."""
    here = [(asked.flexion - FLEXIONS[0]) / _STEP, (asked.abduction - ABDUCTIONS[0]) / _STEP]
    looks = (("#fff", 5), ("#000", 2))
    ring = {"type": "scatter", "data": [here], "symbolSize": 15, "silent": True, "animation": False, "z": 5}
    return [
        ring | {"id": colour, "itemStyle": {"color": "transparent", "borderColor": colour, "borderWidth": width}}
        for colour, width in looks
    ]
