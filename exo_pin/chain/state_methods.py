"""Methods of a chain made from functions of its state."""

from __future__ import annotations

from collections.abc import Callable
from functools import wraps
from inspect import Parameter, signature
from typing import Any, Concatenate, ParamSpec, TypeVar

from .structure.chain_state import ChainState

_Given = ParamSpec("_Given")
_Answer = TypeVar("_Answer")


def method_of_state(
    function: Callable[Concatenate[ChainState, _Given], _Answer],
) -> Callable[Concatenate[Any, _Given], _Answer]:
    """The method that hands the ``_state`` of its object to a function."""

    @wraps(function)
    def method(self: Any, *given: _Given.args, **named: _Given.kwargs) -> _Answer:
        return function(self._state, *given, **named)

    known = signature(function)
    own = Parameter("self", Parameter.POSITIONAL_OR_KEYWORD)
    method.__signature__ = known.replace(parameters=[own, *list(known.parameters.values())[1:]])  # type: ignore[attr-defined]
    return method
