"""The cache of machine code: no state of the disk stops a question, damage is noticed, and both are said once."""

import errno
import os
import signal
import warnings
from types import FunctionType

import numpy as np
import pytest
from numba.core import config
from numba.core.caching import CacheImpl

from exo_pin import FileFormatError
from exo_pin.core import compiled
from exo_pin.core.compiled import Kernel, compilations
from exo_pin.core.errors import CacheUnusable
from exo_pin.core.machine_code import numba_cache
from exo_pin.core.machine_code.numba_cache import _Entries

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
