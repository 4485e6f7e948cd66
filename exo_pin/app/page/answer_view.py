"""What the page shows of one design: scene, map, answer, and the call in Python."""

from __future__ import annotations

import secrets
from collections.abc import Callable
from functools import partial
from html import escape
from typing import Any

from nicegui import ui

from ..asked import Asked
from ..following import Shown
from ..pose_map import ABDUCTIONS, FLEXIONS, PoseMap, chart_of, rings_at, top_of
from ..words import answer_html
from .scene_feed import SceneFeed
from .widgets import card, tag


class AnswerView:
    """Scene, map, answer and call of one design, in the slot where it is made.

    Parameters
    ----------
    asked : Asked
        The question to begin with.
    drag : callable
        Gets what the scene's page sends of a handle that is dragged.
    pick : callable
        Gets ``flexion`` and ``abduction`` of a cell of the map that is clicked, degrees.
    mapped : callable
        Gets the view and the columns of its map, in another thread, whenever some are new; it keeps them as
        ``columns``, and :meth:`draw_map` draws them.
    """

    def __init__(
        self,
        asked: Asked,
        drag: Callable[[str], None],
        pick: Callable[..., None],
        mapped: Callable[..., None],
    ) -> None:
        self.key, self.answers = secrets.token_urlsafe(9), 0
        self.feed, self._pick = SceneFeed(drag), pick
        self._asked, self.columns = asked, dict[float, list[float | None]]()
        self._map = PoseMap(partial(mapped, self))
        self._whole = ui.element("div").classes("view")
        with self._whole:
            with ui.element("div").classes("column middle"):
                with card("named"):
                    self._name = ui.label().classes("name")
                with card("scene"):
                    frame = ui.element("iframe")
                    frame.props(f'src="scene/{self.key}/#framed" title="Device on the person, with forces"')
                with card("map"):
                    tag("h2", "Force of arm and device over all poses; × not held")
                    chart = ui.echart(chart_of({}, asked, top_of({})), on_point_click=self._clicked)
                    self._chart = chart.props('role="img" aria-label="Map of flexion and abduction"')
            with ui.element("div").classes("column answer"):
                with card("answers"):
                    self._answer = ui.html("", sanitize=False).props('aria-live="polite" aria-atomic="true"')
                with card("python"):
                    tag("h2", "The same in Python")
                    self._call = ui.html("", sanitize=False)

    def close(self) -> None:
        """End what works for it, and take it off the page."""
        self._map.close()
        if not self._whole.is_deleted:
            self._whole.delete()

    @property
    def is_gone(self) -> bool:
        """Whether the page is closed, or the view taken off it."""
        return self._whole.is_deleted

    def show(self, shown: Shown) -> None:
        """Show an answer; the map follows one in full."""
        self.answers += 1
        self._asked = shown.asked
        self._answer.set_content(answer_html(shown))
        self._answer.props(f"data-answers={self.answers} data-moving={'yes' if shown.moving else 'no'}")
        rings = [{"id": each["id"], "data": each["data"]} for each in rings_at(shown.asked)]
        self._chart.run_chart_method("setOption", {"series": rings})
        self._call.set_content(f"<pre class='call'>{escape(shown.asked.python())}</pre>")
        if shown.report is not None:
            self._name.set_text(shown.asked.name)
            if not shown.moving:
                self._map.ask(shown.asked)

    def draw_map(self, top: float) -> None:
        """Draw the map, coloured from 0 to ``top``, N."""
        self._chart.options.clear()
        self._chart.options.update(chart_of(self.columns, self._asked, top))
        self._chart.update()

    def _clicked(self, event: Any) -> None:
        i, j, *_ = event.value
        self._pick(flexion=FLEXIONS[int(i)], abduction=ABDUCTIONS[int(j)])
