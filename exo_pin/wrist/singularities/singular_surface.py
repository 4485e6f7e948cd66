"""The nearest singular pose, and its distance as an angle on the rotation group.

The share of each daily range of motion beyond the singular surface.
"""

from __future__ import annotations

import math
from collections.abc import Iterable
from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import NDArray
from scipy.spatial.transform import Rotation

from ...core.compiled import kernel
from ...core.errors import InvalidInput
from ...core.errors.checked import checked
from ...core.results import Result
from ...core.validation import FloatArray, as_single_rotation
from ...design import WristGeometry
from ...load_case.pose_stacks import pose_matrices
from ...load_case.ranges_of_motion import ADL_BOX, DAILY_RANGES, RangeOfMotion, Share, share_of_volume
from ...numerics.analytic_vectors import unit
from ...numerics.polynomial import MAX_DEGREE, roots_and_touches
from ...numerics.vectors import FOLDED_SINE, cross, dot, triple, vector
from ..kinematics.assembly import frame_along
from ..kinematics.inverse import inverse_kinematics
from .measures import locus_function, require_three_limbs

#: Number of axes that are searched, on half a sphere, each in both senses. Neighbours are about 12° apart.
_DIRECTIONS = 150
#: Number of axes that are refined.
_STARTS = 4


@dataclass(frozen=True, eq=False)
class NearestSingularity(Result):
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

    Examples
    --------
    >>> exo = ep.load("prototype")
    >>> found = exo.nearest_singularity(exo.pose(abduction=3))
    >>> there = exo.singularity(found.pose).determinant
    >>> round(float(np.degrees(found.distance)), 2), round(abs(float(there)), 9)  # degrees; det X is zero there
    (2.75, 0.0)
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
        a_i, b_i = vector(a, i), vector(b, i)
        along, normal = dot(n, b_i), cross(a_i, n)
        ab, across = cross(a_i, b_i), cross(a_i, cross(n, b_i))
        for j in range(3):
            # As a quadratic in t = tan θ/2, times 1 + t².
            fixed = normal[j] * along
            parts[i, 0, j], parts[i, 1, j], parts[i, 2, j] = ab[j], 2.0 * across[j], fixed - (ab[j] - fixed)
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
            # Second chart: t is -1/tan θ/2, the angle from 180°. The other sense belongs to the opposite axis.
            best = min(best, (2.0 * math.atan(found[m]) + chart * math.pi) % (2.0 * math.pi))
    return best


@kernel
def _nearest(a: Any, b: Any, directions: Any, axis: Any) -> float:
    """Least angle to det[a_i × b_i] = 0 over all axes; write the axis."""
    poly, other, found = np.empty(MAX_DEGREE + 1), np.empty(MAX_DEGREE + 1), np.empty(2 * MAX_DEGREE)
    parts, n, frame = np.empty((3, 3, 3)), np.empty(3), np.empty_like(a)
    angles = np.empty(directions.shape[0])
    for m in range(directions.shape[0]):
        angles[m] = _first_zero(directions[m], a, b, poly, other, found, parts)
    best = math.inf
    for _ in range(_STARTS):
        first = angles.argmin()
        angle, centre = angles[first], directions[first].copy()
        # Neighbouring directions lead to the same minimum.
        angles[directions @ centre > 0.95] = math.inf
        # Compass search on the sphere of axes. At the minimum the angle is flat: its error is that of the axis squared.
        step, improved = 0.1, True
        while step > 3e-9:
            if improved:
                frame_along(centre, frame)
            improved = False
            for d in range(8):
                u, v = step * math.cos(d * math.pi / 4.0), step * math.sin(d * math.pi / 4.0)
                for j in range(3):
                    n[j] = centre[j] + u * frame[j, 0] + v * frame[j, 1]
                size = math.sqrt(dot(n, n))
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
def nearest_stack(b: Any, a: Any, directions: Any, distance: Any, axis: Any) -> None:
    """Distance and axis, shapes (N,) and (N, 3), written, for unit vectors a_i and a stack of unit vectors b_i."""
    for k in range(b.shape[0]):
        distance[k] = _nearest(a, b[k], directions, axis[k])


@checked
def nearest_singularity(geometry: WristGeometry, poses: Rotation) -> NearestSingularity:
    """Find the singular pose with the least rotation of the arm.

    The singular set is the zero set of det[a_i × b_i]: det X = 0 and the folded poses. Along a turn about
    a fixed axis that is a polynomial of degree 6 in tan θ/2, whose first root is found exactly; the axis is searched
    over the whole sphere and then refined.

    Parameters
    ----------
    geometry : WristGeometry
        Three limbs.
    poses : Rotation
        Pose, single or a stack of shape (...). About 10 ms each.

    Returns
    -------
    NearestSingularity

    Raises
    ------
    InvalidInput
        For other than three limbs: of more the singular poses are curves or single poses.

    Examples
    --------
    >>> from exo_pin import wrist
    >>> exo = ep.load("optimised-table-c-2")
    >>> round(float(np.degrees(wrist.nearest_singularity(exo.geometry, exo.pose(30, 30)).distance)), 1)  # degrees away
    22.0
    """
    require_three_limbs(geometry)
    shape, matrices = pose_matrices(poses)
    # Fibonacci's lattice on the upper half of the sphere.
    height = (np.arange(_DIRECTIONS) + 0.5) / _DIRECTIONS
    around = np.arange(_DIRECTIONS) * np.pi * (3.0 - np.sqrt(5.0))
    width = np.sqrt(1.0 - height**2)
    half = np.stack([width * np.cos(around), width * np.sin(around), height], axis=1)
    directions = np.stack([half, -half], axis=1).reshape(-1, 3)
    a, platform = (unit(points) for points in (geometry.base_points, geometry.platform_points))
    b = platform @ np.swapaxes(matrices, 1, 2)
    distance, axis = np.empty(len(matrices)), np.zeros((len(matrices), 3))
    nearest_stack(b, a, directions, distance, axis)
    axis[distance == 0.0] = 0.0
    turned = Rotation.from_rotvec(axis * distance[:, None]) * Rotation.from_matrix(matrices)
    state = inverse_kinematics(geometry, turned)
    sine, cosine = np.linalg.norm(np.cross(a, b), axis=-1), np.abs(np.einsum("ij,kij->ki", a, b))
    folded = state.reach <= np.sqrt(FOLDED_SINE) * np.linalg.norm(geometry.platform_points, axis=1)
    return NearestSingularity(
        distance.reshape(shape),
        Rotation.from_quat(turned.as_quat().reshape(*shape, 4)),
        axis.reshape(*shape, 3),
        folded.reshape(*shape, 3),
        np.arctan2(sine, cosine).reshape(*shape, 3),
    )


#: The locus function, of order one, is zero to rounding below this.
_SINGULAR = 1e-12


#: |det X| below which a pose of a daily range counts as close to the locus.
CLOSE = 0.05


def side_of_rest(geometry: WristGeometry) -> int:
    """Side of the singular surface of the hanging arm: the sign of det X there, 0 if that pose is singular."""
    value = float(locus_function(geometry, Rotation.identity())[0])
    return 0 if abs(value) < _SINGULAR else int(np.sign(value))


@dataclass(frozen=True, eq=False)
class RangeCrossing:
    """Shares of the volume of a range of motion on either side of the singular surface, with their errors.

    Attributes
    ----------
    range : RangeOfMotion
        The range.
    across : Share
        Share of it on the other side of the locus than the rest pose, which is not reached without a singular pose.
    close : Share
        Share with |det X| below 0.05.

    Examples
    --------
    >>> from exo_pin import wrist
    >>> found = wrist.daily_crossings(ep.load("optimised-table-c-2").geometry, step_deg=15.0)[0]
    >>> found.range.name, bool(found.across > 0.3)
    ('daily-life box', True)
    """

    range: RangeOfMotion
    across: Share
    close: Share


@checked
def daily_crossings(
    geometry: WristGeometry,
    ranges: Iterable[RangeOfMotion] = (ADL_BOX, *DAILY_RANGES),
    step_deg: float = 5.0,
    side: str = "left",
    start: Rotation | None = None,
) -> list[RangeCrossing]:
    """Share of each range on the other side of the singular surface than the rest pose.

    Parameters
    ----------
    geometry : WristGeometry
        Three limbs.
    ranges : iterable of RangeOfMotion
        The ranges.
    step_deg : float
        Of the grids, degrees.
    side : {"left", "right"}
        Side of the body.
    start : Rotation, optional
        The rest pose; the hanging arm if left out.

    Returns
    -------
    list of RangeCrossing

    Raises
    ------
    InvalidInput
        For other than three limbs, or a start that is singular.

    Examples
    --------
    >>> from exo_pin import wrist
    >>> crossings = wrist.daily_crossings(ep.load("prototype").geometry, step_deg=15.0)
    >>> round(float(crossings[0].across), 1)  # of the box of daily life, beyond the singular surface
    0.4
    """
    pose = as_single_rotation("start", Rotation.identity() if start is None else start)
    here = float(locus_function(geometry, pose)[0])
    if abs(here) < _SINGULAR:
        raise InvalidInput("the start is a singular pose: it belongs to neither side")
    found = []
    for item in ranges:
        smooth, determinant = locus_function(geometry, item.poses(step_deg, side))
        sets = (np.sign(smooth) != np.sign(here), np.abs(np.nan_to_num(determinant)) < CLOSE)
        found.append(RangeCrossing(item, *(share_of_volume(member, item.axes(step_deg)) for member in sets)))
    return found
