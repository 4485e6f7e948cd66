"""Whether kernels run plain or compiled in this process, and how many have been compiled."""

from __future__ import annotations

import os
import sys
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from threading import RLock

from .errors import UnknownName

MODES = ("auto", "plain", "compiled")

#: Held while the mode changes, and while a kernel makes one of its forms.
lock = RLock()
_compilations = 0
_listeners: list[Callable[[], None]] = []


def on_change(listener: Callable[[], None]) -> None:
    """Call ``listener`` whenever the mode changes."""
    _listeners.append(listener)


def current_mode() -> str:
    """The mode of the process: "auto", "plain" or "compiled"."""
    return _mode


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
    return _compilations


def count_compilation() -> None:
    """Count, and in mode "auto" announce the first: the user has not chosen to wait."""
    global _compilations
    _compilations += 1
    if _compilations == 1 and _mode == "auto" and sys.stderr is not None:
        sys.stderr.write(
            "exo_pin: compiling, once; this takes up to a minute ('exo-pin warm-up' does it ahead of time)\n"
        )
        sys.stderr.flush()


def _set_mode(name: str) -> None:
    global _mode
    with lock:
        _mode = name
        for listener in _listeners:
            listener()


def _checked(name: str) -> str:
    if name not in MODES:
        raise UnknownName("compile mode", name, MODES)
    if os.environ.get("NUMBA_DISABLE_JIT", "0") not in ("", "0"):
        return "plain"
    return name


_mode = _checked(os.environ.get("EXO_PIN_COMPILE") or "auto")
