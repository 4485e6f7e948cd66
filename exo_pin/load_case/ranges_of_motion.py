"""Ranges of shoulder motion in daily life, as published, in clinical angles.

Source: thesis Table 2-1.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from scipy.spatial.transform import Rotation

from ..core.conventions import shoulder_rotation
from ..core.errors import InvalidInput
from ..core.validation import FloatArray, as_finite, as_positive, set_fields


@dataclass(frozen=True)
class RangeOfMotion:
    """A box of shoulder angles, intrinsic Y-X-Z, all positive as named.

    Attributes
    ----------
    name : str
        What it is the range of.
    flexion_deg, abduction_deg, internal_rotation_deg : tuple of float
        Lowest and highest, degrees.
    source : str
        Where it was published.
    """

    name: str
    flexion_deg: tuple[float, float]
    abduction_deg: tuple[float, float]
    internal_rotation_deg: tuple[float, float]
    source: str = ""

    def __post_init__(self) -> None:
        for name in ("flexion_deg", "abduction_deg", "internal_rotation_deg"):
            low, high = as_finite(name, getattr(self, name), (2,)).tolist()
            if not -360.0 <= low <= high <= 360.0:
                raise InvalidInput(f"expected {name} as (lowest, highest) in degrees, got ({low:g}, {high:g})")
            set_fields(self, **{name: (low, high)})

    @property
    def intervals(self) -> tuple[tuple[float, float], ...]:
        """The three intervals, degrees, in the order flexion, abduction, internal rotation."""
        return self.flexion_deg, self.abduction_deg, self.internal_rotation_deg

    def axes(self, step_deg: float) -> tuple[FloatArray, FloatArray, FloatArray]:
        """Angles from lowest to highest in equal steps of at most ``step_deg``, degrees, both ends included."""
        step = as_positive("step_deg", step_deg)
        first, second, third = (
            np.linspace(low, high, int(np.ceil((high - low) / step - 1e-9)) + 1) for low, high in self.intervals
        )
        return first, second, third

    def poses(self, step_deg: float, side: str = "left") -> Rotation:
        """The grid of :meth:`axes`, a stack of shape (flexions, abductions, rotations)."""
        return grid_rotation(*self.axes(step_deg), side=side)


def grid_rotation(flexion: FloatArray, abduction: FloatArray, internal: FloatArray, side: str = "left") -> Rotation:
    """Orientations over a grid of angles in degrees, shape (nf, na, ni); single turns are made once and multiplied."""
    zero = 0.0
    first = shoulder_rotation(flexion[:, None, None], zero, zero, side, degrees=True)
    second = shoulder_rotation(zero, abduction[None, :, None], zero, side, degrees=True)
    third = shoulder_rotation(zero, zero, internal[None, None, :], side, degrees=True)
    return first * second * third


#: What the mechanism is meant to cover: the summarised range of Table 2-1, of which Appendix C makes its grid.
ADL_BOX = RangeOfMotion(
    "daily-life box", (0.0, 110.0), (-4.0, 96.0), (-20.0, 85.0), "Table 2-1, summarised range; Appendix C"
)

#: Three published ranges of daily tasks.
DAILY_RANGES = (
    # Printed "-20.1 to -39.7" for abduction; every other cell runs from low to high, so the second sign is a slip.
    RangeOfMotion(
        "ten daily tasks (Murray & Johnson)",
        (14.7, 111.9),
        (-20.1, 39.7),
        (18.7, 85.9),
        "Table 2-1, first row; Murray & Johnson 2004",
    ),
    RangeOfMotion(
        "daily tasks (Buckley et al.)", (7.0, 108.0), (15.0, 96.0), (-20.0, 85.0), "Table 2-1, third row; Buckley 1996"
    ),
    RangeOfMotion("feeding (Safaee-Rad et al.)", (5.0, 45.0), (5.0, 35.0), (5.0, 25.0), "Safaee-Rad et al. 1990"),
)
