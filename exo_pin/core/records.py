"""Records that survive pickling and copying, and objects that explain why they cannot.

Pickle and deepcopy make new arrays that can be written, also of arrays that could not. Here the state of an object
names the arrays that are read-only, so that the copy's are, too.
"""

from __future__ import annotations

from collections.abc import Mapping
from functools import cached_property
from types import MappingProxyType
from typing import Any, ClassVar, NoReturn, Self, TypeVar

import numpy as np

_Kind = TypeVar("_Kind")


def read_only_arrays(value: Any) -> list[np.ndarray]:
    """Arrays that cannot be written, in a value and in tuples, lists and mappings within it; not in objects within."""
    if isinstance(value, np.ndarray):
        return [] if value.flags.writeable else [value]
    inner = value.values() if isinstance(value, Mapping) else value if isinstance(value, tuple | list) else ()
    return [array for item in inner for array in read_only_arrays(item)]


def freeze(arrays: list[np.ndarray]) -> None:
    """Switch writing off."""
    for array in arrays:
        array.setflags(write=False)


class Record:
    """Base of objects whose attributes are all that they are.

    A copy has the same attributes, its arrays read-only where they were. What a ``cached_property`` holds is left out:
    the copy computes it again.
    """

    @classmethod
    def made_of(cls, **attributes: Any) -> Self:
        """An object with these attributes and no other, unchecked.

        The own ``__init__`` of a frozen dataclass sets its attributes one by one, which takes microseconds.
        """
        made = cls.__new__(cls)
        object.__setattr__(made, "__dict__", attributes)
        return made

    def __getstate__(self) -> tuple[dict[str, Any], list[np.ndarray], list[str]]:
        computed = {name for name in vars(self) if isinstance(getattr(type(self), name, None), cached_property)}
        state = {name: value for name, value in vars(self).items() if name not in computed}
        # A view on a mapping cannot be pickled: the mapping is, and the copy makes the view.
        views = [name for name, value in state.items() if isinstance(value, MappingProxyType)]
        state |= {name: dict(state[name]) for name in views}
        return state, read_only_arrays(state), views

    def __setstate__(self, state: tuple[dict[str, Any], list[np.ndarray], list[str]]) -> None:
        attributes, arrays, views = state
        freeze(arrays)
        vars(self).update(attributes)
        vars(self).update({name: MappingProxyType(attributes[name]) for name in views})


def keeps_read_only(kind: type[_Kind]) -> type[_Kind]:
    """Decorate a NamedTuple: its read-only arrays are read-only in copies, and in other processes, too."""
    kind.__reduce__ = reduced_tuple  # type: ignore[assignment, method-assign]
    return kind


def reduced_tuple(record: tuple[Any, ...]) -> tuple[Any, ...]:
    """``__reduce__`` of a NamedTuple that holds read-only arrays."""
    return _tuple_again, (type(record), tuple(record), read_only_arrays(tuple(record)))


def _tuple_again(kind: type[Any], values: tuple[Any, ...], arrays: list[np.ndarray]) -> Any:
    freeze(arrays)
    return kind(*values)


class OneProcess:
    """Base of objects that cannot leave their process, nor be copied: they hold a server, a program, or raw memory.

    ``_instead`` names the alternative.
    """

    _instead: ClassVar[str] = "send or copy the object it was made from, and make a new one from it"

    def __reduce_ex__(self, _: Any) -> NoReturn:
        raise TypeError(f"{type(self).__name__} cannot be pickled or copied: {self._instead}")

    def __copy__(self) -> Self:
        return self.__reduce_ex__(4)

    def __deepcopy__(self, _: dict[int, Any]) -> Self:
        return self.__reduce_ex__(4)
