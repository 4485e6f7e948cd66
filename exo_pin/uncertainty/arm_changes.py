"""An arm that weighs more, or has its centre of mass elsewhere; what of it is the device's stays the device's."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import replace
from functools import reduce
from operator import add

from ..core.validation import FloatArray
from ..design import Arm


def heavier(arm: Arm, more: float) -> Arm:
    """All parts with so many times their mass and inertia."""

    def own(part: Arm) -> Arm:
        return replace(part, mass=more * part.mass, inertia=None if part.inertia is None else more * part.inertia)

    return _of_parts(arm, own)


def moved(arm: Arm, shift: FloatArray) -> Arm:
    """All parts elsewhere, shape (3,), m."""
    return _of_parts(arm, lambda part: replace(part, centre_of_mass=part.centre_of_mass + shift))


def _of_parts(arm: Arm, changed: Callable[[Arm], Arm]) -> Arm:
    return reduce(add, [changed(part) for part in arm.parts])
