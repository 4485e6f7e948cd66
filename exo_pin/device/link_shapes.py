"""Distances of a device's links, by their own shapes, to the wearer's body.

Shapes are capsules: cylinders and capsules with their radius, spheres as they are, a box as the capsule along its
longest edge that holds it. Meshes are left out. Links that are fixed to the arm or to the torso do not count: cuff and
harness touch the wearer. Pieces of routes between two bodies count as cables of 3 mm radius; those that run along one
body do not.
"""

from __future__ import annotations

from typing import Any

import numpy as np

from ..chain.structure.description import Shape
from ..core.compiled import kernel
from ..core.validation import FloatArray
from ..numerics.vectors import vector
from ..wrist.clearance.clearance import LIMB_RADII, segment_distance
from .chain_device import ChainDevice
from .device_model import DeviceModel, device_model
from .parts.routes import PlacedRoute
from .postures import placements

#: Axes and origin of the torso's frame, as those of the joints.
_TORSO = np.concatenate([np.eye(3), np.zeros((1, 3))])[None]


def _capsule(shape: Shape) -> tuple[FloatArray, float] | None:
    """Ends in the shape's own frame, shape (2, 3), and radius, m; None for a mesh."""
    size = np.array(shape.size)
    if shape.kind == "sphere":
        return np.zeros((2, 3)), float(size[0])
    if shape.kind in ("cylinder", "capsule"):
        end = np.array([0.0, 0.0, size[1] / 2.0])
        return np.stack([-end, end]), float(size[0])
    if shape.kind == "box":
        long = int(size.argmax())
        end = np.zeros(3)
        end[long] = size[long] / 2.0
        return np.stack([-end, end]), float(np.linalg.norm(np.delete(size, long)) / 2.0)
    return None


def link_capsules(device: ChainDevice) -> tuple[FloatArray, FloatArray]:
    """Capsules of the moving links: ends with their joint's index, shape (S, 7), and radii, shape (S,), m."""
    state, arm = device.chain._state, device.arm_index
    rows, radii = [], []
    for shape in device.chain.description.shapes:
        own, frame = _capsule(shape), state.model.frames[state.frame_index(shape.frame)]
        if own is None or frame.parentJoint in (0, arm):
            continue
        place = frame.placement * shape.place
        rows.append([*(place.act(end) for end in own[0]), [frame.parentJoint]])
        radii.append(own[1])
    flat = [np.concatenate([np.asarray(part, dtype=float) for part in row]) for row in rows]
    return np.array(flat).reshape(-1, 7), np.array(radii, dtype=float)


def route_pieces(model: DeviceModel) -> list[tuple[PlacedRoute, int]]:
    """Routes of drives and springs with the number of each piece that runs from one body to another."""
    routes = [place for _, place in (*model.drives, *model.springs) if isinstance(place, PlacedRoute)]
    return [(route, int(k)) for route in routes for k in np.flatnonzero(np.diff(route.joints))]


def link_gaps(
    device: ChainDevice, q: FloatArray, matrices: FloatArray, torso: FloatArray, arm: FloatArray
) -> FloatArray:
    """Least gaps of the moving links to the wearer's arm and torso, shape (N, 2), m; infinite without shapes.

    Parameters
    ----------
    device : ChainDevice
        The device.
    q : ndarray
        Its configurations, shape (N, nq).
    matrices : ndarray
        Orientations of the arm, shape (N, 3, 3).
    torso, arm : ndarray
        Capsules of the body, shape (K, 7): two ends and a radius, m, in base and arm frame.
    """
    capsules, radii = link_capsules(device)
    model = device_model(device)
    pieces = route_pieces(model)
    radii = np.concatenate([radii, np.full(len(pieces), LIMB_RADII["cable"])])
    out = np.full((len(q), 2), np.inf)
    if not len(radii):
        return out
    joints, shapes = capsules[:, 6].astype(np.intp), len(capsules)
    first, second = np.empty((len(q), len(radii), 3)), np.empty((len(q), len(radii), 3))
    for k in range(len(q)):
        # The torso's frame stands first.
        every = np.concatenate([_TORSO, placements(model.held, q[k])])
        poses = every[joints]
        for ends, local in ((first, capsules[:, :3]), (second, capsules[:, 3:6])):
            ends[k, :shapes] = np.einsum("sij,si->sj", poses[:, :3], local) + poses[:, 3] - model.centre
        for i, (route, piece) in enumerate(pieces, start=shapes):
            points = route.points(every) - model.centre
            first[k, i], second[k, i] = points[piece], points[piece + 1]
    _gaps(first, second, radii, np.ascontiguousarray(matrices), np.array(torso), np.array(arm), out)
    return out


@kernel(stack=True)
def _gaps(first: Any, second: Any, radii: Any, R: Any, torso: Any, arm: Any, out: Any) -> None:
    """Fill the least gaps to arm and torso."""
    for k in range(first.shape[0]):
        for part in range(2):
            rows = arm if part == 0 else torso
            for j in range(rows.shape[0]):
                a, b = vector(rows[:, 0:3], j), vector(rows[:, 3:6], j)
                if part == 0:
                    a = (
                        R[k, 0, 0] * a[0] + R[k, 0, 1] * a[1] + R[k, 0, 2] * a[2],
                        R[k, 1, 0] * a[0] + R[k, 1, 1] * a[1] + R[k, 1, 2] * a[2],
                        R[k, 2, 0] * a[0] + R[k, 2, 1] * a[1] + R[k, 2, 2] * a[2],
                    )
                    b = (
                        R[k, 0, 0] * b[0] + R[k, 0, 1] * b[1] + R[k, 0, 2] * b[2],
                        R[k, 1, 0] * b[0] + R[k, 1, 1] * b[1] + R[k, 1, 2] * b[2],
                        R[k, 2, 0] * b[0] + R[k, 2, 1] * b[1] + R[k, 2, 2] * b[2],
                    )
                for i in range(first.shape[1]):
                    gap = segment_distance(vector(first[k], i), vector(second[k], i), a, b) - radii[i] - rows[j, 6]
                    out[k, part] = min(out[k, part], gap)
