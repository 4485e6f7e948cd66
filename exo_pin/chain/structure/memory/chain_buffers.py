"""One thread's scratch memory for a chain: Pinocchio's Data, NumPy windows on it, buffers for the kernels.

A chain's constants as two arrays, because a kernel called from Python takes longer for an array than for its work.

Twenty arrays take 1.5 µs to hand over; windows on two are made within the kernel in a tenth of that.

Copies of a tree side by side, so that one call of Pinocchio serves several samples of a stack.
"""

from __future__ import annotations

from collections.abc import Iterator
from typing import Any

import numpy as np
import pinocchio as pin
from numpy.lib.stride_tricks import as_strided

from ....core.compiled import kernel
from ....core.errors import ExoPinError
from ....core.records import OneProcess
from ....core.validation import FloatArray, frozen
from ...kinematics.kernels import closure_kernels as kernels
from ..topology import IntArray, Topology
from .new_data import new_data

#: How many arrays are packed of each kind.
_INTEGERS = 10


#: Coordinates of all copies together: more are hardly faster, and the memory of Data grows with their cube.
_COORDINATES = 32


def packed_constants(model: pin.Model, topology: Topology) -> tuple[IntArray, FloatArray]:
    """Where each array starts and all integers; all other numbers."""
    owners, carried, per_newton, length = topology.bodies
    joints, local, kinds, distances, rows, signs, supports, coupled, polynomials = topology.loops
    row_scale, column, blocks = topology.scales
    integers = joints, kinds, rows, coupled, *blocks, owners, np.array(model.parents)
    numbers = np.array([length]), local, distances, signs, supports, polynomials, row_scale, column, carried, per_newton
    starts = [np.cumsum([0, *(part.size for part in parts)]) for parts in (integers, numbers)]
    starts[0] += len(starts[0]) + len(starts[1])
    whole = np.concatenate([*starts, *(part.ravel() for part in integers)]).astype(np.int64)
    return frozen(whole), frozen(np.concatenate([part.ravel() for part in numbers]))


@kernel(inline=True)
def _three(whole: Any, of: Any, k: int) -> Any:
    """Three windows; a kernel that makes no array may return several, and not one."""
    return of[whole[k] : whole[k + 1]], of[whole[k + 1] : whole[k + 2]], of[whole[k + 2] : whole[k + 3]]


@kernel(inline=True)
def unpacked_constants(whole: Any, numbers: Any) -> Any:
    """Windows on what :func:`packed_constants` returns.

    Returns
    -------
    tuple
        ``loops``, ``scales`` and ``bodies`` of :class:`exo_pin.chain.structure.topology.Topology`, and of
        each joint its parent, of each coordinate its joint.
    """
    joints, kinds, rows = _three(whole, whole, 0)
    coupled, block_rows, block_columns = _three(whole, whole, 3)
    row_starts, column_starts, owners = _three(whole, whole, 6)
    blocks, parents, starts = (
        (block_rows, block_columns, row_starts, column_starts), whole[whole[9] : whole[10]], whole[_INTEGERS + 1 :],
    )  # fmt: skip
    local, distances, signs = _three(starts, numbers, 1)
    supports, polynomials, row_scale = _three(starts, numbers, 4)
    column, carried, per_newton = _three(starts, numbers, 7)
    length, m, nv, couplings = numbers[0], len(kinds), len(column), len(coupled) // 5
    loops = (
        joints.reshape((m, 2)), local.reshape((m, 2, 4, 3)), kinds, distances, rows, signs.reshape((m, nv)),
        supports.reshape((m, 2, nv)), coupled.reshape((couplings, 5)), polynomials.reshape((couplings, 7)),
    )  # fmt: skip
    bodies = owners, carried.reshape((len(parents), m)), per_newton, length
    return loops, (row_scale, column, blocks), bodies, (parents, owners)


class ChainBuffers(OneProcess):
    """Pinocchio's Data for one chain and one thread.

    Attributes
    ----------
    data : pinocchio.Data
        Overwritten by every call.
    poses : ndarray
        Shape (njoints, 4, 3), a window on ``data.oMi``: rows 0 to 2 are the columns of R, row 3 is p.
    forces : ndarray
        Shape (njoints, 6), a window on ``data.f``.
    tree : ndarray
        Shape (njoints, 6), a window on ``data.of``, which derivatives of RNEA fill: the same as the forces, in
        world axes about the world's origin.
    tau : ndarray
        Shape (nv,), a window on ``data.tau``.
    trees : tuple of ndarray
        Shape (nv, nv), windows on the derivatives of RNEA with respect to q, v and a, of the last the lower half.
    constants : tuple of ndarray
        Loops, scales, bodies and axes as :func:`packed_constants` packs them.
    for_derivatives : tuple
        What kernels of derivatives take of all this: poses, J, dJ, q with v and a, trees, constants, the Jacobian's
        rate.
    external, external_vector
        Shape (njoints, 6), a window on the vector of forces that RNEA takes; and that vector.
    J, dJ : ndarray
        Shape (nv, 6), windows on ``data.J`` and ``data.dJ``, transposed.
    gap, jacobian, jacobian_rate, drift, move
        Buffers of shapes (rows,), (rows, nv), (rows, nv), (rows,), (nv,).
    q, v, a : ndarray
        Shapes (nq,), (nv,) and (nv,), the state of the last call, windows on one buffer.
    still : ndarray
        Shape (nv,), zeros.
    """

    def __init__(self, model: pin.Model, topology: Topology) -> None:
        self._model, self._topology = model, topology
        self.data = new_data(model)
        self.external_vector = pin.StdVec_Force()
        for _ in range(model.njoints):
            self.external_vector.append(pin.Force.Zero())
        count = model.njoints
        self.poses = pose_window(self.data.oMi, count)
        self.forces = force_window(self.data.f, count)
        self.external = force_window(self.external_vector, count)
        self.tree, self.tau = force_window(self.data.of, model.njoints), np.asarray(self.data.tau)
        # Pinocchio fills the upper half of M; its rows are written as columns.
        parts = self.data.dtau_dq, self.data.dtau_dv, self.data.M.T
        by_q, by_v, lower = (np.reshape(part, (model.nv, model.nv)) for part in parts)
        self.trees: tuple[FloatArray, FloatArray, FloatArray] = by_q, by_v, lower
        self.J, self.dJ = jacobian_window(self.data.J, model.nv), jacobian_window(self.data.dJ, model.nv)
        rows = topology.row_count
        self.gap, self.drift = np.zeros(rows), np.zeros(rows)
        self.jacobian, self.jacobian_rate = np.zeros((rows, model.nv)), np.zeros((rows, model.nv))
        self.move, self.still = np.zeros(model.nv), frozen(np.zeros(model.nv))
        motion = np.zeros(model.nq + 2 * model.nv)
        self.q, self.v, self.a = np.split(motion, [model.nq, model.nq + model.nv])
        self.constants = packed_constants(model, topology)
        self.for_derivatives = self.poses, self.J, self.dJ, motion, self.trees, self.constants, self.jacobian_rate

    def residual(self, q: FloatArray) -> float:
        """Fill ``gap`` and return its largest entry."""
        pin.forwardKinematics(self._model, self.data, q)
        np.copyto(self.q, q)
        return self._filled(self.J[:0], self.jacobian[:0])

    def linearise(self, q: FloatArray) -> float:
        """Fill ``gap`` and ``jacobian`` and return the largest entry of the gap."""
        pin.computeJointJacobians(self._model, self.data, q)
        np.copyto(self.q, q)
        return self._filled(self.J, self.jacobian)

    def _filled(self, J: FloatArray, jacobian: FloatArray) -> float:
        return kernels.residual_jacobian(self.poses, J, self._topology.loops, self.q, self.gap, jacobian)

    def jacobian_rates(self, q: FloatArray, v: FloatArray) -> None:
        """Fill the poses, ``J``, ``dJ`` and ``q``."""
        np.copyto(self.q, q)
        pin.computeJointJacobiansTimeVariation(self._model, self.data, q, v)

    def drift_of(self, q: FloatArray, v: FloatArray) -> FloatArray:
        """Fill ``jacobian_rate`` and ``drift``, its product with v, and return the drift."""
        self.jacobian_rates(q, v)
        kernels.jacobian_rate(
            self.poses, self.J, self.dJ, v, self._topology.loops, self.q, self.jacobian_rate, self.drift
        )
        return self.drift


def _address(array: Any) -> int:
    return int(array.__array_interface__["data"][0])


def _window(first: list[Any], second: list[Any], shape: tuple[int, int]) -> FloatArray:
    """One array over equal records that lie one after the other in memory.

    A record is a C-ordered block ``first[k]`` with ``second[k]`` right behind it. Reading hundreds of poses through
    the bindings one by one would cost more than the kinematics. The addresses are checked, because Pinocchio does
    not document the layout.
    """
    size = 8 * shape[0] * shape[1]
    start = _address(first[0])
    for k, (one, other) in enumerate(zip(first, second, strict=True)):
        block = _address(one) == start + k * size and one.flags.c_contiguous
        tail = _address(other) == start + k * size + 8 * one.size and other.flags.c_contiguous
        if not (block and tail and 8 * (one.size + other.size) == size):
            raise ExoPinError(
                f"pinocchio {pin.__version__} stores its arrays in an unexpected layout: install pinocchio 4.1"
            )
    return as_strided(first[0].ravel(), (len(first), *shape), (size, 8 * shape[1], 8))


def jacobian_window(matrix: Any, count: int) -> FloatArray:
    """A window on the columns of a matrix, shape (count, 6); with one column the bindings give a vector."""
    return np.asarray(matrix.T if matrix.ndim == 2 else matrix.reshape(count, 6))


def pose_window(vector: Any, count: int) -> FloatArray:
    """A window on poses, shape (count, 4, 3): rows 0 to 2 are the columns of R, row 3 is p."""
    poses = [vector[k] for k in range(count)]
    return _window([pose.rotation.T for pose in poses], [pose.translation for pose in poses], (4, 3))


def force_window(vector: Any, count: int) -> FloatArray:
    """A window on wrenches, shape (count, 6)."""
    window = _window([vector[k].linear for k in range(count)], [vector[k].angular for k in range(count)], (1, 6))
    return window[:, 0, :]


class Forest(OneProcess):
    """Scratch memory of one thread for several samples at a time.

    Parameters
    ----------
    model : pinocchio.Model
        The tree.
    """

    def __init__(self, model: pin.Model) -> None:
        self._given, self._count = model, max(1, _COORDINATES // max(model.nv, 1))
        self._model = pin.Model()
        for k in range(self._count):
            first = k * (model.njoints - 1)
            for joint in range(1, model.njoints):
                parent, place = model.parents[joint], model.jointPlacements[joint]
                name = f"{model.names[joint]}/{k}"
                self._model.addJoint(first + parent if parent else 0, model.joints[joint], place, name)
        self._data = new_data(self._model)
        shape = self._count, model.njoints - 1
        self._poses = pose_window(self._data.oMi, self._model.njoints)[1:].reshape(*shape, 4, 3)
        self._forces = force_window(self._data.f, self._model.njoints)[1:].reshape(*shape, 6)
        self._J, self._dJ = (
            jacobian_window(matrix, self._model.nv).reshape(self._count, model.nv, 6)
            for matrix in (self._data.J, self._data.dJ)
        )

    def follow(self) -> None:
        """Take over gravity, masses and armatures of the given model, which may have changed."""
        given = self._given
        self._model.gravity = given.gravity
        self._model.armature = np.tile(given.armature, self._count)
        inertias = list(given.inertias)[1:]
        for k in range(1, self._model.njoints):
            self._model.inertias[k] = inertias[(k - 1) % len(inertias)]

    def kinematics(self, q: FloatArray, v: FloatArray | None = None) -> tuple[FloatArray, FloatArray, FloatArray]:
        """Poses and Jacobians of n samples.

        Parameters
        ----------
        q, v : ndarray
            Shapes (n, nq) and (n, nv); without v no rates are computed.

        Returns
        -------
        poses : ndarray
            Shape (n, njoints, 4, 3): rows 0 to 2 are the columns of R, row 3 is p.
        J, dJ : ndarray
            Shape (n, nv, 6), world Jacobians, transposed, and their rates, zero without v.
        """
        poses, shape = np.empty((len(q), self._given.njoints, 4, 3)), (len(q), self._given.nv, 6)
        poses[:, 0, :3], poses[:, 0, 3] = np.eye(3), 0.0
        J, dJ = np.empty(shape), np.zeros(shape)
        for own, size in self._groups(len(q)):
            if v is None:
                pin.computeJointJacobians(self._model, self._data, self._whole(q[own]))
            else:
                at, speed = self._whole(q[own]), self._whole(v[own])
                pin.computeJointJacobiansTimeVariation(self._model, self._data, at, speed)
                dJ[own] = self._dJ[:size]
            poses[own, 1:] = self._poses[:size]
            J[own] = self._J[:size]
        return poses, J, dJ

    def rnea(self, q: FloatArray, v: FloatArray, a: FloatArray) -> tuple[FloatArray, FloatArray]:
        """Generalised forces of n samples, shape (n, nv), and the joints' wrenches, shape (n, njoints, 6).

        Wrenches are in the joints' own axes about their own origins.
        """
        tau, forces = np.empty(v.shape), np.zeros((len(q), self._given.njoints, 6))
        for own, size in self._groups(len(q)):
            at, speed, rate = self._whole(q[own]), self._whole(v[own]), self._whole(a[own])
            found = pin.rnea(self._model, self._data, at, speed, rate)
            tau[own] = found.reshape((self._count, v.shape[1]))[:size]
            forces[own, 1:] = self._forces[:size]
        return tau, forces

    def integrate(self, q: FloatArray, move: FloatArray) -> FloatArray:
        """q ⊕ move of n samples, shape (n, nq)."""
        found = np.empty(q.shape)
        for own, size in self._groups(len(q)):
            there = pin.integrate(self._model, self._whole(q[own]), self._whole(move[own]))
            found[own] = there.reshape((self._count, q.shape[1]))[:size]
        return found

    def _groups(self, samples: int) -> Iterator[tuple[slice, int]]:
        """Samples that one call takes, and their number."""
        for first in range(0, samples, self._count):
            yield slice(first, first + self._count), min(self._count, samples - first)

    def _whole(self, rows: FloatArray) -> FloatArray:
        """Rows one after the other for all copies, where there are too few with the last repeated."""
        short = self._count - len(rows)
        return (np.concatenate([rows, np.repeat(rows[-1:], short, axis=0)]) if short else rows).ravel()


def forest_of(state: Any) -> Forest:
    """This thread's memory of a chain for stacks, with its model's masses."""
    found: Forest | None = getattr(state._local, "forest", None)
    if found is None:
        found = state._local.forest = Forest(state.model)
    found.follow()
    return found
