"""Trajectories one after the other."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from ...core.errors import InvalidInput
from ...core.errors.base import echo
from ...core.validation import FloatArray, require_type
from .reference import Trajectory

__all__ = ["Sequence"]

#: A jump of the orientation between two parts beyond this, rad, is one.
_JUMP = 1e-8


@dataclass(frozen=True, eq=False, repr=False)
class Sequence(Trajectory):
    """Trajectories one after the other, each starting where the one before ends.

    ω and η may jump between two parts unless both are at rest there.

    Attributes
    ----------
    parts : tuple of Trajectory
        In order.
    title : str
        What it is.
    """

    parts: tuple[Trajectory, ...]
    title: str = ""

    def __post_init__(self) -> None:
        if not isinstance(self.parts, (tuple, list)) or not self.parts:
            raise InvalidInput(f"expected parts as a tuple of trajectories, got {echo(self.parts)}")
        for part in self.parts:
            require_type("each part", part, Trajectory, "a Trajectory")
        object.__setattr__(self, "parts", tuple(self.parts))
        for k, (one, other) in enumerate(zip(self.parts[:-1], self.parts[1:], strict=True)):
            jump = (other.start * one.end.inv()).magnitude()
            if jump > _JUMP:
                raise InvalidInput(
                    f"part {k + 1} starts {np.degrees(jump):.3g} degrees away from the end of part {k}: put a "
                    "point_to_point between them"
                )

    @property
    def duration(self) -> float:  # type: ignore[override]
        """s."""
        return float(sum(part.duration for part in self.parts))

    def _states(self, t: FloatArray) -> tuple[FloatArray, FloatArray, FloatArray]:
        starts = np.cumsum([0.0, *(part.duration for part in self.parts[:-1])])
        which = np.searchsorted(starts, t, side="right") - 1
        quaternions, velocity, acceleration = np.empty((len(t), 4)), np.empty((len(t), 3)), np.empty((len(t), 3))
        for k, part in enumerate(self.parts):
            here = which == k
            # Rounding of the sum of durations must not carry a time beyond the part's end.
            own = part._states(np.clip(t[here] - starts[k], 0.0, part.duration))
            quaternions[here], velocity[here], acceleration[here] = own
        return quaternions, velocity, acceleration
