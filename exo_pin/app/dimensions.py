"""Which dimensions of a device the page has sliders for, in mm and degrees, and how far they go."""

from __future__ import annotations

from contextlib import suppress
from typing import NamedTuple

import numpy as np

from ..core.errors import UnknownName
from ..device.protocol import Device

#: How far a slider goes to both sides: m and rad.
_SPANS = {"_m": (1e3, "_mm", 60.0), "_rad": (180.0 / np.pi, "_deg", 25.0)}
#: What moves all joints on the arm of a wrist.
_CUFF = "cuff_height_mm"


class Dimension(NamedTuple):
    """A dimension in the unit that its name ends in, with the ends of its slider."""

    name: str
    value: float
    low: float
    high: float


def dimensions_of(device: Device) -> list[Dimension]:
    """Dimensions of a device that are lengths and angles; of a wrist the height of its cuff first."""
    found = []
    with suppress(UnknownName):
        (named,) = device.parameters([_CUFF])
        found.append(_dimension(_CUFF, 1e3 * float(device.value_of(named) or 0.0), 60.0))
    for name, value in device.dimensions().items():
        for ending, (size, unit, span) in _SPANS.items():
            if name.endswith(ending) and np.isfinite(value):
                found.append(_dimension(name.removesuffix(ending) + unit, size * value, span))
    return found


def _dimension(name: str, value: float, span: float) -> Dimension:
    middle = round(value, 1)  # a step of the slider
    return Dimension(name, middle, round(middle - span, 1), round(middle + span, 1))
