"""The page: widgets that change a question, and what shows its answer."""

from __future__ import annotations

import asyncio
import json
from collections.abc import Callable
from dataclasses import replace
from functools import partial
from importlib.resources import files
from typing import Any

import numpy as np
from nicegui import run, ui

from ...core.errors import ExoPinError
from ...design import presets
from ...exo.loading import load
from ...view import Scene
from ...view.colours import BLUE
from ...view.scene.panels import ANGLES
from ..asked import AT_REST, Asked
from ..dimensions import dimensions_of
from ..files import LARGEST_DESIGN, PageFiles
from ..following import Following, Shown
from ..pose_map import top_of
from ..searching import Found, Search
from .answer_view import AnswerView
from .live_input import LiveInput
from .playing import Player
from .scene_feed import SceneFeed, call_in
from .widgets import Slider, card, choice, tag

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


class Visit:
    """A browser's page: its question, and what shows the answer.

    Parameters
    ----------
    asked : Asked
        The question to begin with.
    """

    def __init__(self, asked: Asked) -> None:
        self._asked, self._call = asked, partial(call_in, asyncio.get_running_loop())
        self._views: list[AnswerView] = []
        self._following = Following(partial(self._call, self._show), self._draw)
        self._search, self._best = Search(partial(self._call, self._take_found)), dict[str, float]()
        self._files, self._sliders, self._chosen = PageFiles(), dict[str, Any](), list[str]()
        self._player = Player(self._move, self._files.keep)
        self.live = LiveInput(self._move, lambda: self._asked.side)
        self._build()
        self.change()

    @property
    def feeds(self) -> dict[str, SceneFeed]:
        """Scenes of the page by their keys."""
        return {view.key: view.feed for view in self._views}

    def close(self) -> None:
        """End what works for the page."""
        self._following.close()
        self._files.close()
        self._search.stop()
        self._player.close()
        self.live.close()
        for view in self._views:
            view.close()

    def change(self, **fields: Any) -> None:
        """Ask with some fields changed; a pose without its motion is at rest."""
        rest = AT_REST if ANGLES.keys() & fields.keys() else {}
        self._asked = replace(self._asked, **(rest | fields))
        beside = [self._beside] if len(self._views) > 1 else []
        asked = (self._asked, *(replace(self._asked, changes=(), **each) for each in beside))
        self._following.ask(*asked)
        self._player.ask(*asked)

    def _draw(self, place: int, scene: Scene) -> None:
        # A view may be taken away meanwhile.
        for view in self._views[place : place + 1]:
            view.feed.show(scene)

    def _show(self, place: int, shown: Shown) -> None:
        # A view may be taken away meanwhile.
        if place >= len(self._views) or self._views[place].is_gone:
            return
        self._views[place].show(shown)
        if place == 0 and shown.report is not None:
            device = shown.report.device
            self._title.set_text(device.title or device.name)

    def _take_map(self, view: AnswerView, columns: dict[float, list[float | None]]) -> None:
        """Draw all maps, to one scale, with what is known of one."""
        view.columns = columns
        top = max(top_of(each.columns) for each in self._views)
        for each in self._views:
            if not each.is_gone:
                each.draw_map(top)

    def _put_beside(self, path: str) -> None:
        """Show another design beside the first one; none where the path is empty."""
        if path:
            self._beside = self._design_fields(path)
        if path and len(self._views) == 1:
            self._add_view()
        elif not path and len(self._views) > 1:
            self._views.pop().close()
        self._board.classes(**{"add" if path else "remove": "two"})
        self.change()

    def _add_view(self) -> None:
        with self._board:
            self._views.append(AnswerView(self._asked, self._drag, self.pose, partial(self._call, self._take_map)))
        self._following.draw_anew()

    def _drag(self, message: str) -> None:
        """Bring hand or joint centre where the scene's handle was dragged."""
        try:
            said = json.loads(message)
            if "dropped" in said:
                if said["dropped"] != "hand":
                    self._build_dimensions()
                return
            name, place = said["drag"], np.array([float(part) for part in said["to"]])
        except (ValueError, TypeError, KeyError, RecursionError):
            return
        if place.shape != (3,) or not np.isfinite(place).all() or not 1e-6 < np.linalg.norm(place) < 10.0:
            return
        if name == "hand":
            self.pose(**self._asked.with_hand_at(place))
        elif name in self._asked.joints:
            self.change(changes=self._asked.with_joint_at(name, place).changes)

    def _offer_joints(self, offered: bool) -> None:
        self._following.joints = offered
        self.change()

    def pose(self, **angles: float) -> None:
        """Move the arm, and the sliders with it, away from a movement that is played."""
        self._player.pause()
        self._move(**angles)

    def _move(self, **fields: Any) -> None:
        self.change(**fields)
        for name in ANGLES.keys() & fields.keys():
            self._sliders[name].value = round(fields[name], 1)

    async def _follow_sensors(self) -> None:
        self._player.leave()
        here = await ui.run_javascript("location.href.replace(/^http/, 'ws').replace(/[?#].*/, '')")
        await self.live.start(f"{here}live/{self.live.key}")

    def _turn(self, name: str, angle: float) -> None:
        """Follow a slider of the pose."""
        self._player.pause()
        self.change(**{name: angle})

    def _build(self) -> None:
        ui.add_css((files("exo_pin.app.page") / "page.css").read_text(encoding="utf-8"))
        ui.colors(primary=BLUE)
        with ui.element("header").classes("top"):
            tag("h1", "exo_pin")
            self._title = ui.label().classes("title")
            for label, make in (
                ("Save design", self._files.design),
                ("Report, PDF", partial(self._files.report, ending=".pdf")),
                ("Report, HTML", partial(self._files.report, ending=".html")),
            ):
                button = ui.button(label).props("outline dense no-caps")
                button.on_click(partial(self._give, button, make))
        with ui.element("main").classes("board") as self._board:
            self._player.build()
            self.live.build()
            with ui.element("div").classes("column controls"):
                self._build_device()
                self._build_pose()
                self._build_person()
            self._add_view()

    def _build_device(self) -> None:
        with card("device"):
            tag("h2", "Device")
            self._designs = {name: name for name in (self._asked.design, *presets())}
            with ui.element("div").classes("fields"):
                self._design = choice("Design", self._designs, self._asked.design, self._choose_design).classes("wide")
                sides = {side: side for side in ("left", "right")}
                choice("Side", sides, self._asked.side, lambda value: self.change(side=value))
                designs = {"": "nothing"} | self._designs
                self._other = choice("Beside it", designs, "", self._put_beside).classes("wide")
            joints = ui.checkbox("Drag joint centres in the picture", on_change=lambda e: self._offer_joints(e.value))
            joints.props("dense").classes("joints")
            self._dimensions = ui.element("div").classes("dimensions")
            self._build_dimensions()
            given = ui.upload(
                label="Load a design (.toml)", auto_upload=True, max_file_size=LARGEST_DESIGN,
                on_upload=self._take_design,
            )  # fmt: skip
            given.props('accept=".toml" flat bordered')

    async def _give(self, button: Any, make: Callable[[Asked], tuple[str, bytes]]) -> None:
        """Make a file, which may take seconds, and hand it to the browser."""
        button.props("loading")
        try:
            name, content = await run.io_bound(make, self._asked)
            ui.download.content(content, name)
        except (ExoPinError, OSError) as error:
            ui.notify(str(error), type="warning", multi_line=True, close_button=True)
        finally:
            button.props(remove="loading")

    async def _take_design(self, event: Any) -> None:
        """Ask about a design that was given as a file."""
        path = event.file.name
        try:
            path = self._files.keep(event.file.name, await event.file.read(), most=LARGEST_DESIGN)
            load(path)
        except (ExoPinError, OSError) as error:
            ui.notify(str(error).replace(path, event.file.name), type="warning", multi_line=True, close_button=True)
            return
        finally:
            event.sender.reset()
        self._designs[path] = event.file.name
        self._other.set_options({"": "nothing"} | self._designs)
        self._design.set_options(self._designs, value=path)

    def _design_fields(self, path: str) -> dict[str, Any]:
        """Fields of a question about a design of the lists."""
        return {"design": path, "shown": self._designs[path] if path != self._designs[path] else ""}

    def _choose_design(self, path: str) -> None:
        self._chosen.clear()
        self._redesign({}, **self._design_fields(path))

    def _build_dimensions(self) -> None:
        """Sliders of the dimensions that are changed, and a list of the others."""
        self._dimensions.clear()
        try:
            known = {each.name: each for each in dimensions_of(self._asked.bare.device)}
        except (ExoPinError, OSError):
            return  # the answer says what is wrong
        changed = dict(self._asked.changes)
        shown = [name for name in known if name in self._chosen or name == next(iter(known))]
        with self._dimensions:
            for name in shown:
                each = known[name]
                self._build_slider(_words(name), name, each.low, each.high, each.value, 0.5, self._resize)
            others = [name for name in known if name not in shown]
            if others:
                other = ui.select(others, label="Change another dimension", on_change=lambda e: self._add(e.value))
                other.props("dense outlined options-dense")
            with ui.element("div").classes("row-of-buttons"):
                self._searching = ui.button("Search within sliders", on_click=self._start_or_stop)
                self._searching.props("outline dense no-caps").set_visibility(bool(shown))
                self._taken = ui.button("Take the best", on_click=self._take_best).props("outline dense no-caps")
                self._taken.set_visibility(False)
            self._found = ui.label().classes("found").props('role="status"')
            self._bounds = {name: (known[name].low, known[name].high) for name in shown}
            moved = dict.fromkeys(name.split(".")[0] for name in changed if name not in shown)
            if moved:
                ui.label(f"Changed: {', '.join(moved)}").classes("found")
            if changed:
                ui.button("As designed", on_click=lambda: self._redesign({})).props("flat dense no-caps")

    def _start_or_stop(self) -> None:
        if self._search.works:
            self._search.stop()
            self._take_found(None)
        else:
            self._search.start(self._asked.exo, self._bounds)
            self._searching.set_text("Stop the search")
            self._found.set_text("Searching ...")

    def _take_found(self, found: Found | None) -> None:
        """Show what a search has found; None at its end."""
        if self._found.is_deleted:
            return
        if found is None:
            self._searching.set_text("Search within sliders")
            return
        self._found.set_text(found.words)
        if found.values:
            self._best = dict(found.values)
            self._taken.set_visibility(found.index > found.start)

    def _take_best(self) -> None:
        self._search.stop()
        self._redesign(dict(self._asked.changes) | self._best)

    def _add(self, name: str) -> None:
        self._chosen.append(name)
        self._build_dimensions()

    def _redesign(self, changes: dict[str, float], **fields: Any) -> None:
        """Ask about other dimensions, and show them."""
        self.change(changes=tuple(sorted(changes.items())), **fields)
        self._build_dimensions()

    def _resize(self, name: str, value: float) -> None:
        self.change(changes=self._asked.changed(name, value).changes)

    def _build_pose(self) -> None:
        with card("pose"):
            tag("h2", "Pose of the arm")
            for name, (low, high) in ANGLES.items():
                words, value = f"{name.replace('_', ' ').capitalize()}, °", getattr(self._asked, name)
                self._sliders[name] = self._build_slider(words, name, low, high, value, 1.0, self._turn)
            ui.button("Follow sensors", on_click=self._follow_sensors).props("outline dense no-caps").classes("sensors")
            self._player.build_upload()

    def _build_slider(
        self,
        words: str,
        name: str,
        low: float,
        high: float,
        value: float,
        step: float,
        change: Callable[[str, float], None],
    ) -> Any:
        with ui.element("div").classes("angle"):
            ui.label(words)
            shown = ui.label().classes("value")
            slider = Slider(min=low, max=high, step=step, value=value).props(f'aria-label="{words}" dense')
            shown.bind_text_from(slider, "value", lambda number: f"{number:g}".replace("-", "−"))
            slider.on("update:model-value", lambda event: change(name, float(event.args)), throttle=_PACE)
        return slider

    def _build_person(self) -> None:
        with card("person"):
            tag("h2", "Person")
            with ui.element("div").classes("fields"):
                sexes = {sex: sex for sex in ("male", "female")}
                choice("Sex", sexes, self._asked.sex, lambda value: self.change(sex=value))
                for name, label, low, high, step in _PERSON:
                    box = ui.number(label, value=getattr(self._asked, name), min=low, max=high, step=step)
                    box.props(f'dense outlined debounce=300 aria-label="{label}"')
                    box.on_value_change(partial(self._number, name))

    def _number(self, name: str, event: Any) -> None:
        # A box that is being emptied asks nothing.
        if event.value is not None:
            self.change(**{name: float(event.value)})


def _words(name: str) -> str:
    """A dimension's name with its unit apart."""
    if name == "cuff_height_mm":
        return "Cuff below shoulder, mm"
    stem, _, unit = name.rpartition("_")
    return f"{stem.replace('_', ' ').capitalize()}, {unit.replace('deg', '°')}"
