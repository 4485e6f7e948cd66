"""The socket of the scapula: its centre and its axes.

``python docs/glenoid_surface.py`` fits them to the mesh of MyoArm's scapula and writes the table that is read here. The
joint surface has 34 triangles, is 36 mm high and 28 mm wide; the centre of the joint is 30.6 mm in front of its plane.
Against the scapula the socket is turned 5.5° backwards; adults have 1 ± 3°. Its inclination is 0°, and -8 to +6° as the
point at the level of the spine, which the mesh does not show clearly, is moved 15 mm down or up; adults have 7 ± 4° of
the bone and 1.6 ± 3° with the labrum.
"""

from __future__ import annotations

import functools
from typing import Any, NamedTuple

from ...core.records import reduced_tuple
from ...core.validation import FloatArray
from .muscle_table import data_table


class GlenoidSurface(NamedTuple):
    """The fitted socket, in the scapula's frame of the model.

    Attributes
    ----------
    centre : ndarray
        Shape (3,), m.
    axes : ndarray
        Shape (3, 3), rows: out of the socket, superior, anterior.
    """

    centre: FloatArray
    axes: FloatArray

    def __reduce__(self) -> tuple[Any, ...]:
        return reduced_tuple(self)


@functools.cache
def glenoid_surface() -> GlenoidSurface:
    """The socket of the model's scapula."""
    rows = data_table("glenoid").numbers(("x", "y", "z"))
    return GlenoidSurface(rows[0], rows[1:])
