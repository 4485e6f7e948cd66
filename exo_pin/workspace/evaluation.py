"""The margins of a design to all criteria, over a stack of poses."""

from __future__ import annotations

import functools
from typing import NamedTuple

import numpy as np
from scipy.spatial.transform import Rotation

from ..core.validation import FloatArray
from ..design import Mechanism
from ..load_case import Load
from ..reaction.constraints.actuator_limits import length_limits
from ..reaction.holding.least_held_forces import least_held_forces
from .body_shape import BodyShape
from .connection import connection_margin, nearest_to_rest
from .criteria import Criteria
from .kernels.clearance_kernels import clearance_stack
from .kernels.joint_kernels import kinematic_stack, shoulder_stack
from .pose_offsets import PoseOffsets

__all__ = ["PoseValues", "clearances", "evaluate_poses", "rest_side"]


class PoseValues(NamedTuple):
    """What :func:`evaluate_poses` finds, N poses along the first axis.

    Attributes
    ----------
    margins : dict of str to ndarray
        By criterion, shape (N,): zero or more where it is met, NaN where that is not known or has no meaning.
    lengths : ndarray
        l_i, shape (N, n), m.
    independent : ndarray
        Shape (N,): det[X_1 X_2 X_3] of three limbs, else the root of det(Σ X_i X_iᵀ).
    tensions, shoulder : ndarray
        f_i, shape (N, n), and F_s, shape (N, 3), N: of the tensions within the limits that make |F_s| least; NaN where
        there are none, or where forces were not computed.
    gaps : ndarray
        Shape (N, 3), m: of the limbs to the arm, to the torso and to one another; NaN where not computed.
    """

    margins: dict[str, FloatArray]
    lengths: FloatArray
    independent: FloatArray
    tensions: FloatArray
    shoulder: FloatArray
    gaps: FloatArray


def evaluate_poses(
    mechanism: Mechanism,
    matrices: FloatArray,
    shape: tuple[int, ...],
    criteria: Criteria,
    names: tuple[str, ...],
    load: Load | None = None,
    offsets: PoseOffsets | None = None,
) -> PoseValues:
    """Margins of N poses, whose stack has the given shape.

    Parameters
    ----------
    mechanism : Mechanism
        The design, with the data that the criteria need.
    matrices : ndarray
        Shape (N, 3, 3), contiguous.
    shape : tuple of int
        Of the stack; of three dimensions for "connected".
    criteria : Criteria
        Limits.
    names : tuple of str
        Which criteria to check.
    load : Load, optional
        On the arm, besides its weight.
    offsets : PoseOffsets, optional
        Of the device's centre in these poses; none if left out. Rest and the way to it get those of the path they come
        from, else those of the pose nearest to rest.
    """
    count, n = len(matrices), mechanism.limb_count
    offsets = PoseOffsets.none() if offsets is None else offsets
    margins: dict[str, FloatArray] = {}
    lengths, bend, independent = _kinematics(mechanism, matrices, offsets, "joint_angles" in names)
    if "joint_angles" in names:
        margins["joint_angles"] = bend
    if "shoulder_range" in names:
        margins["shoulder_range"] = _shoulder_margin(mechanism, matrices)
    if "stroke" in names:
        margins["stroke"] = _stroke_margin(mechanism, lengths, criteria.stroke_rule)
    nearest = nearest_to_rest(matrices)
    side = rest_side(mechanism, independent, offsets, nearest)
    if "singularity" in names:
        margins["singularity"] = side * independent - criteria.independence
    if "connected" in names:

        def independence(way: FloatArray) -> FloatArray:
            return _kinematics(mechanism, way, offsets.at(way, nearest), False)[2]

        path = connection_margin(independence, matrices, shape, side * independent, side)
        margins["connected"] = path - criteria.independence
    tensions, shoulder = np.full((count, n), np.nan), np.full((count, 3), np.nan)
    if "forces" in names or "shoulder_force" in names:
        held = ((offsets.base, offsets.cuff), lengths, criteria.least_tension, load)
        moment, tensions, shoulder = least_held_forces(mechanism, matrices, *held)
        if "forces" in names:
            margins["forces"] = moment - criteria.least_moment
        if "shoulder_force" in names:
            assert criteria.largest_shoulder_force is not None
            margins["shoulder_force"] = criteria.largest_shoulder_force - np.sqrt((shoulder**2).sum(axis=1))
    gaps = np.full((count, 3), np.nan)
    if "clearance" in names:
        base, platform = mechanism.geometry.base_points, mechanism.geometry.platform_points
        gaps = clearances(matrices, base, platform, offsets, criteria.radii(mechanism), criteria.body)
        margins["clearance"] = gaps.min(axis=1) - criteria.least_gap
    return PoseValues(margins, lengths, independent, tensions, shoulder, gaps)


def rest_side(mechanism: Mechanism, independent: FloatArray, offsets: PoseOffsets, nearest: int) -> float:
    """Sign of det X at rest, ±1, of three limbs: the side of the singular surface that can be reached from rest.

    If rest itself is singular, the sign that most of the poses have. For more than three limbs 1.
    """
    if mechanism.limb_count > 3:
        return 1.0
    rest = np.eye(3)[None]
    determinant = float(_kinematics(mechanism, rest, offsets.at(rest, nearest), False)[2][0])
    if abs(determinant) > 1e-9:
        return float(np.sign(determinant))
    return 1.0 if (independent > 0.0).sum() >= (independent < 0.0).sum() else -1.0


def _kinematics(
    mechanism: Mechanism, matrices: FloatArray, offsets: PoseOffsets, angles: bool
) -> tuple[FloatArray, FloatArray, FloatArray]:
    """Lengths (N, n), margins of the universal joints (N,) and independence (N,)."""
    geometry, count, n = mechanism.geometry, len(matrices), mechanism.limb_count
    half, turns = np.full(n, np.inf), np.tile(np.eye(3), (n, 1, 1))
    if angles:
        for i, limb in enumerate(mechanism.limbs):
            if limb.kind == "UPU":
                assert limb.joint_limit is not None
                assert limb.joint_straight is not None
                half[i], turns[i] = limb.joint_limit, _from_z(np.array(limb.joint_straight))
    lengths, bend, independent = np.empty((count, n)), np.empty(count), np.empty(count)
    kinematic_stack(
        matrices, geometry.base_points, geometry.platform_points, offsets.base, offsets.cuff,
        _rows(geometry.base_frames @ turns), _rows(geometry.platform_frames @ turns), half, lengths, bend, independent,
    )  # fmt: skip
    return lengths, bend, independent


def _rows(frames: FloatArray) -> FloatArray:
    """Frames whose axes are columns with their axes as rows."""
    return np.ascontiguousarray(np.swapaxes(frames, 1, 2))


def _from_z(direction: FloatArray) -> FloatArray:
    """The least rotation that takes e_z to a unit vector: from it the angles of a universal joint are counted."""
    axis = np.cross([0.0, 0.0, 1.0], direction)
    sine, cosine = float(np.linalg.norm(axis)), float(direction[2])
    if sine < 1e-12:
        return np.eye(3) if cosine > 0.0 else np.diag([1.0, -1.0, -1.0])
    return np.asarray(Rotation.from_rotvec(axis / sine * np.arctan2(sine, cosine)).as_matrix())


def _shoulder_margin(mechanism: Mechanism, matrices: FloatArray) -> FloatArray:
    margin = np.empty(len(matrices))
    outward = 1.0 if mechanism.side == "left" else -1.0
    shoulder_stack(matrices, mechanism.shoulder.abduction_centre, mechanism.shoulder.half_diagonal, outward, margin)
    return margin


def _stroke_margin(mechanism: Mechanism, lengths: FloatArray, rule: str) -> FloatArray:
    """Distance of the lengths to the ends of the strokes, shape (N,), m; see :attr:`Criteria.stroke_rule`."""
    low, high = length_limits(mechanism)
    # Limb by limb: a minimum along so short an axis takes NumPy several times as long.
    columns = [np.ascontiguousarray(column) for column in lengths.T]
    if rule == "not all short":
        return np.asarray(functools.reduce(np.maximum, [c - a for c, a in zip(columns, low, strict=True)]))
    sides = [np.minimum(c - a, b - c) for c, a, b in zip(columns, low, high, strict=True)]
    return np.asarray(functools.reduce(np.minimum, sides))


def clearances(
    matrices: FloatArray,
    base: FloatArray,
    platform: FloatArray,
    offsets: PoseOffsets,
    radii: FloatArray,
    body: BodyShape | None,
) -> FloatArray:
    """Least distances of limbs to arm, torso and each other, shape (N, 3), m."""
    assert body is not None
    gaps = np.empty((len(matrices), 3))
    still, moving = np.array(body.torso), np.array(body.arm)  # writable, for which the kernel is compiled
    clearance_stack(matrices, base, platform, offsets.base, offsets.cuff, radii, still, moving, gaps)
    return gaps
