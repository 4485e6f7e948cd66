"""Offsets of the device's centre with which a search judges its designs.

A frame on the torso has the shoulder's centre at its own only in some poses, and no donning is exact. A search may be
given several offsets, each of them one for all poses or a centre path: then every pose counts once with each.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace
from typing import Any, cast

import numpy as np
from numpy.typing import ArrayLike

from ...core.errors import InvalidInput
from ...core.validation import FloatArray, as_finite
from ...load_case import CentreOffset
from ...load_case.centre_path import CentrePath

__all__ = ["Centre", "as_centres", "centre_text", "described", "shifted"]

#: An offset that holds for any pose; None: the centres are one.
Centre = CentreOffset | CentrePath | None


def as_centres(given: Centre | ArrayLike | Sequence[Centre]) -> tuple[Centre, ...]:
    """Offsets from what a user passes: one, or a sequence of records and None.

    Raises
    ------
    InvalidInput
        If one of them is a stack: a search has other poses than the check of what it finds.
    """
    if isinstance(given, (tuple, list)) and all(isinstance(each, Centre) for each in given):
        if not given:
            raise InvalidInput("expected at least one centre_offset, got an empty sequence")
        return tuple(_single(cast(Centre, each)) for each in given)
    if given is None or isinstance(given, (CentreOffset, CentrePath)):
        return (_single(given),)
    return (_single(CentreOffset.together(as_finite("centre_offset", cast(ArrayLike, given), (3,), stack=True))),)


def _single(centre: Centre) -> Centre:
    if isinstance(centre, CentreOffset) and (centre.base.ndim > 1 or centre.cuff.ndim > 1):
        raise InvalidInput(
            f"expected centre_offset as one offset or a CentrePath, got stacks of {centre.base.shape}, "
            f"{centre.cuff.shape}: designs are judged in other poses, too"
        )
    return centre


def shifted(centre: Centre, shift: FloatArray) -> CentreOffset | CentrePath:
    """The offset of a device that sits elsewhere besides, base and cuff alike, by ``shift``, shape (3,), m."""
    if isinstance(centre, CentrePath):
        return replace(centre, fit=np.asarray(centre.fit) + shift)
    if centre is None:
        return CentreOffset.together(shift)
    return CentreOffset(centre.base + shift, centre.cuff + shift)


def described(centre: Centre) -> dict[str, Any] | None:
    """The numbers of an offset, by which a stored study knows it again."""
    return None if centre is None else {name: np.asarray(value).tolist() for name, value in vars(centre).items()}


def centre_text(centre: Centre) -> str:
    """One line on an offset, for a report."""
    if centre is None:
        return "The device's centre is the shoulder's."
    if isinstance(centre, CentrePath):
        most, fit = 1e3 * np.linalg.norm(centre.displacement, axis=-1).max(), 1e3 * np.asarray(centre.fit)
        where = "" if not fit.any() else f", and is off by ({', '.join(f'{x:g}' for x in fit)}) mm at rest"
        return f"The shoulder's centre moves with the arm, by at most {most:.0f} mm on its path{where}."
    base, cuff = (", ".join(f"{1e3 * x:g}" for x in side) for side in (centre.base, centre.cuff))
    return f"The device's centre is off the shoulder's by ({base}) mm at the base and ({cuff}) mm at the cuff."
