"""What the page does with samples of sensors, over UDP and WebSocket, as stored: with widgets that only tell."""

import asyncio
import contextlib
import json
from types import SimpleNamespace
from unittest import mock

import pytest
from answers import changes, each_of

pytest.importorskip("nicegui", reason="needs the extra app")
from starlette.websockets import WebSocketDisconnect
from told_widgets import said

from exo_pin.app.page import live_input, widgets

OPENING = json.dumps({"open": {}, "token": "key 9", "rate": 100})
SAMPLE = '{"t": 0.0, "flexion": 35.0, "internal_rotation": 12.3456789}'


class Talks(asyncio.DatagramProtocol):
    """A sensor: what it sends over UDP or WebSocket, and what it is answered."""

    def __init__(self, told):
        self.told, self.texts = told, asyncio.Queue()

    def connection_made(self, transport):
        self.transport = transport

    def datagram_received(self, data, _):
        self.told.append(["heard", json.loads(data)])

    def say(self, text):
        self.transport.sendto(text.encode())

    async def accept(self):
        self.told.append("accepted")

    async def receive_text(self):
        if (text := await self.texts.get()) is None:
            raise WebSocketDisconnect
        return text

    async def send_text(self, text):
        self.told.append(["heard", json.loads(text)])

    async def close(self, code):
        self.told.append(["closed", code])


class Page:
    """The strip of a page that follows sensors, on a machine that has no port for them at first, and no clock."""

    def __init__(self, stack):
        self.ui, self.told, self.called, self.side, self.ports = mock.MagicMock(), [], 0, "right", []
        self.serving, self.refusals = [], [OSError(), OSError()]
        loop = asyncio.get_running_loop()
        loop.set_exception_handler(lambda _, fault: self.told.append(repr(fault["exception"])))
        self.make, self.sensors = loop.create_datagram_endpoint, [Talks(self.told) for _ in "abc"]
        self.ui.element.return_value.classes.return_value.id, self.picture = 7, asyncio.Future()
        self.ui.run_javascript.side_effect = lambda *_, **__: self.picture
        for place, name, other in (
            (live_input, "ui", self.ui), (widgets, "ui", self.ui),
            (live_input.secrets, "token_urlsafe", "key {}".format),
            (loop, "create_datagram_endpoint", self.listen),
        ):  # fmt: skip
            stack.enter_context(mock.patch.object(place, name, other))
        stack.enter_context(mock.patch("exo_pin.app.live_samples.time", SimpleNamespace(monotonic=lambda: 5.0)))
        self.live = live_input.LiveInput(lambda **moved: self.told.append(moved), lambda: self.side)
        self.live.build()

    async def listen(self, protocol, address):
        self.told.append([*address])
        if self.refusals:
            raise self.refusals.pop()
        transport, own = await self.make(protocol, ("127.0.0.1", 0))
        self.ports.append(transport.get_extra_info("sockname")[1])
        return transport, own

    async def follow(self, sensor=None):
        await self.live.start("ws://here")
        if sensor is not None:
            await self.make(lambda: sensor, remote_addr=("127.0.0.1", self.ports[-1]))

    async def tick(self):
        self.picture = asyncio.Future()
        self.picture.set_exception(TimeoutError())
        self.picture.exception()
        await self.ui.timer.call_args.args[1]()

    async def new(self):
        """What widgets were given since the last time, and all that was told."""
        await asyncio.sleep(0.02)
        calls = [each for each in self.ui.mock_calls[self.called :] if "__" not in each[0][-8:]]
        self.called, told = len(self.ui.mock_calls), self.told[:]
        del self.told[:]
        shown = json.dumps([[name, *said(given), *said([*more.items()])] for name, given, more in calls])
        for port in self.ports:
            shown = shown.replace(f"port {port}", "port …")
        return json.loads(shown), told


def steps(page):
    """What happens, by name, one after the other."""
    first, second, third = page.sensors

    def serve(sensor, *texts):
        page.serving.append(asyncio.create_task(page.live.serve(sensor)))
        for text in texts:
            sensor.texts.put_nowait(text)

    yield "built", page.tick
    yield "no port", page.follow
    yield "followed", lambda: page.follow(first)
    yield "waiting", page.tick
    yield "opened", lambda: first.say(OPENING)
    yield "wrong", lambda: first.say("{")
    yield "sample", lambda: first.say(SAMPLE)
    yield "shown", page.tick
    yield "the same", page.tick
    yield "second", lambda: serve(second, OPENING, SAMPLE.replace("35", "36"))
    yield "moved", page.tick
    yield "gone", lambda: second.texts.put_nowait(None)
    yield "third", lambda: serve(third)
    yield "left", page.live.leave
    yield "late", lambda: (third.texts.put_nowait(SAMPLE), first.say(SAMPLE))
    yield "nothing", page.tick
    yield "other side", lambda: setattr(page, "side", "left")
    yield "once more", page.follow
    yield "token", lambda: serve(third, OPENING.replace("9", "8"), OPENING, SAMPLE)
    yield "turned", page.tick
    yield "twice", page.follow
    yield "ended", lambda: (page.live.close(), first.transport.close())


async def _listened():
    with contextlib.ExitStack() as stack:
        page, told = Page(stack), {}
        for name, step in steps(page):
            if asyncio.iscoroutine(done := step()):
                await done
            told[name] = await page.new()
        return told, [each.done() for each in page.serving]


def listened():
    """What is shown, moved, and answered to sensors."""
    return asyncio.run(_listened())


ASKED = {each.__name__: each for each in (listened,)}


@each_of(ASKED)
def test_an_answer_is_as_stored(name):
    assert not changes(__file__, name, ASKED[name])
