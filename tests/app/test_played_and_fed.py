"""What a movement on the page asks and shows, and what browsers of a scene are sent, as stored."""

import asyncio
import contextlib
from concurrent.futures import Future
from types import SimpleNamespace
from unittest import mock

import pytest
from answers import changes, each_of
from asked_in_turn import in_a_folder

pytest.importorskip("nicegui", reason="needs the extra app")
from starlette.websockets import WebSocketDisconnect
from told_widgets import said

from exo_pin.app.asked import Asked
from exo_pin.app.page import playing, widgets
from exo_pin.app.page.scene_feed import SceneFeed, call_in
from exo_pin.core.errors import InvalidInput

CABLES, OTHER = Asked("four-cables", flexion=20.0), Asked("prototype", flexion=20.0)
FOUND = {"words": "Held all along.", "held": [True, False], "lines": [[0.0, 0.4], [20.0, 30.0], [None, None]]}
RECORD = "time_s,flexion_deg,abduction_deg,internal_rotation_deg\n" + "".join(
    f"{2.0 + 0.1 * k:.1f},{20 + 7 * k},{30 + k * k},{3 * k}\n" for k in range(5)
)


class Played:
    """A player whose widgets tell what they are given, with files, forces and a clock that are set from outside."""

    def __init__(self, stack):
        self.ui, self.told, self.tasks, self.now, self.called = mock.MagicMock(), [], [], 100.0, 0
        self.timer, self.muscles = self.ui.timer.return_value, True
        self.timer.active = False
        self.timer.activate.side_effect = lambda: setattr(self.timer, "active", True)
        self.timer.deactivate.side_effect = lambda: setattr(self.timer, "active", False)
        strip = self.ui.element.return_value.classes.return_value
        strip.is_deleted, strip.id = False, 7
        self.ui.echart.return_value.props.return_value.run_chart_method.side_effect = self.marked
        for place, other in (
            ("ui", self.ui), ("Slider", self.ui.slider), ("workers", lambda: self),
            ("has_muscles", lambda: self.muscles),
            ("time", SimpleNamespace(monotonic=lambda: self.now)), ("run.io_bound", self.read),
        ):  # fmt: skip
            stack.enter_context(mock.patch(f"{playing.__name__}.{place}", other))
        stack.enter_context(mock.patch.object(widgets, "ui", self.ui))
        self.player = playing.Player(lambda **moved: self.told.append(moved), self.keep)
        self.player.build_upload()
        self.player.build()

    def marked(self, *_, **__):
        done = asyncio.get_running_loop().create_future()
        done.set_exception(TimeoutError()) if self.now == 100.2 else done.set_result(None)
        done.exception()
        return done

    async def read(self, function, *arguments):
        return function(*arguments)

    def keep(self, name, content, endings):
        if not name.endswith(endings):
            raise InvalidInput(f"not {name}")
        with open(name, "wb") as file:
            file.write(content)
        return name

    def submit(self, function, exo, movement, person):
        self.told.append([function.__name__, exo.name, len(movement.times), person is not None])
        self.tasks.append(Future())
        return self.tasks[-1]

    async def give(self, name):
        async def content():
            return RECORD.encode()

        sender, file = mock.MagicMock(), SimpleNamespace(name=name, read=content)
        await self.ui.upload.call_args.kwargs["on_upload"](SimpleNamespace(file=file, sender=sender))
        self.told.append(["reset", sender.reset.call_count])

    async def tick(self, now):
        self.now = now
        await self.ui.timer.call_args.args[1]()

    def play(self):
        next(each for each in self.ui.button.call_args_list if each.args == ("Play",)).kwargs["on_click"]()

    def scrub(self, moment):
        self.ui.slider.return_value.props.return_value.on.call_args.args[1](SimpleNamespace(args=str(moment)))

    async def new(self):
        """What widgets were given since the last time, whether the movement goes on, and what was asked."""
        await asyncio.sleep(0.01)
        calls = [each for each in self.ui.mock_calls[self.called :] if "__" not in each[0][-8:]]
        self.called, told, self.told = len(self.ui.mock_calls), self.told, []
        shown = [[name, *said(given), *said([*more.items()])] for name, given, more in calls]
        return shown, self.ui.slider.return_value.props.return_value.value, self.timer.active, told


def steps(own):
    """What happens with a movement, by name, one after the other."""
    ask = own.player.ask
    yield "built", lambda: ask(CABLES)
    yield "wrong", lambda: own.give("mine.exe")
    yield "given", lambda: own.give("mine.csv")
    yield "asked", lambda: ask(CABLES)
    yield "same", lambda: ask(Asked("four-cables", flexion=50.0))
    yield "found", lambda: own.tasks[0].set_result(FOUND)
    yield "two", lambda: ask(CABLES, OTHER)
    yield "second", lambda: own.tasks[2].set_result(FOUND)
    yield "fault", lambda: own.tasks[1].set_exception(InvalidInput("no forces"))
    yield "late", lambda: (ask(OTHER), own.tasks[-1].set_running_or_notify_cancel(), ask(CABLES))
    yield "old", lambda: own.tasks[-2].set_result(FOUND)
    yield "dropped", lambda: (ask(OTHER), own.told.append(own.tasks[-2].cancelled()))
    yield "no muscles", lambda: (setattr(own, "muscles", False), ask(CABLES))
    yield "play", own.play
    yield "ticked", lambda: own.tick(100.13)
    yield "slow", lambda: own.tick(100.2)
    yield "paused", own.play
    yield "on", own.play
    yield "ended", lambda: own.tick(103.0)
    yield "again", own.play
    yield "begun", lambda: own.tick(103.07)
    yield "scrubbed", lambda: own.scrub(0.27)
    yield "beyond", lambda: own.scrub(9.0)
    yield "asked anew", lambda: ask(OTHER, CABLES)
    yield "other side", lambda: ask(Asked("four-cables", side="right"))
    yield "closed", lambda: (own.player.close(), own.told.append([each.cancelled() for each in own.tasks]))


async def _played():
    with contextlib.ExitStack() as stack:
        own, told = Played(stack), {}
        for name, step in steps(own):
            if asyncio.iscoroutine(done := step()):
                await done
            told[name] = await own.new()
        return told


class Drawn:
    """A scene, of which a browser is sent its name, and changes."""

    def __init__(self, name, told):
        self.name, self.told = name, told

    def attach(self, publish):
        self.publish = publish
        return lambda: self.name

    def close(self):
        self.told.append(["closed", self.name.decode()])


class Socket:
    """A browser's connection; no text ends it."""

    def __init__(self, told):
        self.told, self.texts = told, asyncio.Queue()

    async def accept(self):
        self.told.append("accepted")

    async def send_bytes(self, sent):
        self.told.append(sent.decode())

    async def receive_text(self):
        if (text := await self.texts.get()) is None:
            raise WebSocketDisconnect
        return text


async def _fed():
    told = []
    feed, first, second = SceneFeed(told.append), Drawn(b"first", told), Drawn(b"second", told)
    socket = Socket(told)
    feed.show(first)
    serving = asyncio.create_task(feed.serve(socket))
    for step in (
        lambda: first.publish(b"a change"), lambda: [first.publish(b"two, "), first.publish(b"three")],
        lambda: feed.show(second), lambda: second.publish(b"more"), lambda: socket.texts.put_nowait("a drag"),
        lambda: socket.texts.put_nowait(None), lambda: second.publish(b"for nobody"), lambda: feed.show(first),
    ):  # fmt: skip
        await asyncio.sleep(0.01)
        step()
        told.append("-")
    await asyncio.sleep(0.01)
    told.append([serving.done(), len(asyncio.all_tasks())])
    return told


@in_a_folder
def played():
    """A movement that is given, computed, played, paused, scrubbed and left."""
    return asyncio.run(_played())


def fed():
    """What browsers of a scene are sent and send, from one scene to the next."""
    told = asyncio.run(_fed())
    loop = asyncio.new_event_loop()
    loop.close()
    call_in(loop, told.append, "too late")
    return told


ASKED = {"played": played, "fed": fed}


@each_of(ASKED)
def test_an_answer_is_as_stored(name):
    assert not changes(__file__, name, ASKED[name])
