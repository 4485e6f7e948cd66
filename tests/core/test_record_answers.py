"""Answers of records that all rooms share, as they are stored: results, their schemas and copies."""

from __future__ import annotations

import copy
import pickle
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field, make_dataclass
from types import MappingProxyType
from typing import Any, ClassVar, Literal, NamedTuple

import numpy as np
import pytest
from answers import changes, each_of
from asked_in_turn import in_turn
from numpy.typing import NDArray
from scipy.spatial.transform import Rotation

import exo_pin as ep
from exo_pin.core import schema, validation
from exo_pin.core.records import OneProcess, Record, keeps_read_only
from exo_pin.core.results import Known, Result, frame_of, plain, taken_as_known
from exo_pin.report import DesignReport


@dataclass
class Own:
    """A record with fields."""

    length: Any = 2
    wall: Any = 0.0
    mass: Any = None


class Unprintable:
    """What Python cannot print."""

    def __repr__(self):
        raise ValueError


class Point(NamedTuple):
    """A point.

    Attributes
    ----------
    x_mm : float
        Along the arm.
    name : str
        What it is called.
    """

    x_mm: float
    name: str


class Corner(NamedTuple):
    """A corner.

    Attributes
    ----------
    y_m : float
        To the left.
    """

    y_m: float


@dataclass(frozen=True, repr=False)
class Part(Result):
    """A part of an answer.

    Attributes
    ----------
    mass : float or None
        In kg, of all.
    about : str
        Or None.
    corner : Corner or None
        Of it.
    """

    mass: float | None
    about: str = "none"
    corner: Corner | None = None


@dataclass(frozen=True, repr=False)
class Answer(Result):
    """An answer with fields of each kind.

    Attributes
    ----------
    status : ndarray of str
        Shape (n,), "ok" or why not.
    force_N : ndarray
        Shape (n, 2), of each limb.
    torques, rates : ndarray
        Shape (n,), N m and rad/s.
    held : ndarray of bool
        Shape (n,).
    share : float
        A share of all.
    turn : Rotation
        Of the arm.
    part : Part
        With a mass.
    points : tuple of Point
        Several.
    by_name : mapping
        Names to N, by name.
    kind : str
        One of two.
    count : int or None
        How many.
    limits : tuple of float
        Least and greatest in mm.
    anything : object
        Whatever.
    """

    status: NDArray[np.str_]
    force_N: NDArray[np.float64]
    torques: NDArray[np.float64]
    rates: NDArray[np.float64]
    held: NDArray[np.bool_]
    share: float
    turn: Rotation
    part: Part
    points: tuple[Point, ...]
    by_name: Mapping[str, float]
    kind: Literal["a", "b"] = "a"
    count: int | None = None
    limits: tuple[float, float] = (1.0, np.inf)
    anything: Any = None
    source: Any = None
    _memory: Any = None
    _derived: ClassVar[tuple[str, ...]] = ("whole",)

    @property
    def verdict(self):
        """Whether it holds."""
        return "It holds."

    @property
    def cautions(self):
        """What to mind."""
        return ("Mind this.",)

    @property
    def whole(self) -> float:
        """All of it, in N.

        More words.
        """
        return float(self.force_N.sum())


#: An answer of twenty texts.
Wide = make_dataclass("Wide", [(f"limb_{k}", str) for k in range(20)], bases=(Result,), repr=False)


def some_answer(**changes):
    values = {
        "status": np.array(["ok", "ok", "no"]),
        "force_N": np.arange(6.0).reshape(3, 2),
        "torques": np.array([1.0, np.nan, 3.25]),
        "rates": np.array([0.5, 0.25, 0.125]),
        "held": np.array([True, True, False]),
        "share": 0.123456789,
        "turn": Rotation.from_rotvec([0.1, 0.0, 0.0]),
        "part": Part(2.0),
        "points": (Point(1.0, "a"), Point(np.inf, "b")),
        "by_name": {"a": 1.0, "b": -2.0},
        "anything": {1, 2},
        "source": "hidden",
        "_memory": 3,
    }
    return Answer(**values | changes)


def asked_of_results():
    answer, part = some_answer(), Part(None)
    kinds = [
        3,
        1.5,
        np.float64(np.nan),
        "a",
        None,
        True,
        np.arange(3),
        np.arange(4),
        np.array(["a", "b"]),
        np.array([True, False]),
    ]
    kinds += [
        Rotation.identity(2),
        {"a": 1.0},
        [1, 2, 3, 4],
        (1.0, "a"),
        ["a" * 90],
        object(),
        np.array(2.5),
        {},
        1234567.8,
        np.array([0.123456]),
        np.array("a"),
        "a" * 78,
        "a" * 79,
    ]
    known = [
        Known("ruler", 1.25, "mm", {"joints_mm": 0.123, "other": 2.0}, True, True),
        Known("gauge", 0.1, "bar", {}, False),
    ]
    return {
        "document": {key: value for key, value in answer.document().items() if key != "provenance"},
        "lines": (answer.to_json(None)[:200], answer.to_json(1)[:60]),
        "bare": [Bare(np.ones((2, 3)), np.ones(size), 2.0).columns() for size in ((2,), (2, 2), (3,))],
        "records": [sorted(Part(1.0, about).as_dict()) for about in (Own(), Own, {"a": object()}, [object()])],
        "notes": {key: value for key, value in answer.notes.items() if key != "provenance"},
        "provenance": sorted(answer.provenance),
        "columns": answer.columns(),
        "inner": type(answer.as_dict()["part"]).__name__,
        "part": (part.as_dict(), part.columns(), repr(part), sorted(part.notes)),
        "shown": [repr(Part(value))[10:-14] for value in kinds],
        "long": [
            len(repr(some_answer(kind="k" * n, status="s" * 900, count="c" * 70, share="d" * 70))) for n in (1, 70)
        ],
        "widest": [len(repr(Wide(*["a" * 50] * 19, "a" * last))) for last in (16, 17)],
        "repr": repr(answer),
        "plain": plain(
            {
                "a": {1},
                2: (np.float64(np.inf), None, True),
                "point": Point(2.0, "x"),
                "own": Own(),
                "kind": Own,
                "e": Part(1.0),
            }
        ),
        "known": taken_as_known(known, " here"),
        "nothing_known": taken_as_known([]),
        "common": Answer.columns(
            some_answer(status=np.zeros((3, 2)), force_N=np.zeros((3, 2, 2)), torques=np.zeros((3, 2)))
        ),
    }


@dataclass(frozen=True, repr=False)
class Bare(Result):
    """An answer without a status."""

    a: NDArray[np.float64]
    b: NDArray[np.float64]
    c: float


@dataclass(frozen=True, repr=False)
class Either(Result):
    """An answer that is one of two records.

    Attributes
    ----------
    one : Part or Corner
        Of it.
    """

    one: Part | Corner


def asked_of_frames():
    pytest.importorskip("pandas")
    both = {"a": np.ones((2, 3)), "b": np.arange(6).reshape(2, 3)}
    return [frame_of(columns).to_csv() for columns in (both, {"a": np.arange(2)}, {})]


@dataclass
class Asked:
    """What is asked.

    Parameters
    ----------
    mass : float
        Of the arm, kg.
    names : tuple of str
        Of limbs.
    part : Part or None
        Whatever it is.
    pose : array_like or None
        Angles in degrees.
    """

    mass: float
    names: tuple[str, ...] = ("a",)
    part: Part | None = None
    pose: Sequence[float] | None = None
    rate: float | None = 2.5
    other: Any | None = None


UNITS = """In m, or a share of it.
Of the arm, kg.
Shape (n, 3), N.
m and rad
In mm, about
a share of all
Own unit each
N s/m of it
percent
rad
Force in N each, and m.
dimensionless
Speed, m/s.
A newton
N m/rad for it
°/s
Hz, W
(kg m²)
no Pas
N, m, s, bar
degrees where it is
In bar that it has
""".splitlines()


def asked_of_schemas():
    s = schema
    own = s.identifier("answer")
    documents = (
        {"schema": own},
        {"schema": "exo_pin.answer/2"},
        {"schema": "exo_pin.other/1"},
        {"schema": "answer"},
        {},
        None,
        {"schema": 3},
    )
    documents += ({"schema": "exo_pin.answer/0"}, {"schema": "exo_pin.answer/1x"})
    return {
        "units": [s.unit_in(text) for text in UNITS],
        "of": dict(s.units_of(Answer)),
        "of_drives": dict(s.units_of(DesignReport)["drives"]),
        "members": {name: [member.text, member.unit, member.required] for name, member in s.members(Answer).items()},
        "asked": {name: [member.text, member.unit, member.required] for name, member in s.members(Asked).items()},
        "schema": s.schema_of(Answer),
        "named": s.schema_of(Part, "own")["$id"],
        "either": s.schema_of(Either)["$defs"]["EitherDocument"]["properties"]["one"],
        "inputs": s.input_schemas(Asked),
        "checked": in_turn(
            {str(k): lambda d=d: s.checked_identifier(d, ["answer", "part"]) for k, d in enumerate(documents)}
        ),
        "names": [s.name_of(kind) for kind in (Answer, OneProcess, Unprintable)],
        "document": s.document(Part, {"mass": 2.0}, "own"),
        "absent": s.document(Answer, {"part": None, "force_N": [1.0], "points": [1]}),
        "reachable": [kind.__name__ for kind in s.reachable(Answer)],
        "joined": s.joined(Part, ep.load("four-cables"), mass=3.0),
    }


@dataclass(frozen=True)
class Kept(Record):
    """Arrays in a record, some of which cannot be written."""

    one: np.ndarray
    other: np.ndarray
    inner: tuple = ()
    view: Mapping = field(default_factory=lambda: MappingProxyType({"a": 1}))


@keeps_read_only
class Pair(NamedTuple):
    """Two arrays."""

    one: np.ndarray
    other: np.ndarray


@dataclass(frozen=True)
class Locked(validation.ReadOnly):
    """A record whose arrays cannot be written."""

    one: np.ndarray
    other: list


class Alone(OneProcess):
    """What stays in its process."""


def refused(action):
    try:
        action()
    except TypeError as error:
        return str(error)


def asked_of_records():
    locked = Locked(np.ones(2), [np.ones(1)])
    first = validation.frozen(np.arange(2.0))
    kept = Kept(first, np.ones(2), ({"a": first}, [np.zeros(1)]))
    again, pair = pickle.loads(pickle.dumps(kept)), copy.deepcopy(Pair(first, np.ones(1)))
    return {
        "kept": [array.flags.writeable for array in (again.one, again.other, again.inner[0]["a"], again.inner[1][0])],
        "view": (type(again.view).__name__, dict(again.view)),
        "pair": [array.flags.writeable for array in pair],
        "read_only": [value.flags.writeable for value in (locked.one, locked.other[0])],
        "made": vars(Kept.made_of(one=1, other=2)),
        "alone": [
            refused(lambda: pickle.dumps(Alone())),
            refused(lambda: copy.copy(Alone())),
            refused(lambda: copy.deepcopy(Alone())),
        ],
    }


ASKED = {
    "results": asked_of_results,
    "frames": asked_of_frames,
    "schemas": asked_of_schemas,
    "records": asked_of_records,
}
#: Those that take longer than 0.15 s.
LONGER = {"schemas"}


@each_of(ASKED, LONGER)
def test_an_answer_is_as_stored(name):
    assert not changes(__file__, name, ASKED[name])
