"""Who may see the live page, and what browsers that read slowly or not at all cost."""

import asyncio
import gc
import os
import socket
import time
from http.client import HTTPConnection

import numpy as np
import pytest

from exo_pin.view import Scene
from exo_pin.view.page import live_server
from exo_pin.view.page.live_server import TOKEN, Server

SECRET = b"the scene" * 30_000
PATHS = ("", "viewer.js", "socket")
UPGRADE = {
    "Upgrade": "websocket", "Connection": "Upgrade", "Sec-WebSocket-Version": "13",
    "Sec-WebSocket-Key": "dGhlIHNhbXBsZSBub25jZQ==",
}  # fmt: skip


@pytest.fixture
def server(caplog, capfd):
    """A server of a scene that is a text, which says nothing on the terminal until its end and after it."""
    served = Server(lambda: SECRET, 0)
    yield served
    served.close()
    gc.collect()
    assert caplog.records == []
    assert capfd.readouterr() == ("", "")


def answer(server, path, host=None, origin=None, method="GET"):
    """Status and first bytes of the body of an answer."""
    connection = HTTPConnection("127.0.0.1", server.port, timeout=10)
    try:
        connection.putrequest(method, path, skip_host=True)
        connection.putheader("Host", f"127.0.0.1:{server.port}" if host is None else host)
        for name, value in UPGRADE.items() if path.endswith("socket") else ():
            connection.putheader(name, value)
        if origin is not None:
            connection.putheader("Origin", origin)
        connection.endheaders()
        got = connection.getresponse()
        return got.status, b"" if got.status == 101 else got.read()
    finally:
        connection.close()


HOSTS = ("127.0.0.1", "localhost", "LOCALHOST:7001", "127.0.0.1:65000", "[::1]:80", "127.1.2.3")
FOREIGN_HOSTS = (
    "evil.example", "127.0.0.1.evil.example", "localhost.evil.example", "evil.example#127.0.0.1", "0.0.0.0", "10.0.0.7",
    "[::]", "127.1", "",
)  # fmt: skip
FOREIGN_ORIGINS = (
    "http://evil.example", "https://127.0.0.1", "http://127.0.0.1:1", "http://127.0.0.1.evil.example", "null", "",
    "http://[",
)  # fmt: skip


def test_who_has_the_address_may_look_under_every_name_of_the_machine(server):
    for host in HOSTS:
        for origin in (None, f"http://{host}"):
            for path in PATHS:
                status, body = answer(server, f"/{TOKEN}/{path}", host, origin)
                assert status == (101 if path == "socket" else 200), (host, origin, path)
                assert path == "socket" or len(body) > 1000


def test_everybody_else_is_refused(server):
    wrong = ("wrong", TOKEN[:-1], TOKEN + "A", TOKEN.swapcase(), "%FF%00", "%C3%BC")
    cases = [(token, None, None) for token in wrong]
    cases += [(TOKEN, host, None) for host in FOREIGN_HOSTS] + [(TOKEN, None, origin) for origin in FOREIGN_ORIGINS]
    # Rebinding: a foreign name that leads to this machine, and a page of the same name.
    cases += [(token, "evil.example:7000", "http://evil.example:7000") for token in (TOKEN, "wrong")]
    for token, host, origin in cases:
        for path in PATHS:
            status, body = answer(server, f"/{token}/{path}", host, origin)
            assert status in (400, 403), (token, host, origin, path)
            assert len(body) < 200
            assert TOKEN.encode() not in body


def test_other_addresses_and_methods_are_refused(server):
    for path in ("", "/", "/socket", "/../", f"/{TOKEN}", f"/{TOKEN}/../{TOKEN}/", f"//{TOKEN}/", f"/{TOKEN}/socket/"):
        assert answer(server, path or "*")[0] in (400, 403)
    for method in ("POST", "PUT", "DELETE", "OPTIONS", "TRACE"):
        assert answer(server, f"/{TOKEN}/", method=method)[0] in (403, 405)


def test_requests_of_random_bytes_are_survived_in_silence(server):
    rng = np.random.default_rng(0)
    request = f"GET /{TOKEN}/socket HTTP/1.1\r\nHost: localhost\r\nContent-Length: 3\r\n"
    request += "".join(f"{name}: {value}\r\n" for name, value in UPGRADE.items()) + "\r\nabc"
    for _ in range(50):
        content = np.frombuffer(request.encode(), np.uint8).copy()
        content[rng.integers(0, len(content), 3)] = rng.integers(0, 256, 3)
        with socket.create_connection(("127.0.0.1", server.port), timeout=10) as sent:
            sent.sendall(content.tobytes()[: rng.integers(1, 2 * len(content))])
    assert answer(server, f"/{TOKEN}/")[0] == 200


def look_on(server):
    """A browser that has opened its socket and has not read anything."""
    reader = socket.socket()
    reader.setsockopt(socket.SOL_SOCKET, socket.SO_RCVBUF, 4096)
    reader.settimeout(10)
    reader.connect(("127.0.0.1", server.port))
    lines = "".join(f"{name}: {value}\r\n" for name, value in UPGRADE.items())
    reader.sendall(f"GET /{TOKEN}/socket HTTP/1.1\r\nHost: localhost:{server.port}\r\n{lines}\r\n".encode())
    return reader


def messages(reader):
    """What a browser is sent, one message after the other."""
    stream = reader.makefile("rb")
    while stream.readline().strip():
        pass  # the answer to the request
    while True:
        size = stream.read(2)[1]
        size = int.from_bytes(stream.read({126: 2, 127: 8}[size])) if size > 125 else size
        yield stream.read(size)


def wait_for(condition):
    end = time.monotonic() + 30.0
    while not condition():
        assert time.monotonic() < end
        time.sleep(0.002)


def turn(server):
    """Let the server do what it has been given."""
    asyncio.run_coroutine_threadsafe(asyncio.sleep(0), server._loop).result()


def memory():
    with open("/proc/self/statm") as file:
        return int(file.read().split()[1]) * os.sysconf("SC_PAGE_SIZE")


def test_stalled_readers_cost_little_and_are_left_in_silence(server):
    readers = [look_on(server) for _ in range(20)]
    wait_for(lambda: len(server._connections) == 20)
    before = memory()
    for k in range(3000):
        # 30 MB in all, for each of 20.
        server.publish(k.to_bytes(4) * 2500)
        if k % 20 == 0:
            turn(server)
    turn(server)
    # No more than twice what may wait, and the scene, for each.
    assert memory() - before < 20 * (2 * live_server._MOST_WAITING + 2 * len(SECRET))
    for reader in readers[:10]:
        reader.close()
    wait_for(lambda: len(server._connections) == 10)
    server.close()
    for reader in readers:
        reader.close()


def test_a_slow_reader_gets_the_newest_state_and_not_the_way_there(caplog):
    newest = [0]
    served = Server(lambda: newest[0].to_bytes(4) + SECRET, 0)
    reader = look_on(served)
    try:
        wait_for(lambda: served._connections)
        for newest[0] in range(1, 2001):
            served.publish(newest[0].to_bytes(4) * 2500)
        turn(served)
        got, sent = [], messages(reader)
        for message in sent:
            got.append(message)
            if message[-4:] == (2000).to_bytes(4) or message[:4] == (2000).to_bytes(4):
                break
        # The first scene, some changes, and the scene as it is at last; 20 MB were published.
        assert sum(map(len, got)) < 2_500_000
        # Then changes again.
        served.publish(b"next")
        assert next(sent) == b"next"
    finally:
        reader.close()
        served.close()
    assert caplog.records == []


def test_a_reader_that_takes_nothing_for_long_is_dropped(server, monkeypatch):
    monkeypatch.setattr(live_server, "_PATIENCE", 0.05)
    with look_on(server):
        wait_for(lambda: server._connections)
        for _ in range(200):
            server.publish(bytes(100_000))
        wait_for(lambda: not server._connections)


def test_cells_of_notebooks_have_the_whole_address(exo):
    scene = Scene(exo, human=False)
    try:
        assert TOKEN in scene.url
        assert f'src="{scene.url}"' in scene.cell().data
    finally:
        scene.close()
