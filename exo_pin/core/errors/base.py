"""Base class of all errors."""

from __future__ import annotations

from typing import Any

from ..records import freeze, read_only_arrays


class ExoPinError(Exception):
    """Base of every error that exo_pin raises on purpose.

    Errors survive pickling, so they reach the parent of a process pool: same class, message and attributes. Python
    would call ``__init__`` with the message alone, which takes other arguments here, and a process pool waits for
    ever for an answer that cannot be unpickled.
    """

    def __reduce__(self) -> tuple[Any, ...]:
        state = dict(vars(self))
        return _error_again, (type(self), self.args), (state, read_only_arrays(state))

    def __setstate__(self, state: Any) -> None:
        attributes, arrays = state
        freeze(arrays)
        vars(self).update(attributes)


def _error_again(kind: type[ExoPinError], args: tuple[Any, ...]) -> ExoPinError:
    """Make an error without its own ``__init__``; that of Python's class sets what ``str`` shows."""
    error = kind.__new__(kind, *args)
    python = next(base for base in kind.__mro__ if base.__module__ == "builtins")
    python.__init__(error, *args)  # type: ignore[misc]
    return error
