"""Chest, neck and head of the person in the scene, drawn as skins over superellipses.

The shape is for pictures: widths and depths are chosen by eye for a person of 1.79 m, no anthropometric data. It fills
what the figure of example-robot-data leaves open (shoulders, neck, face), and stands alone where that is missing.
Frame: O is the shoulder centre, x forward, z up; y is counted from the middle of the body.
"""

from __future__ import annotations

from typing import Any

import numpy as np

from ...core.validation import FloatArray
from ..meshcat_viewer import mg
from ..scene.shapes import loft, matt_material, placement
from ..scene.stage import Stage

__all__ = ["CLOTH", "MIDDLE", "OWN_STATURE", "SKIN", "depth_in_chest", "draw_bust", "starts_inside"]

#: Stature that the sizes belong to, from soles to crown, and distance of the body's middle from the shoulder centre, m.
OWN_STATURE, MIDDLE = 1.787, 0.21
SKIN, CLOTH = (0.86, 0.70, 0.60), (0.62, 0.67, 0.73)
_EYE = (0.20, 0.17, 0.16)

#: Sections of the chest from below: height, half width, half depth, how far forward its middle is, m.
_CHEST = np.array(
    [
        (-0.350, 0.119, 0.098, -0.012),
        (-0.290, 0.117, 0.096, -0.009),
        (-0.220, 0.126, 0.104, -0.006),
        (-0.140, 0.141, 0.111, -0.003),
        (-0.070, 0.151, 0.110, -0.004),
        (-0.020, 0.158, 0.098, -0.008),
        (0.015, 0.178, 0.080, -0.012),
        (0.040, 0.162, 0.069, -0.014),
        (0.062, 0.118, 0.062, -0.015),
        (0.082, 0.084, 0.058, -0.014),
        (0.100, 0.066, 0.056, -0.010),
    ]
)
_NECK = np.array([(0.085, 0.062, 0.057, -0.008), (0.130, 0.055, 0.056, -0.002), (0.200, 0.053, 0.056, 0.002)])
_HEAD = np.array(
    [
        (0.165, 0.012, 0.012, 0.058),
        (0.170, 0.034, 0.034, 0.040),
        (0.185, 0.050, 0.056, 0.024),
        (0.210, 0.062, 0.078, 0.010),
        (0.245, 0.071, 0.090, 0.002),
        (0.285, 0.076, 0.097, -0.003),
        (0.325, 0.076, 0.097, -0.006),
        (0.360, 0.067, 0.085, -0.007),
        (0.388, 0.048, 0.060, -0.007),
        (0.402, 0.024, 0.030, -0.007),
        (0.406, 0.004, 0.005, -0.007),
    ]
)
#: Exponent of the superellipses: 2 is an ellipse, more is nearer to a rectangle.
_ROUND = 2.35
#: Centre and radii of balls that are stretched to nose and ears, and to eyes: x, y, z, then their radii, m.
_FEATURES = (
    ((0.092, 0.0, 0.262), (0.016, 0.010, 0.022)),
    ((-0.010, 0.077, 0.272), (0.017, 0.008, 0.028)),
    ((-0.010, -0.077, 0.272), (0.017, 0.008, 0.028)),
)
_EYES = (((0.084, 0.030, 0.294), (0.007, 0.008, 0.006)), ((0.084, -0.030, 0.294), (0.007, 0.008, 0.006)))
#: Radius of the rounding of a shoulder, m.
_SHOULDER = 0.060


def draw_bust(stage: Stage, path: str, side: str, scale: float, opacity: float) -> None:
    """Draw chest, neck, head and shoulders, in place once and for all.

    Parameters
    ----------
    stage : Stage
        Where.
    path : str
        Its node.
    side : {"left", "right"}
        Which shoulder is at O.
    scale : float
        Of everything: stature over :data:`OWN_STATURE`.
    opacity : float
        Of the shoulder that wears the device; 1 is opaque.
    """
    node = stage.viewer[path]
    cloth, skin, dark = matt_material(CLOTH), matt_material(SKIN), matt_material(_EYE)
    for name, sections, material in (("chest", _CHEST, cloth), ("neck", _NECK, skin), ("head", _HEAD, skin)):
        node[name].set_object(loft(_rings(sections)), material)
    features = [*((shape, skin) for shape in _FEATURES), *((shape, dark) for shape in _EYES)]
    for k, ((centre, radii), material) in enumerate(features):
        _ball(node[f"feature_{k}"], centre, radii, material)
    own, other = (1.0, -1.0) if side == "left" else (-1.0, 1.0)
    _ball(node["shoulder"], (0.0, own * MIDDLE, 0.0), (_SHOULDER,) * 3, matt_material(SKIN, opacity))
    _ball(node["other_shoulder"], (0.0, other * MIDDLE, 0.0), (_SHOULDER,) * 3, cloth)
    stage.set_transform(f"/meshcat/{path}", placement(scale, [0.0, -own * scale * MIDDLE, 0.0]))


def depth_in_chest(points: FloatArray, side: str, scale: float = 1.0) -> FloatArray:
    """How far points are inside the chest of the picture.

    Parameters
    ----------
    points : ndarray
        Shape (k, 3), m, base frame.
    side : {"left", "right"}
        Which shoulder is at O.
    scale : float
        As in :func:`draw_bust`.

    Returns
    -------
    ndarray
        Shape (k,), m, to the nearest corner of the skin; zero outside.
    """
    local = np.asarray(points, dtype=float) / scale + [0.0, MIDDLE if side == "left" else -MIDDLE, 0.0]
    width, depth, forward = (np.interp(local[:, 2], _CHEST[:, 0], _CHEST[:, k]) for k in (1, 2, 3))
    size = np.abs(local[:, 1] / width) ** _ROUND + np.abs((local[:, 0] - forward) / depth) ** _ROUND
    inside = (size < 1.0) & (local[:, 2] > _CHEST[0, 0]) & (local[:, 2] < _CHEST[-1, 0])
    skin = _rings(_CHEST)[1:-1].reshape(-1, 3)
    nearest = np.linalg.norm(local[:, None] - skin, axis=-1).min(axis=1)
    return np.where(inside, scale * nearest, 0.0)


def starts_inside(points: FloatArray, side: str, scale: float = 1.0) -> list[str]:
    """Limbs whose joints on the torso, shape (k, 3), m, are inside the chest of the picture, in words."""
    return [
        f"limb {i + 1} starts {max(1e3 * depth, 1.0):.0f} mm inside the chest: move A_{i + 1} out of it"
        for i, depth in enumerate(depth_in_chest(points, side, scale))
        if depth > 0.0
    ]


def _rings(sections: FloatArray, corners: int = 48, steps: int = 4) -> FloatArray:
    """Closed rings over sections, a few between each two, shape (k, corners, 3)."""
    from scipy.interpolate import PchipInterpolator

    rows = np.arange(len(sections), dtype=float)
    fine = PchipInterpolator(rows, sections)(np.linspace(0.0, rows[-1], steps * (len(sections) - 1) + 1))
    turn = np.linspace(0.0, 2 * np.pi, corners, endpoint=False)
    x, y = (np.sign(part) * np.abs(part) ** (2.0 / _ROUND) for part in (np.cos(turn), np.sin(turn)))
    rings = [
        np.column_stack([forward + depth * x, width * y, np.full(corners, height)])
        for height, width, depth, forward in fine
    ]
    ends = [np.tile(rings[k].mean(axis=0), (corners, 1)) for k in (0, -1)]
    return np.array([ends[0], *rings, ends[1]])


def _ball(node: Any, centre: tuple[float, ...], radii: tuple[float, ...], material: Any) -> None:
    node.set_object(mg.Sphere(1.0), material)
    node.set_transform(placement(radii, centre))
