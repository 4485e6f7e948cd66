"""Answers of a service that runs, as stored: how its processes and its server begin, and live streams to their end."""

import asyncio
import json
import re
import socket
from dataclasses import replace
from types import SimpleNamespace
from unittest import mock

import pytest
from answers import changes, each_of
from asked_in_turn import refused

from exo_pin.service import ServiceOptions, serve

pytest.importorskip("uvicorn", reason="needs the extra service")
import uvicorn

from exo_pin.service import workers
from exo_pin.service.application import application
from exo_pin.service.live import Live

TOKEN = "0123456789abcdef"
OPENING = json.dumps({"open": {}, "token": TOKEN, "rate": 100.0})
SAMPLE = '{"t": 0.5, "flexion": 10.0}'
#: What the server is given.
CONFIGURED = (
    "ws_max_size", "ws_per_message_deflate", "server_header", "limit_concurrency", "timeout_graceful_shutdown",
    "log_level",
)  # fmt: skip


def prepared():
    """What a process asks itself first, and whether it is answered."""
    asked, reply = [], workers.reply
    with mock.patch.object(workers, "reply", lambda *given: asked.append([*given, reply(*given)[0]])):
        workers.prepare()
    return asked


def served():
    """What the server is given, that its processes end with it, and addresses that it cannot have."""
    told, made = [], socket.socket

    class Processes:
        def __init__(self, *given):
            told.append(["begins", *given])
            self.given = given

        def close(self):
            told.append(["ends", *self.given])

    def run(server, sockets):
        (listener,), routes = sockets, server.config.app._app.routes
        flags = [listener.getsockopt(socket.SOL_SOCKET, each) for each in (socket.SO_ACCEPTCONN, socket.SO_REUSEADDR)]
        told.append([[getattr(server.config, name) for name in CONFIGURED], routes[-1].path, [*map(bool, flags)]])
        port = listener.getsockname()[1]
        told.extend(refused(lambda: serve(ServiceOptions(port=port))))
        told[:] = [re.sub(rf"\b{port}\b|\[Errno.*", "…", each) if isinstance(each, str) else each for each in told]

    def opened(family):
        told.append(family.name)
        return made(socket.AF_INET)

    given = ServiceOptions(port=0, workers=3, seconds=7.0, waiting=5, memory=11, body=13)
    with mock.patch.object(workers, "Workers", Processes), mock.patch.object(uvicorn.Server, "run", run):
        serve(given, told.append)
        serve(replace(given, live=0))
    with mock.patch("socket.socket", opened):
        told.append(refused(lambda: serve(ServiceOptions(host="::1")))[0].partition(":")[0])
    return told, refused(lambda: serve(3), lambda: serve(announce=3))


class Quick:
    """Answers with number and time of a sample at once; has no time for a stream of 9 Hz."""

    def __init__(self):
        self.asked = []

    async def answer(self, name, body):
        asked = json.loads(body)
        self.asked.append([name, *(key for key in ("opening", "sample") if asked[key])])
        if (asked["opening"] or {}).get("rate") == 9.0:
            raise workers.Busy("too many wait")
        return 200, json.dumps({"seq": asked["seq"], "t": (asked["sample"] or {}).get("t")}).encode()


def heard(message):
    """A message without the words of other packages and without what its clock says."""
    found = json.loads(message)
    return found if "kind" not in found else [found["status"], found["kind"], found["detail"].partition(": ")[0]]


def websockets():
    """Streams over WebSocket from their first message to their end."""
    made, allowed, limits = Live(Quick(), ServiceOptions(live=2, token=TOKEN)), asyncio.timeout, []

    def timeout(seconds):
        limits.append(seconds)
        return allowed(0.01)

    async def talk(*messages):
        events = [{"type": f"websocket.{'receive' if each else 'connect'}"} | each for each in ({}, *messages)]
        sent = []

        async def receive():
            for _ in range(30):
                await asyncio.sleep(0.0)
            if not events and not messages:
                await asyncio.sleep(9.0)
            return events.pop(0) if events else {"type": "websocket.disconnect"}

        async def send(message):
            sent.append(heard(message["text"]) if "text" in message else message)

        await made.route.app({"type": "websocket", "path": "/live", "headers": []}, receive, send)
        return sent, made.open

    samples = [{"text": json.dumps({"t": 0.01 * k, "flexion": 10.0})} for k in (0, 2)]
    answers = {"samples": asyncio.run(talk({"bytes": OPENING.encode()}, *samples, {"text": "{"}))}
    wrong = {
        "nothing": "",
        "token": '{"open": {}}',
        **{rate: OPENING.replace("100.0", rate) for rate in ("-1.0", "9.0")},
    }
    for name, text in wrong.items():
        answers[name] = asyncio.run(talk({"text": text}))
    with mock.patch("asyncio.timeout", timeout):
        answers["late"] = asyncio.run(talk())
    made.open = 2
    answers["full"] = asyncio.run(talk({"text": OPENING}))
    return answers, limits, made.workers.asked, made.route.path


def datagrams():
    """Streams over UDP until they are silent, by a clock that waits for those who ask."""
    with socket.socket(socket.AF_INET, socket.SOCK_DGRAM) as free:
        free.bind(("127.0.0.1", 0))
        port = free.getsockname()[1]
    made, rest = Live(Quick(), ServiceOptions(live=2, token=TOKEN, udp=port)), asyncio.sleep
    clock, going, slept, found = [0.0], [], [], []

    async def sleep(seconds):
        while not going:
            await rest(0.001)
        going.pop()
        clock[0] += seconds
        slept.append(seconds)

    async def talk():
        told, loop = asyncio.Queue(), asyncio.get_running_loop()
        server = await made.listen()

        class Hears(asyncio.DatagramProtocol):
            def datagram_received(self, data, _):
                told.put_nowait(heard(data))

        first, second = [(await loop.create_datagram_endpoint(Hears, remote_addr=("127.0.0.1", port)))[0] for _ in "ab"]

        async def say(sender, message):
            sender.sendto(message.encode())
            found.append([await asyncio.wait_for(told.get(), 30.0), made.open])

        async def pass_time(seconds):
            for _ in range(seconds):
                going.append(1)
                while going:
                    await rest(0.001)
            await rest(0.01)
            found.append([clock[0], made.open])

        for sender, message in (
            (first, SAMPLE), (first, '{"open" 1}'), (first, OPENING), (first, SAMPLE), (first, OPENING),
            (second, OPENING),
        ):  # fmt: skip
            await say(sender, message)
        server.get_protocol().pause_writing()
        first.sendto(SAMPLE.encode())
        await rest(0.02)
        server.get_protocol().resume_writing()
        await pass_time(10)
        await say(second, SAMPLE.replace("0.5", "0.6"))
        await pass_time(1)
        await say(first, SAMPLE)
        await pass_time(10)
        for each in (server, first, second):
            each.close()
        await rest(0.02)
        return len(asyncio.all_tasks()), told.qsize()

    with (
        mock.patch("exo_pin.service.live.time", SimpleNamespace(monotonic=lambda: clock[0])),
        mock.patch("asyncio.sleep", sleep),
    ):
        left = asyncio.run(talk())
    return found, left, set(slept), asyncio.run(Live(Quick(), ServiceOptions()).listen())


def begun():
    """Whether the port for datagrams is taken before the service begins, while it runs, and when it has ended."""
    with socket.socket(socket.AF_INET, socket.SOCK_DGRAM) as free:
        free.bind(("127.0.0.1", 0))
        port = free.getsockname()[1]

    def is_taken():
        with socket.socket(socket.AF_INET, socket.SOCK_DGRAM) as own:
            try:
                own.bind(("127.0.0.1", port))
            except OSError:
                return True
            return False

    async def run(options, live):
        events, sent, made = asyncio.Queue(), asyncio.Queue(), Quick()
        app = application(made, options, Live(made, options) if live else None)
        serving = asyncio.create_task(app({"type": "lifespan"}, events.get, sent.put))
        found = [is_taken()]
        for event in ("startup", "shutdown"):
            await events.put({"type": f"lifespan.{event}"})
            found += [(await asyncio.wait_for(sent.get(), 30.0))["type"], is_taken()]
            await asyncio.sleep(0.01)
        await serving
        return [*found, is_taken()]

    given = ServiceOptions(udp=port)
    return [asyncio.run(run(*each)) for each in ((given, True), (given, False), (ServiceOptions(), True))]


ASKED = {each.__name__: each for each in (prepared, served, websockets, datagrams, begun)}


@each_of(ASKED, ASKED)
def test_an_answer_is_as_stored(name):
    assert not changes(__file__, name, ASKED[name])
