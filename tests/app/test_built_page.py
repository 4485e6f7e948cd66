"""What the page is built of, and what its widgets ask, as stored: with widgets that only tell what they are given."""

import asyncio
import contextlib
import json
from dataclasses import asdict
from types import SimpleNamespace
from unittest import mock

import pytest
from answers import changes, each_of
from told_widgets import said

pytest.importorskip("nicegui", reason="needs the extra app")
from exo_pin.app.asked import Asked
from exo_pin.app.following import answered
from exo_pin.app.page import answer_view, live_input, playing, visit, widgets
from exo_pin.app.searching import Found

BEGINS = Asked("four-cables", flexion=20.0, payload=0.5)


class Page:
    """A page with widgets that tell what they are given, and questions that nobody answers."""

    def __init__(self, stack):
        self.ui, self.following, self.search, self.feed = (mock.MagicMock() for _ in range(4))
        self.slider, self.called = self.ui.slider, 0
        for module in (answer_view, live_input, playing, visit, widgets):
            stack.enter_context(mock.patch.object(module, "ui", self.ui))
        for module, name, other in (
            (visit, "Following", self.following), (visit, "Search", self.search), (visit, "Slider", self.slider),
            (playing, "Slider", self.slider), (answer_view, "PoseMap", mock.MagicMock()),
            (answer_view, "SceneFeed", self.feed), (answer_view.secrets, "token_urlsafe", "key {}".format),
        ):  # fmt: skip
            stack.enter_context(mock.patch.object(module, name, other))
        classed = self.ui.label.return_value.classes.return_value
        classed.props.return_value.is_deleted = self.ui.element.return_value.classes.return_value.is_deleted = False
        self.search.return_value.works = False
        self.visit = visit.Visit(BEGINS)
        self.show, _ = self.following.call_args.args
        (self.find,), (self.drag,) = self.search.call_args.args, self.feed.call_args.args

    def new(self):
        """What widgets were given since the last time, and the last questions."""
        calls = [
            (name, given, more) for name, given, more in self.ui.mock_calls[self.called :] if "__" not in name[-8:]
        ]
        self.called = len(self.ui.mock_calls)
        own = [
            {key: value for key, value in asdict(each).items() if value != getattr(Asked(), key)}
            for each in self.following.return_value.ask.call_args.args
        ]
        return [[name, *said(given), *said([*more.items()])] for name, given, more in calls if name != "add_css"], own

    def choose(self, kind, label, value):
        """Change the widget of that kind and label."""
        calls = [each for each in getattr(self.ui, kind).call_args_list if label in (*each.args, *each.kwargs.values())]
        calls[-1].kwargs["on_change"](SimpleNamespace(value=value))

    def click(self, label):
        """Click a button."""
        [each for each in self.ui.button.call_args_list if label in each.args][-1].kwargs["on_click"]()

    def fill(self, label, value):
        """Change a number."""
        labels = [each.args[0] for each in self.ui.number.call_args_list]
        changed = self.ui.number.return_value.on_value_change.call_args_list[labels.index(label)]
        changed.args[0](SimpleNamespace(value=value))

    def slide(self, label, value):
        """Change a slider."""
        made = self.slider.return_value.props
        place = max(k for k, each in enumerate(made.call_args_list) if f'"{label}"' in each.args[0])
        made.return_value.on.call_args_list[place].args[1](SimpleNamespace(args=value))


def events(page):
    """What happens on a page, by name, one after the other."""
    yield "side", lambda: page.choose("select", "Side", "right")
    yield "beside", lambda: page.choose("select", "Beside it", "prototype")
    yield "alone", lambda: page.choose("select", "Beside it", "")
    yield "other", lambda: page.choose("select", "Design", "prototype")
    yield "back", lambda: page.choose("select", "Design", "four-cables")
    yield "sex", lambda: page.choose("select", "Sex", "female")
    yield "joints", lambda: page.choose("checkbox", "Drag joint centres in the picture", True)
    yield "dimension", lambda: page.choose("select", "Change another dimension", "A[1].radius_mm")
    yield "search", lambda: page.click("Search within sliders")
    yield "worse", lambda: page.find(Found(48, 0.2, 0.3, {"cuff_height_mm": 201.0}))
    yield "better", lambda: page.find(Found(96, 0.4, 0.3, {"cuff_height_mm": 202.0}))
    yield "best", lambda: page.click("Take the best")
    yield "ended", lambda: page.find(None)
    yield "designed", lambda: page.click("As designed")
    for place in ([0.3, 0.2, 0.1], [0.0, 0.0, 0.0], [9.0, 9.0, 0.0], [1.0, 2.0]):
        yield f"hand {place}", lambda place=place: page.drag(json.dumps({"drag": "hand", "to": place}))
    yield "joint", lambda: page.drag('{"drag": "A[2]", "to": [0.1, 0.2, 0.3]}')
    for text in ('{"dropped": "A[2]"}', '{"dropped": "hand"}', "", "[]", '{"drag": "x", "to": [1, 2, 3]}'):
        yield text, lambda text=text: page.drag(text)
    yield "shown", lambda: page.show(0, answered(BEGINS))
    yield "moving", lambda: page.show(0, answered(BEGINS, moving=True))
    yield "wrong", lambda: page.show(0, answered(Asked(mass=1.0)))
    yield "nowhere", lambda: page.show(3, answered(BEGINS))
    yield "emptied", lambda: page.fill("Mass, kg", None)
    yield "number", lambda: page.fill("Mass, kg", 61)
    yield "turned", lambda: page.slide("Abduction, °", 12)
    yield "resized", lambda: page.slide("Cuff below shoulder, mm", 190)
    yield "picked", lambda: page.ui.echart.call_args.kwargs["on_point_click"](SimpleNamespace(value=[3, 7, 12.5]))


async def _built():
    with contextlib.ExitStack() as stack:
        page = Page(stack)
        told = {"built": page.new()}
        for name, event in events(page):
            event()
            await asyncio.sleep(0.0)
            told[name] = page.new()
        started = said([each.args[1] for each in page.search.return_value.start.call_args_list])
        page.visit.close()
        ends = [page.following.return_value.close.called, page.search.return_value.stop.call_count, [*page.visit.feeds]]
        return told, started, ends


def built():
    """The page as it is built, and what is asked and drawn when a widget changes."""
    return asyncio.run(_built())


ASKED = {each.__name__: each for each in (built,)}


@pytest.mark.full
@each_of(ASKED)
def test_an_answer_is_as_stored(name):
    pytest.importorskip("myo_sim", reason="needs the extra person: pip install '.[person]'")
    assert not changes(__file__, name, ASKED[name])
