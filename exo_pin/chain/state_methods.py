"""Methods of a chain made from functions of its state, and from functions that read one."""

from __future__ import annotations

from collections.abc import Callable
from functools import wraps
from inspect import Parameter, signature
from typing import TYPE_CHECKING, Any, Concatenate, ParamSpec, TypeVar

import pinocchio as pin

from .structure.chain_state import ChainState
from .structure.description import Closures

if TYPE_CHECKING:
    from .closed_chain import ClosedChain

_Given = ParamSpec("_Given")
_Answer = TypeVar("_Answer")


def method_of_state(
    function: Callable[Concatenate[ChainState, _Given], _Answer],
) -> Callable[Concatenate[Any, _Given], _Answer]:
    """The method that hands the ``_state`` of its object to a function."""

    @wraps(function)
    def method(self: Any, *given: _Given.args, **named: _Given.kwargs) -> _Answer:
        return function(self._state, *given, **named)

    return _called_on("self", method, 1)


def class_method_of(read: Callable[_Given, tuple[pin.Model, Closures]]) -> classmethod[Any, _Given, ClosedChain]:
    """The class method that makes an object of the tree and the closures that a function returns."""

    @wraps(read)
    def method(cls: Any, *given: _Given.args, **named: _Given.kwargs) -> ClosedChain:
        return cls(*read(*given, **named))

    return classmethod(_called_on("cls", method, 0, return_annotation="ClosedChain"))


def _called_on(owner: str, method: Any, first: int, **returned: Any) -> Any:
    """A method whose signature has its owner in place of the first parameters of its function."""
    known = signature(method)
    own = Parameter(owner, Parameter.POSITIONAL_OR_KEYWORD)
    method.__signature__ = known.replace(parameters=[own, *list(known.parameters.values())[first:]], **returned)
    return method
