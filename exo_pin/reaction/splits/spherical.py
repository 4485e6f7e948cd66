"""Split "spherical": limbs that carry no side force, (D-30)."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from ...design import Mechanism
from ..indeterminacy.freedom import Freedom
from .limb_and_side_forces import Pose
from .split import Chosen, PoseStack, Split

__all__ = ["Spherical"]


class Spherical(Split):
    """g = 0, as for bare pneumatic muscles; of tensions that balance themselves, those of least norm."""

    name = "spherical"
    assumption = "limbs that carry no side force (g = 0)"
    options = frozenset({"cone"})
    is_linear = True

    def caption(self, mechanism: Mechanism) -> str:
        """What is assumed, in a few words."""
        return "limbs carry no side force"

    def program(self, poses: PoseStack, row: int) -> Pose:
        """Tensions of least norm within their limits."""
        return poses.program(row)._replace(metric=None)

    def choose(self, poses: PoseStack, rows: NDArray[np.intp], answer: Chosen) -> None:
        """Tensions of least norm."""
        f = poses.tensions.f[rows]
        answer.put_determined(rows, f, np.zeros_like(f))

    def kinds(self, freedom: Freedom) -> NDArray[np.str_]:
        """Assumed, but for tensions that balance themselves."""
        return np.where(freedom.is_fixed(freedom.of_tensions), "assumed", "optimiser")
