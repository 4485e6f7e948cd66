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

Kernels as parts of others: kept as intermediate code, which becomes machine code only within what calls it.

On its own Numba optimises a function that another calls, makes machine code of it, and does both once more within the
caller; and so at each level of calls. A part is only lowered to LLVM's intermediate code. The kernel that Python calls
takes in all of its parts, and is optimised once, as a whole.
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

from llvmlite.binding import parse_bitcode
from numba import __version__, njit, types
from numba.core.caching import CompileResultCacheImpl, FunctionCache, NullCache
from numba.core.codegen import JITCodeLibrary
from numba.core.compiler import Compiler, CompileResult
from numba.core.compiler_lock import global_compiler_lock
from numba.core.serialize import dumps
from numba.core.sigutils import normalize_signature

from ..errors import CacheUnusable, FileFormatError
from ..files import write_bytes
from ..files.atomic import read_file


class _PartLibrary(JITCodeLibrary):
    """Intermediate code with all that it calls, which is neither optimised as a whole nor made machine code."""

    def finalize(self) -> None:
        self._raise_if_finalized()
        for library in dict.fromkeys(self._linking_libraries):
            if hasattr(self, "_reload_init"):  # not in Numba 0.61
                self._reload_init.update(library._reload_init)
            self._final_module.link_in(library._get_module_for_linking(), preserve=True)
        self._finalize_dynamic_globals()
        self._finalized = True

    def serialize_using_object_code(self) -> tuple[str, bytes]:
        self._ensure_finalized()
        return self.name, self._final_module.as_bitcode()

    @classmethod
    def _unserialize(cls, codegen: Any, state: tuple[str, bytes]) -> _PartLibrary:
        library = cls(codegen, state[0])
        library._final_module = parse_bitcode(state[1])
        library._finalize_dynamic_globals()
        library._finalized = True
        return library


class _PartCompiler(Compiler):
    """Numba's compiler, which ends at intermediate code."""

    def __init__(self, *arguments: Any) -> None:
        super().__init__(*arguments)
        self.state.flags.no_compile = True
        self.state.library = _PartLibrary(self.state.targetctx.codegen(), "part")


class PartCacheImpl(CompileResultCacheImpl):
    """How a part is stored."""

    def rebuild(self, target_context: Any, payload: tuple[Any, ...]) -> CompileResult:
        """Make of what ``CompileResult._reduce`` has stored the same, without machine code."""
        code, fndesc, environment, signature, objectmode, lifted, annotation, reload_init, environments = payload
        for each in reload_init:
            each()
        return CompileResult(
            typing_context=target_context.typing_context,
            target_context=target_context,
            entry_point=None,
            typing_error=None,
            type_annotation=annotation,
            signature=signature,
            objectmode=objectmode,
            lifted=lifted,
            fndesc=fndesc,
            library=_PartLibrary._unserialize(target_context.codegen(), code),
            call_helper=None,
            environment=environment,
            metadata=None,
            reload_init=reload_init,
            referenced_envs=environments,
        )


def part_dispatcher(function: FunctionType, options: dict[str, Any]) -> Any:
    """Make a dispatcher of a function that other dispatchers' functions call, and not Python."""
    made = njit(pipeline_class=_PartCompiler, no_cpython_wrapper=True, **options)(function)
    made.compile = partial(_compile_part, made)
    made.get_call_template = partial(_part_template, made)
    return made


def _compile_part(made: Any, signature: Any) -> Any:
    """Put into a dispatcher what its callers need; in place of the dispatcher's own ``compile``."""
    with global_compiler_lock:
        own = tuple(normalize_signature(signature)[0])
        found = made.overloads.get(own)
        if found is None:
            found = made._cache.load_overload(signature, made.targetctx)
            new = found is None
            if new:
                found = made._compiler.compile(own, None)
            # Numba finds a function by its entry, which a part does not have.
            found = found._replace(entry_point=_Entry())
            made.targetctx.insert_user_function(found.entry_point, found.fndesc, [found.library])
            made.overloads[own] = found
            if new:
                made._cache.save_overload(signature, found)
        return found.entry_point


class _Entry:
    """In place of a function."""


def _part_template(made: Any, arguments: Any, keywords: Any) -> Any:
    """What typing asks of a part: the same for a constant as for any value of its type."""
    return type(made).get_call_template(made, tuple(_general(each, False) for each in arguments), keywords)


def compile_entry(made: Any, compile_now: Callable[[Any], Any], signature: Any) -> Any:
    """Compile what Python calls: the same for arrays that cannot be written as for those that can.

    The machine code gets the environments of the parts in it, as Numba does on reading it.
    """
    asked = tuple(normalize_signature(signature)[0])
    own = tuple(_general(each, True) for each in asked)
    new = own not in made.overloads
    entry = compile_now(own)
    if new:
        result = made.overloads[own]
        for environment in result._find_referenced_environments() if result.metadata is not None else ():
            result.codegen.set_env(environment.env_name, environment)
    if own != asked:
        made._insert([each._code for each in asked], entry, False)
    return entry


def _general(kind: Any, writeable: bool) -> Any:
    """A type without constants and, if ``writeable``, with arrays that can be written; tuples part by part."""
    if isinstance(kind, types.BaseTuple):
        return types.BaseTuple.from_types(
            [_general(each, writeable) for each in kind], getattr(kind, "instance_class", None)
        )
    if writeable and isinstance(kind, types.Array) and not kind.mutable:
        return kind.copy(readonly=False)
    return types.unliteral(kind)


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
        Whether other dispatchers' functions call it, and not Python; see the module's description.
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
