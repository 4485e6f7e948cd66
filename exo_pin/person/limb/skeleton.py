"""Bones and muscle paths as shapes, for pictures.

The meshes are those of the installed package ``myo_sim``; none is copied. Bones that do not move against each other
are one mesh: the trunk (sacrum to skull), and the radius with the hand, whose wrist and fingers stay straight. Meshes
with more triangles than a picture needs are made coarser by merging vertices in the cells of a grid.

The glenohumeral centre stays at O, as in all forces of the package: it is the trunk that moves a little as the arm is
elevated.
"""

from __future__ import annotations

import functools
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from ...core.conventions import MIRROR, as_side
from ...core.records import keeps_read_only
from ...core.validation import FloatArray, frozen
from .limb_state import angles_of, muscle_paths, placed, thorax_to_base
from .muscle_table import MUSCLES
from .myoarm import MyoArm, glenoid_surface, mesh_of_geom, myoarm

#: Parts that are drawn as one mesh each.
BONES = ("trunk", "clavicle", "scapula", "humerus", "ulna", "radius")
#: Meshes with more triangles are made coarser, by cells of this size, m.
_FINE, _CELL = 1200, 0.0022
#: Mesh geoms of other groups are no bones.
_BONE_GROUP = 0


@keeps_read_only
class LimbShape(NamedTuple):
    """Where bones and muscles are in one pose, in {O_A}, m.

    Attributes
    ----------
    bones : dict of str to ndarray
        Placement of each of :data:`BONES`, shape (4, 4), with the person's size as scale.
    paths : list of ndarray
        Path of each muscle, shape (k, 3): where it is fixed, where it bends, and where it touches what it wraps around.
    socket_centre : ndarray
        Centre of the joint surface of the scapula, shape (3,).
    socket_axes : ndarray
        Shape (3, 3), rows: out of the socket, superior, anterior.
    """

    bones: dict[str, FloatArray]
    paths: list[FloatArray]
    socket_centre: FloatArray
    socket_axes: FloatArray


def bone_meshes(side: str) -> dict[str, tuple[FloatArray, NDArray[np.int64]]]:
    """Vertices, shape (v, 3), m, and triangles, shape (t, 3), of each of :data:`BONES` of one side.

    Parameters
    ----------
    side : {"left", "right"}
        Side of the arm; a left one is the mirror image.
    """
    right = _right_meshes()
    if as_side(side) == "right":
        return dict(right)
    return {name: (vertices @ MIRROR, faces[:, ::-1]) for name, (vertices, faces) in right.items()}


@functools.cache
def _right_meshes() -> dict[str, tuple[FloatArray, NDArray[np.int64]]]:
    limb = myoarm(all_bones=True)
    data = limb.mujoco.MjData(limb.model)
    limb.mujoco.mj_kinematics(limb.model, data)
    found = {}
    for name, root in zip(BONES, _roots(limb), strict=True):
        origin, axes = data.xpos[root], data.xmat[root].reshape(3, 3)
        vertices: list[FloatArray] = []
        faces: list[NDArray[np.int64]] = []
        count = 0
        for geom in _bone_geoms(limb, name):
            own, triangles = _coarser(*mesh_of_geom(limb, geom))
            body = limb.model.geom_bodyid[geom]
            there = own @ data.xmat[body].reshape(3, 3).T + data.xpos[body]
            vertices.append((there - origin) @ axes)
            faces.append(triangles + count)
            count += len(own)
        # Read-only: all callers share them.
        found[name] = frozen(np.concatenate(vertices)), frozen(np.concatenate(faces))
    return found


def limb_shape(
    matrix: FloatArray,
    elbow_flexion: float,
    forearm_rotation: float,
    scale: float,
    left: bool,
    scapular_motion: float = 1.0,
) -> LimbShape:
    """Place bones and muscles in one pose, which may lie outside the range of motion.

    Parameters
    ----------
    matrix : ndarray
        Orientation of {O_B} in {O_A}, shape (3, 3).
    elbow_flexion, forearm_rotation : float
        Angles of elbow and forearm, rad; pronation is positive.
    scale : float
        Person's lengths over the model's.
    left : bool
        Whether the arm is a left one.
    scapular_motion : float
        How far clavicle and scapula follow the elevation, over the model's.

    Returns
    -------
    LimbShape
    """
    limb = myoarm()
    mirror = MIRROR if left else np.eye(3)
    angles = angles_of(limb, (mirror @ matrix @ mirror)[None])[0]
    data = placed(limb, angles, elbow_flexion, forearm_rotation, scapular_motion)
    # From the model's world to {O_A}, turned, mirrored and scaled.
    turn = mirror @ thorax_to_base(limb) @ data.xmat[limb.root].reshape(3, 3).T
    centre = data.xpos[limb.humerus]

    def place(points: FloatArray) -> FloatArray:
        return scale * ((points - centre) @ turn.T)

    bones = {}
    for name, body in zip(BONES, _roots(limb), strict=True):
        matrix4 = np.eye(4)
        matrix4[:3, :3] = scale * (turn @ data.xmat[body].reshape(3, 3) @ mirror)
        matrix4[:3, 3] = place(data.xpos[body])
        bones[name] = matrix4
    spots, _, muscle = muscle_paths(limb, data)
    points = place(spots)
    socket = glenoid_surface()
    scapula = data.xmat[limb.scapula].reshape(3, 3)
    return LimbShape(
        bones,
        [points[muscle == k] for k in range(len(MUSCLES))],
        place(data.xpos[limb.scapula] + scapula @ socket.centre),
        socket.axes @ scapula.T @ turn.T,
    )


def _roots(limb: MyoArm) -> tuple[int, ...]:
    clavicle = int(limb.model.body("clavicle_r").id)
    return limb.root, clavicle, limb.scapula, limb.humerus, limb.ulna, limb.radius


def _bone_geoms(limb: MyoArm, name: str) -> list[int]:
    """Mesh geoms of one part."""
    model = limb.model
    is_bone = (model.geom_type == int(limb.mujoco.mjtGeom.mjGEOM_MESH)) & (model.geom_group == _BONE_GROUP)
    bodies = model.geom_bodyid
    if name == "radius":
        part = limb.in_radius[bodies]
    elif name == "trunk":
        part = bodies < model.body("clavicle_r").id
    else:
        part = bodies == model.body(f"{name}_r").id
    return np.flatnonzero(is_bone & part).tolist()


def _coarser(vertices: FloatArray, faces: NDArray[np.int64]) -> tuple[FloatArray, NDArray[np.int64]]:
    """Merge the vertices of each cell of a grid into their mean, and drop the triangles that this leaves flat."""
    if len(faces) <= _FINE:
        return vertices, faces
    steps = ((vertices - vertices.min(axis=0)) / _CELL).astype(np.int64)
    wide, high = steps.max(axis=0)[1:] + 1
    _, cell = np.unique((steps[:, 0] * wide + steps[:, 1]) * high + steps[:, 2], return_inverse=True)
    total = np.zeros((int(cell.max()) + 1, 3))
    np.add.at(total, cell, vertices)
    merged = total / np.bincount(cell)[:, None]
    corners = cell[faces]
    good = (corners[:, 0] != corners[:, 1]) & (corners[:, 1] != corners[:, 2]) & (corners[:, 2] != corners[:, 0])
    return merged, corners[good]
