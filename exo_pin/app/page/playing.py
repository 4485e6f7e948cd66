"""A recorded movement on the page: read, played, paused and scrubbed, with the force over time."""

from __future__ import annotations

import asyncio
import time
from collections.abc import Callable
from concurrent.futures import Future
from contextlib import suppress
from functools import partial
from typing import Any

import numpy as np
from nicegui import run, ui

from ...core.conventions import shoulder_angles
from ...core.errors import ExoPinError
from ...load_case import Movement, read_movement
from ...view.colours import BLACK
from ...view.scene.panels import ANGLES
from ..asked import Asked, has_muscles
from ..files import LARGEST
from ..force_history import history, plot_of
from ..pose_map import workers
from .scene_feed import call_in
from .widgets import Slider, reveal

#: Pictures a second of a movement that is played.
_RATE = 30.0
#: Longest wait for a browser's picture, s.
_SLOW = 5.0
#: Endings of recordings.
ENDINGS = (".csv", ".txt", ".tsv", ".mot", ".sto", ".mvnx", ".c3d")


class Player:
    """The movement of a page.

    Parameters
    ----------
    moved : callable
        Gets the fields of the pose and motion at each moment that is shown.
    keep : callable
        Gets name, content and allowed endings of a file that was given, and returns where it is.
    """

    def __init__(self, moved: Callable[..., None], keep: Callable[..., str]) -> None:
        self._moved, self._keep, self._loop = moved, keep, asyncio.get_running_loop()
        self._movement: Movement | None = None
        self._asked: tuple[Asked, ...] = ()
        self._of: tuple[Asked, ...] = ()
        self._known: list[dict[str, Any] | None] = []
        self._tasks: list[Future[dict[str, Any]]] = []
        self._now: float

    def build_upload(self) -> None:
        """The widget that takes a recording."""
        given = ui.upload(label="Play a recording", auto_upload=True, max_file_size=LARGEST, on_upload=self._take)
        given.props(f'accept="{",".join(ENDINGS)}" flat bordered')

    def build(self) -> None:
        """The strip with buttons, scrubber and plot, which is shown while there is a movement."""
        self._strip = ui.element("section").classes("card strip movement")
        self._strip.set_visibility(False)
        with self._strip:
            with ui.element("div").classes("about"):
                self._title = ui.label().classes("name")
                with ui.element("div").classes("row-of-buttons"):
                    self._button = ui.button("Play", on_click=self._play_or_pause).props("outline dense no-caps")
                    ui.button("Close", on_click=self.leave).props("flat dense no-caps")
                    self._clock = ui.label().classes("clock")
                self._words = ui.label().classes("words").props('role="status"')
            with ui.element("div").classes("track"):
                self._chart = ui.echart({}).props('role="img" aria-label="Force over time"')
                self._slider = Slider(min=0.0, max=1.0, step=0.01, value=0.0).props('aria-label="Time, s" dense')
                self._slider.on("update:model-value", lambda event: self._scrub(float(event.args)), throttle=0.025)
            self._timer = ui.timer(1.0 / _RATE, self._tick, active=False)

    async def _take(self, event: Any) -> None:
        name, asked = event.file.name, self._asked[0]
        try:
            path = self._keep(name, await event.file.read(), ENDINGS)
            movement = await run.io_bound(read_movement, path, asked.side)
        except (ExoPinError, OSError) as error:
            ui.notify(str(error), type="warning", multi_line=True, close_button=True)
            return
        finally:
            event.sender.reset()
        self._movement, self._side, self._of = movement, asked.side, ()
        own = movement.motion
        angles = shoulder_angles(movement.poses, asked.side, degrees=True)
        self._rows = np.round(np.concatenate([angles, own.angular_velocity, own.angular_acceleration], axis=1), 6)
        self._times = movement.times - movement.times[0]
        self._title.set_text(name)
        self._slider.props(f":max={self._times[-1]:g}")
        reveal(self._strip)
        self._scrub(0.0)

    def ask(self, *asked: Asked) -> None:
        """Compute the forces along the movement for these designs, unless they are those of the last call."""
        self._asked = asked
        wanted = tuple(each.anywhere for each in asked)
        if self._movement is None or wanted == self._of:
            return
        if asked[0].side != self._side:
            self.leave()  # the record was read as one of the other arm
            return
        self._drop()
        self._of, self._known = wanted, [None] * len(asked)
        self._words.set_text("Computing the forces ...")
        for place, each in enumerate(asked):
            person = each.person if has_muscles() else None
            task = workers().submit(history, each.exo, self._movement, person)
            show = partial(self._show, wanted, place)
            task.add_done_callback(partial(call_in, self._loop, show))
            self._tasks.append(task)

    def _show(self, wanted: tuple[Asked, ...], place: int, task: Future[dict[str, Any]]) -> None:
        if wanted != self._of or task.cancelled() or self._strip.is_deleted:
            return
        problem = task.exception()
        self._known[place] = None if problem else task.result()
        pairs = [(each, found) for each, found in zip(wanted, self._known, strict=True) if found]
        words = (f"{each.name}: " * (len(wanted) > 1) + found["words"] for each, found in pairs)
        self._words.set_text(str(problem or "") or "\n".join(words))
        self._chart.options.clear()
        self._chart.options.update(plot_of([each.name for each in wanted], self._known))
        self._chart.update()

    def _drop(self) -> None:
        for task in self._tasks:
            task.cancel()
        self._tasks, self._of = [], ()

    def leave(self) -> None:
        """Take the movement off the page."""
        self.pause()
        self._drop()
        self._movement = None
        self._strip.set_visibility(False)

    def close(self) -> None:
        """Drop what is not yet computed."""
        self._drop()

    def pause(self) -> None:
        """Stand still."""
        self._timer.deactivate()
        self._button.set_text("Play")

    def _play_or_pause(self) -> None:
        if self._timer.active:
            self.pause()
            return
        if self._now >= self._times[-1]:
            self._now = 0.0
        self._stamp = time.monotonic()
        self._button.set_text("Pause")
        self._timer.activate()

    async def _tick(self) -> None:
        before, self._stamp = self._stamp, time.monotonic()
        self._go(self._now + self._stamp - before)
        self._slider.value = round(self._now, 2)
        if self._now >= self._times[-1]:
            self.pause()
        # A browser that draws slowly is not sent more than it draws.
        with suppress(TimeoutError):
            await self._mark()

    def _scrub(self, moment: float) -> None:
        self.pause()
        self._go(moment)
        self._mark()

    def _go(self, moment: float) -> None:
        self._now = min(moment, float(self._times[-1]))
        row = self._rows[int(np.abs(self._times - self._now).argmin())].tolist()
        self._clock.set_text(f"{self._now:.2f} of {self._times[-1]:.2f} s")
        velocity, acceleration = tuple(row[3:6]), tuple(row[6:])
        angles = dict(zip(ANGLES, row, strict=False))
        self._moved(**angles, angular_velocity=velocity, angular_acceleration=acceleration)

    def _mark(self) -> Any:
        """Mark the moment in the plot; what is returned waits until the browser has done so."""
        mark = {"symbol": "none", "silent": True, "animation": False, "label": {"show": False}}
        mark |= {"lineStyle": {"color": BLACK, "type": "solid"}, "data": [{"xAxis": self._now}]}
        return self._chart.run_chart_method("setOption", {"series": [{"id": "now", "markLine": mark}]}, timeout=_SLOW)
