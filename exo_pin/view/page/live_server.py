"""The live page: a small web server in a thread of its own, on this machine only."""

from __future__ import annotations

import asyncio
import socket
import threading
from collections.abc import Callable
from typing import Any

from tornado.httpserver import HTTPServer
from tornado.web import Application, RequestHandler
from tornado.websocket import WebSocketClosedError, WebSocketHandler

from ...core.errors import InvalidInput
from ...core.records import OneProcess
from .page_overlay import live_page, viewer_script

__all__ = ["FIRST_PORT", "Server"]

#: Where the search for a free port starts, and how many are tried.
FIRST_PORT, _PORTS = 7000, 100


class _Page(RequestHandler):
    """Gives out one text."""

    def initialize(self, text: Callable[[], str], kind: str) -> None:
        """Store the settings of this address."""
        self._text, self._kind = text, kind

    def get(self) -> None:
        """Answer a browser."""
        self.set_header("Content-Type", f"{self._kind}; charset=utf-8")
        self.set_header("Cache-Control", "no-store")
        self.write(self._text())


class _Socket(WebSocketHandler):
    """A browser that looks on: it gets the scene, then every change."""

    def initialize(self, snapshot: Callable[[], bytes], connections: set[Any]) -> None:
        """Store the settings of this address."""
        self._snapshot, self._connections = snapshot, connections

    def open(self, *_: str, **__: str) -> None:
        """Greet a browser with the whole scene."""
        self._connections.add(self)
        self.write_message(self._snapshot(), binary=True)

    def on_message(self, message: str | bytes) -> None:
        """Messages of browsers are ignored."""

    def on_close(self) -> None:
        """Forget a browser that has left."""
        self._connections.discard(self)


class Server(OneProcess):
    """Serves the page and the scene on 127.0.0.1.

    Parameters
    ----------
    snapshot : callable
        Gives the whole scene as a run of commands; called from the server's thread.
    port : int, optional
        The first port to try, :data:`FIRST_PORT` if left out; a used one moves on to the next. 0 takes any.

    Raises
    ------
    InvalidInput
        If the port is no port, or none of the ports from there on is free.
    """

    def __init__(self, snapshot: Callable[[], bytes], port: int | None = None) -> None:
        first = FIRST_PORT if port is None else port
        if isinstance(first, bool) or not isinstance(first, int) or not 0 <= first <= 65535:
            raise InvalidInput(f"expected port to be a whole number from 0 to 65535, got {port!r}")
        listening = _free_socket(first)
        self.port: int = listening.getsockname()[1]
        self._connections: set[_Socket] = set()
        self._loop = asyncio.new_event_loop()
        started = threading.Event()
        application = Application(
            [
                (r"/", _Page, {"text": live_page, "kind": "text/html"}),
                (r"/viewer.js", _Page, {"text": viewer_script, "kind": "text/javascript"}),
                (r"/socket", _Socket, {"snapshot": snapshot, "connections": self._connections}),
            ],
            log_function=lambda _: None,
        )

        def run() -> None:
            asyncio.set_event_loop(self._loop)
            self._http = HTTPServer(application)
            self._http.add_socket(listening)
            self._loop.call_soon(started.set)
            self._loop.run_forever()
            self._loop.close()

        self._thread = threading.Thread(target=run, name="exo_pin view", daemon=True)
        self._thread.start()
        started.wait()

    @property
    def url(self) -> str:
        """Address of the page."""
        return f"http://127.0.0.1:{self.port}/"

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
            try:
                connection.write_message(commands, binary=True)
            except WebSocketClosedError:  # left, and not yet forgotten
                self._connections.discard(connection)

    async def _stop(self) -> None:
        self._http.stop()
        for connection in list(self._connections):
            connection.close()
        # Another turn of the loop, so that the browsers get the message before their connections close.
        await asyncio.sleep(0.05)
        await self._http.close_all_connections()
        self._loop.stop()


def _free_socket(first: int) -> socket.socket:
    last = min(first + _PORTS, 65536) if first else 1
    for port in range(first, last):
        found = socket.socket()
        try:
            found.setsockopt(socket.SOL_SOCKET, socket.SO_REUSEADDR, 1)
            found.bind(("127.0.0.1", port))
            found.listen(64)
        except OSError:
            found.close()
            continue
        found.setblocking(False)
        return found
    raise InvalidInput(f"no free port from {first} to {last - 1}")
