"""Write exo_pin/person/limb/data/glenoid.csv: the socket of the scapula, fitted to the mesh of MyoArm.

    python docs/scripts/glenoid_surface.py

Needs the extra ``person``. The joint surface is the connected part of the mesh around the triangles that face the
centre of the joint (within 42 mm of it, normal within 26° of the direction to it), as far as the normals stay within
45° of the mean one. Its plane is the plane of least squared distance (area-weighted). Superior is the direction in that
plane that lies in the plane of the scapula, which passes through the socket's centre, the medial border at the level of
the spine and the inferior angle.
"""

from collections import defaultdict
from pathlib import Path

import numpy as np

import exo_pin as ep
from exo_pin.core.files import write_text
from exo_pin.core.files.csv_tables import csv_text
from exo_pin.person.limb.myoarm import mesh_of_geom, myoarm

TABLE = Path(ep.__file__).parent / "person" / "limb" / "data" / "glenoid.csv"
COMMENTS = (
    "Socket of the scapula, in the frame of that body of MyoArm, fitted to its mesh by docs/scripts/"
    "glenoid_surface.py:",
    "the centre of the joint surface, m, and unit vectors out of the socket, superior and anterior.",
)
#: Farthest triangle from the joint's centre, m; least cosine between its normal and the direction to the centre; and
#: least cosine between a normal and the mean one.
_FARTHEST, _FACING, _SPREAD = 0.042, 0.9, np.cos(np.radians(45.0))
#: Vertices of the mesh: medial border at the level of the spine, and inferior angle; m, in the scapula's frame.
_SPINE = np.array([-0.0888, -0.0268, -0.1017])
_INFERIOR = np.array([-0.1055, -0.1251, -0.0753])


def scapula_mesh(limb):
    """Vertices, shape (v, 3), m, in the scapula's frame, and triangles, shape (t, 3)."""
    is_mesh = limb.model.geom_type == int(limb.mujoco.mjtGeom.mjGEOM_MESH)
    return mesh_of_geom(limb, int(np.flatnonzero((limb.model.geom_bodyid == limb.scapula) & is_mesh)[0]))


def fitted():
    """Centre, axes in rows, extents along superior and anterior, m, and the triangles of the surface."""
    limb = myoarm(all_bones=True)
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


def _fitted(corners, area, normal, part, vertices, faces):
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
    extents = float(np.ptp(spots @ superior)), float(np.ptp(spots @ anterior))
    return centre, np.stack([outward, superior, anterior]), *extents, np.sort(part)


def _neighbours(vertices, faces):
    """Triangles that share an edge with each triangle; vertices of the same place count as one."""
    _, same = np.unique(np.round(vertices * 1e5), axis=0, return_inverse=True)
    merged = same.ravel()[faces]
    on_edge = defaultdict(list)
    for index, face in enumerate(merged.tolist()):
        for a, b in ((0, 1), (1, 2), (2, 0)):
            on_edge[min(face[a], face[b]), max(face[a], face[b])].append(index)
    found = [set() for _ in faces]
    for triangles in on_edge.values():
        for triangle in triangles:
            found[triangle].update(other for other in triangles if other != triangle)
    return found


def _connected(neighbours, chosen):
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


if __name__ == "__main__":
    centre, axes = fitted()[:2]
    rows = zip(("centre", "outward", "superior", "anterior"), [centre, *axes], strict=True)
    cells = [[name, *map(repr, values.tolist())] for name, values in rows]
    write_text(TABLE, csv_text(("what", "x", "y", "z"), cells, COMMENTS))
