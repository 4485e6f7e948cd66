"""Picture of a device with a centre offset: shifted joints, and how far its centres are off."""

from __future__ import annotations

import numpy as np
from numpy.typing import ArrayLike
from scipy.spatial.transform import Rotation

from ...core.validation import FloatArray
from ...design import Mechanism
from ...load_case import CentreOffset, CentrePath
from ...reaction import Split
from ...reaction.assumptions import as_split
from ...wrist.forces.displaced import as_offset

#: Centres nearer than this are at one place, m.
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


def offset_notes(offset: Offset | None, matrix: FloatArray) -> list[str]:
    """How far the device's centres are from the shoulder's in a pose of shape (3, 3), in words."""
    if offset is None:
        return []
    base, cuff = offset[0], matrix @ offset[1]
    centres = {"harness": base, "cuff": cuff} if np.linalg.norm(base - cuff) > _FITS else {"device": base}
    sizes = {name: float(np.linalg.norm(centre)) for name, centre in centres.items()}
    return [f"{name}'s centre, {1e3 * size:.0f} mm off" for name, size in sizes.items() if size > _FITS]
