"""Sensors that the page follows: samples over WebSocket and UDP move the arm."""

from __future__ import annotations

import asyncio
import json
import secrets
from collections.abc import Callable
from contextlib import suppress
from typing import Any, cast

from nicegui import ui

from ...core.conventions import shoulder_angles
from ...core.optional_packages import optional
from ...view.scene.panels import ANGLES
from ..live_samples import LiveSamples
from .widgets import reveal

#: Port for datagrams that is tried first, and poses a second that are shown at most.
_PORT, _RATE = 9600, 30.0
#: Longest wait for a browser's picture, s.
_SLOW = 5.0


class LiveInput:
    """The stream that a page follows.

    Parameters
    ----------
    moved : callable
        Gets the angles of each pose that is shown, degrees.
    side : callable
        The arm's side.
    """

    def __init__(self, moved: Callable[..., None], side: Callable[[], str]) -> None:
        self._moved, self._side = moved, side
        self.key = secrets.token_urlsafe(9)
        self._samples: LiveSamples | None = None
        self._datagrams: asyncio.BaseTransport | None = None

    def build(self) -> None:
        """The strip, which is shown while sensors are followed."""
        self._strip = ui.element("section").classes("card strip live")
        self._strip.set_visibility(False)
        with self._strip:
            with ui.element("div").classes("about"):
                ui.label("Following sensors").classes("name")
                with ui.element("div").classes("row-of-buttons"):
                    ui.button("Stop", on_click=self.leave).props("outline dense no-caps")
                self._words = ui.label().classes("words").props('role="status"')
            self._where = ui.html("", sanitize=False).classes("where")
            self._timer = ui.timer(1.0 / _RATE, self._tick, active=False)

    async def start(self, url: str) -> None:
        """Take samples at ``url``, and over UDP."""
        self.leave()
        self._samples = LiveSamples(self.key, self._side())
        make = asyncio.get_running_loop().create_datagram_endpoint
        for port in (_PORT, 0):
            with suppress(OSError):
                self._datagrams, _ = await make(lambda: _Datagrams(self._take), ("127.0.0.1", port))
                break
        lines = [f"WebSocket  {url}"]
        if self._datagrams is not None:
            lines.append(f"UDP        127.0.0.1 port {self._datagrams.get_extra_info('sockname')[1]}")
        opening = json.dumps({"open": {}, "token": self.key, "rate": 100})
        lines += [f"first      {opening}", 'then       {"t": 0.00, "seq": 0, "quaternion_xyzw": [0, 0, 0, 1]}']
        self._where.set_content(f"<pre>{chr(10).join(lines)}</pre>")
        reveal(self._strip)
        self._timer.activate()

    def leave(self) -> None:
        """Follow no longer."""
        self.close()
        self._timer.deactivate()
        self._strip.set_visibility(False)

    def close(self) -> None:
        """Take no more samples."""
        if self._datagrams is not None:
            self._datagrams.close()
        self._samples = self._datagrams = None

    def _take(self, message: bytes | str) -> bytes | None:
        return None if self._samples is None else self._samples.take(message)

    async def serve(self, websocket: Any) -> None:
        """Take the samples of one sender until it leaves, or nobody follows."""
        gone = optional("app", "starlette.websockets").WebSocketDisconnect
        await websocket.accept()
        with suppress(gone):
            while self._samples is not None:
                answer = self._take(await websocket.receive_text())
                if answer is not None:
                    await websocket.send_text(answer.decode())
            await websocket.close(1008)

    async def _tick(self) -> None:
        if self._samples is None:
            return
        self._words.set_text(self._samples.words)
        pose = self._samples.newest()
        if pose is not None:
            angles = shoulder_angles(pose, self._side(), degrees=True).round(6).tolist()
            self._moved(**dict(zip(ANGLES, angles, strict=True)))
        # A browser that draws slowly is not sent more than it draws.
        with suppress(TimeoutError):
            await ui.run_javascript("true", timeout=_SLOW)


class _Datagrams(asyncio.DatagramProtocol):
    """Samples over UDP; answers go back to their sender."""

    def __init__(self, take: Callable[[bytes], bytes | None]) -> None:
        self._take = take

    def connection_made(self, transport: asyncio.BaseTransport) -> None:
        """Begin."""
        # Of another class in uvloop, with the same methods.
        self._transport = cast(asyncio.DatagramTransport, transport)

    def datagram_received(self, data: bytes, address: Any) -> None:
        """Take a message."""
        answer = self._take(data)
        if answer is not None:
            self._transport.sendto(answer, address)
