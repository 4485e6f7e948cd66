"""Chest, neck and head of the person in the scene, drawn as skins over superellipses.

The shape, in ``bust.toml``, is for pictures: chosen by eye for a person of 1.79 m, no anthropometric data. It fills
what the figure of example-robot-data leaves open (shoulders, neck, face), and stands alone where that is missing.
Frame: O is the shoulder centre, x forward, z up; y is counted from the middle of the body.
"""

from __future__ import annotations

from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import ArrayLike

from ...core.files.toml_tables import read_toml
from ...core.validation import FloatArray
from ..meshcat_viewer import mg
from ..stage.shapes import loft, matt_material, placement
from ..stage.stage import Stage

#: Stature that the sizes belong to, from soles to crown, and distance of the body's middle from the shoulder centre, m.
OWN_STATURE, MIDDLE = 1.787, 0.21
#: Opacity of the shoulder and arm that wear the device, which shows joints and forces in them.
SEE_THROUGH = 0.5
SKIN, CLOTH = (0.86, 0.70, 0.60), (0.62, 0.67, 0.73)
_EYE = (0.20, 0.17, 0.16)

_DATA = read_toml(Path(__file__).with_name("bust.toml"))
#: Sections from below: height, half width, half depth, how far forward its middle is, m.
_CHEST, _NECK, _HEAD = (_DATA.quantity("length", part, (None, 4)) for part in ("chest", "neck", "head"))
#: Centre and radii of balls, m.
_FEATURES, _EYES = (_DATA.quantity("length", part, (None, 6)) for part in ("nose_and_ears", "eyes"))
_DATA.finish()
#: Exponent of the superellipses: 2 is an ellipse, more is nearer to a rectangle.
_ROUND = 2.35
#: Radius of the rounding of a shoulder, m.
_SHOULDER = 0.060


def draw_bust(stage: Stage, side: str, scale: float) -> None:
    """Draw chest, neck, head and shoulders, in place once and for all.

    Parameters
    ----------
    stage : Stage
        Where.
    side : {"left", "right"}
        Which shoulder is at O.
    scale : float
        Of everything: stature over :data:`OWN_STATURE`.
    """
    node = stage.viewer["bust"]
    cloth, skin, dark = matt_material(CLOTH), matt_material(SKIN), matt_material(_EYE)
    for name, sections, material in (("chest", _CHEST, cloth), ("neck", _NECK, skin), ("head", _HEAD, skin)):
        node[name].set_object(loft(_rings(sections)), material)
    features = [*((shape, skin) for shape in _FEATURES), *((shape, dark) for shape in _EYES)]
    for k, (ball, material) in enumerate(features):
        _ball(node[f"feature_{k}"], ball[:3], ball[3:], material)
    own, other = (1.0, -1.0) if side == "left" else (-1.0, 1.0)
    _ball(node["shoulder"], (0.0, own * MIDDLE, 0.0), _SHOULDER, matt_material(SKIN, SEE_THROUGH))
    _ball(node["other_shoulder"], (0.0, other * MIDDLE, 0.0), _SHOULDER, cloth)
    stage.set_transform("/meshcat/bust", placement(scale, [0.0, -own * scale * MIDDLE, 0.0]))


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


def _rings(sections: FloatArray) -> FloatArray:
    """Closed rings over sections, a few between each two, shape (k, 48, 3)."""
    from scipy.interpolate import PchipInterpolator

    rows = np.arange(len(sections), dtype=float)
    fine = PchipInterpolator(rows, sections)(np.linspace(0.0, rows[-1], 4 * (len(sections) - 1) + 1))
    turn = np.linspace(0.0, 2 * np.pi, 48, endpoint=False)
    x, y = (np.sign(part) * np.abs(part) ** (2.0 / _ROUND) for part in (np.cos(turn), np.sin(turn)))
    rings = [
        np.column_stack([forward + depth * x, width * y, np.full(48, height)]) for height, width, depth, forward in fine
    ]
    ends = [np.tile(rings[k].mean(axis=0), (48, 1)) for k in (0, -1)]
    return np.array([ends[0], *rings, ends[1]])


def _ball(node: Any, centre: ArrayLike, radii: ArrayLike, material: Any) -> None:
    node.set_object(mg.Sphere(1.0), material)
    node.set_transform(placement(radii, centre))
