"""Processes that answer: how they begin, how many wait, and how they are ended and replaced."""

import asyncio
import contextlib
import json
import multiprocessing
import os
import resource
import signal
import threading
import time

import pytest

from exo_pin.service import workers
from exo_pin.service.workers import Busy, Workers

MEMORY = 100
WRONG, LONG, LARGE = b'{"design": "nothing"}', b"what takes a minute", b"what takes two gigabytes"


@pytest.mark.full
@pytest.mark.filterwarnings("ignore:.*multi-threaded:DeprecationWarning")
def test_processes_are_ended_where_they_take_too_much_and_begin_again(monkeypatch, tmp_path, caplog):
    # Copies of this process know all modules, so that what they would compile first is not asked.
    monkeypatch.setattr(workers, "_NEW", multiprocessing.get_context("fork"))
    monkeypatch.setattr(workers, "mode", lambda _: contextlib.nullcontext())

    def prepare():
        time.sleep(0.1)
        names = [each.name for each in threading.enumerate()]
        told = [signal.getsignal(signal.SIGINT) == signal.SIG_IGN, "exo_pin parent" in names]
        (tmp_path / str(os.getpid())).write_text(json.dumps(told))

    monkeypatch.setattr(workers, "prepare", prepare)
    reply = workers.reply

    def slow_or_large(question, body):
        if body == LONG:
            time.sleep(60.0)
        # One block: the copy of this process has what this one has freed, which may be some hundred megabytes.
        return (422, bytes(2**31)) if body == LARGE else reply(question, body)

    monkeypatch.setattr(workers, "reply", slow_or_large)
    made = Workers(2, 60.0, 1, MEMORY)
    begun = {int(path.name) for path in tmp_path.iterdir()}
    assert [json.loads((tmp_path / str(pid)).read_text()) for pid in begun] == [[True, True]] * 2

    async def said(question, body):
        status, text = await made.answer(question, body)
        return status, *[json.loads(text)[name] for name in ("kind", "detail")]

    async def ask():
        assert (await said("check", WRONG))[:2] == (422, "UnknownName")
        assert (made.busy, made.waiting, made.restarts) == (0, 0, 0)
        found = [await said("check", LARGE)]
        assert made.restarts == 1
        made.seconds = 0.2
        found.append(await said("workspace", LONG))
        assert made.restarts == 2
        made.seconds = 60.0
        asked = [asyncio.create_task(said("workspace", LONG)) for _ in range(2)]
        asked.append(asyncio.create_task(said("check", WRONG)))
        while not made.waiting:
            await asyncio.sleep(0.0)
        assert (made.busy, made.waiting) == (2, 1)
        with pytest.raises(Busy, match="1 questions wait: try again"):
            await made.answer("check", WRONG)
        # Who has asked goes away; the process works on.
        asked[0].cancel()
        await asyncio.sleep(0.0)
        assert (made.busy, made.waiting) == (2, 1)
        for each in multiprocessing.active_children():
            os.kill(each.pid, signal.SIGKILL)
        found += [await each for each in asked[1:]]
        # A process that is never ready has ended, too.
        monkeypatch.setattr(workers, "_PREPARATION", 0.0)
        monkeypatch.setattr(workers, "prepare", lambda: time.sleep(60.0))
        made.seconds = 0.2
        await asyncio.gather(*[said("workspace", LONG) for _ in range(2)])
        found.append(await said("check", WRONG))
        return found

    try:
        for pid in begun:
            soft, hard = resource.prlimit(pid, resource.RLIMIT_AS)
            with open(f"/proc/{pid}/statm", encoding="ascii") as file:
                used = int(file.read().split()[0]) * resource.getpagesize()
            assert (soft - used) / 2**20 == pytest.approx(MEMORY, abs=1.0)
            assert hard == resource.RLIM_INFINITY
        large, late, ended, wrong, unready = asyncio.run(ask())
    finally:
        made.close()
    assert large == (422, "MemoryLimit", "the answer needs more than 100 MB: ask fewer poses")
    assert late == (422, "TimeLimit", "the answer needs more than 0.2 s: ask fewer poses")
    assert ended == unready == (500, "InternalFault", "a fault of exo_pin, which its log describes")
    assert wrong[1] == "UnknownName"
    assert made.restarts == 7
    assert caplog.messages[0] == "a process has ended while it answered: workspace"
    assert multiprocessing.active_children() == []
