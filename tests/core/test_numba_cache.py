"""The cache of machine code: no state of the disk stops a question, damage is noticed, and both are said once."""

import contextlib
import errno
import os
import re
import shutil
import signal
import subprocess
import sys
import time
import warnings
from hashlib import sha256
from types import FunctionType

import numpy as np
import pytest
from numba.core import config
from numba.core.caching import CacheImpl

from exo_pin.core import compiled, numba_cache
from exo_pin.core.compiled import Kernel, compilations
from exo_pin.core.errors import CacheUnusable, FileFormatError
from exo_pin.core.numba_cache import _Entries

needs_jit = pytest.mark.skipif(
    os.environ.get("NUMBA_DISABLE_JIT", "0") not in ("", "0"), reason="with NUMBA_DISABLE_JIT there is no compiled form"
)
KEY, DATA = (("float64",), ("a processor", "avx")), (b"machine code" * 8, {"name": 1.5})


def half(x):
    return 0.5 * x


def more(x):
    return half(x) + 1.0


def ask():
    """Answers of a kernel that is new to this process, for two sets of types, and how many it compiled for that."""
    before = compilations()
    with compiled.mode("compiled"):
        again = Kernel(half)
        answers = again(3.0), again(np.array([3.0]))[0]
    assert answers == (1.5, 1.5)
    return compilations() - before


@pytest.fixture
def cache(tmp_path, monkeypatch):
    """The files of a cache of its own, of a process that has been told nothing."""
    monkeypatch.setattr(config, "CACHE_DIR", str(tmp_path))
    monkeypatch.setattr(numba_cache, "_said", set())
    return lambda: sorted(tmp_path.rglob("*.nbc"))


def cut(path):
    os.truncate(path, path.stat().st_size // 2)


def empty(path):
    os.truncate(path, 0)


def change_a_bit(path):
    content = bytearray(path.read_bytes())
    content[-200] ^= 1
    path.write_bytes(content)


def fill(path):
    path.write_bytes(np.random.default_rng(0).bytes(5000))


def make_pipe(path):
    path.unlink()
    os.mkfifo(path)


def make_folder(path):
    path.unlink()
    (path / "something").mkdir(parents=True)


def make_circle(path):
    path.unlink()
    path.symlink_to(path)


@needs_jit
@pytest.mark.parametrize(
    "damage",
    [
        *(cut, change_a_bit, make_folder),
        *(pytest.param(each, marks=pytest.mark.full) for each in (empty, fill, make_pipe, make_circle)),
    ],
)
def test_what_cannot_be_read_is_compiled_anew_and_said_once(cache, damage):
    assert (ask(), ask(), len(cache())) == (2, 0, 2)
    for path in cache():
        damage(path)
    with warnings.catch_warnings(record=True) as said:
        warnings.simplefilter("always")
        assert ask() == 2
    assert all(each.category is CacheUnusable for each in said)
    messages = [str(each.message) for each in said]
    assert sum("cannot be read, so it is compiled anew" in text for text in messages) == 1
    # A folder is somebody's: it stays, and the code cannot be stored in its place.
    stays = damage is make_folder
    assert sum("cannot be stored" in text for text in messages) == stays == len(messages) - 1
    assert ask() == 2 * stays


@needs_jit
def test_one_damaged_file_costs_one_compilation(cache):
    ask()
    cut(cache()[0])
    with pytest.warns(CacheUnusable, match="damaged"):
        assert ask() == 1
    assert ask() == 0


@needs_jit
@pytest.mark.parametrize(
    ("step", "number"),
    [
        ("write", errno.ENOSPC),
        pytest.param("fsync", errno.EIO, marks=pytest.mark.full),
        pytest.param("replace", errno.EROFS, marks=pytest.mark.full),
    ],
)
def test_what_cannot_be_written_stays_in_the_process(cache, monkeypatch, step, number):
    def fail(*_):
        raise OSError(number, os.strerror(number))

    with monkeypatch.context() as patch:
        patch.setattr(os, step, fail)
        with pytest.warns(CacheUnusable, match=os.strerror(number)) as said:
            assert ask() == 2
        assert ask() == 2
    assert len(said) == 1
    assert "NUMBA_CACHE_DIR" in str(said[0].message)
    assert cache() == []
    assert (ask(), ask()) == (2, 0)


@needs_jit
def test_without_any_folder_every_process_compiles(cache, monkeypatch):
    monkeypatch.setattr(CacheImpl, "_locator_classes", [])
    with pytest.warns(CacheUnusable, match="cannot be stored") as said:
        assert ask() == 2
    assert len(said) == 1
    assert ask() == 2


@needs_jit
def test_code_of_another_version_is_replaced_without_a_word(cache, monkeypatch):
    ask()
    with monkeypatch.context() as patch:
        patch.setattr(numba_cache, "__version__", "0.1")
        assert (ask(), ask()) == (2, 0)
    assert (ask(), ask()) == (2, 0)
    assert len(cache()) == 2


@pytest.mark.parametrize("step", [7, pytest.param(1, marks=pytest.mark.full)])
def test_every_cut_and_every_changed_byte_is_noticed(tmp_path, step):
    entries = _Entries(str(tmp_path / "kernel"), "stamp")
    path = tmp_path / os.path.basename(entries.path(KEY))
    assert entries.load(KEY) is None
    entries.save(KEY, DATA)
    assert entries.load(KEY) == DATA
    content = path.read_bytes()
    damaged = [content[:size] for size in range(0, len(content), step)] + [content + b"\0"]
    damaged += [content[:at] + bytes([content[at] ^ 0x10]) + content[at + 1 :] for at in range(0, len(content), step)]
    for each in damaged:
        path.write_bytes(each)
        with pytest.raises(FileFormatError, match="damaged"):
            entries.load(KEY)
    entries.drop(KEY)
    assert entries.load(KEY) is None
    entries.drop(KEY)


def test_a_file_under_another_name_is_not_taken(tmp_path):
    entries, other = _Entries(str(tmp_path / "kernel"), "stamp"), (("int64",), ("another processor", ""))
    entries.save(KEY, DATA)
    os.rename(entries.path(KEY), entries.path(other))
    assert entries.load(other) is None
    assert _Entries(str(tmp_path / "kernel"), "newer").load(KEY) is None


QUERY = (
    "import numpy as np, exo_pin as ep\n"
    "from exo_pin.core.compiled import compilations\n"
    "exo = ep.load('prototype')\n"
    "found = exo.reaction_map(exo.pose(np.linspace(0, 60, 400), 10, 0))\n"
    "print(float(found.shoulder_force.sum()), compilations())\n"
)


def start(folder):
    clean = {key: value for key, value in os.environ.items() if key != "NUMBA_DISABLE_JIT"}
    return subprocess.Popen(
        [sys.executable, "-c", QUERY],
        env={
            **clean,
            "PYTHONPATH": os.pathsep.join(sys.path),
            "NUMBA_CACHE_DIR": str(folder),
            "EXO_PIN_COMPILE": "auto",
        },
        stdout=subprocess.PIPE,
        stderr=subprocess.PIPE,
        text=True,
    )


def finished(process):
    """The sum of the forces, the number of compilations, and what was said."""
    out, said = process.communicate(timeout=300)
    assert process.returncode == 0, said
    total, count = out.split()
    return float(total), int(count), said


@pytest.fixture(scope="module")
def begun(tmp_path_factory):
    """A cache that three processes fill at once, and what they answer."""
    folder = tmp_path_factory.mktemp("together")
    return folder, [finished(process) for process in [start(folder) for _ in range(3)]]


@pytest.mark.full
def test_processes_that_begin_together_share_a_new_cache(begun):
    folder, answers = begun
    assert len({total for total, *_ in answers}) == 1
    assert not any("CacheUnusable" in said for *_, said in answers)
    assert finished(start(folder)) == (answers[0][0], 0, "")


@pytest.mark.full
def test_a_map_of_forces_survives_damage_of_all_files(begun, tmp_path):
    folder = tmp_path / "damaged"
    shutil.copytree(begun[0], folder)
    damages = (cut, empty, change_a_bit)
    files = sorted(folder.rglob("*.nbc"))
    for k, path in enumerate(files):
        damages[k % 3](path)
    again, compiled_anew, said = finished(start(folder))
    assert again == begun[1][0][0]
    assert compiled_anew == len(files) > 20
    assert said.count("CacheUnusable") == 1
    assert finished(start(folder)) == (again, 0, "")


@pytest.mark.full
def test_a_map_of_forces_on_a_disk_of_64_kb(tmp_path):
    if subprocess.run(["mount", "-t", "tmpfs", "-o", "size=64k", "tmpfs", tmp_path], capture_output=True).returncode:
        pytest.skip("a disk can be mounted by root only")
    try:
        _, count, said = finished(start(tmp_path))
    finally:
        subprocess.run(["umount", tmp_path], check=True)
    assert count > 20
    assert said.count("CacheUnusable") == 1
    assert "No space left on device" in said


@pytest.fixture
def hears_ctrl_c():
    """Python's own handler: a job in the background starts with SIGINT ignored."""
    before = signal.signal(signal.SIGINT, signal.default_int_handler)
    yield
    signal.signal(signal.SIGINT, before)


@needs_jit
@pytest.mark.usefixtures("hears_ctrl_c")
def test_ctrl_c_while_compiling_waits_for_the_machine_code(cache):
    def stop():
        signal.raise_signal(signal.SIGINT)

    plain, stamp = {"error_model": "numpy", "nogil": True, "no_cfunc_wrapper": True}, "stamp"
    inner = numba_cache.dispatcher(half, plain, stamp, stop)  # stopped within a compilation of another
    made = numba_cache.dispatcher(FunctionType(more.__code__, {"half": inner}, "more"), plain, stamp, lambda: None)
    with pytest.raises(KeyboardInterrupt):
        inner(3)
    assert signal.getsignal(signal.SIGINT) is signal.default_int_handler
    # Both are whole, in memory and on the disk.
    assert inner(3) == 1.5
    assert len(cache()) == 1
    with pytest.raises(KeyboardInterrupt):
        made(3.0)
    assert made(3.0) == 2.5
    assert len(cache()) == 3
    assert not [path for path in cache() if path.name.startswith(".")]
    compiled_again = []
    again = numba_cache.dispatcher(half, plain, stamp, lambda: compiled_again.append(1))
    assert again(3) == 1.5
    assert not compiled_again


@needs_jit
@pytest.mark.usefixtures("hears_ctrl_c")
def test_a_second_ctrl_c_does_not_wait_and_a_program_s_own_handler_stays():
    reached = []

    def stop_twice():
        with numba_cache._stop_deferred():
            signal.raise_signal(signal.SIGINT)
            reached.append("first")
            signal.raise_signal(signal.SIGINT)
            reached.append("second")

    with pytest.raises(KeyboardInterrupt):
        stop_twice()
    assert reached == ["first"]

    def own(*_):
        reached.append("own")

    before = signal.signal(signal.SIGINT, own)
    try:
        with numba_cache._stop_deferred():
            signal.raise_signal(signal.SIGINT)
            assert reached == ["first", "own"]
        assert signal.getsignal(signal.SIGINT) is own
    finally:
        signal.signal(signal.SIGINT, before)


def check_entries(folder):
    """Every entry is whole, and what a kill left behind has a name that no reader asks for."""
    for path in folder.rglob("*"):
        if path.suffix == ".nbc":
            content = path.read_bytes()
            assert sha256(content[32:]).digest() == content[:32], path
        elif path.is_file():
            assert re.fullmatch(r"\..+\.nbc\.[0-9a-f]{16}", path.name), path


@needs_jit
@pytest.mark.parametrize(
    "kills", [2, pytest.param(10, marks=pytest.mark.full), pytest.param(200, marks=pytest.mark.long)]
)
def test_a_kill_while_compiling_leaves_whole_entries(tmp_path, kills):
    """A program that compiles the same code for ever is killed at random moments."""
    program = (
        "import os, sys, itertools, numpy as np\n"
        "from exo_pin.core import compiled, numba_cache\n"
        "from exo_pin.core.compiled import Kernel\n"
        "def half(x):\n    return 0.5 * x\n"
        "half.__code__ = half.__code__.replace(co_filename=sys.argv[1])\n"
        "made = [None]\n"
        "def ask():\n"
        "    kernel = Kernel(half)\n"
        "    kernel.options['error_model'] = ('numpy', 'python')[next(turn) % 2]\n"
        "    for value in (1, 1.0, np.zeros(2), np.zeros((2, 2))):\n        kernel(value)\n"
        "turn = itertools.count()\n"
        "with compiled.mode('compiled'):\n"
        "    ask()\n"
        "    for line in sys.stdin:\n"
        "        child = os.fork()\n"
        "        while child == 0:\n            ask()\n"
        "        print(child, flush=True)\n"
        "        os.waitpid(child, 0)\n"
        "        print('gone', flush=True)\n"
    )
    own = os.environ | {"NUMBA_CACHE_DIR": str(tmp_path), "PYTHONPATH": os.pathsep.join(sys.path)}
    rng = np.random.default_rng(9)
    with subprocess.Popen(
        [sys.executable, "-c", program, __file__], env=own, stdin=subprocess.PIPE, stdout=subprocess.PIPE, text=True
    ) as job:
        for _ in range(kills):
            job.stdin.write("\n")
            job.stdin.flush()
            child = int(job.stdout.readline())
            time.sleep(rng.uniform(0.0, 0.5))
            os.kill(child, signal.SIGKILL)
            assert job.stdout.readline() == "gone\n"
            check_entries(tmp_path)
        job.stdin.close()
    assert len(list(tmp_path.rglob("*.nbc"))) == 4


@needs_jit
@pytest.mark.parametrize("kills", [pytest.param(6, marks=pytest.mark.full), pytest.param(40, marks=pytest.mark.long)])
def test_a_killed_command_leaves_whole_entries(tmp_path, kills):
    """A map of forces, killed while it compiles what it lacks, again and again; the last one has all and answers."""
    rng = np.random.default_rng(10)
    for _ in range(kills):
        job = start(tmp_path)
        with contextlib.suppress(subprocess.TimeoutExpired):
            job.wait(rng.uniform(1.0, 20.0))
        job.kill()
        job.communicate()
        check_entries(tmp_path)
    total, _, said = finished(start(tmp_path))
    assert "CacheUnusable" not in said
    assert finished(start(tmp_path)) == (total, 0, "")


@needs_jit
@pytest.mark.full
@pytest.mark.parametrize("after", [0.5, 1.5, 3.0, 6.0])
def test_ctrl_c_in_a_command_leaves_no_traceback_and_no_half_entry(tmp_path, after):
    own = os.environ | {"NUMBA_CACHE_DIR": str(tmp_path), "EXO_PIN_COMPILE": "compiled"}
    command = [sys.executable, "-m", "exo_pin.cli", "reaction", "four-cables", "--flexion", "60"]
    job = subprocess.Popen(command, env=own, stdout=subprocess.PIPE, stderr=subprocess.PIPE, text=True)
    with contextlib.suppress(subprocess.TimeoutExpired):
        job.wait(after)
    job.send_signal(signal.SIGINT)
    _, said = job.communicate(timeout=300)
    assert job.returncode in (0, 130, -signal.SIGINT)
    assert "Traceback" not in said
    assert "ignored" not in said
    check_entries(tmp_path)
    assert not [path for path in tmp_path.rglob(".*") if path.is_file()]
