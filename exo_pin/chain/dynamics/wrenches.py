"""Wrenches of joints and closures about any point and in any axes.

Wrenches are columns: shape (6, sets), force above moment, N and N m.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from typing import Any, NamedTuple

import numpy as np
import pinocchio as pin
from numpy.typing import ArrayLike, NDArray

from ...core.compiled import kernel
from ...core.errors import InvalidInput
from ...core.records import Record, reduced_tuple
from ...core.tables import three_digits
from ...core.validation import FloatArray, as_finite, frozen
from ..structure.chain_state import ChainState
from ..structure.topology import Part
from .equations.equations_of_motion import EquationsOfMotion

_COMPONENTS = ("F_x", "F_y", "F_z", "M_x", "M_y", "M_z")


@dataclass(frozen=True, eq=False)
class JointReaction(Record):
    """Wrench that a joint or closure transmits, and which components equilibrium determines; prints as a table.

    Of a stack of n samples every array has n in front. Where a sample has fewer ``directions`` than another, its last
    ones are zero.

    Attributes
    ----------
    name : str
        Of the joint or closure.
    on : str
        The body that receives it.
    wrench : ndarray
        Shape (6,), force and moment, N and N m.
    unique : ndarray of bool
        Shape (6,): which components are the same in every solution of the equations of motion (Wojtyra's criterion:
        no self-stress of the chain changes them).
    directions : ndarray
        Shape (6, r), the directions in which the wrench may change without any motion: the image of the
        chain's self-stresses, orthonormal with moments divided by the characteristic length. r = 0 if it is unique.
    interval : ndarray
        Shape (6, 2), N and N m, least and largest value of each component within the bounds; infinite where it is not
        bounded, twice the value where it is unique.

    Examples
    --------
    >>> chain = ep.load("appendix-d").chain_with_masses()
    >>> q = chain.close(chain.neutral())
    >>> shoulder = chain.joint_reaction("root_joint", q)
    >>> shoulder.on, shoulder.unique[3:].tolist()  # a ball joint bears no moment, whatever the limbs do
    ('arm', [True, True, True])
    """

    name: str
    on: str
    wrench: FloatArray
    unique: NDArray[np.bool_]
    directions: FloatArray
    interval: FloatArray

    @property
    def force(self) -> FloatArray:
        """Shape (..., 3), N."""
        return self.wrench[..., :3]

    @property
    def moment(self) -> FloatArray:
        """Shape (..., 3), N m, about the point given as ``at``."""
        return self.wrench[..., 3:]

    @property
    def undetermined(self) -> int:
        """Number of independent directions in which the wrench is undetermined, in a stack the most of a sample."""
        return self.directions.shape[-1]

    def __str__(self) -> str:
        if self.wrench.ndim == 2:
            return self._table_of_stack()
        lines = [f"{self.name} on {self.on}"]
        for k, name in enumerate(_COMPONENTS):
            note = what_is_open(bool(self.unique[k]), self.interval[k])
            lines.append(f"{name} {three_digits(float(self.wrench[k])):>10} {'N' if k < 3 else 'N m':4} {note}")
        return "\n".join(lines)

    def _table_of_stack(self) -> str:
        lines = [f"{self.name} on {self.on}, {len(self.wrench)} samples: least, greatest"]
        for k, name in enumerate(_COMPONENTS):
            low, high = (round(float(of(self.wrench[:, k])), 6) + 0.0 for of in (np.nanmin, np.nanmax))
            some = int((~self.unique[:, k]).sum())
            note = f"undetermined in {some}" if some else "unique"
            lines.append(f"{name} {low:14.6f} {high:14.6f} {'N' if k < 3 else 'N m':4} {note}")
        return "\n".join(lines)


def transmitting_part(state: ChainState, name: str) -> Part:
    """A joint or closure that transmits a wrench.

    Raises
    ------
    UnknownName
        If there is none of this name.
    InvalidInput
        If it is a coupling, or a joint and a closure share the name.
    """
    part, joints = state.part(name), state.model.njoints - 1
    if part.place >= joints and state.closures[part.place - joints].polynomial is not None:
        raise InvalidInput(
            f"closure {name!r} is a coupling, which transmits no wrench but a generalised force in each of its joints: "
            "see ClosedForces.coupling"
        )
    return part


def own_frame(equations: EquationsOfMotion, index: int) -> tuple[FloatArray, FloatArray]:
    """Point (3,) and axes (3, 3), as rows, of a joint or closure, by :attr:`Part.place`.

    A joint's are those of its child link; a closure's point is frame b's origin and its axes are those of frame a.
    """
    poses, top, c = equations.poses, equations.state.topology, index - (len(equations.poses) - 1)
    if c < 0:
        return poses[1 + index, 3], poses[1 + index, :3]
    (joint_a, joint_b), (local_a, local_b) = top.joints[c], top.local[c]
    return local_b[3] @ poses[joint_b, :3] + poses[joint_b, 3], local_a[:3] @ poses[joint_a, :3]


def shifted(wrenches: FloatArray, by: FloatArray) -> FloatArray:
    """Wrenches, shape (6, sets), about a point that is ``by``, shape (3,), m, beyond theirs."""
    return np.concatenate([wrenches[:3], wrenches[3:] - pin.skew(by) @ wrenches[:3]])


def turned(wrenches: FloatArray, axes: FloatArray) -> FloatArray:
    """Wrenches in axes that are given as rows, shape (3, 3)."""
    return np.concatenate([axes @ wrenches[:3], axes @ wrenches[3:]])


def expressed(
    equations: EquationsOfMotion,
    name: str,
    columns: FloatArray,
    own: tuple[FloatArray, FloatArray],
    bodies: tuple[int, int],
    on: str | None,
    at: str | ArrayLike,
    in_frame: str,
) -> tuple[FloatArray, str]:
    """A wrench about its own point in world axes, on another body, about another point or in other axes.

    Parameters
    ----------
    name, on, at, in_frame
        As for :meth:`exo_pin.chain.ClosedForces.joint_reaction`.
    columns : ndarray
        Shape (6, sets).
    own : tuple of ndarray
        Its own point and axes, as of :func:`own_frame`.
    bodies : tuple of int
        The body that receives it, and the other one.

    Returns
    -------
    tuple
        The columns, and the name of the body that receives them.
    """
    state, receiver = equations.state, bodies[0]
    if on is not None:
        receiver = state.body_index(on)
        if receiver not in bodies:
            one, other = (state.body_names[body] for body in bodies)
            raise InvalidInput(f"on={on!r} is not a body of {name!r}: expected {one!r} or {other!r}")
        if receiver != bodies[0]:
            columns = -columns
    point, axes = own
    if not isinstance(at, str):
        point = as_finite("at", at, (3,))
    elif at != "origin":
        point = _frame_pose(equations, at, "point or frame", ("origin",))[0]
    if in_frame == "world":
        axes = np.eye(3)
    elif in_frame != "local":
        axes = _frame_pose(equations, in_frame, "frame", ("world", "local"))[1]
    return turned(shifted(columns, point - own[0]), axes), on or state.body_names[receiver]


def _frame_pose(
    equations: EquationsOfMotion, name: str, what: str, others: tuple[str, ...]
) -> tuple[FloatArray, FloatArray]:
    frame = equations.state.model.frames[equations.state.frames.find(what, name, others=others)]
    pose = equations.poses[frame.parentJoint]
    return frame.placement.translation @ pose[:3] + pose[3], frame.placement.rotation.T @ pose[:3]


def on_body(posed: EquationsOfMotion, body: int, sets: int, columns_of: Callable[[int], FloatArray]) -> FloatArray:
    """Total wrench of all joints and closures on a body about its joint's origin, world axes, shape (6, sets).

    ``columns_of`` gives that of a part, by :attr:`Part.place`, about its own point on the body that receives it.
    """
    here, total = posed.poses[body, 3], np.zeros((6, sets))
    for part in posed.state.all_parts:
        # A coupling joins no bodies.
        if part.receiver != part.other and body in (part.receiver, part.other):
            moved = shifted(columns_of(part.place), here - own_frame(posed, part.place)[0])
            total += moved if body == part.receiver else -moved
    return total


class Certified(NamedTuple):
    """Several wrenches with what is unique in them: see :class:`exo_pin.chain.JointReaction`."""

    columns: FloatArray  # (count, 6, 2 + k): the value, what z = 0 adds to it, the change per unit of z
    value: FloatArray  # (count, 6)
    unique: NDArray[np.bool_]  # (count, 6)
    ranges: FloatArray  # (count, 6, 2), without bounds
    basis: FloatArray  # (count, 6, min(6, k)), orthonormal in the metric, not scaled; zero beyond those that count
    counts: NDArray[np.int64]  # (count,), how many of the basis count

    def __reduce__(self) -> tuple[Any, ...]:
        return reduced_tuple(self)


def certified(columns: FloatArray, length: float, sharpness: float) -> Certified:
    """Values and certificates of several wrenches.

    Parameters
    ----------
    columns : ndarray
        Shape (count, 6, 2 + k): the value, what z = 0 adds to it, and the change per unit of z.
    length : float
        Characteristic length, m, by which moments are divided.
    sharpness : float
        The share of a self-stress that is rounding.
    """
    columns = np.ascontiguousarray(columns)
    unique, basis, counts = _certificates(columns, length, sharpness)
    value = columns[:, :, 0].copy()
    ranges = np.stack([value, value], axis=-1)
    ranges[~unique] = -np.inf, np.inf
    return Certified(columns, frozen(value), frozen(unique), frozen(ranges), basis, counts)


@kernel(stack=True)
def _certificates(columns: Any, length: float, sharpness: float) -> Any:
    """Which components are unique, and the directions in which the wrenches may change, with their number."""
    count, free = len(columns), columns.shape[2] - 2
    unique, counts = np.ones((count, 6), dtype=np.bool_), np.zeros(count, dtype=np.int64)
    basis, A = np.zeros((count, 6, min(6, free))), np.empty((6, free))
    for s in range(count):
        total = 0.0
        for i in range(6):
            unit = 1.0 if i < 3 else 1.0 / length
            for k in range(free):
                A[i, k] = columns[s, i, 2 + k] * unit
                total += A[i, k] * A[i, k]
                if not abs(A[i, k]) <= sharpness:
                    unique[s, i] = False
        # The largest singular value is not above the root of the sum of squares.
        if not total > sharpness * sharpness:
            continue
        U, sizes, _ = np.linalg.svd(A, False)
        for k in range(len(sizes)):
            if sizes[k] > sharpness:
                counts[s] += 1
                for i in range(6):
                    basis[s, i, k] = U[i, k] if i < 3 else U[i, k] * length
    return unique, basis, counts


def what_is_open(unique: bool, interval: ArrayLike) -> str:
    """What equilibrium leaves open of a force within an interval, in words."""
    if unique:
        return "unique"
    low, high = (float(bound) for bound in np.asarray(interval))
    if np.isinf([low, high]).all():
        return "here; undetermined, equilibrium alone allows any number"
    return f"here; undetermined, from {three_digits(low)} to {three_digits(high)}"
