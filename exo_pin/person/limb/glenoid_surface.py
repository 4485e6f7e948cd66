"""The socket of the scapula's mesh: its plane, its axes and its size.

The joint surface is the connected part of the mesh around the triangles that face the centre of the joint (within
42 mm of it, normal within 26° of the direction to it), as far as the normals stay within 45° of the mean one. Its plane
is the plane of least squared distance (area-weighted). Superior is the direction in that plane that lies in the plane
of the scapula, which passes through the socket's centre, the medial border at the level of the spine and the inferior
angle.

On MyoArm's scapula: 34 triangles, 36 mm high and 28 mm wide; the centre of the joint is 30.6 mm in front of the plane.
Against the scapula the socket is turned 5.5° backwards; adults have 1 ± 3°. Its inclination is 0°, and -8 to +6° as the
point at the level of the spine, which the mesh does not show clearly, is moved 15 mm down or up; adults have 7 ± 4° of
the bone and 1.6 ± 3° with the labrum.
"""

from __future__ import annotations

import functools
from collections import defaultdict
from typing import Any, NamedTuple

import numpy as np
from numpy.typing import NDArray

from ...core.records import reduced_tuple
from ...core.validation import FloatArray, frozen
from .myoarm import MyoArm, myoarm

#: Farthest triangle from the joint's centre, m; least cosine between its normal and the direction to the centre; and
#: least cosine between a normal and the mean one.
_FARTHEST, _FACING, _SPREAD = 0.042, 0.9, np.cos(np.radians(45.0))
#: Vertices of the mesh: medial border at the level of the spine, and inferior angle; m, in the scapula's frame.
_SPINE = np.array([-0.0888, -0.0268, -0.1017])
_INFERIOR = np.array([-0.1055, -0.1251, -0.0753])


class GlenoidSurface(NamedTuple):
    """The fitted socket, in the scapula's frame of the model.

    Attributes
    ----------
    centre : ndarray
        Shape (3,), m.
    axes : ndarray
        Shape (3, 3), rows: out of the socket, superior, anterior.
    height, width : float
        Extents along superior and anterior, m.
    triangles : ndarray of int
        Triangles of the mesh that belong to it.
    """

    centre: FloatArray
    axes: FloatArray
    height: float
    width: float
    triangles: NDArray[np.int64]

    def __reduce__(self) -> tuple[Any, ...]:
        return reduced_tuple(self)


def mesh_of_geom(limb: MyoArm, geom: int) -> tuple[FloatArray, NDArray[np.int64]]:
    """Vertices of a mesh in the frame of its body, shape (v, 3), m, and triangles, shape (t, 3)."""
    mujoco, model = limb.mujoco, limb.model
    mesh = int(model.geom_dataid[geom])
    first, first_face = model.mesh_vertadr[mesh], model.mesh_faceadr[mesh]
    vertices = model.mesh_vert[first : first + model.mesh_vertnum[mesh]].astype(np.float64)
    turn = np.empty(9)
    mujoco.mju_quat2Mat(turn, model.geom_quat[geom])
    vertices = vertices @ turn.reshape(3, 3).T + model.geom_pos[geom]
    return vertices, model.mesh_face[first_face : first_face + model.mesh_facenum[mesh]].astype(np.int64)


def scapula_mesh(limb: MyoArm) -> tuple[FloatArray, NDArray[np.int64]]:
    """Vertices, shape (v, 3), m, in the scapula's frame, and triangles, shape (t, 3)."""
    is_mesh = limb.model.geom_type == int(limb.mujoco.mjtGeom.mjGEOM_MESH)
    return mesh_of_geom(limb, int(np.flatnonzero((limb.model.geom_bodyid == limb.scapula) & is_mesh)[0]))


@functools.cache
def glenoid_surface() -> GlenoidSurface:
    """Fit the socket of the model's scapula."""
    limb = myoarm()
    vertices, faces = scapula_mesh(limb)
    corners = vertices[faces]
    middle = corners.mean(axis=1)
    normal = np.cross(corners[:, 1] - corners[:, 0], corners[:, 2] - corners[:, 0])
    area = 0.5 * np.linalg.norm(normal, axis=1)
    normal = normal / np.maximum(2.0 * area[:, None], 1e-18)
    # The joint's centre does not move in the scapula.
    to_centre = limb.model.body("scapphant_r").pos - middle
    distance = np.linalg.norm(to_centre, axis=1)
    facing = (distance < _FARTHEST) & (np.einsum("ij,ij->i", normal, to_centre) > _FACING * distance)
    neighbours = _neighbours(vertices, faces)
    core = max(_connected(neighbours, facing), key=lambda part: float(area[part].sum()))
    mean = (normal[core] * area[core, None]).sum(axis=0)
    smooth = (normal @ mean > _SPREAD * np.linalg.norm(mean)) & (distance < _FARTHEST)
    smooth[core] = True
    surface = next(part for part in _connected(neighbours, smooth) if core[0] in part)
    return _fitted(corners, area, normal, np.array(surface), vertices, faces)


def _fitted(
    corners: FloatArray, area: FloatArray, normal: FloatArray, part: NDArray[np.int64], vertices: FloatArray, faces: Any
) -> GlenoidSurface:
    weight = area[part]
    centre = (corners[part].mean(axis=1) * weight[:, None]).sum(axis=0) / weight.sum()
    rel = corners[part] - centre
    mid = rel.mean(axis=1)
    # Second moment of area of flat triangles.
    moment = np.einsum("t,ti,tj->ij", weight * 9.0 / 12.0, mid, mid) + np.einsum(
        "t,tki,tkj->ij", weight / 12.0, rel, rel
    )
    _, basis = np.linalg.eigh(moment)
    outward = basis[:, 0] * np.sign(basis[:, 0] @ (normal[part] * weight[:, None]).sum(axis=0))
    # Normal of the plane of the scapula; of a right one it points forwards.
    front = np.cross(centre - _SPINE, _INFERIOR - centre)
    front *= np.sign(front[0])
    superior = np.cross(outward, front)
    superior /= np.linalg.norm(superior)
    anterior = np.cross(superior, outward)
    spots = vertices[np.unique(faces[part])] - centre
    return GlenoidSurface(
        frozen(centre),
        frozen(np.stack([outward, superior, anterior])),
        float(np.ptp(spots @ superior)),
        float(np.ptp(spots @ anterior)),
        frozen(np.sort(part)),
    )


def _neighbours(vertices: FloatArray, faces: NDArray[np.int64]) -> list[set[int]]:
    """Triangles that share an edge with each triangle; vertices of the same place count as one."""
    _, same = np.unique(np.round(vertices * 1e5), axis=0, return_inverse=True)
    merged = same.ravel()[faces]
    on_edge = defaultdict(list)
    for index, face in enumerate(merged.tolist()):
        for a, b in ((0, 1), (1, 2), (2, 0)):
            on_edge[min(face[a], face[b]), max(face[a], face[b])].append(index)
    found: list[set[int]] = [set() for _ in faces]
    for triangles in on_edge.values():
        for triangle in triangles:
            found[triangle].update(other for other in triangles if other != triangle)
    return found


def _connected(neighbours: list[set[int]], chosen: NDArray[np.bool_]) -> list[list[int]]:
    """The chosen triangles in connected parts."""
    left = set(np.flatnonzero(chosen).tolist())
    parts = []
    while left:
        part = [left.pop()]
        for triangle in part:  # grows while it is read
            new = neighbours[triangle] & left
            left -= new
            part.extend(new)
        parts.append(sorted(part))
    return parts
