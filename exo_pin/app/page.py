"""The page: widgets that change a question, and what shows its answer."""

from __future__ import annotations

import asyncio
import secrets
from collections.abc import Callable
from dataclasses import replace
from functools import partial
from html import escape
from importlib.resources import files
from typing import Any

from nicegui import ui

from ..core.records import OneProcess
from ..design import presets
from ..view.colours import BLUE
from ..view.scene.panels import ANGLES
from .asked import Asked
from .following import Following, Shown
from .pose_map import ABDUCTIONS, FLEXIONS, PoseMap, chart_of
from .scene_feed import SceneFeed
from .words import answer_html

__all__: list[str] = []

#: Fields of the person: name, label, least, greatest, step.
_PERSON = (
    ("height", "Height, m", 1.2, 2.2, 0.01),
    ("mass", "Mass, kg", 25.0, 200.0, 1.0),
    ("elbow", "Elbow bent, °", 0.0, 130.0, 5.0),
    ("payload", "In the hand, kg", 0.0, 12.0, 0.5),
    ("strength", "Strength, %", 0.0, 200.0, 5.0),
    ("girth", "Arm girth, mm", 0.0, 800.0, 5.0),
    ("clothing", "Clothing, mm", 0.0, 50.0, 1.0),
)
#: Seconds between two questions of a slider that moves.
_PACE = 0.025


class Visit(OneProcess):
    """A browser's page: its question, and what shows the answer.

    Parameters
    ----------
    asked : Asked
        The question to begin with.
    """

    def __init__(self, asked: Asked) -> None:
        self.key = secrets.token_urlsafe(9)
        self._asked, self._loop = asked, asyncio.get_running_loop()
        self.feed = SceneFeed(lambda _: None)
        self._following = Following(self._send, self.feed.show)
        self._map, self._columns = PoseMap(self._send_map), dict[float, list[float | None]]()
        self._sliders: dict[str, Any] = {}
        self.answers = 0
        self._build()
        self.change()

    def close(self) -> None:
        """End what works for the page."""
        self._following.close()
        self._map.close()

    def change(self, **fields: Any) -> None:
        """Ask with some fields changed."""
        self._asked = replace(self._asked, **fields)
        self._following.ask(self._asked)

    def _send(self, shown: Shown) -> None:
        self._loop.call_soon_threadsafe(self._show, shown)

    def _show(self, shown: Shown) -> None:
        if self._answer.is_deleted:
            return
        self.answers += 1
        self._answer.set_content(answer_html(shown))
        self._answer.props(f"data-answers={self.answers} data-moving={'yes' if shown.moving else 'no'}")
        self._call.set_content(f"<pre class='call'>{escape(shown.asked.python())}</pre>")
        if shown.report is not None:
            device = shown.report.device
            self._title.set_text(device.title or device.name)

        if not shown.moving and shown.report is not None:
            self._map.ask(shown.asked)
        self._draw_map()

    def _send_map(self, columns: dict[float, list[float | None]]) -> None:
        self._loop.call_soon_threadsafe(self._take_map, columns)

    def _take_map(self, columns: dict[float, list[float | None]]) -> None:
        self._columns = columns
        self._draw_map()

    def _draw_map(self) -> None:
        if not self._chart.is_deleted:
            self._chart.options.clear()
            self._chart.options.update(chart_of(self._columns, self._asked))
            self._chart.update()

    def _pick(self, event: Any) -> None:
        """Go to the pose of a cell of the map."""
        i, j, *_ = event.value
        self.pose(flexion=FLEXIONS[int(i)], abduction=ABDUCTIONS[int(j)])

    def pose(self, **angles: float) -> None:
        """Move the arm, and the sliders with it."""
        self.change(**angles)
        for name, angle in angles.items():
            self._sliders[name].value = angle

    def _build(self) -> None:
        ui.add_css((files("exo_pin.app") / "page.css").read_text(encoding="utf-8"))
        ui.colors(primary=BLUE)
        with ui.element("header").classes("top"):
            _tag("h1", "exo_pin")
            self._title = ui.label().classes("title")
        with ui.element("main").classes("board"):
            with ui.element("div").classes("column"):
                self._build_device()
                self._build_pose()
                self._build_person()
            with ui.element("div").classes("column middle"):
                with _card("scene"):
                    frame = ui.element("iframe")
                    frame.props(f'src="scene/{self.key}/#framed" title="Device on the person, with forces"')
                with _card("map"):
                    _tag("h2", "Force of arm and device over the box of poses; × is not held")
                    chart = ui.echart(chart_of({}, self._asked), on_point_click=self._pick)
                    self._chart = chart.props('role="img" aria-label="Map of flexion and abduction"')
            with ui.element("div").classes("column answer"):
                with _card("answers"):
                    self._answer = ui.html("", sanitize=False).props('aria-live="polite" aria-atomic="true"')
                with _card("python"):
                    _tag("h2", "The same in Python")
                    self._call = ui.html("", sanitize=False)

    def _build_device(self) -> None:
        with _card("device"):
            _tag("h2", "Device")
            names = list(dict.fromkeys([self._asked.design, *presets()]))
            with ui.element("div").classes("fields"):
                _choice("Design", names, self._asked.design, lambda value: self.change(design=value)).classes("wide")
                sides = ["left", "right"]
                _choice("Side", sides, self._asked.side, lambda value: self.change(side=value))

    def _build_pose(self) -> None:
        with _card("pose"):
            _tag("h2", "Pose of the arm")
            for name, (low, high) in ANGLES.items():
                self._build_angle(name, low, high)

    def _build_angle(self, name: str, low: float, high: float) -> None:
        words = name.replace("_", " ").capitalize()
        with ui.element("div").classes("angle"):
            ui.label(words)
            value = ui.label().classes("value")
            slider = ui.slider(min=low, max=high, step=1, value=getattr(self._asked, name))
            self._sliders[name] = slider
            slider.props(f'aria-label="{words}, degrees" dense')
            value.bind_text_from(slider, "value", lambda angle: f"{angle:.0f}°".replace("-", "−"))
            slider.on("update:model-value", lambda event: self.change(**{name: float(event.args)}), throttle=_PACE)

    def _build_person(self) -> None:
        with _card("person"):
            _tag("h2", "Person")
            with ui.element("div").classes("fields"):
                _choice("Sex", ["male", "female"], self._asked.sex, lambda value: self.change(sex=value))
                for name, label, low, high, step in _PERSON:
                    box = ui.number(label, value=getattr(self._asked, name), min=low, max=high, step=step)
                    box.props(f'dense outlined debounce=300 aria-label="{label}"')
                    box.on_value_change(partial(self._number, name))

    def _number(self, name: str, event: Any) -> None:
        # A box that is being emptied asks nothing.
        if event.value is not None:
            self.change(**{name: float(event.value)})


def _tag(tag: str, text: str) -> Any:
    with ui.element(tag) as made:
        ui.html(escape(text), sanitize=False, tag="span")
    return made


def _card(classes: str = "") -> Any:
    return ui.element("section").classes(f"card {classes}")


def _choice(label: str, options: list[str], value: str, change: Callable[[str], None]) -> Any:
    made = ui.select(options, label=label, value=value, on_change=lambda event: change(event.value))
    return made.props("dense outlined options-dense")
