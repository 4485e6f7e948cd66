"""Colours (Okabe and Ito's palette, and a scale that also reads in grey), and styles in which limbs are drawn."""

from __future__ import annotations

from collections.abc import Iterable, Sequence

import numpy as np

from ..core.validation import FloatArray

#: Okabe and Ito's palette, safe for colour-blind readers.
BLUE, ORANGE, GREEN, RED = "#0072B2", "#E69F00", "#009E73", "#D55E00"
SKY, PURPLE, BLACK = "#56B4E9", "#CC79A7", "#000000"
GREY = "#6E7781"
#: Of springs: darker than all arrows but black.
SPRING = "#7A4A1E"

#: The cividis scale at equal steps, dark blue to yellow; lightness rises all the way.
CIVIDIS = "#00224E #123570 #3B496C #575D6D #707173 #8A8678 #A59C74 #C3B369 #E1CC55 #FEE838".split()  # noqa: SIM905


#: Activations of the wearer's muscles, pale to dark red: muscles at rest stand out from dark limbs, all from bones.
ACTIVATIONS = ["#E2A696", "#B0524E", "#66001C"]


def number(rgb: Iterable[float]) -> int:
    """A colour of shape (3,) in 0 to 1 as three.js expects it."""
    return int(hexadecimal(rgb)[1:], 16)


def channels(colour: str) -> FloatArray:
    """Red, green and blue of a ``#RRGGBB`` colour, shape (3,), in 0 to 1."""
    return np.array([int(colour[i : i + 2], 16) for i in (1, 3, 5)]) / 255.0


def hexadecimal(rgb: Iterable[float]) -> str:
    """``#RRGGBB`` of a colour of shape (3,) in 0 to 1."""
    return "#" + "".join(f"{round(255 * float(part)):02X}" for part in rgb)


def scale_colours(values: FloatArray, low: float, high: float, scale: Sequence[str] = CIVIDIS) -> FloatArray:
    """Colours of values on a scale.

    Parameters
    ----------
    values : ndarray
        Shape (...). NaN becomes light grey.
    low, high : float
        Ends of the scale; values beyond take the colour of the end.
    scale : sequence of str
        Its colours at equal steps, ``#RRGGBB``.

    Returns
    -------
    ndarray
        Shape (..., 3), red, green, blue in 0 to 1.
    """
    values = np.asarray(values, dtype=float)
    span = high - low if high > low else 1.0
    place = np.clip(np.nan_to_num((values - low) / span), 0.0, 1.0) * (len(scale) - 1)
    parts = np.stack([channels(colour) for colour in scale], axis=1)
    colours = np.stack([np.interp(place, np.arange(len(scale)), part) for part in parts], axis=-1)
    colours[np.isnan(values)] = 0.85
    return np.asarray(colours)


LIMB_STYLES = ("rods", "muscles")
