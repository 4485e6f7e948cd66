"""The face that all results share: a short ``repr``, plain data, JSON and tables, and where the numbers come from.

Plain data are numbers, strings, lists and dicts: what a result's fields hold, by their names and in their units.

Pictures of results, drawn by a room that stands above the results.

A result has a method ``plot`` because that is where a user looks for it. Its room knows nothing of pictures: the method
passes itself on by name.
"""

from __future__ import annotations

import dataclasses
import itertools
import json
import math
from collections.abc import Mapping, Sequence
from importlib import import_module
from pkgutil import resolve_name
from typing import Any, ClassVar

import numpy as np
from scipy.spatial.transform import Rotation

from .optional_packages import optional
from .records import Record
from .schema import document

#: Characters of a ``repr``, and of one field of it.
_SCREEN, _FIELD = 1200, 80


#: Effects of what was taken as known, in words.
_EFFECTS = {
    "joints_mm": "mm of the joints",
    "F_s_percent": "% of |F_s|",
    "pose_deg": "deg of the pose",
    "force_percent": "% of the force",
    "friction_percent": "% of the friction",
    "damping_percent": "% of the damping",
}


@dataclasses.dataclass(frozen=True)
class Known:
    """A quantity that an answer took as known, and what an error of it does.

    Attributes
    ----------
    name : str
        Of the quantity.
    size : float
        The error meant, in ``unit``: one unit of it, or its tolerance where that was stated.
    unit : str
        Of ``size``.
    effects : dict of str to float
        What such an error does, by names that end in their units.
    shows : bool
        Whether the data would contradict it.
    is_stated : bool
        Whether ``size`` is a stated tolerance, which counts in the deviations of the answer.

    Examples
    --------
    >>> from exo_pin.core.results import Known
    >>> print(Known("torso mounting", 1.0, "deg", {"joints_mm": 8.7, "F_s_percent": 1.6}, shows=False))
    1 deg of the torso mounting: 8.7 mm of the joints, 1.6 % of |F_s|
    """

    name: str
    size: float
    unit: str
    effects: Mapping[str, float]
    shows: bool
    is_stated: bool = False

    def __str__(self) -> str:
        does = ", ".join(f"{size:.2g} {_EFFECTS.get(name, name)}" for name, size in self.effects.items())
        known = " (its tolerance)" if self.is_stated else ""
        return f"{self.size:.3g} {self.unit} of the {self.name}{known}: {does}"


def taken_as_known(known: Sequence[Known], more: str = "") -> str:
    """One sentence on what an answer took as known; empty where it is nothing."""
    return f"Taken as known{more}: {'; '.join(map(str, known))}." if known else ""


class Result(Record):
    """Base of results.

    Attributes
    ----------
    cautions : tuple of str
        What to mind: doubts about the numbers, what was not checked or not used, a sentence each.
    """

    cautions: ClassVar[Any] = ()
    #: Field whose shape is that of the stack of poses or samples; where it has none, rows are what all arrays share.
    _per_row: ClassVar[str] = "status"
    #: Properties that its plain data have besides the fields, a record that describes
    #: its data where they are none of its fields, and records that describe what it has besides.
    _derived: ClassVar[tuple[str, ...]] = ()
    _document: ClassVar[type | None] = None
    _described: ClassVar[tuple[type, ...]] = ()
    #: Fields that are no data of the result, such as what it computes others from.
    _hidden: ClassVar[frozenset[str]] = frozenset({"source"})

    def __init_subclass__(cls, **options: Any) -> None:
        super().__init_subclass__(**options)
        # A dataclass keeps a __repr__ that its class has already.
        if "__repr__" not in vars(cls):
            cls.__repr__ = Result.__repr__  # type: ignore[method-assign]

    @property
    def provenance(self) -> dict[str, Any]:
        """Where the numbers come from: kind of the result and version of the package."""
        return {"result": type(self).__name__, "exo_pin": import_module("exo_pin").__version__}

    def as_dict(self) -> dict[str, Any]:
        """Fields as arrays and plain values, with verdict and cautions, in one flat dict.

        Returns
        -------
        dict
            By name of the field or property; arrays keep their shapes.

        Examples
        --------
        >>> exo = ep.load("four-cables")
        >>> fields = exo.singularity(exo.pose(60)).as_dict()
        >>> round(float(fields["smallest_singular_value"] * fields["amplification"]), 9)  # inverse of each other
        1.0
        """
        found = {
            name: value.as_dict() if isinstance(value, Result) else value
            for name, value in self._fields().items()
            if isinstance(value, Result) or _is_data(value)
        }
        verdict = getattr(self, "verdict", None)
        if isinstance(verdict, str):
            found["verdict"] = verdict
        found |= {name: getattr(self, name) for name in self._derived}
        return found | {"cautions": list(self.cautions)}

    def document(self) -> dict[str, Any]:
        """Plain data of :meth:`as_dict` and :attr:`provenance`, with the name of their schema and their units.

        Returns
        -------
        dict
            What :meth:`to_json` writes; a number that is not finite is None.

        Examples
        --------
        >>> exo = ep.load("four-cables")
        >>> found = exo.reaction(exo.pose(60, 30)).document()
        >>> found["schema"], found["units"]["shoulder_force"]
        ('exo_pin.reaction/1', 'N')
        """
        return dict(plain(document(type(self), self.as_dict() | {"provenance": self.provenance})))

    def to_json(self, indent: int | None = 2) -> str:
        """Return :meth:`document` as JSON; a number that is not finite is null.

        Parameters
        ----------
        indent : int or None
            Spaces a level; None for one line.

        Returns
        -------
        str

        Examples
        --------
        >>> import json
        >>> exo = ep.load("four-cables")
        >>> json.loads(exo.reaction(exo.pose(60, 30)).to_json())["can_hold"]
        True
        """
        return json.dumps(self.document(), indent=indent)

    @property
    def notes(self) -> dict[str, Any]:
        """What is to be known about a table of :meth:`columns`: verdict, cautions and :attr:`provenance`, plain."""
        verdict = getattr(self, "verdict", None)
        said = {"verdict": verdict} if isinstance(verdict, str) else {}
        return dict(plain(said | {"cautions": list(self.cautions), "provenance": self.provenance}))

    def to_dataframe(self) -> Any:
        """A pandas DataFrame of :meth:`columns`.

        Returns
        -------
        pandas.DataFrame

        Raises
        ------
        MissingExtra
            If pandas is not installed.

        Examples
        --------
        >>> exo = ep.load("four-cables")
        >>> frame = exo.singularity(exo.pose(flexion=[0, 30, 60, 90])).to_dataframe()
        >>> len(frame), frame["kind"].unique().tolist()  # one row a pose
        (4, ['regular'])
        """
        return frame_of(self.columns())

    def columns(self) -> dict[str, Any]:
        """Arrays by name, one row a pose or sample, a column for each number that it has.

        Returns
        -------
        dict of str to ndarray
            Each of shape (N,); the units are in the names.

        Examples
        --------
        >>> exo = ep.load("four-cables")
        >>> table = exo.reaction(exo.pose([0, 90])).columns()
        >>> table["f_2_N"].round(1).tolist()
        [1.0, 19.9]
        """
        data = self.as_dict()
        shape = np.shape(data[self._per_row]) if self._per_row in data else _common([*data.values()])
        columns: dict[str, Any] = {}
        for name, value in data.items():
            array = np.asarray(value) if isinstance(value, np.ndarray | np.generic | float | int | str) else None
            if array is None or array.shape[: len(shape)] != shape:
                continue
            for index in np.ndindex(array.shape[len(shape) :]):
                columns["_".join([name, *(str(i + 1) for i in index)])] = array[(..., *index)]
        return columns

    def _fields(self) -> dict[str, Any]:
        names = [field.name for field in dataclasses.fields(self)]  # type: ignore[arg-type]
        return {name: getattr(self, name) for name in names if name not in self._hidden and not name.startswith("_")}

    def __repr__(self) -> str:
        verdict = getattr(self, "verdict", None)
        parts = [repr(verdict)] if isinstance(verdict, str) else []
        parts += [f"{name}={_shown(value)}" for name, value in self._fields().items() if value is not None]
        text = f"{type(self).__name__}({', '.join(parts)})"
        return text if len(text) <= _SCREEN else f"{text[: _SCREEN - 5]}, ...)"


def _common(values: list[Any]) -> tuple[int, ...]:
    """The leading dimensions that all arrays have in common."""
    shapes = [value.shape for value in values if isinstance(value, np.ndarray) and value.ndim]
    return tuple(
        sides[0] for sides in itertools.takewhile(lambda sides: len(set(sides)) == 1, zip(*shapes, strict=False))
    )


def plain(value: Any) -> Any:
    """A value as numbers, strings, lists and dicts; what is not finite becomes None, what has no data its ``repr``."""
    if isinstance(value, Mapping):
        return {str(key): plain(item) for key, item in value.items()}
    if isinstance(value, np.ndarray | np.generic):
        return plain(value.tolist())
    if isinstance(value, tuple) and hasattr(value, "_asdict"):
        return plain(value._asdict())
    if isinstance(value, list | tuple | set | frozenset):
        return [plain(item) for item in value]
    if isinstance(value, float):
        return value if math.isfinite(value) else None
    if value is None or isinstance(value, str | int):
        return value
    if isinstance(value, Rotation):
        return {"quaternions_xyzw": plain(value.as_quat())}
    if isinstance(value, Result):
        return plain(value.as_dict())
    if dataclasses.is_dataclass(value) and not isinstance(value, type):
        shown = [field.name for field in dataclasses.fields(value) if not field.name.startswith("_")]
        return {name: plain(getattr(value, name)) for name in shown}
    return _shown(value)


def frame_of(columns: dict[str, Any]) -> Any:
    """A pandas DataFrame of columns, one row a pose; a stack of several dimensions has an index of as many levels.

    Raises
    ------
    MissingExtra
        If pandas is not installed.
    """
    pandas = optional("study", "pandas")
    shape = next(map(np.shape, columns.values()), ())
    names = [f"axis_{k}" for k in range(len(shape))]
    index = None if len(names) < 2 else pandas.MultiIndex.from_product([range(n) for n in shape], names=names)
    return pandas.DataFrame({name: np.asarray(values).ravel() for name, values in columns.items()}, index=index)


def _is_data(value: Any) -> bool:
    """Whether a field is a number, a string, an array, or a record that holds such."""
    if dataclasses.is_dataclass(value) and not isinstance(value, type):
        return all(_is_data(getattr(value, field.name)) for field in dataclasses.fields(value))
    if isinstance(value, Mapping):
        return all(map(_is_data, value.values()))
    if isinstance(value, list | tuple):
        return all(map(_is_data, value))
    return value is None or isinstance(value, np.ndarray | np.generic | float | int | str | Rotation)


def _shown(value: Any) -> str:
    """A field in a few characters."""
    if isinstance(value, np.ndarray | np.generic):
        if np.ndim(value) == 0:
            return _shown(value.item())
        if value.size <= 3 and value.dtype.kind in "fiub":
            return str(np.array2string(np.asarray(value), precision=4, separator=", "))
        return f"<{'str' if value.dtype.kind == 'U' else value.dtype} {value.shape}>"
    if isinstance(value, Rotation):
        return f"<Rotation {value.shape}>"
    if isinstance(value, float):
        return f"{value:.6g}"
    if isinstance(value, Mapping | tuple | list):
        if len(value) > 3:
            return f"<{len(value)} entries>"
        pairs = value.items() if isinstance(value, Mapping) else [("", item) for item in value]
        text = f"[{', '.join(f'{name}: {_shown(item)}' if name else _shown(item) for name, item in pairs)}]"
    else:
        text = repr(value) if isinstance(value, str | int | None) else f"<{type(value).__name__}>"
    return text if len(text) <= _FIELD else f"{text[: _FIELD - 3]}..."


def drawn(kind: str, *arguments: Any) -> Any:
    """The figure that a module of :mod:`exo_pin.view.plots` makes.

    Parameters
    ----------
    kind : str
        Module and function, such as "answer_plots:reaction_figure".
    *arguments
        Passed on.

    Raises
    ------
    MissingExtra
        If matplotlib is not installed.
    """
    return resolve_name(f"exo_pin.view.plots.{kind}")(*arguments)
