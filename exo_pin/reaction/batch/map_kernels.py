"""The loops over poses behind :func:`exo_pin.reaction.reaction_map`, compiled, without the GIL.

Both take blocks of poses with their loads: one any limbs, one three limbs without bounds, several poses at once.

The input are unit quaternions. Each pose is computed by itself, so that the result does not depend on the blocks or on
the number of threads, to the last bit.
"""

from __future__ import annotations

import math
from typing import Any, NamedTuple

import numpy as np
from scipy.spatial.transform import Rotation

from ...core.compiled import kernel
from ...core.errors import InvalidInput
from ...core.validation import FloatArray, require_type
from ...design import Mechanism
from ...load_case import Load, Motion
from ...load_case.pose_stacks import Rows
from ...numerics.bounded.box_descent import scratch
from ...numerics.bounded.box_program import GAP_TOLERANCE, least_bounded
from ...numerics.bounded.polytope_program import FEW
from ...numerics.small_linear import copy_numbers
from ...numerics.vectors import (
    NOT_SOLVED,
    SINGULAR,
    along_normals,
    applied_load,
    gram,
    inertia_load,
    limb,
    margin_of_moments,
    matrix,
    root,
    rotation_matrix,
    second_invariant,
    status_code,
    triple,
    turn,
    vector,
    weight_load,
)
from ...wrist.forces.force_kernels import add_open, open_effects, spherical_forces, standalone_forces
from ...wrist.limbs import fill_limbs, largest_radius, pose_status
from ..answer import QUERY_STATUS
from .limit_kernels import MET, NOT_HELD, CompiledLimits, limits_of_pose, many_tensions_within, tensions_within

#: Poses of a block: few enough for their numbers to fit into the first cache.
LANES = 64
#: Rows of a block of three limbs: quaternion, force and moment in; then f, g, F_s, status, margin and |F_s| out.
ROWS = 22
# Where the rows begin. Unsigned numbers spare the compiler the case of an index that counts from the end, without
# which it does not work on several poses at once.
FX, FY, FZ, MX, MY, MZ = (np.uint64(row * LANES) for row in range(6))
QX, QY, QZ, QW = (np.uint64(row * LANES) for row in range(18, 22))
X, Y, Z, W = (np.uint64(column) for column in range(4))
#: Vectors of motion and load, in the order of the last fields of :class:`Terms`.
_VECTORS = {"motion": ("angular_velocity", "angular_acceleration"), "load": ("force", "moment", "at")}


class LimbPoints(NamedTuple):
    """A mechanism as arrays: joint centres (n, 3), indices of the UPU limbs."""

    base: Any
    platform: Any
    upu: Any


class Terms(NamedTuple):
    """Arm, motion and load. Arrays of the last five have one row a pose, or a single row for all of them."""

    mass: float
    centre: Any
    inertia: Any
    gravity: Any
    moving: bool
    loaded: bool
    in_arm: bool
    velocity: Any
    acceleration: Any
    force: Any
    couple: Any
    at: Any


class Outputs(NamedTuple):
    """Arrays for the results, one row a pose; an array without rows is not filled."""

    shoulder: Any
    f: Any
    g: Any
    status: Any
    margin: Any
    magnitude: Any


@kernel
def pose(w: Any, k: Any) -> Any:
    """The rotation matrix of a pose of the block, as a tuple of rows."""
    return rotation_matrix(w[QX + k], w[QY + k], w[QZ + k], w[QW + k])


@kernel
def _weigh(lanes: Any, mass: float, centre: Any, gravity: Any, w: Any) -> None:
    """Fill force and moment of a block with those of the arm's weight."""
    c, down = vector(centre, 0), vector(gravity, 0)
    for k in range(lanes):
        _, F, M = weight_load(pose(w, k), mass, c, down)
        w[FX + k], w[FY + k], w[FZ + k] = F
        w[MX + k], w[MY + k], w[MZ + k] = M


@kernel(inline=True)
def _add(w: Any, k: Any, F: Any, M: Any) -> None:
    w[FX + k] += F[0]
    w[FY + k] += F[1]
    w[FZ + k] += F[2]
    w[MX + k] += M[0]
    w[MY + k] += M[1]
    w[MZ + k] += M[2]


@kernel
def _accelerate(
    lanes: Any, start: int, mass: float, centre: Any, inertia: Any, velocity: Any, acceleration: Any, w: Any
) -> None:
    """Add the arm's inertia to force and moment of a block."""
    c, I = vector(centre, 0), matrix(inertia)  # noqa: E741
    step_v, step_a = min(velocity.shape[0] - 1, 1), min(acceleration.shape[0] - 1, 1)
    for k in range(lanes):
        i = start + np.int64(k)
        R = pose(w, k)
        F, M = inertia_load(R, mass, turn(R, c), I, vector(velocity, i * step_v), vector(acceleration, i * step_a))
        _add(w, k, F, M)


@kernel
def _pull(lanes: Any, start: int, force: Any, couple: Any, at: Any, in_arm: bool, w: Any) -> None:
    """Add a load on the arm to force and moment of a block."""
    step_f, step_c, step_at = min(force.shape[0] - 1, 1), min(couple.shape[0] - 1, 1), min(at.shape[0] - 1, 1)
    for k in range(lanes):
        i = start + np.int64(k)
        at_k = vector(at, i * step_at)
        F, M = applied_load(pose(w, k), vector(force, i * step_f), vector(couple, i * step_c), at_k, in_arm)
        _add(w, k, F, M)


@kernel(inline=True)
def fill_block(q: Any, start: int, terms: Terms, w: Any) -> Any:
    """Fill the poses of the block that begins at ``start`` and their loads; return their number."""
    lanes = np.uint64(min(LANES, q.shape[0] - start))
    block = q[start:]
    for k in range(lanes):
        w[QX + k], w[QY + k], w[QZ + k], w[QW + k] = block[k, X], block[k, Y], block[k, Z], block[k, W]
    _weigh(lanes, terms.mass, terms.centre, terms.gravity, w)
    if terms.moving:
        _accelerate(lanes, start, terms.mass, terms.centre, terms.inertia, terms.velocity, terms.acceleration, w)
    if terms.loaded:
        _pull(lanes, start, terms.force, terms.couple, terms.at, terms.in_arm, w)
    return lanes


class PoseBlocks:
    """Quaternions of a stack of poses, block by block: a Rotation returns a copy of all of them."""

    def __init__(self, poses: Rotation) -> None:
        self.shape: tuple[int, ...] = poses.shape
        self.count = math.prod(self.shape)
        self._stack = poses
        # Stacks of one dimension can be cut before they are copied. SciPy stores the others as one array anyway.
        self._whole = None if len(self.shape) == 1 else np.reshape(poses.as_quat(), (-1, 4))

    def block(self, start: int, stop: int) -> FloatArray:
        """Rows of the flat stack, shape (stop - start, 4)."""
        rows = self._stack[start:stop].as_quat() if self._whole is None else self._whole[start:stop]
        rows = np.require(rows, dtype=np.float64, requirements=["C", "W"])
        # A sum is not finite if any of its terms is not, and entries of unit quaternions are too small to overflow.
        if not math.isfinite(rows.sum()):
            raise InvalidInput("expected poses to be finite")
        return rows


class TermBlocks:
    """Arm, motion and load, block by block."""

    def __init__(self, mechanism: Mechanism, motion: Motion | None, load: Load | None, shape: tuple[int, ...]) -> None:
        self._rows: list[Rows] = []
        for name, value, kind in (("motion", motion, Motion), ("load", load, Load)):
            if value is not None:
                require_type(name, value, kind)
            for field in _VECTORS[name]:
                vectors = np.zeros(3) if value is None else np.asarray(getattr(value, field))
                self._rows.append(Rows(f"{name}.{field}", vectors, shape))
        arm = mechanism.require_arm("weight" if motion is None else "motion", inertia=motion is not None)
        self._fixed = (
            arm.mass,
            np.array(arm.centre_of_mass).reshape(1, 3),
            # At rest inertia has no effect, so it may be unknown.
            np.zeros((3, 3)) if motion is None else np.array(arm.inertia_about_origin),
            np.array(mechanism.gravity).reshape(1, 3),
            motion is not None,
            load is not None,
            load is not None and load.frame == "arm",
        )

    def block(self, start: int, stop: int) -> Terms:
        """Arm, motion and load of rows of the flat stack."""
        return Terms(*self._fixed, *(rows.block(start, stop) for rows in self._rows))


#: Splits.
SPHERICAL, STANDALONE, MINIMAL = 0, 1, 2
#: Status of a pose in which no tensions are within their limits.
INFEASIBLE = QUERY_STATUS.index("infeasible")


@kernel(stack=True)
def map_any(
    q: Any, device: LimbPoints, terms: Terms, split: int, by_actuator: bool, lower: Any, upper: Any,
    limits: CompiledLimits, out: Outputs,
) -> None:  # fmt: skip
    """Any split of any number of limbs.

    Parameters
    ----------
    q : ndarray
        Unit quaternions, shape (N, 4), scalar last.
    device, terms, out : NamedTuple
        The mechanism, the query, and the arrays for the results.
    split : int
        One of the codes above.
    by_actuator : bool
        Whether the bounds on g are the pose's own |f_i|.
    lower, upper : ndarray
        Bounds on g of "minimal", shape (N, n) or (1, n), N.
    limits : CompiledLimits
        Limits of f, of more than three limbs for "spherical" only. Poses in which no tensions meet them get the code
        :data:`INFEASIBLE`; those in which rounding decides, or a limb cannot have its length, keep the tensions of
        least norm.
    """
    base, upu = device.base, device.upu
    n, u = base.shape[0], upu.shape[0]
    own = n - 3
    m = own + u
    each = base.shape
    b, s, X, Q, U = np.empty(each), np.empty(each), np.empty(each), np.empty(each), np.empty((3, 3))
    length, reach = np.empty(n), np.empty(n)
    f, g, shoulder = np.empty(n), np.empty(n), np.empty(3)
    N, G, c, z = np.empty((n, own)), np.empty((3, m)), np.empty(3), np.empty(max(m, 1))
    low, high = np.full(m, -np.inf), np.full(m, np.inf)
    work, w, limb_work = scratch(m), np.empty(ROWS * LANES), scratch(n)
    own_G, arms, moment, relief = np.empty((3, own)), np.empty(each), np.empty((2, 3)), np.empty((2, n))
    limited, low_f, high_f = limits.lower.shape[0] > 0 and own > 0 and split == SPHERICAL, np.empty(n), np.empty(n)
    radius = largest_radius(device.platform)
    for i in range(q.shape[0]):
        lane = np.uint64(i % LANES)
        if lane == 0:
            fill_block(q, i, terms, w)
        fill_limbs(pose(w, lane), base, device.platform, b, s, X, length, reach)
        status, margin = pose_status(X, reach, upu)
        if status < SINGULAR:
            F = (w[FX + lane], w[FY + lane], w[FZ + lane])
            M = (w[MX + lane], w[MY + lane], w[MZ + lane])
            spherical_forces(s, X, reach, F, M, f, shoulder, Q, U)
            g[:] = 0.0
            if limited:
                found = MET
                if not limits_of_pose(limits, length, low_f, high_f):
                    pass
                elif own <= FEW:
                    room = (N, own_G, c, z, arms, moment, relief)
                    found = tensions_within(s, X, reach, M, radius, Q, low_f, high_f, *room, f, shoulder)
                else:
                    some = (c, arms, moment, relief, limb_work)
                    found = many_tensions_within(s, X, reach, M, radius, low_f, high_f, *some, f, shoulder)
                if found == NOT_HELD:
                    status = INFEASIBLE
            elif split == STANDALONE:
                if not standalone_forces(s, X, upu, Q, f, g, shoulder, N, G, c, z):
                    status = SINGULAR
            elif split == MINIMAL and m > 0:
                open_effects(s, X, upu, Q, N, G)
                low_row, high_row = min(i, lower.shape[0] - 1), min(i, upper.shape[0] - 1)
                for k in range(u):
                    limit = abs(f[upu[k]])
                    low[own + k] = -limit if by_actuator else lower[low_row, upu[k]]
                    high[own + k] = limit if by_actuator else upper[high_row, upu[k]]
                if least_bounded(shoulder, G, low, high, z, work) <= GAP_TOLERANCE:
                    add_open(upu, N, z, f, g)
                    for j in range(3):
                        for k in range(m):
                            shoulder[j] += G[j, k] * z[k]
                else:
                    status = NOT_SOLVED
        if status >= SINGULAR and status != INFEASIBLE:
            f[:], g[:], shoulder[:] = np.nan, np.nan, np.nan
        if out.shoulder.shape[0]:
            copy_numbers(shoulder, out.shoulder[i])
        if out.f.shape[0]:
            copy_numbers(f, out.f[i])
        if out.g.shape[0]:
            copy_numbers(g, out.g[i])
        if out.status.shape[0]:
            out.status[i] = status
        if out.margin.shape[0]:
            out.margin[i] = margin
        if out.magnitude.shape[0]:
            out.magnitude[i] = root(shoulder[0] ** 2 + shoulder[1] ** 2 + shoulder[2] ** 2)


# Where the rows of the results begin in a block.
F1, F2, F3, G1, G2, G3, SX, SY, SZ = (np.uint64(row * LANES) for row in range(6, 15))
STATUS, MARGIN, SIZE = (np.uint64(row * LANES) for row in range(15, 18))


@kernel
def _three_limbs(lanes: Any, base: Any, platform: Any, standalone: bool, w: Any) -> None:
    """One block of poses of three limbs, without bounds.

    It has no branch and calls no function, so that the compiler can vectorise it over poses.
    """
    a1, a2, a3 = vector(base, 0), vector(base, 1), vector(base, 2)
    p1, p2, p3 = vector(platform, 0), vector(platform, 1), vector(platform, 2)
    side, rest = (1.0, 0.0) if standalone else (0.0, 1.0)
    for k in range(lanes):
        R = pose(w, k)
        _, s1, X1, _, h1, folded1 = limb(R, a1, p1)
        _, s2, X2, _, h2, folded2 = limb(R, a2, p2)
        _, s3, X3, _, h3, folded3 = limb(R, a3, p3)
        gram1, gram2, gram3 = gram(X1, h1), gram(X2, h2), gram(X3, h3)
        second = second_invariant(
            (
                gram1[0] + gram2[0] + gram3[0],
                gram1[1] + gram2[1] + gram3[1],
                gram1[2] + gram2[2] + gram3[2],
                gram1[3] + gram2[3] + gram3[3],
                gram1[4] + gram2[4] + gram3[4],
                gram1[5] + gram2[5] + gram3[5],
            )
        )
        volume = triple(X1, X2, X3) * h1 * h2 * h3
        margin = margin_of_moments(h1 * h1 + h2 * h2 + h3 * h3, second, volume)
        code = status_code(folded1 | folded2 | folded3, margin)
        # Added to a part of the moment it makes all forces of a singular pose NaN, without a branch; to what is zero by
        # assumption, it takes away the sign of the zero.
        blank = np.nan if code >= SINGULAR else 0.0
        y = along_normals((w[MX + k] + blank, w[MY + k], w[MZ + k]), X1, X2, X3)
        f1, f2, f3 = y[0] / h1, y[1] / h2, y[2] / h3
        Sx = f1 * s1[0] + f2 * s2[0] + f3 * s3[0] - w[FX + k]
        Sy = f1 * s1[1] + f2 * s2[1] + f3 * s3[1] - w[FY + k]
        Sz = f1 * s1[2] + f2 * s2[2] + f3 * s3[2] - w[FZ + k]
        g = along_normals((Sx, Sy, Sz), X1, X2, X3)
        Sx, Sy, Sz = rest * Sx + blank, rest * Sy + blank, rest * Sz + blank
        w[F1 + k], w[F2 + k], w[F3 + k] = f1, f2, f3
        w[G1 + k], w[G2 + k], w[G3 + k] = side * g[0] + blank, side * g[1] + blank, side * g[2] + blank
        w[SX + k], w[SY + k], w[SZ + k] = Sx, Sy, Sz
        w[STATUS + k], w[MARGIN + k], w[SIZE + k] = float(code), margin, root(Sx * Sx + Sy * Sy + Sz * Sz)


@kernel(inline=True)
def _copy_vectors(w: Any, x: Any, y: Any, z: Any, start: int, lanes: Any, out: Any) -> None:
    if out.shape[0]:
        block = out[start:]
        for k in range(lanes):
            block[k, X], block[k, Y], block[k, Z] = w[x + k], w[y + k], w[z + k]


@kernel(inline=True)
def _copy_numbers(w: Any, row: Any, start: int, lanes: Any, out: Any) -> None:
    if out.shape[0]:
        block = out[start:]
        for k in range(lanes):
            block[k] = w[row + k]


@kernel(stack=True)
def map_three(q: Any, device: LimbPoints, terms: Terms, standalone: bool, out: Outputs) -> None:
    """Splits "spherical" and "standalone" of three limbs.

    Parameters
    ----------
    q : ndarray
        Unit quaternions, shape (N, 4), scalar last.
    device, terms, out : NamedTuple
        The mechanism, the query, and the arrays for the results.
    standalone : bool
        Whether F_s = 0 (three UPU limbs), else g = 0.
    """
    count = q.shape[0]
    w = np.empty(ROWS * LANES)
    for start in range(0, count, LANES):
        lanes = fill_block(q, start, terms, w)
        _three_limbs(lanes, device.base, device.platform, standalone, w)
        _copy_vectors(w, SX, SY, SZ, start, lanes, out.shoulder)
        _copy_vectors(w, F1, F2, F3, start, lanes, out.f)
        _copy_vectors(w, G1, G2, G3, start, lanes, out.g)
        _copy_numbers(w, STATUS, start, lanes, out.status)
        _copy_numbers(w, MARGIN, start, lanes, out.margin)
        _copy_numbers(w, SIZE, start, lanes, out.magnitude)
