"""What the page is built of, and what its widgets ask, as stored: with widgets that only tell what they are given."""

import asyncio
import contextlib
import json
import re
from dataclasses import asdict, replace
from importlib.resources import files
from pathlib import Path
from types import SimpleNamespace
from unittest import mock

import pytest
from answers import changes, each_of
from told_widgets import said

pytest.importorskip("nicegui", reason="needs the extra app")
from exo_pin.app.asked import Asked
from exo_pin.app.files import LARGEST_DESIGN
from exo_pin.app.following import answered
from exo_pin.app.page import answer_view, live_input, playing, visit, widgets
from exo_pin.app.searching import Found
from exo_pin.core.errors import InvalidInput

BEGINS = Asked("four-cables", flexion=20.0, payload=0.5)


class Page:
    """A page with widgets that tell what they are given, and questions that nobody answers."""

    def __init__(self, stack):
        self.ui, self.following, self.search, self.feed, self.mapped = (mock.MagicMock() for _ in range(5))
        for name in ("following", "search", "feed", "mapped"):
            self.ui.attach_mock(getattr(self, name), name)
        self.slider, self.called, self.slid = self.ui.slider, 0, []
        # A slider that is moved by the page tells where to.
        slides = property(lambda _: None, lambda _, value: self.slid.append(value))
        type(self.slider.return_value.props.return_value).value = slides
        for module in (answer_view, live_input, playing, visit, widgets):
            stack.enter_context(mock.patch.object(module, "ui", self.ui))
        self.ui.run_javascript = mock.AsyncMock(return_value="ws://here/")
        for module, name, other in (
            (visit, "Following", self.following), (visit, "Search", self.search), (visit, "Slider", self.slider),
            (playing, "Slider", self.slider), (answer_view, "PoseMap", self.mapped),
            (answer_view, "SceneFeed", self.feed), (answer_view.secrets, "token_urlsafe", "key {}".format),
            (visit.run, "io_bound", self.make), (live_input.LiveInput, "start", self.follow),
        ):  # fmt: skip
            stack.enter_context(mock.patch.object(module, name, other))
        classed = self.ui.label.return_value.classes.return_value
        classed.props.return_value.is_deleted = self.ui.element.return_value.classes.return_value.is_deleted = False
        self.search.return_value.works = False
        self.visit = visit.Visit(BEGINS)
        self.show, self.draw = self.following.call_args.args
        (self.find,), (self.drag,) = self.search.call_args.args, self.feed.call_args.args

    async def make(self, function, asked):
        if asked.mass == 61.0:
            raise InvalidInput("no file <of 61 kg>")
        return f"{getattr(function, 'func', function).__name__} of {asked.design}", repr(
            getattr(function, "keywords", "")
        )

    async def follow(self, url):
        self.ui.followed(url)

    def give(self, label):
        """Click a button that makes a file."""
        place = [each.args[0] for each in self.ui.button.call_args_list].index(label)
        return self.ui.button.return_value.props.return_value.on_click.call_args_list[place].args[0]()

    def map(self, place, columns):
        """Compute some of the map of a view."""
        self.mapped.call_args_list[place].args[0](columns)

    def write(self, number):
        """Show a number beside a slider."""
        bound = self.ui.label.return_value.classes.return_value.bind_text_from.call_args
        self.ui.written(bound.args[2](number))

    def gone(self, is_gone):
        """Close the browser's page, or not."""
        made = self.ui.label.return_value.classes.return_value.props.return_value
        made.is_deleted = self.ui.element.return_value.classes.return_value.is_deleted = is_gone

    def offered(self):
        """What the list of designs shows."""
        return self.ui.select.return_value.props.return_value.classes.return_value.set_options.call_args.kwargs["value"]

    def load(self, name, content):
        """Give a design as a file."""
        (given,) = [each.kwargs for each in self.ui.upload.call_args_list if "toml" in each.kwargs["label"]]
        file = SimpleNamespace(name=name, read=mock.AsyncMock(return_value=content))
        return given["on_upload"](SimpleNamespace(file=file, sender=SimpleNamespace(reset=self.ui.reset)))

    def new(self):
        """What widgets were given since the last time, and the last questions."""
        calls = [
            (name, given, more) for name, given, more in self.ui.mock_calls[self.called :] if "__" not in name[-8:]
        ]
        self.called = len(self.ui.mock_calls)
        own = [
            {key: value for key, value in asdict(each).items() if value != getattr(Asked(), key) or key == "changes"}
            for each in self.following.return_value.ask.call_args.args
        ]
        # A style sheet by one of its rules.
        shown = [(name, [".board {" in given[0]] if name == "add_css" else given, more) for name, given, more in calls]
        slid, self.slid = [["slides", *sorted(self.slid)]] * bool(self.slid), []
        told = [[name, *said(given), *said([*more.items()])] for name, given, more in shown]
        return told + slid, own

    def choose(self, kind, label, value):
        """Change the widget of that kind and label."""
        calls = [each for each in getattr(self.ui, kind).call_args_list if label in (*each.args, *each.kwargs.values())]
        calls[-1].kwargs["on_change"](SimpleNamespace(value=value))

    def click(self, label):
        """Click a button."""
        return [each for each in self.ui.button.call_args_list if label in each.args][-1].kwargs["on_click"]()

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
    yield "mapped", lambda: page.map(0, {20.0: [10.0, None, 30.0]})
    yield "mapped beside", lambda: page.map(1, {-20.0: [100.0]})
    yield "shown beside", lambda: page.show(1, answered(BEGINS))
    yield "alone", lambda: page.choose("select", "Beside it", "")
    yield "other", lambda: page.choose("select", "Design", "prototype")
    yield "back", lambda: page.choose("select", "Design", "four-cables")
    yield "sex", lambda: page.choose("select", "Sex", "female")
    yield "joints", lambda: page.choose("checkbox", "Drag joint centres in the picture", True)
    yield "dimension", lambda: page.choose("select", "Change another dimension", "A[1].radius_mm")
    yield "search", lambda: page.click("Search within sliders")
    yield "worse", lambda: page.find(Found(48, 0.2, 0.3, {"cuff_height_mm": 201.0}))
    yield "better", lambda: page.find(Found(96, 0.4, 0.3, {"cuff_height_mm": 202.0}))
    yield "stopped", lambda: (setattr(page.search.return_value, "works", True), page.click("Search within sliders"))
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
    yield "elsewhere", lambda: page.show(0, answered(replace(BEGINS, flexion=50.0, abduction=70.0), moving=True))
    yield "mapped there", lambda: page.map(0, {30.0: [40.0]})
    yield "wrong", lambda: page.show(0, answered(Asked(mass=1.0)))
    yield "nowhere", lambda: page.show(3, answered(BEGINS))
    yield "drawn", lambda: [page.draw(place, "…") for place in (0, 1)]
    yield "closed", lambda: page.gone(True)
    yield "shown to nobody", lambda: page.show(0, answered(BEGINS))
    yield "mapped for nobody", lambda: page.map(0, {20.0: [10.0]})
    yield "found for nobody", lambda: page.find(Found(96, 0.4, 0.3, {"cuff_height_mm": 202.0}))
    yield "open", lambda: page.gone(False)
    yield "emptied", lambda: page.fill("Mass, kg", None)
    yield "number", lambda: page.fill("Mass, kg", 61)
    yield "turned", lambda: page.slide("Abduction, °", 12)
    yield "written", lambda: [page.write(number) for number in (-12.5, 30.0)]
    yield "resized", lambda: page.slide("Cuff below shoulder, mm", 190)
    yield "picked", lambda: page.ui.echart.call_args.kwargs["on_point_click"](SimpleNamespace(value=[3, 7, 12.5]))
    yield "not saved", lambda: page.give("Save design")
    yield "lighter", lambda: page.fill("Mass, kg", 60)
    for label in ("Save design", "Report, PDF", "Report, HTML"):
        yield label, lambda label=label: page.give(label)
    yield "sensors", lambda: page.click("Follow sensors")
    yield (
        "given",
        lambda: page.load("mine.toml", files("exo_pin.design.presets").joinpath("prototype.toml").read_bytes()),
    )
    yield "not toml", lambda: page.load("mine.toml", b"[")
    yield "large", lambda: page.load("mine.toml", bytes(LARGEST_DESIGN + 1))
    yield "own", lambda: page.choose("select", "Design", page.offered())
    yield "own beside", lambda: page.choose("select", "Beside it", page.offered())
    yield "another beside", lambda: page.choose("select", "Beside it", "prototype")
    yield "drawn beside", lambda: [page.draw(place, "…") for place in (0, 1, 2)]
    yield "lower", lambda: page.slide("Cuff below shoulder, mm", 210)


async def _built():
    with contextlib.ExitStack() as stack:
        page = Page(stack)
        told = {"built": page.new()}
        for name, event in events(page):
            if asyncio.iscoroutine(done := event()):
                await done
            await asyncio.sleep(0.0)
            told[name] = page.new()
        started = said([each.args[1] for each in page.search.return_value.start.call_args_list])
        kept = Path(page.offered())
        there = kept.exists()
        page.gone(True)
        page.visit.close()
        ends = [page.new()[0], there, kept.exists(), page.following.return_value.joints, [*page.visit.feeds]]
        # Where a given file is kept is anything.
        return json.loads(re.sub(r"/[^\" ]*exo_pin_app_[^/]+/[^/]+/", "…/", json.dumps([told, started, ends])))


def built():
    """The page as it is built, and what is asked and drawn when a widget changes."""
    return asyncio.run(_built())


ASKED = {each.__name__: each for each in (built,)}


@pytest.mark.full
@each_of(ASKED)
def test_an_answer_is_as_stored(name):
    pytest.importorskip("myo_sim", reason="needs the extra person: pip install '.[person]'")
    assert not changes(__file__, name, ASKED[name])
