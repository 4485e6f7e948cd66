"""Pneumatic muscles that pull a cable over a tackle."""

from __future__ import annotations

from dataclasses import dataclass

from ..core.errors import InvalidInput
from ..core.fields import set_fields, set_positive
from ..core.validation import as_finite

__all__ = ["Tackle"]


@dataclass(frozen=True)
class Tackle:
    """Pneumatic muscles side by side that pull one cable over a tackle of ratio r : 1.

    The cable takes up r times the contraction of a muscle, and its tension is 1/r of what the muscles pull together.

    Attributes
    ----------
    ratio : float
        r, 1 or more.
    muscle_length : float
        Nominal length of a muscle, m. The muscles are at their nominal length where the limb is at its longest.
    force_law : str
        Name of the static law of one muscle (:func:`exo_pin.muscle.muscle_models`), scaled to ``muscle_length``.
    supply_pressure : float
        Greatest gauge pressure, Pa.
    count : int
        Muscles side by side.

    Raises
    ------
    InvalidInput
        If a number is out of its range.
    """

    ratio: float
    muscle_length: float
    force_law: str
    supply_pressure: float
    count: int = 1

    def __post_init__(self) -> None:
        set_positive(self, "ratio", "muscle_length", "supply_pressure")
        if self.ratio < 1.0:
            raise InvalidInput(f"expected a ratio of 1 or more, got {self.ratio:g}")
        count = float(as_finite("count", self.count, ()))
        if isinstance(self.count, bool) or count != int(count) or count < 1:
            raise InvalidInput(f"expected count as a number of muscles from 1, got {self.count!r}")
        set_fields(self, count=int(count))
        if not isinstance(self.force_law, str) or not self.force_law:
            raise InvalidInput(f"expected force_law as the name of a static law, got {self.force_law!r}")
