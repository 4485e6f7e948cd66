"""The cache of compiled code: no state of the disk stops a question, and processes may fill it together."""

import contextlib
import errno
import os
import shutil
import signal
import subprocess
import sys
import tempfile
import threading
import time
import warnings

import numba
import numpy as np
import pytest
from numba.core import event

from exo_pin.core import compiled, machine_code
from exo_pin.core.compiled import Kernel, compilations
from exo_pin.core.errors import CacheUnusable

try:
    from fcntl import LOCK_EX, flock
except ImportError:  # Windows
    flock = None

pytestmark = pytest.mark.skipif(
    os.environ.get("NUMBA_DISABLE_JIT", "0") not in ("", "0"), reason="with NUMBA_DISABLE_JIT there is no compiled form"
)


def half(x):
    return 0.5 * x


def ask():
    """Answers of kernels that are new to this process, and how many functions it compiled for that."""
    before = compilations()
    with compiled.mode("compiled"):
        inner = Kernel(half)
        outer = Kernel(type(half)(more.__code__, {"inner": inner}, "more"))
        assert (outer(3.0), inner(np.array([3.0]))[0]) == (2.5, 1.5)
    return compilations() - before


def more(x):
    return inner(x) + 1.0  # noqa: F821 - given by ask


@pytest.fixture
def cache(tmp_path, monkeypatch):
    """The files of a cache of its own, of a process that knows no other kernels."""
    monkeypatch.setattr(numba.config, "CACHE_DIR", str(tmp_path))
    monkeypatch.setattr(compiled, "_all", [])
    monkeypatch.setattr(machine_code, "_is_stored", True)
    return lambda: sorted(tmp_path.rglob("*.nb[ci]"))


def cut(path):
    os.truncate(path, path.stat().st_size // 2)


def empty(path):
    os.truncate(path, 0)


@pytest.mark.parametrize("damage", [cut, empty])
@pytest.mark.parametrize("kernel", ["half", "more"])
def test_what_cannot_be_read_is_compiled_anew_and_said_once(cache, monkeypatch, damage, kernel):
    assert (ask(), ask(), len(cache())) == (3, 0, 6)
    for path in cache():
        if path.name.startswith(f"test_machine_code.{kernel}"):
            damage(path)
    with pytest.warns(CacheUnusable, match="compiles it anew") as said:
        ask()
    assert len(said) == 1
    # The folder has been cleared: the next process stores all anew.
    monkeypatch.setattr(machine_code, "_is_stored", True)
    assert (ask(), ask(), len(cache())) == (3, 0, 6)


@pytest.mark.parametrize(("step", "number"), [("replace", errno.ENOSPC), ("mkdir", errno.EROFS)])
def test_what_cannot_be_written_stays_in_the_process(cache, monkeypatch, step, number):
    def fail(*_):
        raise OSError(number, os.strerror(number))

    monkeypatch.setattr(os, step, fail)
    with pytest.warns(CacheUnusable, match=os.strerror(number)) as said:
        ask()
    assert len(said) == 1
    assert "NUMBA_CACHE_DIR" in str(said[0].message)
    with warnings.catch_warnings():
        warnings.simplefilter("error")
        assert ask() == 3
    assert cache() == []


def test_no_other_folder_is_taken_for_one_that_cannot_be_written(cache, monkeypatch):
    def only_elsewhere(dir):
        if ".more" in str(dir):
            raise OSError(errno.EACCES, os.strerror(errno.EACCES))
        return temporary(dir=dir)

    temporary = tempfile.TemporaryFile
    monkeypatch.setattr(tempfile, "TemporaryFile", only_elsewhere)
    ask()
    assert [each.compiled.stats.cache_path is None for each in compiled.kernels()] == [False, True]
    monkeypatch.setattr(os, "access", lambda *_: False)
    compiled.kernels()[1].forget()
    with pytest.warns(CacheUnusable, match="Permission denied"):
        compiled.kernels()[1](1)


@pytest.mark.usefixtures("cache")
def test_code_of_other_versions_is_kept_for_a_day(tmp_path):
    machine_code.dispatcher(half, "a version", {}, list)
    (folder,) = tmp_path.glob("exo_pin/*.half")
    for name, age in (("young", 86_000), ("old", 87_000)):
        (folder / name).mkdir()
        os.utime(folder / name, (0.0, time.time() - age))
    before = set(folder.iterdir())
    machine_code.dispatcher(half, "another", {}, list)
    assert {path.name for path in before - set(folder.iterdir())} == {"old"}
    (new,) = set(folder.iterdir()) - before
    shutil.rmtree(new)
    # Another process may make the folder in the same instant.
    machine_code.dispatcher(half, "another", {}, new.mkdir)
    assert machine_code._is_stored


def test_a_kernel_that_cannot_be_compiled_leaves_the_cache_alone(cache):
    ask()
    with compiled.mode("compiled"), pytest.raises(numba.TypingError):
        Kernel(lambda x: x.nothing)(1.0)
    assert ask() == 0


@pytest.fixture
def hears_ctrl_c():
    """Python's own handler: a job in the background starts with SIGINT ignored."""
    before = signal.signal(signal.SIGINT, signal.default_int_handler)
    yield
    signal.signal(signal.SIGINT, before)


@pytest.mark.usefixtures("hears_ctrl_c", "cache")
def test_ctrl_c_waits_for_the_machine_code_and_a_second_does_not():
    class Stops(event.Listener):
        """Ctrl-C while Numba compiles."""

        def __init__(self, count):
            self.count, self.reached = count, []

        def on_start(self, event):
            for _ in range(self.count):
                signal.raise_signal(signal.SIGINT)
                self.reached.append("on")

        def on_end(self, event):
            pass

    def compile_for(made, value, stops):
        with event.install_listener("numba:compile", stops):
            machine_code.make_ready(made, (value,))

    made = machine_code.dispatcher(half, "a stamp", {}, list)
    twice = Stops(2)
    with pytest.raises(KeyboardInterrupt):
        compile_for(made, 1.0, twice)
    assert twice.reached == ["on"]
    assert made.signatures == []
    with pytest.raises(KeyboardInterrupt):
        compile_for(made, 1.0, Stops(1))
    assert made.signatures == [(numba.float64,)]
    assert signal.getsignal(signal.SIGINT) is signal.default_int_handler
    # A program's own handler stays.
    heard = []
    signal.signal(signal.SIGINT, lambda *_: heard.append(1))
    compile_for(made, 1, Stops(2))
    assert heard == [1, 1]


@pytest.mark.skipif(flock is None, reason="this system has no locks")
def test_another_process_is_waited_for_where_it_compiles_the_same(cache, tmp_path):
    ask()
    inner, outer = compiled.kernels()
    held = os.open(next(tmp_path.rglob("*.half.part/*")), os.O_RDONLY)
    flock(held, LOCK_EX)
    found = []
    with compiled.mode("compiled"):
        assert inner(3) == 1.5  # another form of the kernel that is locked
        job = threading.Thread(target=lambda: found.append(outer(3)), daemon=True)
        job.start()
        job.join(1.0)
        assert found == []
        os.close(held)
        job.join()
    assert found == [2.5]


QUERY = (
    "import numpy as np, exo_pin as ep\n"
    "from exo_pin.core.compiled import compilations\n"
    "exo = ep.load('prototype')\n"
    "found = exo.reaction_map(exo.pose(np.linspace(0, 60, 400), 10, 0))\n"
    "print(float(found.shoulder_force.sum()), compilations())\n"
)


def start(folder, *command):
    own = os.environ | {"PYTHONPATH": os.pathsep.join(sys.path), "NUMBA_CACHE_DIR": str(folder)}
    return subprocess.Popen(
        [sys.executable, *(command or ("-c", QUERY))],
        env=own | {"EXO_PIN_COMPILE": "compiled" if command else "auto"},
        stdout=subprocess.PIPE,
        stderr=subprocess.PIPE,
        text=True,
    )


def finished(process):
    """The sum of the forces, the number of compilations, and what was said."""
    out, said = process.communicate(timeout=600)
    assert process.returncode == 0, said
    total, count = out.split()
    return float(total), int(count), said


@pytest.mark.full
def test_processes_that_begin_together_share_a_new_cache(tmp_path):
    answers = [finished(process) for process in [start(tmp_path) for _ in range(3)]]
    assert len({total for total, *_ in answers}) == 1
    assert not any("CacheUnusable" in said for *_, said in answers)
    # They waited for one another: each function was compiled once, by one of them.
    assert sum(count for _, count, _ in answers) == len(list(tmp_path.rglob("*.nbc")))
    assert finished(start(tmp_path)) == (answers[0][0], 0, "")


@pytest.mark.parametrize("kills", [pytest.param(6, marks=pytest.mark.full), pytest.param(40, marks=pytest.mark.long)])
def test_a_killed_command_leaves_a_cache_that_answers(tmp_path, kills):
    rng = np.random.default_rng(10)
    for _ in range(kills):
        job = start(tmp_path)
        with contextlib.suppress(subprocess.TimeoutExpired):
            job.wait(rng.uniform(1.0, 10.0))
        job.kill()
        job.communicate()
    total, _, said = finished(start(tmp_path))
    assert "CacheUnusable" not in said
    assert finished(start(tmp_path)) == (total, 0, "")


@pytest.mark.parametrize("after", [pytest.param(after, marks=pytest.mark.full) for after in (0.5, 3.0)])
def test_ctrl_c_in_a_command_leaves_no_traceback(tmp_path, after):
    job = start(tmp_path, "-m", "exo_pin.cli", "reaction", "four-cables", "--flexion", "60")
    with contextlib.suppress(subprocess.TimeoutExpired):
        job.wait(after)
    job.send_signal(signal.SIGINT)
    _, said = job.communicate(timeout=600)
    assert job.returncode in (0, 130, -signal.SIGINT)
    assert "Traceback" not in said
    assert "ignored" not in said
    assert not list(tmp_path.rglob("*.tmp.*"))
