"""Colours (Okabe and Ito's palette, and a scale that also reads in grey), and styles in which limbs are drawn."""

from __future__ import annotations

from collections.abc import Iterable

import numpy as np

from ..core.validation import FloatArray

#: Okabe and Ito's palette, safe for colour-blind readers.
BLUE, ORANGE, GREEN, RED = "#0072B2", "#E69F00", "#009E73", "#D55E00"
SKY, PURPLE, BLACK = "#56B4E9", "#CC79A7", "#000000"
GREY = "#6E7781"
#: Of springs: darker than all arrows but black.
SPRING = "#7A4A1E"

#: The cividis scale at equal steps, dark blue to yellow; lightness rises all the way.
CIVIDIS = np.array(
    [
        (0, 34, 78),
        (18, 53, 112),
        (59, 73, 108),
        (87, 93, 109),
        (112, 113, 115),
        (138, 134, 120),
        (165, 156, 116),
        (195, 179, 105),
        (225, 204, 85),
        (254, 232, 56),
    ],
    dtype=float,
)


#: Activations of the wearer's muscles, pale to dark red: muscles at rest stand out from dark limbs, all from bones.
ACTIVATIONS = np.array([(226, 166, 150), (176, 82, 78), (102, 0, 28)], dtype=float)


def number(colour: str) -> int:
    """A ``#RRGGBB`` colour as three.js expects it."""
    return int(colour[1:], 16)


def channels(colour: str) -> FloatArray:
    """Red, green and blue of a ``#RRGGBB`` colour, shape (3,), in 0 to 1."""
    return np.array([int(colour[i : i + 2], 16) for i in (1, 3, 5)]) / 255.0


def hexadecimal(rgb: Iterable[float]) -> str:
    """``#RRGGBB`` of a colour of shape (3,) in 0 to 1."""
    return "#" + "".join(f"{round(255 * float(part)):02X}" for part in rgb)


def scale_colours(values: FloatArray, low: float, high: float, scale: FloatArray = CIVIDIS) -> FloatArray:
    """Colours of values on a scale.

    Parameters
    ----------
    values : ndarray
        Shape (...). NaN becomes light grey.
    low, high : float
        Ends of the scale; values beyond take the colour of the end.
    scale : ndarray
        Shape (k, 3), its colours at equal steps, 0 to 255.

    Returns
    -------
    ndarray
        Shape (..., 3), red, green, blue in 0 to 1.
    """
    values = np.asarray(values, dtype=float)
    span = high - low if high > low else 1.0
    place = np.clip(np.nan_to_num((values - low) / span), 0.0, 1.0) * (len(scale) - 1)
    steps = np.arange(len(scale))
    colours = np.stack([np.interp(place, steps, scale[:, part]) for part in range(3)], axis=-1) / 255.0
    colours[np.isnan(values)] = 0.85
    return np.asarray(colours)


LIMB_STYLES = ("rods", "muscles")
