"""Numba's dispatchers with a cache on disk that notices every change of the code they are made of.

Numba's own cache notices a change of the file that the function stands in. It does not notice a change of a kernel or a
constant that comes from another file, and goes on with the old machine code. Here the stamp of the cache covers all of
it (:attr:`exo_pin.core.compiled.Kernel.stamp`).

Compiled code goes into ``__pycache__`` beside the source, into the user's cache folder where that cannot be written, or
into the folder that the environment variable ``NUMBA_CACHE_DIR`` names.
"""

from __future__ import annotations

import contextlib
from collections.abc import Callable
from types import FunctionType
from typing import Any

from numba import njit
from numba.core.caching import FunctionCache, IndexDataCacheFile

__all__ = ["dispatcher"]


class _KernelCache(FunctionCache):
    """The cache of one kernel, valid for one stamp."""

    def __init__(self, function: FunctionType, stamp: str, on_compile: Callable[[], None]) -> None:
        super().__init__(function)
        self._on_compile = on_compile
        self._cache_file = IndexDataCacheFile(
            cache_path=self._cache_path, filename_base=self._impl.filename_base, source_stamp=stamp
        )

    def load_overload(self, signature: Any, target: Any) -> Any:
        """Read the machine code; where there is none Numba compiles next."""
        found = None
        with contextlib.suppress(ImportError):  # of a kernel that stood in another module when this was compiled
            found = super().load_overload(signature, target)
        if found is None:
            self._on_compile()
        return found


def dispatcher(function: FunctionType, options: dict[str, Any], stamp: str, on_compile: Callable[[], None]) -> Any:
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
    """
    made = njit(**options)(function)
    with contextlib.suppress(RuntimeError):  # no folder can be written: every process compiles anew
        made._cache = _KernelCache(function, stamp, on_compile)
    return made
