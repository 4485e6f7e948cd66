"""Live streams: nothing waits for a slow reader, and over WebSocket and UDP each sample has its answer."""

import asyncio
import json
import os
import re
import signal
import socket
import subprocess
import sys
import time

import pytest
from places import page
from service_client import Service

import exo_pin as ep

pytest.importorskip("starlette", reason="needs the extra service")
from exo_pin.service.live_stream import LiveStream
from exo_pin.service.samples import Opening
from exo_pin.service.workers import Busy


class _Quick:
    """In place of the process that computes: it answers with the sample's number at once."""

    async def answer(self, name, body):
        asked = json.loads(body)
        if asked["sample"] is None:
            return 200, b"{}"
        return 200, json.dumps({"seq": asked["seq"], "delay": asked["delay"]}).encode()


def test_a_reader_that_stalls_loses_old_answers_and_holds_up_nobody():
    async def stall():
        sent, free = [], asyncio.Event()

        async def send(body):
            await free.wait()
            sent.append(json.loads(body))

        free.set()
        stream = LiveStream(_Quick(), send)
        assert await stream.open(Opening({}))
        free.clear()
        # Numbers go up by two: every other sample is lost.
        for number in range(0, 1000, 2):
            stream.take(json.dumps({"t": 0.01 * number, "seq": number}))
            while 2 * stream.answered <= number:
                await asyncio.sleep(0)
        free.set()
        for _ in range(50):
            await asyncio.sleep(0)
        stream.take(json.dumps({"t": 10.0, "seq": 1000}))
        for _ in range(50):
            await asyncio.sleep(0)
        await stream.close()
        return sent[1:]

    sent = asyncio.run(stall())
    # One was under way, eight waited; all others gave way to newer ones, which the next answer counts.
    assert [each["seq"] for each in sent] == [0, *range(984, 1001, 2)]
    assert [each["dropped"] for each in sent] == [0, 491] + [0] * 8
    # Of the gaps it names the last ones.
    assert sent[1]["lost"] == [[k, k] for k in range(959, 999, 2)]
    assert sent[-1]["lost"] == [[999, 999]]


def test_a_sample_that_no_process_has_time_for_is_answered_by_saying_so():
    async def refuse():
        sent = []

        class Crowded(_Quick):
            async def answer(self, name, body):
                if json.loads(body)["sample"] is not None:
                    raise Busy("64 questions wait: try again")
                return await super().answer(name, body)

        async def send(body):
            sent.append(json.loads(body))

        stream = LiveStream(Crowded(), send)
        await stream.open(Opening({}))
        stream.take(json.dumps({"t": 0.0, "seq": 0}))
        for _ in range(50):
            await asyncio.sleep(0)
        await stream.close()
        return sent[1:]

    (told,) = asyncio.run(refuse())
    assert (told["status"], told["kind"], told["detail"]) == (503, "Busy", "64 questions wait: try again")


def test_a_sample_gives_way_to_a_newer_one_while_one_is_answered(monkeypatch):
    async def crowd():
        sent, free = [], asyncio.Event()

        class Slow(_Quick):
            async def answer(self, name, body):
                await free.wait()
                return await super().answer(name, body)

        async def send(body):
            sent.append(json.loads(body))

        free.set()
        stream = LiveStream(Slow(), send)
        await stream.open(Opening({}))
        free.clear()
        for number in (0, 1, 2, 5, 4):
            # The first came at once, the others a quarter of a second later than they were made.
            monkeypatch.setattr(time, "monotonic", lambda k=number: 7.0 + 0.01 * k + 0.25 * (k > 0))
            stream.take(json.dumps({"t": 0.01 * number, "seq": number}))
            await asyncio.sleep(0)
            await asyncio.sleep(0)
        free.set()
        for _ in range(50):
            await asyncio.sleep(0)
        await stream.close()
        return sent[1:]

    first, second = asyncio.run(crowd())
    assert (first["seq"], second["seq"]) == (0, 5)
    assert (first["skipped"], first["lost"], first["late"]) == (2, [[3, 4]], [4])
    assert (second["skipped"], second["lost"], second["late"]) == (0, [], [])
    assert (first["delay"], second["delay"]) == pytest.approx((0.0, 0.25), abs=1e-3)


def free_port():
    with socket.socket(socket.AF_INET, socket.SOCK_DGRAM) as found:
        found.bind(("127.0.0.1", 0))
        return found.getsockname()[1]


@pytest.fixture(scope="module")
def service():
    port = free_port()
    with Service("--workers", "1", "--live", "2", "--udp", str(port)) as running:
        running.udp = port
        yield running


def magnitude(flexion):
    exo = ep.load("four-cables")
    return float(exo.reaction(exo.pose(flexion)).magnitude)


OPEN = json.dumps({"open": {"design": "four-cables"}, "rate": 100.0})


@pytest.mark.full
def test_over_websocket_each_sample_has_its_answer(service):
    connect = pytest.importorskip("websockets.sync.client", reason="needs the extra service").connect
    with connect(f"ws://127.0.0.1:{service.port}/live") as stream:
        stream.send(OPEN)
        assert json.loads(stream.recv()) == {"opened": "reaction", "design": "four-cables", "side": "left"}
        for number in (0, 1, 4, 3, 5):
            stream.send(json.dumps({"t": 0.01 * number, "seq": number, "flexion": 10.0 * number}))
            if number == 3:
                continue
            found = json.loads(stream.recv())
            assert found["magnitude"] == pytest.approx(magnitude(10.0 * number), rel=1e-9)
            assert (found["seq"], found["lost"]) == (number, [[2, 3]] if number == 4 else [])
        assert found["late"] == [3]
        stream.send("{")
        assert json.loads(stream.recv())["status"] == 422
        assert service.metric("exo_pin_streams") == 1


@pytest.mark.full
def test_streams_are_refused_as_requests_are(service):
    client = pytest.importorskip("websockets.sync.client", reason="needs the extra service")
    from websockets.exceptions import ConnectionClosed, InvalidStatus

    address = f"ws://127.0.0.1:{service.port}/live"
    with pytest.raises(InvalidStatus), client.connect(address, origin="http://example.org"):
        pass
    for first, said in ((json.dumps({"open": {"design": "../x"}}), "unknown design"), ("{", "first message")):
        with client.connect(address) as stream:
            stream.send(first)
            assert said in json.loads(stream.recv())["detail"]
            with pytest.raises(ConnectionClosed):
                stream.recv()
    with client.connect(address) as one, client.connect(address) as two, client.connect(address) as three:
        for stream, status in ((one, None), (two, None), (three, 503)):
            stream.send(OPEN)
            assert json.loads(stream.recv()).get("status") == status


@pytest.mark.full
def test_over_udp_each_sample_has_its_answer(service):
    with socket.socket(socket.AF_INET, socket.SOCK_DGRAM) as sender:
        sender.connect(("127.0.0.1", service.udp))
        sender.settimeout(120)

        def say(message):
            sender.send(message if isinstance(message, bytes) else json.dumps(message).encode())
            return json.loads(sender.recv(65536))

        assert say({"t": 0.0, "flexion": 1.0})["status"] == 410
        assert say(b'{"open": 1}')["status"] == 422
        assert say(OPEN.encode())["opened"] == "reaction"
        for number in (0, 1, 3):
            found = say({"t": 0.01 * number, "flexion": 20.0 * number})
            assert found["magnitude"] == pytest.approx(magnitude(20.0 * number), rel=1e-9)
            # Without numbers those that are lost follow from time and rate.
            assert (found["seq"], found["lost"]) == (number, [[2, 2]] if number == 3 else [])


@pytest.mark.full
def test_a_stream_whose_process_has_ended_says_so_and_can_be_opened_again(service):
    connect = pytest.importorskip("websockets.sync.client", reason="needs the extra service").connect
    with connect(f"ws://127.0.0.1:{service.port}/live") as stream:
        stream.send(OPEN)
        stream.recv()
        for pid in service.processes()[1:]:
            with open(f"/proc/{pid}/cmdline", "rb") as file:
                if b"spawn_main" in file.read():
                    os.kill(pid, signal.SIGKILL)
        statuses = []
        for number in range(2):
            stream.send(json.dumps({"t": 0.1 * number, "flexion": 1.0}))
            statuses.append(json.loads(stream.recv(timeout=120))["status"])
        assert statuses == [500, 410]
    with connect(f"ws://127.0.0.1:{service.port}/live") as stream:
        stream.send(OPEN)
        assert "opened" in json.loads(stream.recv(timeout=120))


@pytest.mark.full
@pytest.mark.parametrize("client", ["websocket", "udp"])
def test_the_lines_of_the_page_open_a_stream(client, service):
    text = page("live")
    code = re.search(rf"<!-- client: {client} -->\n```python\n(.*?)```", text, re.DOTALL)[1]
    shown = re.search(rf"<!-- output: {client} -->\n```text\n(.*?)```", text, re.DOTALL)[1]
    assert code.count("8600" if client == "websocket" else "9600") == 1
    code = code.replace("8600", str(service.port)).replace("9600", str(service.udp))
    done = subprocess.run([sys.executable, "-c", code], capture_output=True, text=True, check=True, timeout=120)
    assert done.stdout == shown
