"""Least distances of a device's limbs to the wearer's arm and torso, and to one another."""

from __future__ import annotations

import numpy as np

from ...core.validation import FloatArray
from ...design import Mechanism
from .body_shape import BodyShape
from .clearance_kernels import clearance_stack

#: Radius of a limb by its actuator's family, m, where none is given: assumed.
LIMB_RADII = {"cable": 0.003, "pneumatic muscle": 0.015, "linear": 0.016}
#: What a limb may pass through, in the order of the gaps.
_PARTS = ("the wearer's arm", "the wearer's torso", "another limb")


def limb_radii(mechanism: Mechanism, radius: float | None = None) -> FloatArray:
    """Radius of every limb, shape (n,), m: the given one or that of its family; NaN where it has none."""
    if radius is not None:
        return np.full(mechanism.limb_count, radius)
    families = [None if limb.actuator is None else limb.actuator.family for limb in mechanism.limbs]
    return np.array([np.nan if family is None else LIMB_RADII[family] for family in families])


def clearances(
    matrices: FloatArray,
    base: FloatArray,
    platform: FloatArray,
    radii: FloatArray,
    body: BodyShape,
    offset: tuple[FloatArray, FloatArray] | None = None,
) -> FloatArray:
    """Gaps between the surfaces of limbs and of arm, torso and other limbs, shape (N, 3), m; negative in an overlap.

    Parameters
    ----------
    matrices : ndarray
        Shape (N, 3, 3).
    base, platform : ndarray
        Joints of the limbs about the device's centre, shape (n, 3), m, base and arm frame.
    radii : ndarray
        Of the limbs, shape (n,), m.
    body : BodyShape
        Of the wearer.
    offset : tuple of ndarray, optional
        Where the device's centre lies from the shoulder's, held by the base and carried by the cuff, shape (N, 3) or
        (1, 3) each, m.
    """
    gaps = np.empty((len(matrices), 3))
    held, carried = (np.zeros((1, 3)), np.zeros((1, 3))) if offset is None else offset
    # Writable copies, for which the kernel is compiled.
    still, moving = np.array(body.torso), np.array(body.arm)
    clearance_stack(matrices, base, platform, held, carried, radii, still, moving, gaps)
    return gaps


def limb_gaps(
    matrices: FloatArray,
    mechanism: Mechanism,
    radii: FloatArray,
    body: BodyShape,
    offset: tuple[FloatArray, FloatArray] | None = None,
) -> FloatArray:
    """Least gap of each limb to arm, torso and other limbs over all poses, shape (n, 3), m; see :func:`clearances`."""
    n, base, platform = mechanism.limb_count, mechanism.geometry.base_points, mechanism.geometry.platform_points
    out = np.full((n, 3), np.inf)
    for i in range(n):
        for j in range(n):
            pair = [i, j] if j != i else [i]
            gap = clearances(matrices, base[pair], platform[pair], radii[pair], body, offset).min(axis=0)
            if j == i:
                out[i, :2] = gap[:2]
            else:
                out[i, 2] = min(out[i, 2], gap[2])
    return out


def wearer_gaps(
    mechanism: Mechanism, matrices: FloatArray, offset: tuple[FloatArray, FloatArray] | None = None
) -> FloatArray | None:
    """Gaps of :func:`clearances` from the body of who wears the design, shape (N, 3), m.

    None where it is not known who wears it, or how thick a limb is.
    """
    wearer, radii = None if mechanism.arm is None else mechanism.arm.wearer, limb_radii(mechanism)
    if wearer is None or np.isnan(radii).any():
        return None
    body, geometry = BodyShape.of(wearer, mechanism.side), mechanism.geometry
    return clearances(matrices, geometry.base_points, geometry.platform_points, radii, body, offset)


def clash(
    mechanism: Mechanism, matrices: FloatArray, offset: tuple[FloatArray, FloatArray] | None = None
) -> str | None:
    """A sentence on the limbs that pass through something in these poses; None where none is known to."""
    gaps = wearer_gaps(mechanism, matrices, offset)
    if gaps is None or not (gaps < 0.0).any():
        return None
    if len(gaps) > 1:
        through = [part for part, gap in zip(_PARTS, gaps.min(axis=0), strict=True) if gap < 0.0]
        share = f"In {int((gaps < 0.0).any(axis=1).sum())} of {len(gaps)} poses"
        return f"{share} limbs pass through {' or '.join(through)}, by up to {_depth(gaps.min())}."
    assert mechanism.arm is not None
    assert mechanism.arm.wearer is not None
    body = BodyShape.of(mechanism.arm.wearer, mechanism.side)
    each = limb_gaps(matrices, mechanism, limb_radii(mechanism), body, offset)
    found = [
        f"limb {limb + 1} passes through {_PARTS[part]} ({_depth(each[limb, part])} deep)"
        for limb, part in np.argwhere(each < 0.0).tolist()
    ]
    return f"As it is worn, {', '.join(found)}."


def _depth(gap: float) -> str:
    return f"{-1e3 * gap:.2g} mm" if gap > -0.01 else f"{-1e3 * gap:.0f} mm"
