"""Kernels: numerical functions that run uncompiled for a single pose and compiled (Numba) for many.

A formula is written once, as a Python function with the decorator :func:`kernel`. From it come two forms:

* ``plain``, the same code run by Python, with NumPy's rules for errors (NaN and infinity, no exceptions). It starts at
  once and takes milliseconds.
* ``compiled``, machine code. Making it takes seconds, once; it is then read from a cache on disk. Numba, whose import
  takes longer than a first answer, is imported only for this form.

A call in mode "auto" takes the plain form until the kernel has done :data:`PLAIN_WORK` units of work, and the compiled
one from then on. A unit is about 0.3 ms: one row of a stack of poses (``stack=True``), or else one call, more for large
matrices, times the kernel's ``cost``.
The choice depends on counts alone, never on a clock. Plain and compiled results agree to rounding.

Environment variables: ``EXO_PIN_COMPILE`` = auto, plain or compiled; ``NUMBA_DISABLE_JIT=1`` means plain.
"""

from __future__ import annotations

import builtins
import functools
import hashlib
import math
import os
import sys
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from dis import get_instructions
from operator import attrgetter
from threading import RLock
from types import CodeType, FunctionType, ModuleType
from typing import Any

import numpy as np

from . import plain_math
from .errors import UnknownName

MODES = ("auto", "plain", "compiled")

#: Held while the mode changes, and while a kernel makes one of its forms.
lock = RLock()
_is_announced = False
#: Whether one short search runs at the moment.
_is_one_search = False

__all__ = ["MODES", "PLAIN_WORK", "Kernel", "compilations", "kernel", "kernels", "mode", "one_search"]
#: Units of work that a kernel does uncompiled in mode "auto": about 0.1 s. Compilation takes 0.3 to 10 s.
PLAIN_WORK = 300
#: Numbers in the largest argument of a call that count as one unit of work more.
_NUMBERS_A_UNIT = 100
_all: list[Kernel] = []


def current_mode() -> str:
    """The mode of the process: "auto", "plain" or "compiled"."""
    return _mode


@contextmanager
def one_search() -> Iterator[None]:
    """Run kernels of cost 1 plain inside a ``with`` block in mode "auto": one search is over before they are compiled.

    Those of a higher cost, which follow postures through closed loops, are compiled as ever.
    """
    global _is_one_search
    before, _is_one_search = _is_one_search, True
    try:
        yield
    finally:
        _is_one_search = before


@contextmanager
def mode(name: str) -> Iterator[None]:
    """Choose how kernels run inside a ``with`` block, for all threads of the process.

    Parameters
    ----------
    name : {"auto", "plain", "compiled"}
        "plain" never compiles; "compiled" compiles at the first call; "auto" as :mod:`exo_pin.core.compiled` says.

    Raises
    ------
    UnknownName
        For another name.
    """
    before = _mode
    _set_mode(_checked(name))
    try:
        yield
    finally:
        _set_mode(before)


def compilations() -> int:
    """Number of functions compiled in this process, once a set of types, without what the cache on disk has."""
    made = [form for each in _all for form in (each._compiled, each._part) if form is not None]
    return sum(sum(each.stats.cache_misses.values()) for each in made)


def _announce() -> None:
    """Say in mode "auto", once, that code is compiled: the user has not chosen to wait."""
    global _is_announced
    if not _is_announced and _mode == "auto" and sys.stderr is not None:
        _is_announced = True
        sys.stderr.write(
            "exo_pin: compiling, once; this takes up to a minute ('exo-pin warm-up' does it ahead of time)\n"
        )
        sys.stderr.flush()


def _set_mode(name: str) -> None:
    global _mode
    with lock:
        _mode = name
        for each in _all:
            each.choose()


def _checked(name: str) -> str:
    if name not in MODES:
        raise UnknownName("compile mode", name, MODES)
    if os.environ.get("NUMBA_DISABLE_JIT", "0") not in ("", "0"):
        return "plain"
    return name


_mode = _checked(os.environ.get("EXO_PIN_COMPILE") or "auto")


class Kernel:
    """A numerical function with a plain and a compiled form; see the module's description.

    Call it as the function. Inside other kernels it is replaced by its form of the same kind.

    Parameters
    ----------
    function : callable
        On numbers, tuples, arrays and named tuples of these, without keyword arguments and without a closure, in the
        part of Python that Numba compiles.
    inline : bool
        Whether the compiled form is inlined where another kernel calls it.
    fills : bool
        Whether it and kernels that it calls return no arrays, and it makes none itself, as one that fills what it is
        given. Its compiled form does not count who holds an array, which takes longer than the work on a small one.
    stack : bool
        Whether the first argument is a stack of poses, whose first axis counts as work.
    cost : int
        Units of work a row or a call. With more than :data:`PLAIN_WORK` even the first call is compiled.
    """

    #: A call is one of ``run``, without a frame of Python between them.
    __call__ = property(attrgetter("run"))

    def __init__(
        self,
        function: Callable[..., Any],
        inline: bool = False,
        fills: bool = False,
        stack: bool = False,
        cost: int = 1,
    ) -> None:
        functools.update_wrapper(self, function)
        self.__qualname__ = function.__qualname__
        self._function: FunctionType = function  # type: ignore[assignment]
        self._stack, self._cost = stack, cost
        self.options: dict[str, Any] = {"error_model": "numpy", "nogil": True, "no_cfunc_wrapper": True}
        # Stated of every kernel: else those that it calls would do as it does.
        self.options["_nrt"] = not fills
        if inline:
            self.options["forceinline"] = True
        self._done = 0
        self._plain: Any = None
        self._compiled: Any = None
        self._part: Any = None
        #: Whether the compiled form has been made in this process.
        self.is_ready = False
        #: What a call runs at the moment.
        self.run: Callable[..., Any] = self._call_plain
        self.choose()
        _all.append(self)

    def __repr__(self) -> str:
        return f"<kernel {self.__module__}.{self.__qualname__}>"

    def __reduce__(self) -> str:
        return self.__qualname__  # pickled by name, as functions are

    @property
    def plain(self) -> Any:
        """The form that Python runs: a function, to be called with NumPy numbers under ``np.errstate``."""
        return self._made("_plain", self._make_plain)

    @property
    def compiled(self) -> Any:
        """The form that Numba compiles: a dispatcher, which compiles for the types it is called with."""
        return self._made("_compiled", self._make_compiled)

    @property
    def part(self) -> Any:
        """The compiled form that compiled forms of other kernels call: Python cannot."""
        return self._made("_part", functools.partial(self._make_compiled, part=True))

    def _made(self, name: str, make: Callable[[], Any]) -> Any:
        """A form, made once by the first thread that asks for it."""
        if getattr(self, name) is None:
            with lock:
                if getattr(self, name) is None:
                    setattr(self, name, make())
        return getattr(self, name)

    @functools.cached_property
    def stamp(self) -> str:
        """Digest of all code and all constants that the compiled form is made of, other kernels' included.

        The cache on disk holds good for this stamp only. It comes from what Python has loaded, not from files: an edit
        of any function or constant counts, in whatever file it stands, and one of a comment does not.
        """
        digest = hashlib.sha256(f"{np.__version__} {sorted(self.options.items())}".encode())
        self._digest_code(self._function.__code__, self._function.__globals__, digest.update)
        return digest.hexdigest()

    def forget(self) -> None:
        """Let both forms be made anew at the next call, of what the function has become."""
        self._plain = self._compiled = self._part = None
        self.is_ready = False
        self.__dict__.pop("stamp", None)
        self.choose()

    def choose(self) -> None:
        """Set which form calls take, by the mode of the process."""
        forms = {"auto": self._call_and_count, "plain": self._call_plain, "compiled": self._call_compiled}
        self.run = self._compiled if self.is_ready and current_mode() != "plain" else forms[current_mode()]

    def _call_plain(self, *arguments: Any) -> Any:
        with np.errstate(all="ignore"):
            return _as_python(self.plain(*[np.float64(a) if type(a) is float else a for a in arguments]))

    def _call_compiled(self, *arguments: Any) -> Any:
        made = self.compiled
        try:
            _machine_code().make_ready(made, arguments)
        except Exception as error:
            if not _machine_code().give_up(error):
                raise
            for each in _all:
                each.forget()
            return self._call_compiled(*arguments)
        self.is_ready = True
        self.choose()
        return made(*arguments)

    def _call_and_count(self, *arguments: Any) -> Any:
        if _is_one_search and self._cost == 1:
            return self._call_plain(*arguments)
        self._done += self._work(arguments)
        if self._done > PLAIN_WORK:
            return self._call_compiled(*arguments)
        return self._call_plain(*arguments)

    def _work(self, arguments: tuple[Any, ...]) -> int:
        if self._stack:
            return self._cost * max(1, len(arguments[0]))
        largest = max((a.size for a in arguments if type(a) is np.ndarray), default=0)
        return self._cost * (1 + largest // _NUMBERS_A_UNIT)

    def _make_plain(self) -> Any:
        code = self._function.__code__
        code = code.replace(co_consts=tuple(_as_numpy(value) for value in code.co_consts))
        return self._twin(code, _plain_form)

    def _make_compiled(self, part: bool = False) -> Any:
        twin = self._twin(self._function.__code__, _compiled_form)
        options = self.options | {"no_cpython_wrapper": part}
        return _machine_code().dispatcher(twin, self.stamp, options, _announce)

    def _twin(self, code: CodeType, form: Callable[[Any], Any]) -> FunctionType:
        """The function with other constants, and with another form of each global that it uses."""
        own = self._function
        used = {name: form(own.__globals__[name]) for name in _globals_of(code) if name in own.__globals__}
        # NumPy imports parts of itself at their first call, and Python's import looks for this in the caller's globals.
        used |= {"__name__": own.__module__, "__builtins__": builtins}
        twin = FunctionType(code, used, own.__name__)
        twin.__qualname__, twin.__module__, twin.__doc__ = own.__qualname__, own.__module__, own.__doc__
        return twin

    def _digest_code(self, code: CodeType, scope: dict[str, Any], update: Callable[[bytes], None]) -> None:
        update(code.co_code)
        for constant in code.co_consts:
            if isinstance(constant, CodeType):
                self._digest_code(constant, scope, update)
            else:
                update(f"{sorted(constant) if isinstance(constant, frozenset) else constant!r} ".encode())
        update(f"{code.co_names} ".encode())
        for name in _globals_of(code):
            if name in scope:
                update(f"{name} {_identity(scope[name])} ".encode())


def kernel(function: Callable[..., Any] | None = None, **options: Any) -> Any:
    """Make a :class:`Kernel` of a function: ``@kernel`` or ``@kernel(stack=True)``.

    Parameters
    ----------
    function : callable
        See :class:`Kernel`.
    **options
        See :class:`Kernel`.
    """
    return functools.partial(kernel, **options) if function is None else Kernel(function, **options)


def kernels() -> tuple[Kernel, ...]:
    """All kernels of the modules that are loaded."""
    return tuple(_all)


def _machine_code() -> Any:
    from . import machine_code  # here, because the import of Numba takes long

    return machine_code


def _globals_of(code: CodeType) -> list[str]:
    """Names of the globals that a function reads. ``co_names`` alone holds the names of attributes, too."""
    return list(dict.fromkeys(step.argval for step in get_instructions(code) if step.opname == "LOAD_GLOBAL"))


def _plain_form(value: Any) -> Any:
    if isinstance(value, Kernel):
        return value.plain
    return plain_math if value is math else _as_numpy(value)


def _compiled_form(value: Any) -> Any:
    return value.part if isinstance(value, Kernel) else value


def _as_numpy(value: Any) -> Any:
    """A float as a NumPy number, which division by zero makes infinite; tuples part by part."""
    if type(value) is float:
        return np.float64(value)
    return tuple(_as_numpy(part) for part in value) if type(value) is tuple else value


def _as_python(value: Any) -> Any:
    """NumPy numbers as Python's, which compiled functions return; tuples part by part."""
    if isinstance(value, np.generic):
        return value.item()
    return tuple(_as_python(part) for part in value) if type(value) is tuple else value


def _identity(value: Any) -> str:
    """What the compiled form has of a global: of a kernel its stamp, of a number its value."""
    if isinstance(value, Kernel):
        return value.stamp
    if isinstance(value, ModuleType):
        return value.__name__
    if callable(value):
        return f"{value.__module__}.{value.__qualname__} {getattr(value, '_fields', '')}"
    return repr(value)
