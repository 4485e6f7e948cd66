"""Machine code of kernels, made and stored by Numba: imported only where a kernel runs compiled.

Numba's cache notices a change of the file that a function stands in, not one of a kernel or a constant from another
file. So each form of a kernel has a folder of its own, named by a digest of all that its code is made of: under
``__pycache__`` of the package, under the user's cache folder where that cannot be written, or under the folder that the
environment variable ``NUMBA_CACHE_DIR`` names.
"""

from __future__ import annotations

import contextlib
import errno
import os
import pickle
import shutil
import signal
import threading
import time
import warnings
from collections.abc import Callable, Iterator
from functools import partial
from hashlib import sha256
from pathlib import Path
from typing import Any

import numba

from .errors import CacheUnusable

try:
    from fcntl import LOCK_EX, flock
except ImportError:  # Windows
    flock = None  # type: ignore[assignment]

#: Code of a kernel's other versions is removed after this time, s.
_KEPT = 86_400.0
#: What reading and writing Numba's files raises; machine code itself never does.
_FAULTS = (OSError, EOFError, pickle.PickleError)
#: Threads compile one after another: two that waited for each other's kernel and for Numba's lock would wait for ever.
_one_thread = threading.RLock()
#: Whether code is stored: until its folder turns out to be unusable.
_is_stored = True


def dispatcher(function: Callable[..., Any], stamp: str, options: dict[str, Any], on_new: Callable[[], None]) -> Any:
    """Make a dispatcher, which compiles a function for the types it is called with.

    Parameters
    ----------
    function : function
        Its globals hold dispatchers, numbers, modules and types.
    stamp : str
        Digest of all that the machine code depends on.
    options : dict
        Options of ``numba.njit``. One without a wrapper for Python is a part of others, which take it in.
    on_new : callable
        Called without arguments if there is no machine code of this stamp.
    """
    is_part = options.get("no_cpython_wrapper", False)
    try:
        folder = _folder(function, stamp, is_part, on_new) if _is_stored else None
    except OSError as error:
        folder = None
        give_up(error)
    made = _stored(function, folder, options)
    made.compile = partial(_compiled, made.compile, folder, is_part)
    return made


def _stored(function: Callable[..., Any], folder: Path | None, options: dict[str, Any]) -> Any:
    """Numba's dispatcher, which stores code in a folder if there is one."""
    if folder is None:
        return numba.njit(**options)(function)
    before, numba.config.CACHE_DIR = numba.config.CACHE_DIR, str(folder)
    try:
        made = numba.njit(cache=True, **options)(function)
        # In other folders, which Numba takes if it cannot write into this one, code would outlive what it is made of.
        if folder in Path(made.stats.cache_path).parents:
            return made
    except RuntimeError:  # typed in at a prompt: there is no file
        pass
    finally:
        numba.config.CACHE_DIR = before
    if not os.access(folder, os.W_OK):
        give_up(PermissionError(errno.EACCES, os.strerror(errno.EACCES), str(folder)))
    return numba.njit(**options)(function)


def _root() -> Path:
    """The folder of all kernels' code."""
    if numba.config.CACHE_DIR:
        return Path(numba.config.CACHE_DIR) / "exo_pin"
    own = Path(__file__).parent / "__pycache__"
    if os.access(own if own.exists() else own.parent, os.W_OK):
        return own / "exo_pin"
    return Path(os.environ.get("XDG_CACHE_HOME") or Path.home() / ".cache") / "exo_pin"


def _folder(function: Callable[..., Any], stamp: str, is_part: bool, on_new: Callable[[], None]) -> Path:
    """The folder of one form of a kernel; an older one of the same form is removed."""
    source = Path(function.__code__.co_filename)
    content = source.read_bytes() if source.is_file() else b""
    digest = sha256(f"{numba.__version__} {stamp}".encode() + content).hexdigest()[:16]
    name = f"{function.__module__}.{function.__qualname__}".replace("<", "").replace(">", "")
    folder = _root() / (f"{name}.part" if is_part else name) / digest
    if not folder.is_dir():
        on_new()
        folder.mkdir(parents=True, exist_ok=True)
        for other in folder.parent.iterdir():
            if other.stat().st_mtime < time.time() - _KEPT:
                shutil.rmtree(other, ignore_errors=True)
    return folder


def make_ready(made: Any, arguments: tuple[Any, ...]) -> None:
    """Compile, or read from the disk, what a call needs."""
    made.compile(tuple(map(numba.typeof, arguments)))


def _compiled(compile_now: Callable[[Any], Any], folder: Path | None, is_part: bool, signature: Any) -> Any:
    """Compile for one signature, or read the code, in place of a dispatcher's own ``compile``; callees pass here, too.

    Numba's index of a kernel is read, extended and written, which two processes must not do at once. A kernel's lock is
    held while those that it calls are locked, and no kernel calls its callers: processes cannot wait in a circle.
    """
    with (
        _one_thread,
        _one_process(folder),
        _stop_deferred(),
        _half_optimised() if is_part else contextlib.nullcontext(),
    ):
        return compile_now(tuple(map(_open, signature)))


def _open(kind: Any) -> Any:
    """The type of an argument; of a flag whether or not its value is written out, as one form serves both values."""
    return numba.types.boolean if isinstance(kind, numba.types.BooleanLiteral) else kind


@contextlib.contextmanager
def _one_process(folder: Path | None) -> Iterator[None]:
    """Wait for other processes that compile the same kernel; on disks without locks, go on."""
    with contextlib.ExitStack() as stack:
        if folder is not None and flock is not None:
            with contextlib.suppress(OSError):
                descriptor = os.open(folder, os.O_RDONLY)
                stack.callback(os.close, descriptor)
                flock(descriptor, LOCK_EX)
        yield


@contextlib.contextmanager
def _half_optimised() -> Iterator[None]:
    """Leave most of a part's optimisation to the kernel that takes it in, which optimises it as a whole once more."""
    before = numba.config.OPT
    numba.config.OPT = type(before)(min(before, 1))
    try:
        yield
    finally:
        numba.config.OPT = before


@contextlib.contextmanager
def _stop_deferred() -> Iterator[None]:
    """Let the first Ctrl-C wait until the block is done: Numba and LLVM would print the exception and drop it.

    Only the main thread can do that, and a program's own handler is left as it is. A second Ctrl-C does not wait.
    """
    own = threading.current_thread() is threading.main_thread()
    if not own or signal.getsignal(signal.SIGINT) is not signal.default_int_handler:
        yield
        return
    came: list[int] = []

    def note(number: int, frame: Any) -> None:
        if came:
            signal.default_int_handler(number, frame)
        came.append(number)

    signal.signal(signal.SIGINT, note)
    try:
        yield
    finally:
        signal.signal(signal.SIGINT, signal.default_int_handler)
        if came:
            raise KeyboardInterrupt


def give_up(error: BaseException | None) -> bool:
    """Store no more code in this process if an error comes from reading or writing it; say so, and clear the folder.

    Returns
    -------
    bool
        Whether that has happened now: dispatchers have to be made anew.
    """
    global _is_stored
    while error is not None and not isinstance(error, _FAULTS):
        error = error.__cause__ or error.__context__  # Numba tells the faults of a kernel that another calls by its own
    if error is None or not _is_stored:
        return False
    _is_stored = False
    shutil.rmtree(_root(), ignore_errors=True)
    warnings.warn(
        f"machine code cannot be stored or read, so this process compiles it anew, which takes up to a minute; "
        f"NUMBA_CACHE_DIR can name another folder; results are the same ({error})",
        CacheUnusable,
        stacklevel=2,
    )
    return True
