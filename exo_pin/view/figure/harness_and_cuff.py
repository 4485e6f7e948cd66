"""Harness and cuff that carry a design's joints: a bow held by a back plate, and a sleeve about the arm.

They are for the picture: a way in which the given joints could be held, no part of the design. They are made of the
joint centres alone, so every design has them, on circles or from points, for either side of the body.
"""

from __future__ import annotations

from typing import Any

import numpy as np
from scipy.interpolate import PchipInterpolator

from ...core.records import OneProcess
from ...core.validation import FloatArray
from ...design import WristGeometry
from ..stage.shapes import IntArray, lathe, matt_material, mesh_of, placement, rings_about_z, skin_of, tube
from ..stage.stage import Stage
from .bust import MIDDLE

__all__ = ["HarnessAndCuff"]

#: Radius of bars and of the balls at the joints, m.
_BAR, _BALL = 0.0065, 0.0138
#: The back plate: how far behind O, its middle's share of the way to the body's middle, its height and half sizes, m.
_BEHIND, _INWARD, _PLATE_HEIGHT, _PLATE = 0.128, 0.55, -0.085, (0.006, 0.062, 0.115)
#: The sleeve: radius about the arm's axis, least height, and how near to O its middle comes, m.
_SLEEVE, _SLEEVE_HEIGHT, _SLEEVE_TOP, _WALL = 0.066, 0.060, -0.075, 0.004
#: A wider gap between neighbours on a bow stays open, rad.
_OPEN_GAP = np.radians(115.0)
#: Joints nearer than this to the axis have no angle about it, m.
_ON_AXIS = 0.005
#: Opacity of a sleeve that shows what is in it.
_SEE_THROUGH = 0.35
#: Of the frames, of the joints and of the sleeve.
_COLOURS = ((0.30, 0.33, 0.37), (0.85, 0.55, 0.15), (0.52, 0.57, 0.62))


class HarnessAndCuff(OneProcess):
    """Harness, in place, and cuff, which turns with the arm.

    Parameters
    ----------
    stage : Stage
        Where they are drawn.
    geometry : WristGeometry
        Joint centres that they carry.
    side : {"left", "right"}
        Side of the body.
    root : str
        Node of the mechanism.
    colour : tuple of float, optional
        One colour and opacity for all of it, as for a ghost.
    offset : (ndarray, ndarray), optional
        How far harness, base frame, and cuff, arm frame, are displaced, m, shape (3,) each.
    see_through : bool
        Whether the sleeve shows what is in it.
    """

    def __init__(
        self,
        stage: Stage,
        geometry: WristGeometry,
        side: str,
        root: str,
        colour: tuple[float, ...] | None = None,
        offset: tuple[FloatArray, FloatArray] | None = None,
        see_through: bool = False,
    ) -> None:
        self._stage, self._root = stage, f"/meshcat/{root}"
        self._harness, self._cuff = (np.zeros(3), np.zeros(3)) if offset is None else offset
        base, arm = np.asarray(geometry.base_points), np.asarray(geometry.platform_points)
        viewer = stage.viewer[root]
        materials = [matt_material(rgb) if colour is None else matt_material(colour[:3], colour[3]) for rgb in _COLOURS]
        frame, joint, cuff = materials
        if see_through and colour is None:
            cuff = matt_material(_COLOURS[2], _SEE_THROUGH)
        bow = _bow(base, geometry.base_axis, np.array([0.0, 1.0, 0.0]))
        # A ghost has no plate: it would lie in the one of the design.
        back = _back(bow, side) if colour is None else []
        viewer["harness/frame"].set_object(mesh_of([*_bars(bow), *back]), frame)
        viewer["harness/joints"].set_object(_balls(base), joint)
        bow = _bow(arm, geometry.platform_axis, np.array([0.0, 0.0, 1.0]))
        sleeve, struts = _sleeve(arm)
        viewer["cuff/sleeve"].set_object(sleeve, cuff)
        viewer["cuff/frame"].set_object(mesh_of([*_bars(bow), *struts]), frame)
        viewer["cuff/joints"].set_object(_balls(arm), joint)

    def show(self, matrix: FloatArray) -> None:
        """Turn the cuff into a pose, shape (3, 3)."""
        self._stage.set_transform(f"{self._root}/harness", placement(1.0, self._harness))
        self._stage.set_transform(f"{self._root}/cuff", placement(matrix, matrix @ self._cuff))


def _bars(line: FloatArray) -> list[Any]:
    return [tube(line, _BAR)] if len(line) > 1 else []


def _bow(points: FloatArray, axis: FloatArray | None, otherwise: FloatArray) -> FloatArray:
    """A smooth line through all points about an axis through O, shape (k, 3); open at a wide gap."""
    about = otherwise if axis is None else np.asarray(axis)
    x = np.cross(about, np.eye(3)[int(np.argmin(np.abs(about)))])
    x /= np.linalg.norm(x)
    y = np.cross(about, x)
    height = points @ about
    radius = np.hypot(points @ x, points @ y)
    angle = np.arctan2(points @ y, points @ x)
    order = np.argsort(angle)
    gaps = np.diff(angle[order], append=angle[order[0]] + 2 * np.pi)
    widest = int(np.argmax(gaps))
    order = np.roll(order, -(widest + 1))
    turns = np.unwrap(angle[order])
    if (radius < _ON_AXIS).any() or (np.diff(turns) < 1e-6).any():
        return points[order]
    knots = np.column_stack([radius[order], height[order]])
    if gaps[widest] < _OPEN_GAP * (1 + 1e-9) or len(points) < 2:
        turns, knots = np.append(turns, turns[0] + 2 * np.pi), np.vstack([knots, knots[:1]])
    fine = np.unique(np.concatenate([turns, np.arange(turns[0], turns[-1], np.radians(5.0))]))
    r, h = (PchipInterpolator(turns, knots)(fine).T if len(turns) > 2 else
            np.array([np.interp(fine, turns, column) for column in knots.T]))  # fmt: skip
    return np.outer(r * np.cos(fine), x) + np.outer(r * np.sin(fine), y) + np.outer(h, about)


def _back(bow: FloatArray, side: str) -> list[tuple[FloatArray, IntArray]]:
    """The back plate and two bars from it to the bow: to its rearmost and to its highest point."""
    inward = -1.0 if side == "left" else 1.0
    centre = np.array([-_BEHIND, inward * _INWARD * MIDDLE, _PLATE_HEIGHT])
    thick, wide, high = _PLATE
    turn = np.linspace(0.0, 2 * np.pi, 48, endpoint=False)
    # A plate with rounded corners: a superellipse.
    y, z = (np.sign(part) * np.abs(part) ** 0.45 for part in (np.cos(turn), np.sin(turn)))
    rim = np.column_stack([np.zeros(48), wide * y, high * z])
    rings = [centre + share * rim + [x, 0.0, 0.0] for x, share in ((-thick, 0), (-thick, 1), (thick, 1), (thick, 0))]
    parts = [skin_of(np.array(rings))]
    ends = [int(np.argmin(bow[:, 0])), int(np.argmax(bow[:, 2]))]
    # One bar to each, or the second to the other end of a bow whose highest point is its rearmost.
    if ends[0] == ends[1]:
        ends[1] = len(bow) // 2
    for end, across in zip(ends, (-0.6, 0.6), strict=True):
        foot = centre + np.array([0.0, -inward * across * wide, 0.75 * high])
        parts.append(tube(_bent(foot, bow[end]), _BAR))
    return parts


def _bent(foot: FloatArray, end: FloatArray) -> FloatArray:
    """A bar that leaves the plate upwards and reaches its end from behind."""
    corner = np.array([min(foot[0], end[0]) - 0.02, (foot[1] + 2 * end[1]) / 3, max(foot[2], end[2])])
    share = np.linspace(0.0, 1.0, 17)[:, None]
    return np.asarray((1 - share) ** 2 * foot + 2 * share * (1 - share) * corner + share**2 * end)


def _sleeve(points: FloatArray) -> tuple[Any, list[tuple[FloatArray, IntArray]]]:
    """A sleeve about the arm's axis as high as the joints on it, and struts to them."""
    reach = np.hypot(points[:, 0], points[:, 1])
    radius = float(np.clip(reach.min() - _BAR, 0.03, _SLEEVE))
    low, high = points[:, 2].min(), points[:, 2].max()
    middle = min((low + high) / 2, _SLEEVE_TOP)
    half = max(_SLEEVE_HEIGHT, high - low + 0.02) / 2
    bottom, top, wall = middle - half, middle + half, radius + _WALL
    profile = np.array([(radius, bottom), (wall, bottom), (wall, top), (radius, top), (radius, bottom)])
    struts = []
    for point, out in zip(points, reach, strict=True):
        if out <= wall + _BAR:
            continue
        foot = np.array([*(radius * point[:2] / out), np.clip(point[2], bottom + _BAR, top - _BAR)])
        struts.append(tube(np.linspace(foot, point, 3), _BAR))
    return lathe(profile, 48), struts


def _balls(points: FloatArray) -> Any:
    rise = np.linspace(-np.pi / 2, np.pi / 2, 9)
    ball = _BALL * rings_about_z(np.column_stack([np.cos(rise), np.sin(rise)]), 16)
    return mesh_of([skin_of(ball + point) for point in points])
