"""Numba's dispatchers with a cache on disk that notices every change of the code they are made of.

Numba's own cache notices a change of the file that the function stands in. It does not notice a change of a kernel or a
constant that comes from another file, and goes on with the old machine code. Here the stamp of the cache covers all of
it (:attr:`exo_pin.core.compiled.Kernel.stamp`).

Compiled code goes into ``__pycache__`` beside the source, into the user's cache folder where that cannot be written, or
into the folder that the environment variable ``NUMBA_CACHE_DIR`` names.
"""

from __future__ import annotations

import contextlib
import sys
from types import FunctionType
from typing import Any

from numba import njit
from numba.core.caching import FunctionCache, IndexDataCacheFile

__all__ = ["compilations", "dispatcher"]

#: Number of kernels that were compiled in this process; those read from the cache do not count.
_compiled = 0


class _KernelCache(FunctionCache):
    """The cache of one kernel, valid for one stamp."""

    def __init__(self, function: FunctionType, stamp: str) -> None:
        super().__init__(function)
        self._cache_file = IndexDataCacheFile(
            cache_path=self._cache_path, filename_base=self._impl.filename_base, source_stamp=stamp
        )

    def load_overload(self, signature: Any, target: Any) -> Any:
        """Read the machine code; where there is none Numba compiles next, which is announced once."""
        found = super().load_overload(signature, target)
        if found is None:
            _announce()
        return found


def dispatcher(function: FunctionType, options: dict[str, Any], stamp: str) -> Any:
    """Make a dispatcher, which compiles a function for the types it is called with.

    Parameters
    ----------
    function : function
        Its globals hold dispatchers, numbers, modules and types.
    options : dict
        Options of ``numba.njit``.
    stamp : str
        Digest of all that the machine code depends on.
    """
    made = njit(**options)(function)
    with contextlib.suppress(RuntimeError):  # no folder can be written: every process compiles anew
        made._cache = _KernelCache(function, stamp)
    return made


def compilations() -> int:
    """Number of kernels that were compiled in this process; those read from the cache do not count."""
    return _compiled


def _announce() -> None:
    global _compiled
    if _compiled == 0 and sys.stderr is not None:
        sys.stderr.write("exo_pin: compiling, once, up to a minute ('exo-pin warm-up' does it ahead of time)\n")
        sys.stderr.flush()
    _compiled += 1
