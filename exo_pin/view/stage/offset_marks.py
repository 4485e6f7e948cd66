"""Picture of a device with a centre offset: shifted joints and marks of its centres."""

from __future__ import annotations

from typing import Any

import numpy as np
from numpy.typing import ArrayLike
from scipy.spatial.transform import Rotation

from ...core.records import OneProcess
from ...core.validation import FloatArray
from ...design import Mechanism
from ...load_case import CentreOffset, CentrePath
from ...reaction import Split
from ...reaction.assumptions import as_split
from ...wrist.forces.displaced import as_offset
from ..colours import BLACK, GREY
from ..meshcat_viewer import mg
from .shapes import flat_material, frustum, placement, segment
from .stage import Stage

__all__ = ["Offset", "OffsetMarks", "displaced", "offsets", "same_offset"]

#: Radius of a mark and of its line from O, m.
_MARK, _LINE = 0.008, 0.0025
#: A centre nearer to O than this is drawn at O, m.
_FITS = 1e-6

#: Where the device's centre lies: of harness and base ring in the base frame, of cuff and arm ring in the arm's, m.
Offset = tuple[FloatArray, FloatArray]


def offsets(
    given: CentreOffset | CentrePath | ArrayLike, poses: Rotation, split: str | Split = "spherical"
) -> list[Offset]:
    """Offsets of poses of shape () or (k,), a list of 1 or k, as the forces of a query count them."""
    known = given.offset(poses) if isinstance(given, CentrePath) else given
    base, cuff = as_offset(known, poses.shape)
    base, cuff = as_split(split).offsets(poses.as_matrix().reshape(-1, 3, 3), base, cuff)
    return list(zip(base, cuff, strict=True))


def same_offset(one: Offset | None, other: Offset | None) -> bool:
    """Whether two offsets are equal."""
    if one is None or other is None:
        return one is other
    return all(np.array_equal(a, b) for a, b in zip(one, other, strict=True))


def displaced(mechanism: Mechanism, offset: Offset | None) -> Mechanism:
    """The mechanism with its joints where the offset has them."""
    if offset is None:
        return mechanism
    geometry = mechanism.geometry
    moved = geometry.replace(
        base_points=geometry.base_points + offset[0], platform_points=geometry.platform_points + offset[1]
    )
    return mechanism.replace(geometry=moved)


class OffsetMarks(OneProcess):
    """Balls at the device's centres and lines to them from O, with what they are.

    Parameters
    ----------
    stage : Stage
        Where they are drawn.
    """

    def __init__(self, stage: Stage) -> None:
        self._stage = stage
        for name, colour in (("harness", BLACK), ("cuff", GREY)):
            node = stage.viewer[f"offset/{name}"]
            node["ball"].set_object(mg.Sphere(1.0), flat_material(colour, on_top=True))
            node["line"].set_object(frustum(1.0, 1.0), flat_material(colour, on_top=True))
        self.show(None, np.eye(3))

    def show(self, offset: Offset | None, matrix: FloatArray) -> list[dict[str, Any]]:
        """Draw them, if there are any, in a pose of shape (3, 3); return their labels."""
        base, cuff = (np.zeros(3), np.zeros(3)) if offset is None else (offset[0], matrix @ offset[1])
        together = float(np.linalg.norm(base - cuff)) < _FITS
        labels = []
        for name, centre, colour in (("harness", base, BLACK), ("cuff", cuff, GREY)):
            size = float(np.linalg.norm(centre))
            hidden = size < _FITS or (name == "cuff" and together)
            ball = placement(_FITS if hidden else _MARK, centre)
            line = segment(np.zeros(3), np.zeros(3) if hidden else centre, _FITS if hidden else _LINE)
            self._stage.set_transform(f"/meshcat/offset/{name}/ball", ball)
            self._stage.set_transform(f"/meshcat/offset/{name}/line", line)
            if not hidden:
                what = "device's centre" if together else f"{name}'s centre"
                labels.append({"text": f"{what}, {1e3 * size:.0f} mm off", "at": centre.tolist(), "colour": colour})
        return labels
