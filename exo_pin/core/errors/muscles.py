"""Errors of muscle models and their identification."""

from __future__ import annotations

from .base import ExoPinError
from .inputs import InvalidInput


class OutsideValidity(InvalidInput):
    """A state lies outside the range in which a muscle model was identified.

    Attributes
    ----------
    model : str
        Name of the model.
    reason : str
        The bound that is broken, with its value and the value that came.
    count : int
        Number of states outside.
    index : tuple of int
        Position of the first of them in the (broadcast) stack; empty for a single state.
    """

    def __init__(self, model: str, reason: str, count: int = 1, index: tuple[int, ...] = ()) -> None:
        self.model = model
        self.reason = reason
        self.count = int(count)
        self.index = tuple(int(i) for i in index)
        where = f" at index {self.index}" if self.index else ""
        many = f" ({self.count} states are outside)" if self.count > 1 else ""
        super().__init__(
            f"muscle model {model!r} does not hold{where}: {reason}{many}; outside='mark' returns marked values"
        )


class OutsideRangeOfMotion(InvalidInput):
    """A pose lies outside the range of motion of the wearer's anatomical model.

    Attributes
    ----------
    reason : str
        The angle, its value and its limits.
    count : int
        Number of poses outside.
    index : tuple of int
        Position of the first of them in the stack; empty for a single pose.
    """

    def __init__(self, reason: str, count: int = 1, index: tuple[int, ...] = ()) -> None:
        self.reason = reason
        self.count = int(count)
        self.index = tuple(int(i) for i in index)
        where = f" at index {self.index}" if self.index else ""
        many = f" ({self.count} poses are outside)" if self.count > 1 else ""
        super().__init__(
            f"the person's arm cannot take this pose{where}: {reason}{many}. Choose a pose within these limits, or "
            "outside='mark' to mark such poses in the result"
        )


class NotIdentifiable(ExoPinError, ValueError):
    """The data cannot determine the requested coefficients.

    Attributes
    ----------
    coefficients : tuple of str
        Names of the coefficients.
    """

    def __init__(self, message: str, coefficients: tuple[str, ...] = ()) -> None:
        self.coefficients = tuple(coefficients)
        super().__init__(message)
