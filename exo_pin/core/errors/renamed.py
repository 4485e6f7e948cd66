"""Old names of a package, which raise and name the new ones for one release."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from functools import wraps
from typing import Any, TypeVar

from .inputs import InvalidInput

#: Words of this package that have another name now, as parameters and as attributes.
OLD_WORDS = {"orientation": "poses", "orientations": "poses", "actuator_bounds": "limits"}
_Thing = TypeVar("_Thing", bound=Callable[..., Any])


def with_old_names(package: str, find: Callable[[str], Any], new_names: Mapping[str, str]) -> Callable[[str], Any]:
    """The ``__getattr__`` of a package: ``find``, but for old names, for which it raises :class:`InvalidInput`.

    The error is no AttributeError, whose text Python hides from ``from package import name``.
    """

    def attribute(name: str) -> Any:
        if name in new_names:
            raise InvalidInput(f"{package}.{name} is called {new_names[name]} now")
        return find(name)

    return attribute


def old_attributes(new_names: Mapping[str, str]) -> Callable[[Any, str], Any]:
    """The ``__getattr__`` of a class with old attribute names; define it where type checkers do not look."""

    def attribute(self: Any, name: str) -> Any:
        owner = type(self).__name__
        if name in new_names:
            raise InvalidInput(f"{owner}.{name} is called {new_names[name]} now")
        raise AttributeError(f"{owner!r} object has no attribute {name!r}", name=name, obj=self)

    return attribute


def name_new_attributes(kind: type) -> None:
    """Let an old attribute of a class that has the new one as a field raise :class:`InvalidInput`."""
    renamed = {old: new for old, new in OLD_WORDS.items() if new in getattr(kind, "__annotations__", ())}
    if renamed and not hasattr(kind, "__getattr__"):
        kind.__getattr__ = old_attributes(renamed)  # type: ignore[attr-defined]


def refuse_old_words(new_words: Mapping[str, str]) -> Callable[[_Thing], _Thing]:
    """Decorate a function: a keyword of ``new_words`` raises :class:`InvalidInput`, which says what to give now."""

    def decorate(function: _Thing) -> _Thing:
        @wraps(function)
        def asked(*values: Any, **named: Any) -> Any:
            for old in new_words.keys() & named.keys():
                raise InvalidInput(f"{function.__name__} has no argument {old} any more: give {new_words[old]}")
            return function(*values, **named)

        return asked  # type: ignore[return-value]

    return decorate
