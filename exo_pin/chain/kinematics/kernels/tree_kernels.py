"""Poses, Jacobian and steps of a tree of joints, compiled: what Pinocchio gives, without a call of it.

A tree of joints as arrays, so that compiled code places it without a call of Pinocchio.
"""

from __future__ import annotations

import math
from typing import Any

import numpy as np
import pinocchio as pin
from numpy.typing import NDArray

from ....core.compiled import kernel
from ....core.validation import FloatArray, frozen
from ...structure.projection import compose

#: Joints by what moves them: a hinge, slide or screw along an axis, a hinge by cosine and sine, a ball, a free flight,
#: a shift, a motion in the plane.
SCREW, ENDLESS, BALL, FLIGHT, SHIFT, PLANE = range(6)
_KINDS = {
    "JointModelSpherical": BALL,
    "JointModelFreeFlyer": FLIGHT,
    "JointModelTranslation": SHIFT,
    "JointModelPlanar": PLANE,
}

#: Parent, kind, first index in q and in v of each joint, shape (n, 4); placements, shape (n, 4, 3), as the kernels
#: have poses; axes of hinges, slides and screws with angular and linear part, shape (n, 2, 3). A plain tuple,
#: because Numba takes it faster than a named one.
Tree = tuple[NDArray[np.int64], FloatArray, FloatArray]


def tree_arrays(model: pin.Model) -> Tree:
    """The arrays of a tree."""
    links, places = np.zeros((model.njoints, 4), dtype=np.int64), np.zeros((model.njoints, 4, 3))
    motions = np.zeros((model.njoints, 2, 3))
    places[0, :3] = np.eye(3)
    for j in range(1, model.njoints):
        kind, place = model.joints[j], model.jointPlacements[j]
        code = _KINDS.get(kind.shortname())
        if code is None:
            code = SCREW if kind.nq == 1 else ENDLESS
            motions[j] = _motion(kind)
        links[j] = model.parents[j], code, kind.idx_q, kind.idx_v
        places[j, :3], places[j, 3] = place.rotation.T, place.translation
    return frozen(links), frozen(places), frozen(motions)


def _motion(kind: pin.JointModel) -> FloatArray:
    """Angular and linear part of the motion of a joint of one coordinate, shape (2, 3)."""
    data = kind.createData()
    at = np.zeros(kind.idx_q + kind.nq)
    at[kind.idx_q] = 1.0 if kind.nq == 2 else 0.0
    kind.calc(data, at)
    axis = np.asarray(data.S).ravel()
    return np.array([axis[3:], axis[:3]])


@kernel(fills=True)
def _turn_about(axis: Any, cosine: float, sine: float, out: Any) -> None:
    """Columns of the rotation about a unit axis, rows of ``out``."""
    x, y, z, c = axis[0], axis[1], axis[2], 1.0 - cosine
    out[0, 0], out[0, 1], out[0, 2] = cosine + x * x * c, x * y * c + z * sine, x * z * c - y * sine
    out[1, 0], out[1, 1], out[1, 2] = x * y * c - z * sine, cosine + y * y * c, y * z * c + x * sine
    out[2, 0], out[2, 1], out[2, 2] = x * z * c + y * sine, y * z * c - x * sine, cosine + z * z * c


@kernel(fills=True)
def _turn_of(x: float, y: float, z: float, w: float, out: Any) -> None:
    """Columns of the rotation of a unit quaternion, rows of ``out``."""
    out[0, 0], out[0, 1], out[0, 2] = 1 - 2 * (y * y + z * z), 2 * (x * y + z * w), 2 * (x * z - y * w)
    out[1, 0], out[1, 1], out[1, 2] = 2 * (x * y - z * w), 1 - 2 * (x * x + z * z), 2 * (y * z + x * w)
    out[2, 0], out[2, 1], out[2, 2] = 2 * (x * z + y * w), 2 * (y * z - x * w), 1 - 2 * (x * x + y * y)


@kernel(fills=True)
def _no_turn(out: Any) -> None:
    for i in range(4):
        for k in range(3):
            out[i, k] = 1.0 if i == k else 0.0


@kernel(fills=True)
def _turning(pose: Any, x: float, y: float, z: float, out: Any) -> None:
    """World twist of a turn about an axis of a body through its origin."""
    for k in range(3):
        out[3 + k] = x * pose[0, k] + y * pose[1, k] + z * pose[2, k]
    p = pose[3]
    out[0] = p[1] * out[5] - p[2] * out[4]
    out[1] = p[2] * out[3] - p[0] * out[5]
    out[2] = p[0] * out[4] - p[1] * out[3]


@kernel(fills=True)
def _sliding(pose: Any, x: float, y: float, z: float, out: Any) -> None:
    """World twist of a shift along an axis of a body, added."""
    for k in range(3):
        out[k] += x * pose[0, k] + y * pose[1, k] + z * pose[2, k]


@kernel(fills=True)
def place_tree(tree: Any, q: Any, local: Any, poses: Any, J: Any) -> None:
    """Fill poses and world Jacobian of a tree.

    Parameters
    ----------
    tree : tuple of ndarray
        What :func:`exo_pin.chain.kinematics.kernels.tree_kernels.tree_arrays` returns.
    q : ndarray
        Shape (nq,).
    local : ndarray
        Room for the pose of a joint in two steps, shape (2, 4, 3).
    poses : ndarray
        Shape (njoints, 4, 3), filled: rows 0 to 2 are the columns of R, row 3 is p.
    J : ndarray
        Shape (nv, 6), filled: the transposed Jacobian, linear part first, about the world's origin.
    """
    links, places, motions = tree
    own, between = local[0], local[1]
    _no_turn(poses[0])
    for j in range(1, len(links)):
        parent, kind, a, b = links[j, 0], links[j, 1], links[j, 2], links[j, 3]
        _no_turn(own)
        axis, slide = motions[j, 0], motions[j, 1]
        if kind == SCREW:
            if axis[0] != 0.0 or axis[1] != 0.0 or axis[2] != 0.0:
                _turn_about(axis, math.cos(q[a]), math.sin(q[a]), own)
            for k in range(3):
                own[3, k] = slide[k] * q[a]
        elif kind == ENDLESS:
            _turn_about(axis, q[a], q[a + 1], own)
        elif kind == BALL:
            _turn_of(q[a], q[a + 1], q[a + 2], q[a + 3], own)
        elif kind == PLANE:
            own[0, 0], own[0, 1] = q[a + 2], q[a + 3]
            own[1, 0], own[1, 1] = -q[a + 3], q[a + 2]
            own[3, 0], own[3, 1] = q[a], q[a + 1]
        else:
            if kind == FLIGHT:
                _turn_of(q[a + 3], q[a + 4], q[a + 5], q[a + 6], own)
            for k in range(3):
                own[3, k] = q[a + k]
        compose(places[j], own, between)
        compose(poses[parent], between, poses[j])
        pose = poses[j]
        if kind in (SCREW, ENDLESS):
            _turning(pose, axis[0], axis[1], axis[2], J[b])
            _sliding(pose, slide[0], slide[1], slide[2], J[b])
            continue
        if kind == PLANE:
            _turning(pose, 0.0, 0.0, 1.0, J[b + 2])
        elif kind != SHIFT:
            first = b + 3 if kind == FLIGHT else b
            _turning(pose, 1.0, 0.0, 0.0, J[first])
            _turning(pose, 0.0, 1.0, 0.0, J[first + 1])
            _turning(pose, 0.0, 0.0, 1.0, J[first + 2])
        if kind != BALL:
            for k in range(2 if kind == PLANE else 3):
                _turning(pose, 0.0, 0.0, 0.0, J[b + k])
                _sliding(pose, 1.0 if k == 0 else 0.0, 1.0 if k == 1 else 0.0, 1.0 if k == 2 else 0.0, J[b + k])


@kernel(fills=True)
def turn_quaternion(q: Any, a: int, x: float, y: float, z: float) -> None:
    """Turn a quaternion, x y z w from index a on, by a rotation vector in the body's own axes."""
    angle = math.sqrt(x * x + y * y + z * z)
    half = 0.5 * angle
    # Of a small angle the series: sin(angle / 2) / angle.
    factor = 0.5 * (1.0 - half * half / 6.0) if angle < 1e-4 else math.sin(half) / angle
    c, x, y, z = math.cos(half), factor * x, factor * y, factor * z
    s, t, u, w = q[a], q[a + 1], q[a + 2], q[a + 3]
    q[a] = s * c + w * x + t * z - u * y
    q[a + 1] = t * c + w * y + u * x - s * z
    q[a + 2] = u * c + w * z + s * y - t * x
    q[a + 3] = w * c - s * x - t * y - u * z
    length = math.sqrt(q[a] * q[a] + q[a + 1] * q[a + 1] + q[a + 2] * q[a + 2] + q[a + 3] * q[a + 3])
    for k in range(4):
        q[a + k] /= length


@kernel(fills=True)
def step_tree(tree: Any, move: Any, q: Any) -> None:
    """Move a configuration along a motion, shape (nv,), in place, as Pinocchio's ``integrate`` moves it.

    Of free flights and motions in the plane the shift is along the body's axes before and not along the screw.
    """
    links = tree[0]
    for j in range(1, len(links)):
        kind, a, b = links[j, 1], links[j, 2], links[j, 3]
        if kind == SCREW:
            q[a] += move[b]
        elif kind == ENDLESS:
            _turn_plane(q, a, move[b])
        elif kind == BALL:
            turn_quaternion(q, a, move[b], move[b + 1], move[b + 2])
        elif kind == SHIFT:
            for k in range(3):
                q[a + k] += move[b + k]
        elif kind == PLANE:
            c, s = q[a + 2], q[a + 3]
            q[a] += c * move[b] - s * move[b + 1]
            q[a + 1] += s * move[b] + c * move[b + 1]
            _turn_plane(q, a + 2, move[b + 2])
        else:
            x, y, z, w = q[a + 3], q[a + 4], q[a + 5], q[a + 6]
            u, v, t = move[b], move[b + 1], move[b + 2]
            q[a] += (1 - 2 * (y * y + z * z)) * u + 2 * (x * y - z * w) * v + 2 * (x * z + y * w) * t
            q[a + 1] += 2 * (x * y + z * w) * u + (1 - 2 * (x * x + z * z)) * v + 2 * (y * z - x * w) * t
            q[a + 2] += 2 * (x * z - y * w) * u + 2 * (y * z + x * w) * v + (1 - 2 * (x * x + y * y)) * t
            turn_quaternion(q, a + 3, move[b + 3], move[b + 4], move[b + 5])


@kernel(fills=True)
def _turn_plane(q: Any, a: int, angle: float) -> None:
    """Turn a pair of cosine and sine."""
    c, s, x, y = math.cos(angle), math.sin(angle), q[a], q[a + 1]
    length = math.hypot(x, y)
    q[a], q[a + 1] = (c * x - s * y) / length, (s * x + c * y) / length
