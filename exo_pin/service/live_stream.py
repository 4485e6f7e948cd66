"""One live stream between its sender and the process that computes: nothing waits for a slow reader.

A sample that comes while the one before is being answered waits, and a newer one takes its place (``skipped``). An
answer that comes while the reader is slow waits among a few, of which the oldest goes (``dropped``).
"""

from __future__ import annotations

import asyncio
import secrets
import time
from collections import deque
from collections.abc import Awaitable, Callable
from typing import Any

import msgspec

from ..core.errors import ExoPinError
from .live_answers import Request
from .problems import problem
from .samples import Opening, Sample, Stream
from .workers import LIVE, Busy, Workers

#: Answers that wait for a reader.
_WAITING = 8
#: Gaps and late samples that an answer names; of more it has the last ones.
_NAMED = 20


class LiveStream:
    """A stream after its opening.

    Parameters
    ----------
    workers : Workers
        The process that computes; it answers samples of all streams in turn.
    send : callable
        Sends a message to the reader, and waits while it is slow.
    """

    def __init__(self, workers: Workers, send: Callable[[bytes], Awaitable[None]]) -> None:
        self._workers, self._send = workers, send
        self._name = secrets.token_hex(8)
        self._stream = Stream()
        self._newest: tuple[Sample, int | None, float] | None = None
        self._answers: deque[dict[str, Any]] = deque(maxlen=_WAITING)
        self._came, self._made = asyncio.Event(), asyncio.Event()
        self._lost: deque[tuple[int, int]] = deque(maxlen=_NAMED)
        self._late: deque[int] = deque(maxlen=_NAMED)
        self.skipped = self.dropped = self.answered = 0
        self._tasks: list[asyncio.Task[None]] = []

    async def open(self, opening: Opening) -> bool:
        """Begin; False where the question is wrong, which the reader has been told."""
        try:
            self._stream = Stream(opening.rate)
        except ExoPinError as error:
            await self._send(problem(422, type(error).__name__, str(error)))
            return False
        status, body = await self._ask(Request(self._name, opening))
        await self._send(body)
        if status == 200:
            self._tasks = [asyncio.create_task(each()) for each in (self._answer_all, self._send_all)]
        return status == 200

    def take(self, message: bytes | str) -> None:
        """Take a sample, and return at once."""
        arrived = time.monotonic()
        try:
            sample = msgspec.json.decode(message, type=Sample)
            found = self._stream.take(sample, arrived)
        except (msgspec.DecodeError, msgspec.ValidationError, UnicodeError, ExoPinError) as error:
            self._put(problem(422, type(error).__name__, f"no sample: {error}"))
            return
        if found.lost is not None:
            self._lost.append(found.lost)
        if found.is_late:
            if found.seq is not None:
                self._late.append(found.seq)
            return
        self.skipped += self._newest is not None
        self._newest = (sample, found.seq, found.delay)
        self._came.set()

    async def close(self) -> None:
        """End."""
        for each in self._tasks:
            each.cancel()
        await asyncio.gather(*self._tasks, return_exceptions=True)
        await self._ask(Request(self._name))

    async def _ask(self, request: Request) -> tuple[int, bytes]:
        """Status and JSON of an answer, or of a problem where as many wait as may."""
        try:
            return await self._workers.answer(LIVE, msgspec.json.encode(request))
        except Busy as error:
            return 503, problem(503, "Busy", str(error))

    async def _answer_all(self) -> None:
        while True:
            await self._came.wait()
            self._came.clear()
            assert self._newest is not None
            (sample, seq, delay), self._newest = self._newest, None
            _, body = await self._ask(Request(self._name, sample=sample, seq=seq, delay=delay))
            self.answered += 1
            self._put(body)

    def _put(self, body: bytes) -> None:
        self.dropped += len(self._answers) == _WAITING
        self._answers.append(msgspec.json.decode(body))
        self._made.set()

    def _since_the_last(self) -> dict[str, Any]:
        """What has happened since the last answer that was sent; answers that are dropped take no news with them."""
        found = {"lost": list(self._lost), "late": list(self._late), "skipped": self.skipped, "dropped": self.dropped}
        self._lost.clear()
        self._late.clear()
        self.skipped = self.dropped = 0
        return found

    async def _send_all(self) -> None:
        while True:
            await self._made.wait()
            self._made.clear()
            while self._answers:
                answer = self._answers.popleft()
                if "seq" in answer:
                    answer |= self._since_the_last()
                await self._send(msgspec.json.encode(answer))
