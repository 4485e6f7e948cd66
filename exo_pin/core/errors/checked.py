"""One rule for arguments of public functions: what does not fit its annotation ends as :class:`InvalidInput`.

:func:`checked` decorates a function, or a class with its constructor and public methods. A call that succeeds costs a
fraction of a microsecond more: only flags are looked at beforehand, because Python would take any text for true. A call
that fails without an error of this package is explained: the first argument that does not fit its annotation is named,
with what was expected and what came. Shapes and names are checked where they are used. An error of a call whose
arguments fit is a fault of the package and stays.
"""

from __future__ import annotations

import sys
from collections.abc import Callable, Iterator, Mapping, Sequence, Set
from functools import wraps
from inspect import Parameter, signature
from numbers import Integral, Real
from types import FunctionType, NoneType, SimpleNamespace, UnionType
from typing import Any, Literal, TypeVar, Union, get_args, get_origin, get_type_hints

import numpy as np
from numpy.typing import ArrayLike

from .base import ExoPinError, echo
from .inputs import InvalidInput

_Thing = TypeVar("_Thing", bound=Callable[..., Any])
_NOTHING = frozenset({NoneType})


def _without_aliases(hint: Any) -> Any:
    """A type without the names that newer versions of NumPy give to unions; unions in it are part of it."""
    hint = getattr(hint, "__value__", hint)
    if get_origin(hint) in (Union, UnionType):
        return Union[tuple(map(_without_aliases, get_args(hint)))]  # noqa: UP007 - made from a tuple
    return hint


_ARRAY_LIKE = frozenset(get_args(_without_aliases(ArrayLike)))
_FLAGS = (bool, np.bool_)
_FLAG_NOTES = ("bool", "InitVar[bool]", bool)


def checked(thing: _Thing) -> _Thing:
    """Decorate a public function, or a class with its constructor and public methods."""
    if not isinstance(thing, type):
        return _explaining(thing)
    room = __package__.partition(".")[0]
    for name, member in {n: m for kind in reversed(thing.__mro__) for n, m in vars(kind).items()}.items():
        inner = getattr(member, "__func__", member)
        own = isinstance(inner, FunctionType) and inner.__module__.startswith(room)
        if own and (name == "__init__" or name[0] != "_") and not hasattr(inner, "explains_arguments"):
            made = _explaining(inner)
            setattr(thing, name, made if inner is member else type(member)(made))
    return thing


def _explaining(function: Any) -> Any:
    code = getattr(function, "__wrapped__", function).__code__
    names = code.co_varnames[: code.co_argcount + code.co_kwonlyargcount]
    # A place that no call has stands for a flag that is given by name alone.
    places = {name: place if place < code.co_argcount else sys.maxsize for place, name in enumerate(names)}
    flags = {name: places[name] for name in names if function.__annotations__.get(name) in _FLAG_NOTES}
    first = min(flags.values(), default=sys.maxsize)

    @wraps(function)
    def call(*values: Any, **named: Any) -> Any:
        if named or len(values) > first:
            for name, place in flags.items():
                flag = values[place] if place < len(values) else named.get(name, True)
                if not isinstance(flag, _FLAGS):
                    raise _misfit(name, flag, "True or False")
        try:
            return function(*values, **named)
        except ExoPinError:
            raise
        except Exception as error:
            found = _explained(function, values, named)
            if found is None:
                raise
            raise found from error

    call.explains_arguments = True  # type: ignore[attr-defined]
    return call


def _misfit(name: str, value: object, expected: str) -> InvalidInput:
    return InvalidInput(f"expected {name} to be {expected}, got {echo(value)}")


def _explained(function: Any, values: Any, named: Any) -> InvalidInput | None:
    """The error that says which argument is to blame; None if none is, or if the call itself is wrong."""
    parameters = signature(function)
    try:
        bound = parameters.bind(*values, **named)
    except TypeError:
        return None
    given = list(_given(function, bound))
    for fit, more in ((_fits, ""), (_is_finite, "finite and "), (_is_array_if_so, "")):
        for name, value, text, hint in given:
            if not fit(value, hint):
                return _misfit(name, value, f"{more}of type {text}")
    return None


def _given(function: Any, bound: Any) -> Iterator[tuple[str, Any, str, Any]]:
    """Name, value, annotation and type of each argument that has been given; of ``*values`` one by one."""
    for name, value in bound.arguments.items():
        parameter = bound.signature.parameters[name]
        text = parameter.annotation
        if text is Parameter.empty or parameter.kind is Parameter.VAR_KEYWORD:
            continue
        hint = _resolved(text, function)
        for one in value if parameter.kind is Parameter.VAR_POSITIONAL else (value,):
            yield name, one, text if isinstance(text, str) else getattr(text, "__name__", str(text)), hint


def _resolved(text: Any, function: Any) -> Any:
    """The type that an annotation means; Any where it cannot be found."""
    if not isinstance(text, str):
        return text
    try:
        noted = SimpleNamespace(__annotations__={"it": text})
        scope = getattr(function, "__wrapped__", function).__globals__
        return _without_aliases(get_type_hints(noted, scope, _Loaded())["it"])
    except Exception:
        return Any


class _Loaded(dict[str, Any]):
    """Names that a module imports for its type checker alone: the one thing that loaded modules call so."""

    def __missing__(self, name: str) -> Any:
        modules = [module for key, module in tuple(sys.modules.items()) if key.startswith("exo_pin.")]
        found = {id(thing): thing for module in modules if (thing := vars(module).get(name)) is not None}
        if len(found) != 1:
            raise KeyError(name)
        return next(iter(found.values()))


def _is_array(hint: Any) -> bool:
    hint = _without_aliases(hint)
    arguments = get_args(hint)
    # Those of a callable are a list.
    arguments = tuple(part for part in arguments if not isinstance(part, list))
    return get_origin(hint) is np.ndarray or set(arguments) >= _ARRAY_LIKE or any(map(_is_array, arguments))


def _is_array_if_so(value: Any, hint: Any) -> bool:
    """Whether a value is an array where nothing else is taken; lists are looked at last, because many take them."""
    return get_origin(hint) is not np.ndarray or isinstance(value, np.ndarray)


def _is_finite(value: Any, hint: Any) -> bool:
    """Whether numbers are finite, where numbers are expected."""
    if not (hint in (int, float) or _is_array(hint)) or value is None:
        return True
    return not _is_numeric(value) or bool(np.isfinite(np.asarray(value, dtype=float)).all())


def _fits(value: Any, hint: Any) -> bool:
    """Whether a value is of the type of an annotation, as far as its parts can be looked at without using them up."""
    hint = _without_aliases(hint)
    if hint is Any or hint is object or isinstance(hint, TypeVar):
        return True
    if hint is None or hint is NoneType:
        return value is None
    origin, arguments = get_origin(hint), get_args(hint)
    if origin in (Union, UnionType):
        if set(arguments) >= _ARRAY_LIKE:
            # An array alone, or None, holds numbers; beside other types a text of theirs is not told from NumPy's.
            others = set(arguments) - _ARRAY_LIKE
            return _is_numeric(value) or any(_fits(value, one) for one in (others if others <= _NOTHING else arguments))
        return any(_fits(value, one) for one in arguments)
    if origin is Literal:
        return isinstance(value, str | int | NoneType) and value in arguments
    if origin is np.ndarray:
        return _is_numeric(value)
    if hint is bool:
        return isinstance(value, _FLAGS)
    if hint in (int, float):
        kind = Integral if hint is int else Real
        return isinstance(value, kind) and not isinstance(value, bool) and _is_numeric(value)
    if origin is tuple and isinstance(value, tuple) and arguments[-1:] != (...,):
        return len(value) == len(arguments) and all(map(_fits, value, arguments))
    return isinstance(value, origin or hint) and _parts_fit(value, arguments) if _is_class(origin or hint) else True


def _is_class(hint: Any) -> bool:
    return isinstance(hint, type) and not getattr(hint, "_is_protocol", False)


def _parts_fit(value: Any, arguments: tuple[Any, ...]) -> bool:
    """Whether the parts of a list, tuple, set or mapping are of their types."""
    if isinstance(value, np.ndarray):
        return not arguments or (value.ndim > 0 and all(_fits(part, arguments[0]) for part in value[:1]))
    if isinstance(value, Mapping) and len(arguments) == 2:
        return all(_fits(key, arguments[0]) and _fits(part, arguments[1]) for key, part in value.items())
    if isinstance(value, str | bytes) and arguments:
        return False
    if isinstance(value, Sequence | Set | Mapping) and arguments:  # a mapping goes by its keys
        return all(_fits(part, arguments[0]) for part in value)
    return True


def _is_numeric(value: Any) -> bool:
    """Whether a value is made of real numbers that floats can hold."""
    try:
        array = np.asarray(value)
        return array.dtype.kind in "biuf"
    except Exception:  # ragged, nested too deep
        return False
