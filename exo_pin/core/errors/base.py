"""Base class of all errors, and the one place where what a message echoes is cut and made printable."""

from __future__ import annotations

import re
from typing import Any

from ..records import freeze, read_only_arrays

#: Longest message, and longest word in one (a name, path or number), characters.
LONGEST, WORD = 2000, 500
_CUT = " [... cut ...] "
_LONG_WORD = re.compile(rf"\S{{{WORD + 1},}}")


def shown(text: str) -> str:
    """A text for a terminal: at most :data:`LONGEST` characters, cut in the middle, control characters as escapes.

    A file may hold texts of any length, and escape sequences that would change the terminal or hide parts of a message.
    Long words are cut first, so that what is said about them remains.
    """
    # Once more afterwards, because escapes are longer than what they stand for.
    return _short("".join(c if c.isprintable() or c == "\n" else repr(c)[1:-1] for c in _short(text)))


def _short(text: str) -> str:
    return _cut(_LONG_WORD.sub(lambda word: _cut(word[0], WORD), text), LONGEST)


def _cut(text: str, longest: int) -> str:
    left = longest - len(_CUT)
    return text if len(text) <= longest else text[: left - left // 3] + _CUT + text[-(left // 3) :]


def echo(value: object) -> str:
    """What a message shows of any value, also where Python cannot print it: an integer of 5,000 digits, deep lists."""
    try:
        return f"{value!r:.80}"
    except Exception:
        return f"a value of type {type(value).__name__}"


class ExoPinError(Exception):
    """Base of every error that exo_pin raises on purpose.

    Its message is :func:`shown`; the attributes hold the whole evidence.

    Errors survive pickling, so they reach the parent of a process pool: same class, message and attributes. Python
    would call ``__init__`` with the message alone, which takes other arguments here, and a process pool waits for
    ever for an answer that cannot be unpickled.

    Examples
    --------
    >>> try:
    ...     ep.Wearer(height=175, mass=75, sex="male")  # cm
    ... except ep.ExoPinError as error:
    ...     print(error)
    expected a height of 0.5 to 2.6 m, got 175; did you mean 1.75 m?
    """

    def __init__(self, *args: object) -> None:
        super().__init__(*(shown(str(arg)) for arg in args))

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
