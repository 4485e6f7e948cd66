"""The package's own scene within the page: its viewer in a frame, fed over a socket of the same server.

A browser that reads slowly is sent the newest state and not the way there, as by the live page.
"""

from __future__ import annotations

import asyncio
from collections.abc import Callable
from contextlib import suppress
from typing import Any

from ...core.optional_packages import optional
from ...view import Scene
from ...view.page.live_server import Reader


def call_in(loop: asyncio.AbstractEventLoop, function: Callable[..., Any], *arguments: Any) -> None:
    """Call a function in the server's loop, from any thread; not at all where the server has ended."""
    with suppress(RuntimeError):
        loop.call_soon_threadsafe(function, *arguments)


class SceneFeed:
    """Browsers that look at a scene, which may be another one later.

    Parameters
    ----------
    receive : callable
        Gets what a browser sends, in the server's loop.
    """

    def __init__(self, receive: Callable[[str], None]) -> None:
        self._receive, self._loop = receive, asyncio.get_running_loop()
        self._readers: set[Reader] = set()
        self._scene: Scene | None = None
        self._whole: Callable[[], bytes] = bytes

    def show(self, scene: Scene) -> None:
        """Show another scene, from any thread."""
        if self._scene is not None:
            self._scene.close()
        self._scene, self._whole = scene, scene.attach(self._publish)
        call_in(self._loop, self._restart)

    async def serve(self, websocket: Any) -> None:
        """Answer one browser until it leaves."""
        gone = optional("app", "starlette.websockets").WebSocketDisconnect
        await websocket.accept()
        reader = Reader(lambda: self._whole())
        self._readers.add(reader)

        async def send() -> None:
            while True:
                await websocket.send_bytes(await reader.take())

        sending = asyncio.create_task(send())
        try:
            with suppress(gone):
                while True:
                    self._receive(await websocket.receive_text())
        finally:
            self._readers.discard(reader)
            sending.cancel()
            with suppress(asyncio.CancelledError, gone, RuntimeError):
                await sending

    def _restart(self) -> None:
        for reader in self._readers:
            reader.restart()

    def _publish(self, commands: bytes) -> None:
        call_in(self._loop, self._push, commands)

    def _push(self, commands: bytes) -> None:
        for reader in self._readers:
            reader.push(commands)
