"""Old names of a package, which raise and name the new ones for one release."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from typing import Any

from .inputs import InvalidInput


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
