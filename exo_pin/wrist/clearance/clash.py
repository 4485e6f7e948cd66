"""Whether limbs pass through the wearer or through one another, wherever it is known who wears the device."""

from __future__ import annotations

import numpy as np

from ...core.validation import FloatArray
from ...design import Mechanism
from .body_shape import BodyShape
from .clearance import clearances, limb_gaps, limb_radii

#: What a limb may pass through, in the order of the gaps.
_PARTS = ("the wearer's arm", "the wearer's torso", "another limb")


def wearer_gaps(
    mechanism: Mechanism, matrices: FloatArray, offset: tuple[FloatArray, FloatArray] | None = None
) -> FloatArray | None:
    """Gaps of :func:`.clearances` from the body of who wears the design, shape (N, 3), m.

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
