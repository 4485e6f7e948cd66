"""The muscle model of Chou and Hannaford, (3-1) to (3-5).

Its constants were never printed for the muscle of the source; those fitted to its tables are "fitted-chou-hannaford".
"""

from __future__ import annotations

from dataclasses import dataclass
from math import pi
from typing import Any

import numpy as np

from ...core.errors import InvalidInput
from ...core.validation import as_finite, as_positive
from .static import StaticModel


@dataclass(frozen=True, kw_only=True)
class ChouHannaford(StaticModel):
    """Virtual work of a cylinder in an inextensible braid, (3-5): F = P (3 (L_0 - x)² - b²)/(4 π n²).

    Parameters
    ----------
    braid_length : float
        Length b of one thread of the braid, m.
    turns : float
        Turns n of that thread around the muscle.

    Notes
    -----
    Source: thesis (3-5).
    """

    braid_length: float
    turns: float

    def __post_init__(self) -> None:
        super().__post_init__()
        as_positive("braid_length", self.braid_length)
        as_positive("turns", self.turns)

    def _force(self, x: Any, pressure: Any) -> Any:
        length = self.reference_length - x
        return pressure * (3 * length**2 - self.braid_length**2) / (4 * pi * self.turns**2)

    def _stiffness(self, x: Any, pressure: Any) -> Any:
        return -6 * pressure * (self.reference_length - x) / (4 * pi * self.turns**2)

    def _pressure_gain(self, x: Any, pressure: Any) -> Any:
        return self._force(x, 1.0) + 0.0 * pressure

    def diameter(self, contraction: Any) -> Any:
        """Diameter in m of the cylinder at a contraction in m, (3-3), (3-4), (3-13): sqrt(b² - L²)/(n π).

        The diameter does not depend on the nominal length, as long as the strain is the same.

        Raises
        ------
        InvalidInput
            If the muscle would be longer than its thread.

        Notes
        -----
        Source: thesis (3-3), (3-4), (3-13).
        """
        x = as_finite("contraction", contraction, (), stack=True) * self.scale
        square = self.braid_length**2 - (self.reference_length - x) ** 2
        if np.any(square < 0):
            raise InvalidInput(f"expected a muscle no longer than its thread of {self.braid_length:g} m")
        return np.sqrt(square) / (self.turns * pi)
