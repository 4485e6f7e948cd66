"""Old names of a package, which raise and name the new ones for one release."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from functools import wraps
from inspect import getattr_static
from types import FunctionType
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


def ask_for_new_words(thing: _Thing) -> _Thing:
    """Decorate a function, or a class with its methods: an old word as a keyword raises :class:`InvalidInput`.

    So does an old attribute of a class that has the new one as a field.
    """
    if not isinstance(thing, type):
        return _asking(thing)
    for name in dir(thing):
        member = getattr_static(thing, name)
        inner = getattr(member, "__func__", member)
        if isinstance(inner, FunctionType) and (asking := _asking(inner)) is not inner:
            setattr(thing, name, asking if inner is member else type(member)(asking))
    renamed = {old: new for old, new in OLD_WORDS.items() if new in getattr(thing, "__annotations__", ())}
    if renamed and not hasattr(thing, "__getattr__"):
        thing.__getattr__ = old_attributes(renamed)  # type: ignore[attr-defined]
    return thing


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


def _asking(function: Any) -> Any:
    code = function.__code__
    parameters = code.co_varnames[: code.co_argcount + code.co_kwonlyargcount]
    renamed = {old: new for old, new in OLD_WORDS.items() if new in parameters}
    if not renamed:
        return function

    @wraps(function)
    def asked(*values: Any, **named: Any) -> Any:
        for old in renamed.keys() & named.keys():
            raise InvalidInput(f"the argument {old} of {function.__name__} is called {renamed[old]} now")
        return function(*values, **named)

    return asked
