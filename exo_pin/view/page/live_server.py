"""The live page: a small web server in a thread of its own, on this machine only, for those who have its address.

The page shows a person's data, and any web site that is open in a browser of this machine can reach 127.0.0.1. So,
as in Jupyter:

- The address holds a random token (:data:`TOKEN`), which the page, its script and its socket all need.
- The name in the header ``Host`` must be one of this machine, whatever the port, which ``ssh -L`` may change. A foreign
  site whose name was made to point here (DNS rebinding) has its own name there.
- A header ``Origin``, which a browser sends with what another site has asked for, must name the same host and port.

Everything else gets status 403. A browser that reads slowly, or not at all, is sent the newest state and not the way
there: what waits for it is bounded, and dropped for the whole scene when it grows beyond. Nothing that a browser does
is reported on the terminal, which is the user's. All that a browser can ask for is a pose, by its sliders.
"""

from __future__ import annotations

import asyncio
import json
import math
import secrets
import socket
import threading
from collections import deque
from collections.abc import Callable
from concurrent.futures import ThreadPoolExecutor
from ipaddress import ip_address
from typing import Any

from tornado.httpserver import HTTPServer
from tornado.httputil import split_host_and_port
from tornado.iostream import StreamClosedError
from tornado.web import Application, RequestHandler
from tornado.websocket import WebSocketClosedError, WebSocketHandler

from ...core.errors import InvalidInput
from ...core.records import OneProcess
from .browser import live_page, viewer_script

#: Flexion, abduction and internal rotation, degrees.
Angles = tuple[float, float, float]
#: No slider goes further, degrees.
_FARTHEST = 360.0


class PoseRequests(OneProcess):
    """What browsers ask for, and what draws it.

    Parameters
    ----------
    draw : callable
        Draws the pose of three angles, degrees.
    """

    def __init__(self, draw: Callable[[Angles], None]) -> None:
        self._draw = draw
        self._newest: deque[Angles] = deque(maxlen=1)
        self._worker = ThreadPoolExecutor(1, "exo_pin sliders")

    def put(self, message: str | bytes) -> None:
        """Take a message of a browser, and return at once. What is no pose is ignored."""
        angles = _angles(message)
        if angles is not None:
            self._newest.append(angles)
            self._worker.submit(self._work)

    def finish(self) -> None:
        """Wait until all is drawn."""
        self._worker.submit(int).result()

    def _work(self) -> None:
        # Where several were asked for meanwhile, the newest is drawn once.
        if self._newest:
            self._draw(self._newest.pop())


def _angles(message: str | bytes) -> Angles | None:
    """The angles of ``{"pose": [60, 30, 0]}``."""
    try:
        first, second, third = (float(value) for value in json.loads(message)["pose"])
    except (ValueError, TypeError, KeyError, RecursionError):
        return None
    angles = (first, second, third)
    return angles if all(math.isfinite(value) and abs(value) <= _FARTHEST for value in angles) else None


#: Where the search for a free port starts, and how many are tried.
FIRST_PORT, _PORTS = 7000, 100
#: Part of every address. One for the process, so that an open page finds the scene that is served next on its port.
TOKEN = secrets.token_urlsafe(24)
#: Bytes of changes that wait for a browser; beyond it gets the whole scene instead.
_MOST_WAITING = 2**18
#: Seconds in which a browser has to take what it is sent.
_PATIENCE = 120.0
#: Bytes of a request: nobody sends more than three angles.
_LARGEST_REQUEST = 2**14


class _Guarded(RequestHandler):
    """Answers those only who have the address; see the module's description."""

    def prepare(self) -> None:
        """Refuse a request that may not be answered."""
        token = self.path_args[0] if self.path_args else ""
        is_here = is_of_this_machine(self.request.host, self.request.headers.get("Origin"))
        if not (secrets.compare_digest(token.encode(), TOKEN.encode()) and is_here):
            self.set_status(403)
            self.finish("Not allowed. Open the whole address that exo_pin has given, with its token, on this machine.")

    def set_default_headers(self) -> None:
        """Keep the address from other sites and the page from the browser's cache."""
        self.set_header("Referrer-Policy", "no-referrer")
        self.set_header("X-Content-Type-Options", "nosniff")
        self.set_header("Cache-Control", "no-store")

    def log_exception(self, *_: Any) -> None:
        """Leave the terminal alone."""


def is_of_this_machine(host: str, origin: str | None) -> bool:
    """Whether a request names this machine, and comes from a page of the same host and port if from any.

    Parameters
    ----------
    host, origin : str
        Its headers of these names; None without ``Origin``.
    """
    name = split_host_and_port(host.lower())[0].strip("[]")
    try:
        is_local = name == "localhost" or ip_address(name).is_loopback
    except ValueError:
        return False
    return is_local and (origin is None or origin.lower().partition("://")[2] == host.lower())


class _Page(_Guarded):
    """Gives out one text."""

    def initialize(self, text: Callable[[], str], kind: str) -> None:
        """Store the settings of this address."""
        self._text, self._kind = text, kind

    def get(self, _: str) -> None:
        """Answer a browser."""
        self.set_header("Content-Type", f"{self._kind}; charset=utf-8")
        self.write(self._text())


class Reader(OneProcess):
    """What waits for one browser: the whole scene, then every change, or several at once if it is slow.

    Parameters
    ----------
    whole : callable
        Gives the whole scene.
    """

    def __init__(self, whole: Callable[[], bytes]) -> None:
        self._whole, self._ready = whole, asyncio.Event()
        self.restart()

    def restart(self) -> None:
        """Send the whole scene next."""
        self._waiting: list[bytes] | None = None
        self._ready.set()

    def push(self, commands: bytes) -> None:
        """Send a run of commands after all that waits; the whole scene where that is too much."""
        if self._waiting is not None:
            self._waiting.append(commands)
            if sum(map(len, self._waiting)) > _MOST_WAITING:
                self._waiting = None
        self._ready.set()

    async def take(self) -> bytes:
        """All that waits, once there is something."""
        await self._ready.wait()
        self._ready.clear()
        found = self._whole() if self._waiting is None else b"".join(self._waiting)
        self._waiting = []
        return found


class _Socket(_Guarded, WebSocketHandler):
    """A browser that looks on."""

    def initialize(
        self, snapshot: Callable[[], bytes], connections: set[Any], receive: Callable[[str | bytes], None]
    ) -> None:
        """Store the settings of this address."""
        self.reader, self._connections, self._receive = Reader(snapshot), connections, receive
        self._sending: asyncio.Task[None] | None = None

    def open(self, *_: str, **__: str) -> None:
        """Greet a browser with the whole scene."""
        self._connections.add(self)
        self._sending = asyncio.create_task(self._send())

    async def _send(self) -> None:
        try:
            while True:
                await asyncio.wait_for(self.write_message(await self.reader.take(), binary=True), _PATIENCE)
        except (WebSocketClosedError, StreamClosedError):  # left, and not yet forgotten
            self._connections.discard(self)
        except TimeoutError:
            # Not close(), which would wait for an answer.
            stream = getattr(self.ws_connection, "stream", None)
            if stream is not None:
                stream.close()

    def on_message(self, message: str | bytes) -> None:
        """Hand on what the page asks for."""
        self._receive(message)

    def on_close(self) -> None:
        """Forget a browser that has left."""
        self._connections.discard(self)
        if self._sending is not None:  # it may leave before it is open
            self._sending.cancel()


class Server(OneProcess):
    """Serves the page and the scene on 127.0.0.1, to those who have :attr:`url`.

    Parameters
    ----------
    snapshot : callable
        Gives the whole scene as a run of commands that replace what was there; called from the server's thread.
    port : int, optional
        The first port to try, :data:`FIRST_PORT` if left out; a used one moves on to the next. 0 takes any.
    receive : callable, optional
        Takes the messages of browsers, in the server's thread, and returns at once; left out, they are ignored.

    Raises
    ------
    InvalidInput
        If the port is no port, or none of the ports from there on is free.
    """

    def __init__(
        self,
        snapshot: Callable[[], bytes],
        port: int | None = None,
        receive: Callable[[str | bytes], None] = lambda _: None,
    ) -> None:
        first = FIRST_PORT if port is None else port
        if isinstance(first, bool) or not isinstance(first, int) or not 0 <= first <= 65535:
            raise InvalidInput(f"expected port to be a whole number from 0 to 65535, got {port!r}")
        # For every connection: otherwise some megabytes of old changes wait in the kernel for a slow browser.
        listening = free_socket(first, _MOST_WAITING)
        listening.setblocking(False)
        self.port: int = listening.getsockname()[1]
        self._connections: set[_Socket] = set()
        self._loop = asyncio.new_event_loop()
        started = threading.Event()
        shared = {"snapshot": snapshot, "connections": self._connections, "receive": receive}
        application = Application(
            [
                (r"/([^/]*)/", _Page, {"text": live_page, "kind": "text/html"}),
                (r"/([^/]*)/viewer\.js", _Page, {"text": viewer_script, "kind": "text/javascript"}),
                (r"/([^/]*)/socket", _Socket, shared),
            ],
            default_handler_class=_Guarded,
            log_function=lambda _: None,
            websocket_max_message_size=_LARGEST_REQUEST,
        )

        def run() -> None:
            asyncio.set_event_loop(self._loop)
            self._loop.set_exception_handler(lambda *_: None)
            self._http = HTTPServer(application, max_body_size=_LARGEST_REQUEST, max_header_size=_LARGEST_REQUEST)
            self._http.add_socket(listening)
            self._loop.call_soon(started.set)
            run_until_stopped(self._loop)

        self._thread = threading.Thread(target=run, name="exo_pin view", daemon=True)
        self._thread.start()
        started.wait()

    @property
    def url(self) -> str:
        """Address of the page, with the token."""
        return f"http://127.0.0.1:{self.port}/{TOKEN}/"

    def publish(self, commands: bytes) -> None:
        """Send a run of commands to everyone who looks on; returns at once."""
        if self._connections:
            self._loop.call_soon_threadsafe(self._send, commands)

    def close(self) -> None:
        """Stop serving."""
        if self._thread.is_alive():
            asyncio.run_coroutine_threadsafe(self._stop(), self._loop)
            self._thread.join()

    def _send(self, commands: bytes) -> None:
        for connection in list(self._connections):
            connection.reader.push(commands)

    async def _stop(self) -> None:
        self._http.stop()
        for connection in list(self._connections):
            connection.close()
        # Another turn of the loop, so that the browsers get the message before their connections close.
        await asyncio.sleep(0.05)
        await self._http.close_all_connections()
        self._loop.stop()


def free_socket(first: int, waiting: int | None = None) -> socket.socket:
    """A socket on 127.0.0.1 at the first free port of a hundred, whose connections let so many bytes wait.

    Raises
    ------
    InvalidInput
        If no port is free.
    """
    last = min(first + _PORTS, 65536) if first else 1
    for port in range(first, last):
        found = socket.socket()
        try:
            found.setsockopt(socket.SOL_SOCKET, socket.SO_REUSEADDR, 1)
            if waiting is not None:
                found.setsockopt(socket.SOL_SOCKET, socket.SO_SNDBUF, waiting)
            found.bind(("127.0.0.1", port))
            found.listen(64)
        except OSError:
            found.close()
            continue
        return found
    raise InvalidInput(f"no free port from {first} to {last - 1}")


def run_until_stopped(loop: asyncio.AbstractEventLoop) -> None:
    """Run an event loop, and cancel what is left when it stops."""
    loop.run_forever()
    left = asyncio.all_tasks(loop)
    for task in left:
        task.cancel()
    if left:
        loop.run_until_complete(asyncio.gather(*left, return_exceptions=True))
    loop.close()
