"""Old names of a package, which raise and name the new ones for one release."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from typing import Any

from .inputs import InvalidInput

__all__ = ["with_old_names"]


def with_old_names(package: str, find: Callable[[str], Any], new_names: Mapping[str, str]) -> Callable[[str], Any]:
    """The ``__getattr__`` of a package: ``find``, but for old names, for which it raises :class:`InvalidInput`.

    The error is no AttributeError, whose text Python hides from ``from package import name``.
    """

    def attribute(name: str) -> Any:
        if name in new_names:
            raise InvalidInput(f"{package}.{name} is called {new_names[name]} now")
        return find(name)

    return attribute
