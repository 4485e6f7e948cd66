"""What the data of parts say in a pose, and what they do not: the reason of the status ``not_evaluated``."""

from __future__ import annotations

from collections.abc import Iterable
from typing import NamedTuple

import numpy as np

from ...core.tables import enumerated


class LackingData(NamedTuple):
    """A part whose data do not cover a pose.

    Attributes
    ----------
    kind, name : str
        "spring" or "drive", and its name.
    value : float
        Its coordinate in the pose, m or rad; NaN where its route has no direction, because two of its points coincide.
    low, high : float
        Range that its law covers; infinite where it has no end.
    unit : str
        "m" or "rad".
    source : str
        What the range is that of: "table", "gas column", "law".
    """

    kind: str
    name: str
    value: float = np.nan
    low: float = -np.inf
    high: float = np.inf
    unit: str = "m"
    source: str = "law"

    def __str__(self) -> str:
        """The reason, such as "spring 'strut' outside its law: 0.25 m, table 0.285 to 0.9 m"."""
        if np.isnan(self.value):
            return f"{self.kind} {self.name!r} without a direction: two points of its route coincide"
        return ", ".join(
            filter(None, (f"{self.kind} {self.name!r} outside its law: {self._at(self.value)}", self._own))
        )

    @property
    def _own(self) -> str:
        """The range in words; empty where it has no ends."""
        ends = np.isfinite([self.low, self.high])
        if not ends.any():
            return ""
        if ends.all():
            return f"{self.source} {self._number(self.low)} to {self._at(self.high)}"
        return f"{self.source} from {self._at(self.low)}" if ends[0] else f"{self.source} up to {self._at(self.high)}"

    def _number(self, x: float) -> str:
        scale, digits = 180.0 / np.pi if self.unit == "rad" else 1.0, 3
        ends = [end for end in (self.low, self.high) if np.isfinite(end)]
        # A value just outside is not shown as the end itself.
        while digits < 12 and any(f"{scale * end:.{digits}g}" == f"{scale * self.value:.{digits}g}" for end in ends):
            digits += 1
        return f"{scale * x + 0.0:.{digits}g}"

    def _at(self, x: float) -> str:
        return self._number(x) + ("°" if self.unit == "rad" else " m")


def lacking_words(found: Iterable[LackingData]) -> str:
    """Parts without data in one or several poses, in a clause.

    'spring "strut" has no data at 0.25 m (table 0.285 to 0.9 m)'.
    """
    groups: dict[tuple[str, str, bool], list[LackingData]] = {}
    for each in found:
        groups.setdefault((each.kind, each.name, bool(np.isnan(each.value))), []).append(each)
    parts = []
    for (kind, name, aimless), group in groups.items():
        if aimless:
            parts.append(f'{kind} "{name}" has no direction, because two points of its route coincide')
            continue
        least, most = min(group, key=lambda part: part.value), max(group, key=lambda part: part.value)
        at = most._at(most.value)
        if least._at(least.value) != at:
            at = f"{least._number(least.value)} to {at}"
        parts.append(f'{kind} "{name}" has no data at {at}' + (f" ({least._own})" if least._own else ""))
    return enumerated(parts)
