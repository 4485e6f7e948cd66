"""Constant data of a chain's loops, as arrays for the kernels."""

from __future__ import annotations

from dataclasses import dataclass
from functools import cached_property
from typing import NamedTuple

import numpy as np
import pinocchio as pin
from numpy.typing import NDArray
from scipy.sparse import csr_array
from scipy.sparse.csgraph import connected_components

from ...core.errors import InvalidInput
from ...core.records import Record
from ...core.validation import FloatArray, frozen
from .couplings import make_couplings
from .description import Closures
from .frames import FrameTable, se3
from .motion_axes import carried_joints, characteristic_length, in_metres
from .projection import COUPLED_LENGTH

IntArray = NDArray[np.int64]
#: Rows and columns, block by block, and where each block starts in either, with the end in the last place; shapes
#: (rows,), (columns,), (blocks + 1,), (blocks + 1,). Coordinates that move no loop are left out. A plain tuple, because
#: Numba takes it ten times faster than a named one.
Blocks = tuple[IntArray, IntArray, IntArray, IntArray]
#: All closures as the kernels take them: joints, local, kinds, distances, rows, signs, supports, coupled, polynomials
#: of :class:`Topology`. A plain tuple, as :data:`Blocks`.
Loops = tuple[IntArray, FloatArray, IntArray, FloatArray, IntArray, FloatArray, FloatArray, IntArray, FloatArray]
#: What takes rows and columns of the constraint Jacobian to characteristic lengths, and its blocks: row_scale, column
#: and blocks of :class:`Topology`.
Scales = tuple[FloatArray, FloatArray, Blocks]


@dataclass(frozen=True, eq=False)
class Topology(Record):
    """Arrays of a chain with m closures, read-only.

    Attributes
    ----------
    joints : ndarray of int
        Shape (m, 2), the joints that carry frames a and b; both the world's, 0, for a coupling, which joins positions
        of joints and no bodies.
    local : ndarray
        Shape (m, 2, 4, 3), the closure's frames in those joints; rows 0 to 2 are the columns of R, row 3 is p.
    kinds, rows : ndarray of int
        Shape (m,), type codes; shape (m + 1,), first row of each closure.
    supports : ndarray
        Shape (m, 2, nv), 1 for coordinates that move frame a (b).
    signs : ndarray
        Shape (m, nv), difference of the two; of a coupling 1 for joint b and -1 for joint a: not zero where a
        coordinate moves a closure.
    carried : ndarray
        Shape (njoints, m): 1 where frame a is on the joint's own body or further out and frame b is not, -1 the other
        way round, else 0.
    length : float
        The characteristic length that weighs metres against radians, m: the root mean square of the distances
        between the joints and closures of each body, the world included. It does not depend on the cut.
    row_metres : ndarray of bool
        Shape (rows,), which rows are in metres.
    row_scale : ndarray
        Shape (rows,), 1/length for rows in metres, 1 for rows in radians.
    distances : ndarray
        Shape (m,), lengths of the distance closures, m; 0 for the others.
    owners, metres : ndarray
        Shape (nv,), int and bool, the joint of each coordinate and whether it is in metres.
    column : ndarray
        Shape (nv,), length for metres, 1 for radians: a velocity over it has no length in it.
    per_newton, weight : ndarray
        Shape (nv,), 1 for forces, 1/length for moments: a generalised force times it is in N; mobility of each
        coordinate in the least movement: length² for metres, 1 for radians.
    blocks : tuple of ndarray
        As :func:`blocks_of` finds them: the loops that share no coordinate with others.
    coupled, polynomials : ndarray
        Shapes (k, 5), int, and (k, 7), the couplings as in :mod:`exo_pin.chain.structure.couplings`.
    """

    joints: IntArray
    local: FloatArray
    kinds: IntArray
    rows: IntArray
    supports: FloatArray
    signs: FloatArray
    carried: FloatArray
    length: float
    row_metres: NDArray[np.bool_]
    row_scale: FloatArray
    distances: FloatArray
    owners: IntArray
    metres: NDArray[np.bool_]
    column: FloatArray
    per_newton: FloatArray
    weight: FloatArray
    blocks: Blocks
    coupled: IntArray
    polynomials: FloatArray

    def frame(self, c: int, end: int) -> pin.SE3:
        """Frame a (end 0) or b (1) of a closure, in the joint that carries it."""
        local = self.local[c, end]
        return pin.SE3(local[:3].T.copy(), local[3].copy())

    @cached_property
    def loops(self) -> Loops:
        """All closures for the kernels."""
        frames = self.joints, self.local, self.kinds, self.distances, self.rows
        return *frames, self.signs, self.supports, self.coupled, self.polynomials

    @cached_property
    def scales(self) -> Scales:
        """Scales of the constraint Jacobian for the kernels."""
        return self.row_scale, self.column, self.blocks

    @cached_property
    def bodies(self) -> tuple[IntArray, FloatArray, FloatArray, float]:
        """What the forces in joints need for the kernels: owners, carried, per_newton and length."""
        return self.owners, self.carried, self.per_newton, self.length

    @property
    def row_count(self) -> int:
        """Number of constraint rows."""
        return int(self.rows[-1])


class Part(NamedTuple):
    """A joint or closure.

    Attributes
    ----------
    place : int
        Its place in lists of all joints but the world's, then all closures.
    receiver, other : int
        The bodies that it joins, by their joints: the child and its parent, or those of frames a and b. Its wrench
        is that on the receiver.
    """

    place: int
    receiver: int
    other: int


def blocks_of(signs: FloatArray, rows: IntArray) -> Blocks:
    """Blocks of a chain, given which coordinates move which closure and the closures' first rows.

    Loops that share no coordinate are independent: the constraint Jacobian is block diagonal after its rows and columns
    are sorted by block. Its singular values are those of the blocks, and so are ranks, self-stresses and least
    solutions: work on it grows with the number of loops, not with its cube. The blocks of usual robots are small enough
    that LAPACK works on them in one thread.

    Parameters
    ----------
    signs, rows : ndarray
        Shapes (m, nv) and (m + 1,), as in :class:`Topology`.
    """
    moved = csr_array(signs != 0.0, dtype=np.int64)
    count, block = connected_components(moved @ moved.T, directed=False) if len(signs) else (0, np.array([], int))
    by_row = np.repeat(block, np.diff(rows))
    row_groups = [np.flatnonzero(by_row == b) for b in range(count)]
    column_groups = [np.flatnonzero(signs[block == b].any(axis=0)) for b in range(count)]
    return _joined(row_groups), _joined(column_groups), _starts(row_groups), _starts(column_groups)


def _joined(groups: list[IntArray]) -> IntArray:
    return frozen(np.concatenate([np.array([], dtype=np.int64), *groups]).astype(np.int64))


def _starts(groups: list[IntArray]) -> IntArray:
    return frozen(np.cumsum([0, *(len(group) for group in groups)]).astype(np.int64))


def make_topology(model: pin.Model, closures: Closures, frames: FrameTable) -> Topology:
    """Find the closures' frames in the model.

    Raises
    ------
    UnknownName
        If a frame is not in the model.
    InvalidInput
        If a closure joins a body with itself, or a coupling's joint is no hinge or slide.
    """
    count = len(closures.closures)
    joints, local = np.zeros((count, 2), dtype=np.int64), np.zeros((count, 2, 4, 3))
    for c, closure in enumerate(closures.closures):
        if closure.kind.is_coupling:
            local[c, :, :3] = np.eye(3)
            continue
        ends = ((closure.frame_a, closure.placement_a), (closure.frame_b, closure.placement_b))
        for end, (name, placement) in enumerate(ends):
            frame = model.frames[frames.find("frame", name, f"closure {closure.name!r}")]
            pose = frame.placement * se3(placement) * _axis_turn(closure.axis)
            joints[c, end] = frame.parentJoint
            local[c, end, :3], local[c, end, 3] = pose.rotation.T, pose.translation
        if joints[c, 0] == joints[c, 1]:
            raise InvalidInput(
                f"closure {closure.name!r} joins {closure.frame_a!r} and {closure.frame_b!r}, which are one rigid body"
            )
    kinds = np.array([closure.kind.code for closure in closures.closures], dtype=np.int64)
    rows = np.cumsum([0, *(closure.rows for closure in closures.closures)], dtype=np.int64)
    (coupled, polynomials), metres = make_couplings(model, closures.closures, rows), in_metres(model)
    sliding = metres[coupled[:, 4]]
    kinds[np.searchsorted(rows, coupled[sliding, 0])] = COUPLED_LENGTH
    outward, owners = carried_joints(model), np.repeat(np.arange(model.njoints), list(model.nvs))
    supports = np.ascontiguousarray(outward[owners].T)[joints].reshape(count, 2, model.nv)
    # In C order, as all that kernels take: another order would be compiled anew.
    carried = frozen(np.ascontiguousarray(outward[:, joints[:, 0]] - outward[:, joints[:, 1]]))
    length = characteristic_length(model, joints, local)
    types = [closure.kind for closure in closures.closures]
    row_metres = np.array([k < kind.translations for kind in types for k in range(kind.rows)], dtype=bool)
    row_metres[coupled[:, 0]] = sliding
    signs = supports[:, 0] - supports[:, 1]
    led, own = coupled[:, 2] >= 0, np.searchsorted(rows, coupled[:, 0])
    signs[own[led], coupled[led, 2]] = -1.0
    signs[own, coupled[:, 4]] = 1.0
    column = np.where(metres, length, 1.0)
    return Topology(
        joints=frozen(joints),
        local=frozen(local),
        kinds=frozen(kinds),
        rows=frozen(rows),
        supports=frozen(supports),
        signs=frozen(signs),
        carried=carried,
        length=length,
        row_metres=frozen(row_metres),
        row_scale=frozen(np.where(row_metres, 1.0 / length, 1.0)),
        distances=frozen(np.array([closure.distance or 0.0 for closure in closures.closures])),
        owners=frozen(owners),
        metres=metres,
        column=frozen(column),
        per_newton=frozen(np.where(metres, 1.0, 1.0 / length)),
        weight=frozen(column**2),
        blocks=blocks_of(signs, rows),
        coupled=coupled,
        polynomials=polynomials,
    )


def _axis_turn(axis: tuple[float, float, float] | None) -> pin.SE3:
    """The least rotation that takes z to the axis, so that the closure's own z is the axis."""
    if axis is None:
        return pin.SE3.Identity()
    if axis[2] < -1.0 + 1e-12:
        return pin.SE3(np.diag([1.0, -1.0, -1.0]), np.zeros(3))
    return pin.SE3(pin.Quaternion.FromTwoVectors(np.array([0.0, 0.0, 1.0]), np.array(axis)), np.zeros(3))
