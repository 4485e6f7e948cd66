"""Motion subspaces of the joints of a model."""

from __future__ import annotations

import numpy as np
import pinocchio as pin

from ...core.validation import FloatArray

__all__ = ["motion_axes"]


def motion_axes(model: pin.Model) -> list[FloatArray]:
    """Motion subspace of every joint at rest, shape (6, nv) each, linear part first, in the joint's frame."""
    rest = pin.neutral(model)
    found = [np.zeros((6, 0))]
    for joint in list(model.joints)[1:]:
        data = joint.createData()
        joint.calc(data, rest)
        found.append(np.array(data.S, dtype=np.float64).reshape(6, -1))
    return found
