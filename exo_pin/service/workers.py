"""Processes that answer: each one question at a time, ended and started again where it takes too long.

Physics computes while it holds Python's lock, and nothing can end a thread; so questions are answered by processes,
which begin anew (no fork of a process with threads), have their kernels compiled before the first question, and end
with the process that has started them, however that ends.
"""

from __future__ import annotations

import asyncio
import contextlib
import multiprocessing
import resource
import signal
from concurrent.futures import ThreadPoolExecutor
from multiprocessing.connection import Connection
from typing import Any

from ..core.compiled import mode
from ..core.progress import end_with_parent
from .live_answers import respond
from .problems import LOG, problem, reply

_NEW = multiprocessing.get_context("spawn")
#: The name of what streams send.
LIVE = "live"
#: Longest preparation of a process, s: kernels of a fresh installation take a minute or two.
_PREPARATION = 900.0
_POSE = {"poses": {"flexion": 40.0}}
#: Questions whose kernels are compiled in a new process, of one design with cables and one with muscles.
_PREPARED: dict[str, dict[str, Any]] = {
    "reaction": {"poses": {"flexion": [20.0, 40.0, 60.0]}},
    "uncertainty": _POSE,
    "inverse_kinematics": _POSE,
    "singularity": _POSE,
    "accuracy": _POSE,
    "workspace": {"poses": 60.0},
}


class Busy(Exception):
    """As many questions wait as may."""


class Workers:
    """A number of processes, and who waits for them.

    Parameters
    ----------
    count : int
        Number of processes.
    seconds : float
        Time that an answer may take, s.
    waiting : int
        Most questions that wait.
    memory : int
        Of each process for its answers, MB.
    """

    def __init__(self, count: int, seconds: float, waiting: int, memory: int) -> None:
        self.seconds, self.most, self.memory = seconds, waiting, memory
        self.waiting = self.restarts = 0
        self._free: asyncio.Queue[int] = asyncio.Queue()
        self._threads = ThreadPoolExecutor(count, "exo_pin answers")
        self._all = [_Worker(memory) for _ in range(count)]
        for place, each in enumerate(self._all):
            each.prepare()
            self._free.put_nowait(place)

    @property
    def busy(self) -> int:
        """Processes that work on an answer."""
        return len(self._all) - self._free.qsize()

    async def answer(self, name: str, body: bytes) -> tuple[int, bytes]:
        """Status and JSON of an answer.

        Raises
        ------
        Busy
            If as many wait as may.
        """
        if self.waiting >= self.most:
            raise Busy(f"{self.waiting} questions wait: try again")
        self.waiting += 1
        try:
            place = await self._free.get()
        finally:
            self.waiting -= 1
        work = asyncio.get_running_loop().run_in_executor(self._threads, self._ask, place, name, body)
        # The process is free when its thread has ended, not when who has asked goes away.
        work.add_done_callback(lambda _: self._free.put_nowait(place))
        return await asyncio.shield(work)

    def _ask(self, place: int, name: str, body: bytes) -> tuple[int, bytes]:
        try:
            if (found := self._all[place].ask(name, body, self.seconds)) is not None:
                return found
            detail = f"the answer needs more than {self.memory} MB: ask fewer poses"
            status, kind = 422, "MemoryLimit"
        except TimeoutError:
            detail = f"the answer needs more than {self.seconds:g} s: ask fewer poses"
            status, kind = 422, "TimeLimit"
        except (EOFError, OSError):
            LOG.error("a process has ended while it answered: %s", name)
            status, kind, detail = 500, "InternalFault", "a fault of exo_pin, which its log describes"
        self._all[place].end()
        self._all[place] = _Worker(self.memory)
        self.restarts += 1
        return status, problem(status, kind, detail)

    def close(self) -> None:
        """End all processes."""
        for each in self._all:
            each.end()
        self._threads.shutdown(wait=True, cancel_futures=True)


class _Worker:
    """A process and the pipe to it, for one thread at a time."""

    def __init__(self, memory: int) -> None:
        self._pipe, inner = _NEW.Pipe()
        self._process = _NEW.Process(target=_work, args=(inner, memory), daemon=True)
        self._process.start()
        inner.close()
        self._is_ready = False

    def prepare(self) -> None:
        """Wait until its kernels are compiled."""
        if not self._is_ready:
            if not self._pipe.poll(_PREPARATION):
                raise EOFError
            self._pipe.recv()
            self._is_ready = True

    def ask(self, name: str, body: bytes, seconds: float) -> tuple[int, bytes] | None:
        """Status and JSON of an answer; None where memory does not suffice, and the process has ended."""
        self.prepare()
        self._pipe.send((name, body))
        if not self._pipe.poll(seconds):
            raise TimeoutError
        found: tuple[int, bytes] | None = self._pipe.recv()
        return found

    def end(self) -> None:
        self._process.kill()
        self._process.join()
        self._pipe.close()


def _work(pipe: Connection, memory: int) -> None:
    """The process: prepare, and answer until the pipe closes."""
    # Ctrl-C reaches the whole group; the process that has started this one ends it.
    signal.signal(signal.SIGINT, signal.SIG_IGN)
    end_with_parent()
    with mode("compiled"), contextlib.suppress(EOFError, OSError):
        prepare()
        _limit_memory(memory)
        pipe.send(None)
        while (found := _reply(*pipe.recv())) is not None:
            pipe.send(found)
        pipe.send(None)


def _reply(name: str, body: bytes) -> tuple[int, bytes] | None:
    # What is left of such an answer may fill the memory that later ones need: the process ends.
    with contextlib.suppress(MemoryError):
        return respond(body) if name == LIVE else reply(name, body)
    return None


def prepare() -> None:
    """Compile, or read from the cache, what the usual questions need."""
    import msgspec

    for design in ("four-cables", "prototype"):
        for name, arguments in _PREPARED.items():
            reply(name, msgspec.json.encode({"design": design, **arguments}))


def _limit_memory(memory: int) -> None:
    with open("/proc/self/statm", encoding="ascii") as file:
        used = int(file.read().split()[0]) * resource.getpagesize()
    resource.setrlimit(resource.RLIMIT_AS, (used + memory * 2**20, resource.RLIM_INFINITY))
