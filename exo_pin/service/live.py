"""Live streams over WebSocket and UDP."""

from __future__ import annotations

import asyncio
import time
from collections.abc import Awaitable, Callable, Coroutine
from typing import Any, cast

from starlette.routing import WebSocketRoute
from starlette.websockets import WebSocket, WebSocketDisconnect

from .live_stream import LiveStream
from .options import ServiceOptions
from .problems import problem
from .sample_poses import opening_of
from .workers import Workers

#: A stream over UDP ends after so many s without a message, and a connection without an opening.
_SILENCE = 10.0


class Live:
    """All live streams of a service.

    Parameters
    ----------
    workers : Workers
        The process that computes for them.
    options : ServiceOptions
        Token, most streams.
    """

    def __init__(self, workers: Workers, options: ServiceOptions) -> None:
        self.workers, self._options = workers, options
        self.open = 0
        self.route = WebSocketRoute("/live", self._websocket)

    async def begin(self, message: bytes | str, send: Callable[[bytes], Awaitable[None]]) -> LiveStream | None:
        """The stream that a first message opens; None where it opens none, which its sender is told."""
        opening = opening_of(message, self._options.token)
        if self.open >= self._options.live:
            opening = problem(503, "Busy", "as many streams are open as may")
        if isinstance(opening, bytes):
            await send(opening)
            return None
        self.open += 1
        stream, opened = LiveStream(self.workers, send), False
        try:
            opened = await stream.open(opening)
        finally:
            if not opened:
                await self.end(stream)
        return stream if opened else None

    async def end(self, stream: LiveStream) -> None:
        """End a stream that has begun."""
        self.open -= 1
        await stream.close()

    async def _websocket(self, socket: WebSocket) -> None:
        await socket.accept()
        try:
            async with asyncio.timeout(_SILENCE):
                first = await _received(socket)
            stream = await self.begin(first, lambda body: socket.send_text(body.decode()))
            if stream is not None:
                try:
                    while True:
                        stream.take(await _received(socket))
                finally:
                    await self.end(stream)
            await socket.close(1008)
        except TimeoutError:
            await socket.close(1008)
        except WebSocketDisconnect:
            pass

    async def listen(self) -> asyncio.DatagramTransport | None:
        """Take datagrams, if the options have a port for them."""
        if self._options.udp is None:
            return None
        at = (self._options.host, self._options.udp)
        transport, _ = await asyncio.get_running_loop().create_datagram_endpoint(lambda: _Datagrams(self), at)
        return transport


async def _received(socket: WebSocket) -> bytes | str:
    message = await socket.receive()
    if message["type"] == "websocket.disconnect":
        raise WebSocketDisconnect(message.get("code", 1000))
    found: bytes | str = message.get("text") or message.get("bytes") or b""
    return found


class _Datagrams(asyncio.DatagramProtocol):
    """Streams over UDP, one a sender's address; an opening begins a new one."""

    def __init__(self, live: Live) -> None:
        self._live = live
        self._streams: dict[Any, LiveStream] = {}
        self._heard: dict[Any, float] = {}
        self._tasks: set[asyncio.Task[None]] = set()
        self._is_full = False

    def connection_made(self, transport: asyncio.BaseTransport) -> None:
        """Begin to take datagrams."""
        # Of another class in uvloop, with the same methods.
        self._transport = cast(asyncio.DatagramTransport, transport)
        self._run(self._end_silent())

    def pause_writing(self) -> None:
        """Send no more for now."""
        self._is_full = True

    def resume_writing(self) -> None:
        """Send again."""
        self._is_full = False

    def connection_lost(self, _: Exception | None) -> None:
        """End all streams with the service, whose process ends."""
        for each in self._tasks:
            each.cancel()

    def datagram_received(self, data: bytes, address: Any) -> None:
        """Take an opening or a sample."""
        self._heard[address] = time.monotonic()
        if b'"open"' in data:
            self._run(self._begin(data, address))
        elif address in self._streams:
            self._streams[address].take(data)
        else:
            self._transport.sendto(problem(410, "Closed", 'no stream is open: send {"open": ...} first'), address)
            del self._heard[address]

    def _run(self, work: Coroutine[Any, Any, None]) -> None:
        task = asyncio.get_running_loop().create_task(work)
        self._tasks.add(task)
        task.add_done_callback(self._tasks.discard)

    async def _begin(self, data: bytes, address: Any) -> None:
        async def send(body: bytes) -> None:
            # Of what the network does not take, nothing waits.
            if not self._is_full:
                self._transport.sendto(body, address)

        await self._end(address)
        stream = await self._live.begin(data, send)
        if stream is not None:
            self._streams[address] = stream

    async def _end(self, address: Any) -> None:
        stream = self._streams.pop(address, None)
        if stream is not None:
            await self._live.end(stream)

    async def _end_silent(self) -> None:
        while True:
            await asyncio.sleep(1.0)
            for address, heard in list(self._heard.items()):
                if time.monotonic() - heard > _SILENCE:
                    del self._heard[address]
                    await self._end(address)
