"""Harness and cuff that carry a design's joints: a bow over the torso, and a sleeve about the arm.

They are for the picture: a way in which the given joints could be held, no part of the design. They are made of the
joint centres alone, so every design has them, on circles or from points, for either side of the body.
"""

from __future__ import annotations

from typing import Any

import numpy as np

from ...core.records import OneProcess
from ...core.validation import FloatArray
from ...design import WristGeometry
from ..stage.shapes import along, lathe, matt_material, mesh_of, placement, rings_about_z, skin_of, tube
from ..stage.stage import Stage

#: Radius of bars and of the balls at the joints, m.
_BAR, _BALL = 0.0065, 0.0138
#: The sleeve: radius about the arm's axis at most, least height, how near to O its middle comes, and its wall, m.
_SLEEVE, _SLEEVE_HEIGHT, _SLEEVE_TOP, _WALL = 0.066, 0.060, -0.075, 0.004
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
        radius, bottom, top = _sleeve_size(arm)
        wall = radius + _WALL
        sleeve = lathe(np.array([(radius, bottom), (wall, bottom), (wall, top), (radius, top), (radius, bottom)]), 48)
        cloth = matt_material(_CLOTH, _SEE_THROUGH if see_through else 1.0)
        stage.viewer[root]["cuff/sleeve"].set_object(sleeve, cloth)
        for name, points, bars in zip(("harness", "cuff"), (base, arm), holding_bars(geometry), strict=True):
            frame = mesh_of([tube(bar, _BAR) for bar in bars])
            stage.viewer[root][f"{name}/frame"].set_object(frame, matt_material(_FRAME))
            stage.viewer[root][f"{name}/joints"].set_object(_balls(points), matt_material(_JOINT))

    def show(self, matrix: FloatArray) -> None:
        """Turn the cuff into a pose, shape (3, 3)."""
        self._stage.set_transform(f"{self._root}/harness", placement(1.0, self._harness))
        self._stage.set_transform(f"{self._root}/cuff", placement(matrix, matrix @ self._cuff))


def holding_bars(geometry: WristGeometry) -> tuple[list[FloatArray], list[FloatArray]]:
    """Middle lines of the bars of the harness, base frame, and of the cuff, arm frame, each of shape (k, 3), m."""
    base, arm = np.asarray(geometry.base_points), np.asarray(geometry.platform_points)
    over = np.array([0.0, 1.0, 0.0] if geometry.base_axis is None else geometry.base_axis)
    about = np.array([0.0, 0.0, 1.0] if geometry.platform_axis is None else geometry.platform_axis)
    return [_bow(base, over)], [_bow(arm, about), *_struts(arm)]


def _bow(points: FloatArray, about: FloatArray) -> FloatArray:
    """A line through all points about an axis through O, shape (k, 3), open at the widest gap."""
    x, y, z = along(about).T
    angle = np.arctan2(points @ y, points @ x)
    order = np.argsort(angle)
    gaps = np.diff(angle[order], append=angle[order[0]] + 2 * np.pi)
    order = np.roll(order, -(int(np.argmax(gaps)) + 1))
    turns = np.unwrap(angle[order])
    fine = np.union1d(turns, np.arange(turns[0], turns[-1], np.radians(5.0)))
    sizes = np.hypot(points @ x, points @ y)[order], (points @ z)[order]
    radius, height = (np.interp(fine, turns, size) for size in sizes)
    return np.outer(radius * np.cos(fine), x) + np.outer(radius * np.sin(fine), y) + np.outer(height, z)


def _sleeve_size(points: FloatArray) -> tuple[float, float, float]:
    """Radius about the arm's axis, and the heights of both rims: as high as the joints on it."""
    radius = float(np.clip(np.hypot(points[:, 0], points[:, 1]).min() - _BAR, 0.03, _SLEEVE))
    low, high = points[:, 2].min(), points[:, 2].max()
    middle = min((low + high) / 2, _SLEEVE_TOP)
    half = max(_SLEEVE_HEIGHT, high - low + 0.02) / 2
    return radius, middle - half, middle + half


def _struts(points: FloatArray) -> list[FloatArray]:
    """From the sleeve to the joints that stand off it."""
    radius, bottom, top = _sleeve_size(points)
    found = []
    for point, out in zip(points, np.hypot(points[:, 0], points[:, 1]), strict=True):
        if out > radius + _WALL + _BAR:
            foot = np.array([*(radius * point[:2] / out), np.clip(point[2], bottom + _BAR, top - _BAR)])
            found.append(np.linspace(foot, point, 3))
    return found


def _balls(points: FloatArray) -> Any:
    rise = np.linspace(-np.pi / 2, np.pi / 2, 9)
    ball = _BALL * rings_about_z(np.column_stack([np.cos(rise), np.sin(rise)]), 16)
    return mesh_of([skin_of(ball + point) for point in points])
