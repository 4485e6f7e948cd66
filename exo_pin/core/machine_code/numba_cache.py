"""Numba's dispatchers with a cache on disk that notices every change of the code, and every damage of its files.

Numba's own cache notices a change of the file that the function stands in. It does not notice a change of a kernel or a
constant that comes from another file, and goes on with the old machine code. Here the stamp of the cache covers all of
it (:attr:`exo_pin.core.compiled.Kernel.stamp`). Numba's own cache also raises where a file of it is damaged or cannot
be written. Here no state of the disk stops a question: what cannot be read is dropped and compiled anew, what cannot be
written is compiled by every process, and a :class:`CacheUnusable` warning says so, once each in a process.

Compiled code goes into ``__pycache__`` beside the source, into the user's cache folder where that cannot be written, or
into the folder that the environment variable ``NUMBA_CACHE_DIR`` names.

Ctrl-C waits for the end of a compilation, which takes seconds: Numba and LLVM call Python where an exception is printed
and dropped. The machine code is then stored, and KeyboardInterrupt is raised. A second Ctrl-C does not wait.
"""

from __future__ import annotations

import contextlib
import os
import pickle
import signal
import threading
import warnings
from collections.abc import Callable, Iterator
from functools import partial
from hashlib import sha256
from types import FunctionType
from typing import Any

from numba import __version__, njit
from numba.core.caching import FunctionCache, NullCache
from numba.core.serialize import dumps

from ..errors import CacheUnusable, FileFormatError
from ..files import write_bytes
from ..files.text_files import read_file
from .kernel_parts import PartCacheImpl, compile_entry, part_dispatcher

_UNREADABLE = "stored machine code cannot be read, so it is compiled anew, which takes seconds"
_NOT_STORED = (
    "machine code cannot be stored, so every process compiles it anew; NUMBA_CACHE_DIR can name another folder"
)
_DIGEST = sha256().digest_size
#: Which of these two this process has been told.
_said: set[str] = set()


class _Entries:
    """The files of one kernel: one for each set of argument types and kind of processor.

    A file holds a digest of all that follows, the stamp, and Numba's record of the machine code. The digest is checked
    first: to unpickle or run damaged code may end Python. There is no index, which two processes could write at once.
    It guards against damage and not against attack: whoever may write the folder may write code, as in that of ``.pyc``
    files.
    """

    def __init__(self, start: str, stamp: str) -> None:
        self._start, self._stamp = start, sha256(f"{__version__} {stamp}".encode()).digest()

    def path(self, key: Any) -> str:
        """File of a key of Numba's. It does not depend on the stamp, so that new code replaces the old."""
        return f"{self._start}.{sha256(repr(key).encode()).hexdigest()[:16]}.nbc"

    def load(self, key: Any) -> Any:
        """Numba's record; None if there is none, or one of other code."""
        path = self.path(key)
        try:
            content = read_file(path)
        except FileFormatError as error:
            if isinstance(error.__cause__, FileNotFoundError):
                return None
            raise
        digest, stamp, record = content[:_DIGEST], content[_DIGEST : 2 * _DIGEST], content[2 * _DIGEST :]
        if sha256(stamp + record).digest() != digest:
            raise FileFormatError("the file is damaged", path)
        if stamp != self._stamp:
            return None
        found, data = pickle.loads(record)
        return data if found == key else None

    def save(self, key: Any, data: Any) -> None:
        """Write Numba's record; a reader finds the old one or the new one."""
        rest = self._stamp + dumps((key, data))
        write_bytes(self.path(key), sha256(rest).digest() + rest)

    def drop(self, key: Any) -> None:
        """Remove a file, so that another can be written in its place, whatever its mode."""
        with contextlib.suppress(OSError):
            os.unlink(self.path(key))


class _KernelCache(FunctionCache):
    """The cache of one kernel, valid for one stamp."""

    _ending = ""

    def __init__(self, function: FunctionType, stamp: str, on_compile: Callable[[], None]) -> None:
        super().__init__(function)
        self._on_compile = on_compile
        start = os.path.join(self._cache_path, self._impl.filename_base)
        self._cache_file = _Entries(start + self._ending, stamp)

    def load_overload(self, signature: Any, target: Any) -> Any:
        """Read the machine code; where there is none Numba compiles next."""
        found = None
        try:
            found = super().load_overload(signature, target)
        except ImportError:  # of a kernel that stood in another module when this was compiled
            pass
        except Exception as error:
            self._cache_file.drop(self._index_key(signature, target.codegen()))
            _say_once(_UNREADABLE, error)
        if found is None:
            self._on_compile()
        return found

    def save_overload(self, signature: Any, data: Any) -> None:
        """Write the machine code, if that is possible."""
        try:
            super().save_overload(signature, data)
        except Exception as error:
            _say_once(_NOT_STORED, error)


class _PartCache(_KernelCache):
    """The cache of one kernel as a part of others."""

    _impl_class = PartCacheImpl
    _ending = ".part"


class _NoCache(NullCache):
    """In place of a cache where no folder can be written."""

    def __init__(self, on_compile: Callable[[], None]) -> None:
        self._on_compile = on_compile

    def load_overload(self, signature: Any, target: Any) -> None:
        """Numba compiles next."""
        self._on_compile()


def dispatcher(
    function: FunctionType, options: dict[str, Any], stamp: str, on_compile: Callable[[], None], part: bool = False
) -> Any:
    """Make a dispatcher, which compiles a function for the types it is called with.

    Parameters
    ----------
    function : function
        Its globals hold dispatchers, numbers, modules and types.
    options : dict
        Options of ``numba.njit``.
    stamp : str
        Digest of all that the machine code depends on.
    on_compile : callable
        Called without arguments before a compilation; not where machine code is read from the cache.
    part : bool
        Whether other dispatchers' functions call it, and not Python; see :mod:`.kernel_parts`.
    """
    made = part_dispatcher(function, options) if part else njit(**options)(function)
    made.compile = partial(_compiled, made.compile if part else partial(compile_entry, made, made.compile))
    try:
        made._cache = (_PartCache if part else _KernelCache)(function, stamp, on_compile)
    except (RuntimeError, OSError) as error:  # no folder can be written
        made._cache = _NoCache(on_compile)
        _say_once(_NOT_STORED, error)
    return made


def _compiled(compile_now: Callable[[Any], Any], signature: Any) -> Any:
    with _stop_deferred():
        return compile_now(signature)


@contextlib.contextmanager
def _stop_deferred() -> Iterator[None]:
    """Let the first Ctrl-C wait until the block is done; kernels that the block compiles within do not wait apart.

    Only the main thread can do that, and a program's own handler is left as it is.
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


def _say_once(what: str, error: Exception) -> None:
    """Warn, unless this process has been warned of the same."""
    if what not in _said:
        _said.add(what)
        warnings.warn(f"{what}; results are the same ({error})", CacheUnusable, stacklevel=2)
