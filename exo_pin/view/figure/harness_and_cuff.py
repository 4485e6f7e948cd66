"""Harness and cuff that carry a design's joints: a bow over the torso, and a sleeve about the arm.

They are for the picture: a way in which the given joints could be held (:mod:`exo_pin.design.holding_frame`), no part
of the design.
"""

from __future__ import annotations

from typing import Any

import numpy as np

from ...core.records import OneProcess
from ...core.validation import FloatArray
from ...design import WristGeometry
from ...design.holding_frame import BAR, WALL, holding_bars, sleeve_size
from ..stage.shapes import lathe, matt_material, mesh_of, placement, rings_about_z, skin_of, tube
from ..stage.stage import Stage

#: Radius of the balls at the joints, m.
_BALL = 0.0138
#: Opacity of a sleeve that shows what is in it.
_SEE_THROUGH = 0.35
#: Of the frames, of the joints and of the sleeve.
_FRAME, _JOINT, _CLOTH = (0.30, 0.33, 0.37), (0.85, 0.55, 0.15), (0.52, 0.57, 0.62)


class HarnessAndCuff(OneProcess):
    """Harness, in place, and cuff, which turns with the arm.

    Parameters
    ----------
    stage : Stage
        Where they are drawn.
    geometry : WristGeometry
        Joint centres that they carry.
    root : str
        Node of the mechanism.
    offset : (ndarray, ndarray), optional
        How far harness, base frame, and cuff, arm frame, are displaced, m, shape (3,) each.
    see_through : bool
        Whether the sleeve shows what is in it.
    """

    def __init__(
        self,
        stage: Stage,
        geometry: WristGeometry,
        root: str,
        offset: tuple[FloatArray, FloatArray] | None = None,
        see_through: bool = False,
    ) -> None:
        self._stage, self._root = stage, f"/meshcat/{root}"
        self._harness, self._cuff = (np.zeros(3), np.zeros(3)) if offset is None else offset
        base, arm = np.asarray(geometry.base_points), np.asarray(geometry.platform_points)
        radius, bottom, top = sleeve_size(arm)
        wall = radius + WALL
        sleeve = lathe(np.array([(radius, bottom), (wall, bottom), (wall, top), (radius, top), (radius, bottom)]), 48)
        cloth = matt_material(_CLOTH, _SEE_THROUGH if see_through else 1.0)
        stage.viewer[root]["cuff/sleeve"].set_object(sleeve, cloth)
        for name, points, bars in zip(("harness", "cuff"), (base, arm), holding_bars(geometry), strict=True):
            frame = mesh_of([tube(bar, BAR) for bar in bars])
            stage.viewer[root][f"{name}/frame"].set_object(frame, matt_material(_FRAME))
            stage.viewer[root][f"{name}/joints"].set_object(_balls(points), matt_material(_JOINT))

    def show(self, matrix: FloatArray) -> None:
        """Turn the cuff into a pose, shape (3, 3)."""
        self._stage.set_transform(f"{self._root}/harness", placement(1.0, self._harness))
        self._stage.set_transform(f"{self._root}/cuff", placement(matrix, matrix @ self._cuff))


def _balls(points: FloatArray) -> Any:
    rise = np.linspace(-np.pi / 2, np.pi / 2, 9)
    ball = _BALL * rings_about_z(np.column_stack([np.cos(rise), np.sin(rise)]), 16)
    return mesh_of([skin_of(ball + point) for point in points])
