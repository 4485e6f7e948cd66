"""The nearest singular pose, and its distance as an angle on the rotation group."""

from __future__ import annotations

import math
from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import NDArray
from scipy.spatial.transform import Rotation

from ...core.compiled import kernel
from ...core.errors import InvalidInput
from ...core.validation import FloatArray
from ...design import WristGeometry
from ...load_case.pose_stacks import pose_matrices
from ...numerics.polynomial import MAX_DEGREE, roots_and_touches
from ...numerics.vectors import FOLDED_SINE, cross, triple
from ..kinematics.inverse import inverse_kinematics

__all__ = ["NearestSingularity", "nearest_singularity"]


#: Number of axes that are searched, on half a sphere, each in both senses. Neighbours are about 12° apart.
_DIRECTIONS = 150
#: Number of axes that are refined.
_STARTS = 4


@dataclass(frozen=True, eq=False)
class NearestSingularity:
    """The singular pose closest to each of a stack of shape (...).

    Attributes
    ----------
    distance : ndarray
        Shape (...), rad: the least angle by which the arm must turn to be singular.
    pose : Rotation
        Shape (...), that singular pose.
    axis : ndarray
        Shape (..., 3), unit vector, base frame: axis of the turn by ``distance`` to that pose. Zero in a singular pose.
    folded : ndarray of bool
        Shape (..., n): limbs that are folded there.
    fold_distance : ndarray
        Shape (..., n), rad: least angle to a pose in which limb i is folded (points at O), that between the lines
        of a_i and b_i.
    """

    distance: FloatArray
    pose: Rotation
    axis: FloatArray
    folded: NDArray[np.bool_]
    fold_distance: FloatArray

    @property
    def degrees(self) -> FloatArray:
        """``distance`` in degrees."""
        return np.degrees(self.distance)


@kernel
def _first_zero(n: Any, a: Any, b: Any, poly: Any, other: Any, found: Any, parts: Any) -> float:
    """Least angle of a turn about the unit vector n after which det[a_i × b_i] = 0; π if there is none.

    About a fixed axis b_i = p + q cos θ + r sin θ, so the determinant has degree 3 in cos θ, sin θ, and degree 6 in
    tan θ/2.
    """
    for i in range(3):
        along = n[0] * b[i, 0] + n[1] * b[i, 1] + n[2] * b[i, 2]
        x, y, z = cross(n, b[i])
        turned = (x, y, z)
        p0, p1, p2 = cross(a[i], n)
        fixed = (p0 * along, p1 * along, p2 * along)
        ab, across = cross(a[i], b[i]), cross(a[i], turned)
        for j in range(3):
            # As a quadratic in t = tan θ/2, times 1 + t².
            level = ab[j] - fixed[j]
            parts[i, 0, j], parts[i, 1, j], parts[i, 2, j] = ab[j], 2.0 * across[j], fixed[j] - level
    poly[:] = 0.0
    for i in range(3):
        for j in range(3):
            for k in range(3):
                poly[i + j + k] += triple(parts[0, i], parts[1, j], parts[2, k])
    best = math.pi
    size = 0.0
    for k in range(7):
        other[k] = poly[6 - k] if k % 2 == 0 else -poly[6 - k]
        size += abs(poly[k])
    if size == 0.0:
        return 0.0
    for chart in range(2):
        number = roots_and_touches(poly if chart == 0 else other, 6, 1e-13 * size, found)
        for m in range(number):
            # Second chart: t is -1/tan θ/2, the angle from 180°.
            angle = 2.0 * math.atan(found[m]) if chart == 0 else 2.0 * math.atan(found[m]) + math.pi
            if angle < 0.0:
                angle += 2.0 * math.pi
            # The other sense of rotation belongs to the opposite axis.
            if angle < best:
                best = angle
    return best


@kernel
def _nearest(a: Any, b: Any, directions: Any, axis: Any) -> float:
    """Least angle to det[a_i × b_i] = 0 over all axes; write the axis."""
    poly, other, found = np.empty(MAX_DEGREE + 1), np.empty(MAX_DEGREE + 1), np.empty(2 * MAX_DEGREE)
    parts, n = np.empty((3, 3, 3)), np.empty(3)
    count = directions.shape[0]
    angles = np.empty(2 * count)
    for m in range(count):
        for e in range(2):
            for j in range(3):
                n[j] = directions[m, j] if e == 0 else -directions[m, j]
            angles[2 * m + e] = _first_zero(n, a, b, poly, other, found, parts)
    best = math.inf
    centre, u, v = np.empty(3), np.empty(3), np.empty(3)
    for _ in range(_STARTS):
        m = int(np.argmin(angles))
        angle = angles[m]
        sign = 1.0 if m % 2 == 0 else -1.0
        centre[:] = sign * directions[m // 2]
        # Neighbouring directions lead to the same minimum.
        for k in range(2 * count):
            sign = 1.0 if k % 2 == 0 else -1.0
            dot = 0.0
            for j in range(3):
                dot += sign * directions[k // 2, j] * centre[j]
            if dot > 0.95:
                angles[k] = math.inf
        # Compass search on the sphere of axes. At the minimum the angle is flat: its error is that of the axis squared.
        step = 0.1
        while step > 3e-9:
            x, y, z = cross(centre, directions[0])
            if x * x + y * y + z * z < 0.1:
                x, y, z = cross(centre, directions[count // 2])
            size = math.sqrt(x * x + y * y + z * z)
            u[0], u[1], u[2] = x / size, y / size, z / size
            v[0], v[1], v[2] = cross(centre, u)
            improved = False
            for d in range(8):
                turn_u, turn_v = math.cos(d * math.pi / 4.0), math.sin(d * math.pi / 4.0)
                for j in range(3):
                    n[j] = centre[j] + step * (turn_u * u[j] + turn_v * v[j])
                size = math.sqrt(n[0] ** 2 + n[1] ** 2 + n[2] ** 2)
                for j in range(3):
                    n[j] /= size
                value = _first_zero(n, a, b, poly, other, found, parts)
                if value < angle:
                    angle = value
                    centre[:] = n
                    improved = True
                    break
            if not improved:
                step *= 0.4
        if angle < best:
            best = angle
            axis[:] = centre
    return best


@kernel(stack=True, cost=1000)
def nearest_stack(R: Any, base: Any, platform: Any, directions: Any, distance: Any, axis: Any) -> None:
    """Distance and axis for a stack of poses, shapes (N,) and (N, 3), written."""
    a, b = np.empty((3, 3)), np.empty((3, 3))
    for i in range(3):
        size = math.sqrt(base[i, 0] ** 2 + base[i, 1] ** 2 + base[i, 2] ** 2)
        for j in range(3):
            a[i, j] = base[i, j] / size
    for k in range(R.shape[0]):
        for i in range(3):
            size = math.sqrt(platform[i, 0] ** 2 + platform[i, 1] ** 2 + platform[i, 2] ** 2)
            for j in range(3):
                b[i, j] = (
                    R[k, j, 0] * platform[i, 0] + R[k, j, 1] * platform[i, 1] + R[k, j, 2] * platform[i, 2]
                ) / size
        distance[k] = _nearest(a, b, directions, axis[k])


def nearest_singularity(geometry: WristGeometry, orientation: Rotation) -> NearestSingularity:
    """Find the singular pose with the least rotation of the arm.

    The singular set is the zero set of det[a_i × b_i]: det X = 0 and the folded poses. Along a turn about
    a fixed axis that is a polynomial of degree 6 in tan θ/2, whose first root is found exactly; the axis is searched
    over the whole sphere and then refined.

    Parameters
    ----------
    geometry : WristGeometry
        Three limbs.
    orientation : Rotation
        Pose, single or a stack of shape (...). About 10 ms each.

    Returns
    -------
    NearestSingularity

    Raises
    ------
    InvalidInput
        For other than three limbs: more limbs lose their hold in isolated poses, not on a surface.
    """
    if geometry.limb_count != 3:
        raise InvalidInput(f"expected three limbs, whose singular poses form a surface, got {geometry.limb_count}")
    shape, matrices = pose_matrices(orientation)
    # Fibonacci's lattice on the upper half of the sphere.
    height = (np.arange(_DIRECTIONS) + 0.5) / _DIRECTIONS
    around = np.arange(_DIRECTIONS) * np.pi * (3.0 - np.sqrt(5.0))
    width = np.sqrt(1.0 - height**2)
    directions = np.stack([width * np.cos(around), width * np.sin(around), height], axis=-1)
    distance, axis = np.empty(len(matrices)), np.zeros((len(matrices), 3))
    nearest_stack(matrices, geometry.base_points, geometry.platform_points, directions, distance, axis)
    axis[distance == 0.0] = 0.0
    turned = Rotation.from_rotvec(axis * distance[:, None]) * Rotation.from_matrix(matrices)
    state = inverse_kinematics(geometry, turned)
    here = inverse_kinematics(geometry, Rotation.from_matrix(matrices)).platform_points
    a = geometry.base_points
    sine, cosine = np.linalg.norm(np.cross(a, here), axis=-1), np.abs(np.einsum("ij,kij->ki", a, here))
    folded = state.reach <= np.sqrt(FOLDED_SINE) * np.linalg.norm(geometry.platform_points, axis=-1)
    return NearestSingularity(
        distance.reshape(shape),
        Rotation.from_quat(turned.as_quat().reshape(*shape, 4)),
        axis.reshape(*shape, 3),
        folded.reshape(*shape, 3),
        np.arctan2(sine, cosine).reshape(*shape, 3),
    )
