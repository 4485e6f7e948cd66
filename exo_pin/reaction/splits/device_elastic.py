"""Split "elastic" of a device that is no wrist: its forces follow from the stiffness of cuff and harness."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from ...core.validation import FloatArray
from ...design import Mechanism
from ..indeterminacy.component_assumptions import Freedom
from .pose_stack import PoseStack
from .spherical import Spherical
from .split import Chosen


class DeviceElastic(Spherical):
    """The pose is held; efforts and displacements are those of :mod:`exo_pin.device.elastic.soft_model`."""

    name = "elastic"
    assumption = "the stiffness of cuff and harness, at the displaced geometry"
    criterion = ""
    options = frozenset()
    determines_sides = True
    moves = True
    chooses_tensions = False

    def assumed(self, mechanism: Mechanism) -> str:
        """The assumption in words."""
        return self.assumption

    def caption(self, mechanism: Mechanism) -> str:
        """The assumption in a few words."""
        return "determined by stiffness"

    def kinds(self, freedom: Freedom) -> NDArray[np.str_]:
        """By stiffness, all of it."""
        return np.full(len(freedom.all), "stiffness")

    def extras(self, poses: PoseStack, answer: Chosen) -> dict[str, FloatArray]:
        """Displacements of harness and cuff."""
        assert poses.placed is not None
        assert poses.placed.interfaces is not None
        return {"interface_displacements": poses.placed.interfaces}
