"""Common parts of the loops over poses: the query as arrays, and blocks of poses with their loads."""

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
from ...numerics.vectors import applied_load, inertia_load, matrix, rotation_matrix, turn, vector, weight_load

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


class Device(NamedTuple):
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
