"""A tree of joints as arrays, so that compiled code places it without a call of Pinocchio."""

from __future__ import annotations

import numpy as np
import pinocchio as pin
from numpy.typing import NDArray

from ....core.validation import FloatArray, frozen
from ...structure.constant_axes import ConstantAxes

#: Joints by what moves them: a hinge, slide or screw along an axis, a hinge by cosine and sine, a ball, a free flight,
#: a shift, a motion in the plane, a ball that rolls in an ellipsoid.
SCREW, ENDLESS, BALL, FLIGHT, SHIFT, PLANE, ELLIPSOID = range(7)
_KINDS = {
    "JointModelSpherical": BALL,
    "JointModelFreeFlyer": FLIGHT,
    "JointModelTranslation": SHIFT,
    "JointModelPlanar": PLANE,
    "JointModelEllipsoid": ELLIPSOID,
}

#: Parent, kind, first index in q and in v of each joint, shape (n, 4); placements, shape (n, 4, 3), as the kernels
#: have poses; axes of hinges, slides and screws with angular and linear part, or an ellipsoid's radii twice, shape
#: (n, 2, 3); and, of each joint of the model itself, its joint here. A plain tuple, because Numba takes it faster
#: than a named one.
Tree = tuple[NDArray[np.int64], FloatArray, FloatArray, NDArray[np.int64]]


def tree_arrays(axes: ConstantAxes) -> Tree:
    """The arrays of a tree."""
    model = axes.model
    links, places = np.zeros((model.njoints, 4), dtype=np.int64), np.zeros((model.njoints, 4, 3))
    motions = np.zeros((model.njoints, 2, 3))
    places[0, :3] = np.eye(3)
    for j in range(1, model.njoints):
        kind, place = model.joints[j], model.jointPlacements[j]
        code = _KINDS.get(kind.shortname())
        if code == ELLIPSOID:
            own = kind.extract() if isinstance(kind, pin.JointModel) else kind
            motions[j] = own.radius_x, own.radius_y, own.radius_z
        elif code is None:
            code = SCREW if kind.nq == 1 else ENDLESS
            motions[j] = _motion(kind)
        links[j] = model.parents[j], code, kind.idx_q, kind.idx_v
        places[j, :3], places[j, 3] = place.rotation.T, place.translation
    return frozen(links), frozen(places), frozen(motions), axes.tree[2]


def _motion(kind: pin.JointModel) -> FloatArray:
    """Angular and linear part of the motion of a joint of one coordinate, shape (2, 3)."""
    data = kind.createData()
    at = np.zeros(kind.idx_q + kind.nq)
    at[kind.idx_q] = 1.0 if kind.nq == 2 else 0.0
    kind.calc(data, at)
    axis = np.asarray(data.S).ravel()
    return np.array([axis[3:], axis[:3]])
