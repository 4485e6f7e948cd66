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

    Examples
    --------
    >>> try:
    ...     ep.muscle.muscle_model("best").force(0.005, 3e5)  # contracted by 5 mm: the law begins at 20
    ... except ep.muscle.OutsideValidity as error:
    ...     print(error.reason)
    expected strain at least 0.0410567, got 0.0166667
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

    Examples
    --------
    >>> person = ep.Person(1.75, 75, "male")
    >>> poses = ep.shoulder_rotation([30, 60, 60], [0, 0, -90], 0, degrees=True)
    >>> try:
    ...     person.joint_contact(poses)
    ... except ep.OutsideRangeOfMotion as error:
    ...     print(error.index, error.count)
    (2,) 1
    """

    def __init__(self, reason: str, count: int = 1, index: tuple[int, ...] = ()) -> None:
        self.reason, self.count, self.index = reason, int(count), tuple(int(i) for i in index)
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

    Examples
    --------
    >>> states = ep.muscle.steady_states(valid_only=True)
    >>> same = np.full(25, 3e5)  # Pa: data of one pressure do not determine what pressure does
    >>> try:
    ...     ep.muscle.identify_static(states.contraction, same, states.force, 0.3)
    ... except ep.muscle.NotIdentifiable as error:
    ...     print(len(error.coefficients))
    6
    """

    def __init__(self, message: str, coefficients: tuple[str, ...] = ()) -> None:
        self.coefficients = tuple(coefficients)
        super().__init__(message)
