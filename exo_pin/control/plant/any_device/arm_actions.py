"""What acts on the arm besides device and weight: what a wearer's moment is asked with, and payloads."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from dataclasses import dataclass
from typing import Any, NamedTuple

import numpy as np

from ....core.errors import InvalidInput, MissingData
from ....core.errors.checked import checked
from ....core.validation import FloatArray, as_finite, as_positive, as_real, set_fields, set_positive
from ....load_case import Load

#: Two times nearer than this, s, are one.
_SAME = 1e-9


def require_known(source: object, values: Mapping[str, Any], query: str) -> None:
    """Raise MissingData for values that nobody gave, or gave without a source."""
    missing = [name for name, value in values.items() if value is None]
    missing += [] if isinstance(source, str) and source.strip() else ["source"]
    if missing:
        raise MissingData(missing, query)


def check_span(record: Any) -> None:
    """Check that a record starts at a time of zero or more, s, and ends later, or never."""
    as_positive("start", record.start, zero=True)
    end = as_real("end", record.end)
    if end.shape != () or not end > record.start:
        raise InvalidInput(f"expected end after start, got {record.end!r} and {record.start!r}")


def load_at_shoulder(load: Load, R: FloatArray) -> tuple[FloatArray, FloatArray]:
    """Force of a load on the arm and its moment about O, base frame, at an orientation of the arm, shape (3, 3)."""
    force, moment = (np.asarray(part, dtype=float) for part in (load.force, load.moment))
    if load.frame == "arm":
        force, moment = R @ force, R @ moment
    return force, moment + np.cross(R @ np.asarray(load.at), force)


class ArmState(NamedTuple):
    """Where the arm is and how it turns, as the wearer's moments are asked.

    Attributes
    ----------
    matrix : ndarray
        Shape (3, 3), {O_B} to {O_A}.
    angular_velocity : ndarray
        Shape (3,), rad/s, base frame.

    Examples
    --------
    >>> from exo_pin.control import ArmState
    >>> arm = ArmState(np.eye(3), np.array([0.0, 0.5, 0.0]))
    >>> -0.4 * arm.angular_velocity + 0.0  # N m, of a damper
    array([ 0. , -0.2,  0. ])
    """

    matrix: FloatArray
    angular_velocity: FloatArray


@checked
@dataclass(frozen=True)
class Payload:
    """A point mass that is part of the arm from a time to another.

    Parameters
    ----------
    mass : float
        kg.
    at : array_like
        Where the arm holds it, shape (3,), m, arm frame.
    start, end : float
        When it is caught, at rest, and dropped, s. With a start of zero it is there from the beginning.

    Raises
    ------
    InvalidInput
        If a number is out of its range.

    Examples
    --------
    >>> from exo_pin.control import Payload
    >>> exo, cup = ep.load("four-cables"), Payload(0.5, (0.0, 0.0, -0.5), end=0.05)
    >>> plant = ep.Plant(exo, payloads=cup)
    >>> run = plant.simulate(lambda t, seen: np.full(4, 0.1), 0.1, plant.held(exo.pose(30), np.full(4, 40.0)))
    >>> bool(np.abs(run.energy_residual).max() < 1e-7)  # J: what is dropped takes its energy with it
    True
    """

    mass: float
    at: tuple[float, float, float]
    start: float = 0.0
    end: float = np.inf

    def __post_init__(self) -> None:
        set_positive(self, "mass")
        set_fields(self, at=tuple(as_finite("at", self.at, (3,)).tolist()))
        check_span(self)

    def is_held(self, time: Any, before: bool = False) -> Any:
        """Whether the arm holds it just after times in s, or just before them; at zero it is there before, too.

        Parameters
        ----------
        time : array_like
            Shape (...), s.
        before : bool
            Whether before.

        Returns
        -------
        bool or ndarray of bool
            Shape (...).

        Raises
        ------
        InvalidInput
            For times that are no numbers.

        Examples
        --------
        >>> from exo_pin.control import Payload
        >>> cup = Payload(0.5, (0.0, 0.0, -0.5), start=0.2, end=1.0)
        >>> [cup.is_held(time) for time in (0.0, 0.2, 1.0)], [cup.is_held(time, True) for time in (0.0, 0.2, 1.0)]
        ([False, True, False], [False, False, True])
        """
        at = as_real("time", time)
        begun = (self.start <= 0.0) | (self.start < at - _SAME) if before else self.start <= at + _SAME
        held = begun & ((at - _SAME if before else at + _SAME) < self.end)
        return held if at.ndim else bool(held)


#: Moment of the wearer on the arm about O, N m, base frame; or a force at O, N, and that moment.
Wearer = Callable[..., Any]
