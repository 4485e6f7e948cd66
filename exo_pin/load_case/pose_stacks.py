"""Poses, motion and load as flat stacks, and what arm and load put on limbs and shoulder there."""

from __future__ import annotations

from typing import Any, NamedTuple

import numpy as np
from numpy.typing import NDArray
from scipy.spatial.transform import Rotation

from ..core.compiled import kernel
from ..core.errors import InvalidInput
from ..core.records import Record
from ..core.validation import FloatArray, as_rotation, broadcast_to, require_type
from ..design import Arm, Mechanism
from ..numerics.vectors import applied_load, inertia_load, matrix, vector, weight_load
from .motion_and_load import Load, Motion


class Query(NamedTuple):
    """Poses, motion and load as flat stacks.

    Attributes
    ----------
    shape : tuple of int
        The stack's shape (...), N poses in all.
    matrices : ndarray
        Shape (N, 3, 3).
    velocity, acceleration : ndarray
        Shape (N, 3), base frame.
    force, moment : ndarray
        Shape (N, 3), the load on the arm, moment about O, base frame.
    quaternions : ndarray
        Shape (N, 4), the poses as x, y, z, w.
    """

    shape: tuple[int, ...]
    matrices: FloatArray
    velocity: FloatArray
    acceleration: FloatArray
    force: FloatArray
    moment: FloatArray
    quaternions: FloatArray

    def rows(self, rows: NDArray[np.intp]) -> Query:
        """Some of the poses as a stack of their own, shape (k,)."""
        return Query((len(rows),), *(part[rows] for part in self[1:]))


class Rows(Record):
    """Vectors that broadcast against a stack of poses, handed out block by block and never spread out as a whole.

    Parameters
    ----------
    name : str
        Of the argument, for the message.
    array : ndarray
        Broadcasts to (..., width).
    shape : tuple of int
        The stack's shape (...).
    width : int
        Length of a vector.

    Raises
    ------
    InvalidInput
        If it does not broadcast.
    """

    def __init__(self, name: str, array: FloatArray, shape: tuple[int, ...], width: int = 3) -> None:
        full = (*shape, width)
        self._spread = broadcast_to(name, array, full)
        self._shape = shape
        #: Whether all poses have the same vector, so that a block is that one row.
        self.is_single = all(side == 1 for side in array.shape[:-1])
        self._flat: FloatArray | None = None
        if self.is_single:
            self._flat = np.broadcast_to(array.reshape(-1), (1, width))
        elif array.shape == full and array.flags.c_contiguous:
            self._flat = array.reshape(-1, width)

    def block(self, start: int, stop: int) -> FloatArray:
        """A writable copy of the rows from ``start`` to ``stop`` of the flattened stack, or of the single one."""
        if self._flat is None:
            return self.rows(np.arange(start, stop))
        return np.array(self._flat if self.is_single else self._flat[start:stop], order="C")

    def rows(self, rows: NDArray[np.intp]) -> FloatArray:
        """A copy of some rows of the flattened stack, shape (k, width)."""
        return np.array(self._spread[np.unravel_index(rows, self._shape)])


def pose_matrices(poses: Rotation) -> tuple[tuple[int, ...], FloatArray]:
    """The stack's shape (...) and its matrices, shape (N, 3, 3), contiguous."""
    rotation = as_rotation("poses", poses)
    return rotation.shape, np.ascontiguousarray(rotation.as_matrix().reshape(-1, 3, 3))


def as_query(poses: Rotation, motion: Motion | None = None, load: Load | None = None) -> Query:
    """Broadcast motion and load against the stack of poses.

    Raises
    ------
    InvalidInput
        If something is of the wrong type, or its stack dimensions do not broadcast to those of ``poses``.
    """
    shape, matrices = pose_matrices(poses)
    count = len(matrices)
    still = np.zeros((count, 3))
    velocity = acceleration = force = moment = still
    if motion is not None:
        require_type("motion", motion, Motion)
        velocity = _spread("motion.angular_velocity", motion.angular_velocity, shape)
        acceleration = _spread("motion.angular_acceleration", motion.angular_acceleration, shape)
    if load is not None:
        require_type("load", load, Load)
        force = _spread("load.force", np.asarray(load.force), shape)
        couple = _spread("load.moment", np.asarray(load.moment), shape)
        at = _spread("load.at", np.asarray(load.at), shape)
        outside, moment = np.empty((count, 3)), np.empty((count, 3))
        applied_stack(matrices, force, couple, at, load.frame == "arm", outside, moment)
        force = outside
    return Query(shape, matrices, velocity, acceleration, force, moment, poses.as_quat().reshape(-1, 4))


def _spread(name: str, array: FloatArray, shape: tuple[int, ...]) -> FloatArray:
    # A copy, always: the kernels take arrays of one kind, and a read-only or strided one is another.
    return np.array(broadcast_to(name, array, (*shape, 3)), order="C").reshape(-1, 3)


def require_massless(mechanism: Mechanism) -> None:
    """Raise if a limb has mass: the closed forms are for massless limbs.

    Raises
    ------
    InvalidInput
        Naming the limb.
    """
    for index, limb in enumerate(mechanism.limbs):
        if limb.mass > 0.0:
            raise InvalidInput(
                f"limb index {index} has mass {limb.mass:g} kg: the closed form holds for massless limbs only "
                "(ShoulderExo.reaction takes limb masses into account)"
            )


@kernel(stack=True)
def arm_load(
    R: Any,
    mass: float,
    centre: Any,
    inertia: Any,
    gravity: Any,
    velocity: Any,
    acceleration: Any,
    force: Any,
    moment: Any,
    F: Any,
    M: Any,
) -> None:
    """Add weight and inertia to the load on the arm: what limbs and shoulder together must carry.

    F = force + m (g - a_C) and M = moment + C × m g - (I η + ω × I ω), base frame, moments about O; see
    :func:`exo_pin.numerics.vectors.inertia_load`.

    Parameters
    ----------
    R, velocity, acceleration, force, moment, F, M : ndarray
        Stacks, shapes (N, 3, 3) and (N, 3); F and M are written.
    mass, centre, inertia, gravity : float or ndarray
        Of the arm: kg, m in {O_B}, kg m² about O in {O_B}; m/s² in the base frame.
    """
    c, I, g = vector(centre.reshape(1, 3), 0), matrix(inertia), vector(gravity.reshape(1, 3), 0)  # noqa: E741
    for k in range(R.shape[0]):
        pose = matrix(R[k])
        C, W, MW = weight_load(pose, mass, c, g)
        FI, MI = inertia_load(pose, mass, C, I, vector(velocity, k), vector(acceleration, k))
        for j in range(3):
            F[k, j] = force[k, j] + W[j] + FI[j]
            M[k, j] = moment[k, j] + MW[j] + MI[j]


@kernel(stack=True)
def applied_stack(R: Any, force: Any, couple: Any, at: Any, in_arm: bool, F: Any, M: Any) -> None:
    """:func:`exo_pin.numerics.vectors.applied_load` over a stack: F and M, shape (N, 3), are written."""
    for k in range(R.shape[0]):
        F_k, M_k = applied_load(matrix(R[k]), vector(force, k), vector(couple, k), vector(at, k), in_arm)
        for j in range(3):
            F[k, j], M[k, j] = F_k[j], M_k[j]


def carried(
    body: Arm, gravity: FloatArray, query: Query, force: FloatArray, moment: FloatArray
) -> tuple[FloatArray, FloatArray]:
    """Force and moment about O, shape (N, 3) each: weight and inertia of a body that turns with the arm, and a load.

    At rest the inertia does not enter, so it may be unknown; a motion needs it.
    """
    total_force, total_moment = np.empty_like(force), np.empty_like(moment)
    arm_load(
        query.matrices,
        body.mass,
        body.centre_of_mass,
        np.zeros((3, 3)) if body.inertia is None else body.inertia_about_origin,
        gravity,
        query.velocity,
        query.acceleration,
        force,
        moment,
        total_force,
        total_moment,
    )
    return total_force, total_moment


def arm_loads(arm: Arm, gravity: FloatArray, query: Query) -> tuple[FloatArray, FloatArray, FloatArray]:
    """What arm and device add to the balance, by Newton and Euler in closed form and not through Pinocchio.

    Returns force (N, 3) and moment (N, 3) about O on the whole arm, load included, and the wrench (N, 6) of the
    device's own parts, without the load.
    """
    nothing = np.zeros_like(query.force)
    force, moment = carried(arm, gravity, query, query.force, query.moment)
    device = np.zeros((len(force), 6))
    for part in arm.parts:
        if part.device:
            device += np.concatenate(carried(part, gravity, query, nothing, nothing), axis=1)
    return force, moment, device
