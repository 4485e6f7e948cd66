"""Brakes: joints of a device that are locked while it is at rest."""

from __future__ import annotations

from dataclasses import dataclass

from ...core.errors import InvalidInput
from ...core.errors.checked import checked
from ...core.validation import set_positive
from .drives import Drive


@checked
@dataclass(frozen=True)
class Brake:
    """A brake that locks a hinge or slide of the chain; its effort is a reaction of either sign.

    Attributes
    ----------
    name : str
        Its name in tables and texts.
    joint : str
        A joint of one coordinate. The effort is positive towards larger coordinates, N m or N.
    limit : float or None
        Greatest effort, N m or N, in either direction; None where it is not known.

    Examples
    --------
    >>> from exo_pin.device import Brake
    >>> Brake("rail_brake", joint="rail_slide", limit=300.0).as_drive.lower  # N
    -300.0
    """

    name: str
    joint: str
    limit: float | None = None

    def __post_init__(self) -> None:
        for what, value in (("a name", self.name), ("the name of a joint", self.joint)):
            if not isinstance(value, str) or not value:
                raise InvalidInput(f"expected {what} of a brake, got {value!r}")
        set_positive(self, "limit", zero=True, optional=True)

    @property
    def as_drive(self) -> Drive:
        """What it is in equilibrium: an effort within its limits."""
        return Drive(self.name, self.joint, lower=None if self.limit is None else -self.limit, upper=self.limit)
