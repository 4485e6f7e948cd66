"""What is said of arguments that do not fit a function, and of faults within it, as stored."""

from __future__ import annotations

from collections.abc import Callable, Iterable, Mapping, Sequence
from dataclasses import dataclass
from typing import Any, Literal

import numpy as np
from answers import changes, each_of
from asked_in_turn import in_turn, tried
from numpy.typing import ArrayLike, NDArray

import exo_pin as ep
from exo_pin.core.errors.checked import checked


@dataclass
class Own:
    """A record with fields."""

    length: Any = 2
    wall: Any = 0.0
    mass: Any = None


class Numbers:
    """What newer versions of NumPy have for arrays: a name of the union."""

    __value__ = ArrayLike


@checked
def asked_for(
    size: float,
    count: int = 1,
    *more: str,
    name: str | None = None,
    loud: bool = False,
    poses: ArrayLike = 0.0,
    array: NDArray[np.float64] | None = None,
    pair: tuple[float, str] = (1.0, "a"),
    rows: Sequence[int] = (),
    by_name: Mapping[str, float] | None = None,
    kind: Literal["a", "b"] = "a",
    call: Callable[[float], float] | None = None,
    part: Own | None = None,
    maybe: ArrayLike | str | None = None,
    alias: Numbers | str | None = None,
    nothing: None = None,
    anything: Any = None,
    names: Sequence[str] = (),
    many: Iterable[float] = (),
    shape: WristGeometry | None = None,  # noqa: F821 - found where it is loaded
    **others: int,
):
    """A question that fails unless all is as expected."""
    raise RuntimeError(f"{size} {loud}")


def failing(**given):
    try:
        return asked_for(**{"size": 1.0} | given)
    except RuntimeError as error:
        return f"RuntimeError: {error}"


GIVEN = {
    "size": (1.5, 2, "a", None, True, np.nan, np.float32(2.0), [1.0], np.array(1.0)),
    "count": (1, 1.0, np.int8(3), True),
    "name": (None, "a", 3),
    "loud": (np.ones(2), True, np.bool_(False), 1, None, "yes"),
    "poses": ([np.nan, None], [1.0, 2.0], [[1.0], [1.0, 2.0]], "a", None, [np.inf], [True]),
    "array": (None, [1.0], np.ones(2), np.array(["a"]), np.array([1.0, np.nan])),
    "pair": ((1.0, "b"), (1.0,), ("b", 1.0), [1.0, "b"]),
    "rows": (np.array(2.0), [1, 2], "ab", (1.0,), [True], 3, np.array([1, 2]), np.array([1.5])),
    "by_name": ({"a": 1}, {"a": "b"}, {1: 1.0}, None, 3),
    "kind": ("b", "c", 3, ["a"]),
    "call": (abs, 3, None),
    "part": (Own(), None, "own"),
    "maybe": ("a", [1.0], {1}, ["a"]),
    "alias": ("a", [1.0], {1}, ["a"]),
    "nothing": (None, 3),
    "anything": (None, 3),
    "names": (["a"], "ab"),
    "many": (np.array([1.0]), np.array(["a"]), np.array(2.0), [1.0], 3),
    "shape": (None, ep.load("four-cables").geometry, 3),
    "more_size": (3, "a"),
}


def without():
    try:
        return asked_for()
    except TypeError as error:
        return str(error)


def asked_of_calls():
    return {
        name: tried(lambda value, name=name: failing(**{name: value}), *values) for name, values in GIVEN.items()
    } | in_turn(
        positional=lambda: failing(more=3) and asked_for_more("a", 3),
        unknown=without,
        too_large=lambda: failing(loud=2),
    )


def asked_for_more(*more):
    try:
        return asked_for(1.0, 2, *more)
    except RuntimeError as error:
        return f"RuntimeError: {error}"


ASKED = {"calls": asked_of_calls}


@each_of(ASKED, longer=ASKED)
def test_an_answer_is_as_stored(name):
    assert not changes(__file__, name, ASKED[name])
