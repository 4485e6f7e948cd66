"""Tensions of least shoulder force within the design's limits, over many poses, and how firmly they hold the arm."""

from __future__ import annotations

import numpy as np
from scipy.spatial.transform import Rotation

from ...core.validation import FloatArray
from ...design import Mechanism
from ...load_case import Load
from ...load_case.pose_stacks import Query, as_query
from ...numerics.bounded.box_program import least_forces
from ...numerics.bounded.polytope_program import least_sum_force
from ...wrist.forces.side_forces import limb_loads
from ..constraints.actuator_limits import design_limits
from .least_force_kernels import holding_stack, three_limb_stack

#: |a × b| below which a limb has no plane, m²; the kernels call such a pose singular long before.
_FOLDED = 1e-12
#: Singular value of Jᵀ, relative to the largest, below which a direction of f counts as moving nothing.
_RANK = 1e-9
#: The second program's limit of unknowns.
_MOST_SUMS = 3


def least_held_forces(
    mechanism: Mechanism,
    matrices: FloatArray,
    offset: tuple[FloatArray, FloatArray],
    lengths: FloatArray,
    least_tension: float = 0.0,
    load: Load | None = None,
    lost: int | None = None,
) -> tuple[FloatArray, FloatArray, FloatArray]:
    """Whether the design's actuators hold an arm at rest, and with which tensions of least shoulder force.

    The split "minimal" of limbs without side force, over many poses and with a margin.

    Parameters
    ----------
    mechanism : Mechanism
        The design.
    matrices : ndarray
        Poses, shape (N, 3, 3).
    offset : tuple of ndarray
        Centre offsets of base (base frame) and cuff (arm frame), each of shape (N, 3), or (1, 3) for all poses, m.
    lengths : ndarray
        l_i, shape (N, n), m.
    least_tension : float
        Of limbs that only pull, N.
    load : Load, optional
        On the arm besides its weight.
    lost : int, optional
        Index of a limb that gives no force: a torn cable, or an actuator that has gone limp.

    Returns
    -------
    margin, tensions, shoulder_force : ndarray
        Shape (N,), N m: the largest disturbing moment of any direction that is held besides, negative where the arm is
        not held, NaN in a singular pose and where a limit is not known; shapes (N, n) and (N, 3), N, NaN where no
        tensions within the limits hold the arm.
    """
    count, n, arm = len(matrices), mechanism.limb_count, mechanism.require_arm("the forces of a workspace")
    by_length = any(limb.actuator is not None and limb.actuator.force_law is not None for limb in mechanism.limbs)
    some = lengths if by_length else lengths[:1]
    low, high = tension_limits(mechanism, some, least_tension)
    low, high, missing = np.array(low), np.array(high), np.isnan(design_limits(mechanism, some).upper)
    if lost is not None:
        low[:, lost], high[:, lost], missing[:, lost] = 0.0, 0.0, False
    unknown = missing.any(axis=1)
    force = moment = np.zeros((1, 3))
    if load is not None or not mechanism.limbs_are_massless:
        query = as_query(Rotation.from_matrix(matrices), None, load)
        limbs = _weight_of_limbs(mechanism, query, offset)
        force, moment = query.force + limbs[:, :3], query.moment + limbs[:, 3:]
    margin, tensions, shoulder = np.full(count, np.nan), np.full((count, n), np.nan), np.full((count, 3), np.nan)
    (three_limb_stack if n == 3 else holding_stack)(
        matrices, mechanism.geometry.base_points, mechanism.geometry.platform_points, *offset,
        np.array([arm.mass, *arm.centre_of_mass]), np.array(mechanism.gravity), force, moment, low, high,
        margin, tensions, shoulder,
    )  # fmt: skip
    # Held only if a limit that is not known at this length were high enough.
    unknown = unknown & (margin >= 0.0)
    margin[unknown], tensions[unknown], shoulder[unknown] = np.nan, np.nan, np.nan
    return margin, tensions, shoulder


def _weight_of_limbs(mechanism: Mechanism, query: Query, offset: tuple[FloatArray, FloatArray]) -> FloatArray:
    """Wrench that limbs with mass put on the arm at rest, besides f_i: force and moment about O, shape (N, 6).

    What the limbs' own weight makes of it depends on the pose alone, so it is a load for the choice of the tensions.
    """
    base, cuff = (np.broadcast_to(part, (len(query.matrices), 3)) for part in offset)
    starts = mechanism.geometry.base_points + base[:, None]
    ends = (mechanism.geometry.platform_points + cuff[:, None]) @ np.swapaxes(query.matrices, 1, 2)
    # A limb through O has no plane; such a pose is singular and has no forces.
    across = np.cross(starts, ends)
    folded = (np.sqrt((across**2).sum(axis=-1)) < _FOLDED).any(axis=1)
    closure, share = limb_loads(mechanism, query, base, cuff, folded)
    return np.asarray((closure - share).sum(axis=1))


def tension_limits(mechanism: Mechanism, lengths: FloatArray, least_tension: float) -> tuple[FloatArray, FloatArray]:
    """Least and greatest f_i at limb lengths, shapes (N, n), N.

    Limbs that only pull have at least ``least_tension``, N. Where a greatest pull is not known, what no muscle of the
    kind can exceed takes its place.
    """
    limits = design_limits(mechanism, lengths)
    pulls = np.array([limb.actuator is not None and limb.actuator.pulls_only for limb in mechanism.limbs])
    low = np.where(pulls, np.maximum(limits.lower, least_tension), limits.lower)
    return low, np.where(np.isnan(limits.upper), limits.ceiling, limits.upper)


def nearest_tensions(
    arms: FloatArray, moment: FloatArray, pulls: FloatArray, force: FloatArray, lower: FloatArray, upper: FloatArray
) -> FloatArray:
    """Tensions of one pose within limits that come nearest to a moment, and of several those of least |F_s|, (n,), N.

    For controllers, whose wanted moments the limbs often cannot give. Two programs follow each other, exact and
    compiled: minimise |Jᵀ f - m| within the limits, which leaves a unique moment; then, of all f with that moment, if
    there are several, minimise |F_s|, F_s = Σ f_i s_i - F. Limbs carry no side force.

    Parameters
    ----------
    arms : ndarray
        Jᵀ, shape (3, n), m: ``arms @ f`` is the moment that tensions take up.
    moment : ndarray
        m, shape (3,), N m.
    pulls : ndarray
        s_i as columns, shape (3, n).
    force : ndarray
        F, shape (3,), N: what weight and motion of the arm put on shoulder and limbs together.
    lower, upper : ndarray
        Limits of f, shape (n,), N; they may be infinite.
    """
    f = least_forces(-moment[None], arms[None], lower[None], upper[None]).variables[0]
    _, values, directions = np.linalg.svd(arms)
    axes = np.ascontiguousarray(directions[int((values > _RANK * values[0]).sum()) :].T)
    if 0 < axes.shape[1] <= _MOST_SUMS:
        pull, sums = np.ascontiguousarray(pulls), np.empty(axes.shape[1])
        if least_sum_force(pull @ f - force, pull @ axes, f, axes, lower, upper, sums):
            f = np.clip(f + axes @ sums, lower, upper)
    return f


def missing_moments(moments: FloatArray, arms: FloatArray, lower: FloatArray, upper: FloatArray) -> FloatArray:
    """Least |Jᵀ f - m| within the limits in N poses, shape (N,), N m.

    ``moments`` has the shape (N, 3), ``arms`` (N, 3, n), the limits (N, n).
    """
    return np.asarray(np.linalg.norm(least_forces(-moments, arms, lower, upper).forces, axis=1))
