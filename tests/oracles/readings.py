"""Search for the reading under which a printed number follows from the printed data.

A reading is a way to fill in what the text leaves open or states otherwise: an order of rotations, a sign, a unit, a
term left out. With many readings one of them agrees by chance, so a match is worth as much as its precision exceeds
the number of readings: both are reported.
"""

from __future__ import annotations

from collections.abc import Iterable
from dataclasses import dataclass

import numpy as np
from numpy.typing import ArrayLike

from exo_pin.core.records import Record
from exo_pin.core.validation import FloatArray, frozen

__all__ = ["Match", "best_reading"]

#: So many of the next best readings give the density of readings about the printed numbers.
_NEIGHBOURS = 5
#: Two readings whose results differ by less than this part of the rounding are one.
_SAME = 1e-6


@dataclass(frozen=True, eq=False)
class Match(Record):
    """The reading that comes nearest to printed numbers.

    Attributes
    ----------
    source, quantity : str
        What was searched.
    reading : str
        Name of the nearest reading.
    printed, values : ndarray
        The printed numbers, and those of this reading.
    misfit : float
        Largest difference, in units of what rounding explains; at most 1 for a match.
    tried : int
        Number of readings with different results.
    by_chance : float
        How many readings would be expected to agree to within rounding if the results were spread about the printed
        numbers as those of the next best readings are. A match with a number far below 1 is no accident.
    """

    source: str
    quantity: str
    reading: str
    printed: FloatArray
    values: FloatArray
    misfit: float
    tried: int
    by_chance: float

    @property
    def is_found(self) -> bool:
        """Whether the reading agrees to within rounding, and not by chance."""
        return self.misfit <= 1.0 and self.by_chance < 0.01

    def __str__(self) -> str:
        shown = ", ".join(f"{value:.5g}" for value in self.values)
        head = f"{self.source}, {self.quantity}: {self.tried} readings; nearest: {self.reading} ({shown})"
        if self.is_found:
            return f"{head}; within rounding, {self.by_chance:.1g} expected by chance"
        if self.misfit <= 1.0:
            return f"{head}; within rounding, but so would {self.by_chance:.1g} by chance: no reproduction"
        return f"{head}; off by {self.misfit:.3g} times what rounding explains"


def best_reading(
    source: str,
    quantity: str,
    printed: ArrayLike,
    rounding: ArrayLike,
    readings: Iterable[tuple[str, ArrayLike]],
    free_scale: bool = False,
) -> Match:
    """Find the reading nearest to printed numbers.

    Parameters
    ----------
    source, quantity : str
        What is searched.
    printed : array_like
        Shape (n,).
    rounding : array_like
        Largest difference that rounding in print explains, one for all or one for each.
    readings : iterable of (str, array_like)
        Name and results, shape (n,), of each reading. Those with results that are not finite are left out.
    free_scale : bool
        Whether a common factor is left open: each result is scaled to the printed numbers by least squares.
    """
    shown = np.atleast_1d(np.asarray(printed, dtype=float))
    slack = np.broadcast_to(np.asarray(rounding, dtype=float), shown.shape)
    found = [(name, np.atleast_1d(np.asarray(values, dtype=float))) for name, values in readings]
    found = [(name, values) for name, values in found if np.isfinite(values).all()]
    if free_scale:
        found = [(name, values * (values @ shown) / max(values @ values, 1e-300)) for name, values in found]
    misfits = np.array([np.abs((values - shown) / slack).max() for _, values in found])
    order = np.argsort(misfits, kind="stable")
    # Readings that differ in name alone count once.
    different: list[int] = []
    seen: set[tuple[int, ...]] = set()
    for index in order:
        key = tuple(np.round(found[index][1] / (_SAME * slack)).astype(np.int64).tolist()) if slack.all() else (index,)
        if key not in seen:
            seen.add(key)
            different.append(int(index))
    best = different[0]
    others = misfits[different[1 : _NEIGHBOURS + 1]]
    numbers = len(shown) - (1 if free_scale else 0)
    by_chance = len(others) * float(max(misfits[best], 1.0) / others[-1]) ** numbers if len(others) else 1.0
    return Match(
        source,
        quantity,
        found[best][0],
        frozen(shown),
        frozen(found[best][1]),
        float(misfits[best]),
        len(different),
        by_chance,
    )
