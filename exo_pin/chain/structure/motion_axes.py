"""Coordinates of the joints of a model: motion subspaces, units, limits, and what each coordinate moves."""

from __future__ import annotations

from collections.abc import Iterable
from dataclasses import dataclass
from typing import Any, NamedTuple

import numpy as np
import pinocchio as pin
from numpy.typing import NDArray
from scipy.spatial.distance import pdist

from ...core.compiled import kernel
from ...core.errors import InvalidInput
from ...core.records import keeps_read_only
from ...core.validation import FloatArray


def q_slice(model: pin.Model, joint: int) -> slice:
    """Indices of a joint's coordinates in q."""
    return slice(model.idx_qs[joint], model.idx_qs[joint] + model.nqs[joint])


def v_slice(model: pin.Model, joint: int) -> slice:
    """Indices of a joint's coordinates in v."""
    return slice(model.idx_vs[joint], model.idx_vs[joint] + model.nvs[joint])


def motion_axes(model: pin.Model) -> list[FloatArray]:
    """Motion subspace of every joint at rest, shape (6, nv) each, linear part first, in the joint's frame."""
    rest = pin.neutral(model)
    return [np.zeros((6, 0)), *(_subspace(joint, rest) for joint in list(model.joints)[1:])]


def unit_of(model: pin.Model, joint: int) -> str | None:
    """Unit of a joint's coordinates, "m" or "rad"; None for a joint that moves in both, and for the world."""
    if joint == 0:
        return None
    subspace = _subspace(model.joints[joint], pin.neutral(model))
    linear, angular = bool(subspace[:3].any()), bool(subspace[3:].any())
    return None if linear == angular else "m" if linear else "rad"


def _subspace(joint: pin.JointModel, q: FloatArray) -> FloatArray:
    data = joint.createData()
    joint.calc(data, q)
    return np.array(data.S, dtype=np.float64).reshape(6, -1)


def in_metres(model: pin.Model) -> NDArray[np.bool_]:
    """Shape (nv,): which coordinates are in metres, the translations: those that turn nothing."""
    return np.asarray(np.linalg.norm(np.hstack(motion_axes(model))[3:], axis=0) < 1e-9)


def carried_joints(model: pin.Model) -> FloatArray:
    """Shape (njoints, njoints): 1 in row j and column k where joint k hangs on joint j, or is it."""
    outward = np.eye(model.njoints)
    for joint in range(model.njoints - 1, 0, -1):
        outward[model.parents[joint]] += outward[joint]
    return outward


def characteristic_length(model: pin.Model, joints: NDArray[np.int64], local: FloatArray) -> float:
    """Root mean square distance between the joints and closures of each body; a free flight is no joint."""
    points: list[list[FloatArray]] = [[] for _ in range(model.njoints)]
    for joint in range(1, model.njoints):
        if model.nvs[joint] < 6:
            points[joint].append(np.zeros(3))
            points[model.parents[joint]].append(model.jointPlacements[joint].translation)
    joined = joints[:, 0] != joints[:, 1]  # not those of couplings
    for bodies, places in zip(joints[joined], local[joined], strict=True):
        for body, place in zip(bodies, places, strict=True):
            points[body].append(place[3])
    pairs = [pdist(np.array(group)) for group in points if len(group) > 1]
    lengths = np.concatenate([np.array([]), *pairs])
    lengths = lengths[lengths > 1e-9]
    return float(np.sqrt(np.mean(lengths**2))) if lengths.size else 1.0


@dataclass(frozen=True, eq=False)
class Limits:
    """Limits of k coordinates that are angles or lengths.

    Attributes
    ----------
    joints : tuple of str
        The joint of each.
    q_index, v_index : ndarray of int
        Shape (k,), their indices in q and v.
    lower, upper : ndarray
        Shape (k,), rad or m.
    """

    joints: tuple[str, ...]
    q_index: NDArray[np.int64]
    v_index: NDArray[np.int64]
    lower: FloatArray
    upper: FloatArray

    def holds(self, q: FloatArray) -> bool:
        """Whether q is within all limits."""
        here = q[self.q_index]
        return bool(((self.lower <= here) & (here <= self.upper)).all())

    def clipped(self, q: FloatArray, weight: FloatArray) -> FloatArray:
        """q with the coordinates that may move (weight, shape (nv,), above zero) put within their limits."""
        q = q.copy()
        inside = np.clip(q[self.q_index], self.lower, self.upper)
        q[self.q_index] = np.where(weight[self.v_index] > 0.0, inside, q[self.q_index])
        return q


def limits_of(model: pin.Model) -> Limits:
    """The limits of a model's joints whose configuration is a vector."""
    lower, upper = np.asarray(model.lowerPositionLimit), np.asarray(model.upperPositionLimit)
    limited = np.isfinite(lower) | np.isfinite(upper)
    found = [
        (model.names[joint], model.idx_qs[joint] + k, model.idx_vs[joint] + k)
        for joint in range(1, model.njoints)
        # Quaternions and cosine-sine pairs have more coordinates than velocities.
        if model.nqs[joint] == model.nvs[joint]
        for k in range(model.nqs[joint])
        if limited[model.idx_qs[joint] + k]
    ]
    q_index, v_index = (np.array([place[part] for place in found], dtype=np.int64) for part in (1, 2))
    return Limits(tuple(name for name, _, _ in found), q_index, v_index, lower[q_index], upper[q_index])


def has_ends(limits: Limits) -> NDArray[np.bool_]:
    """Which of some limits end a motion, shape (k,).

    A hinge that may turn all the way round has no end; files write -π to π for it.
    """
    with np.errstate(over="ignore"):  # Pinocchio's joints without limits have the largest numbers there are
        room = limits.upper - limits.lower
    return np.asarray((room < 2.0 * np.pi * (1.0 - 1e-9)) | (np.isfinite(limits.lower) != np.isfinite(limits.upper)))


@keeps_read_only
class ActuatedCoordinates(NamedTuple):
    """Indices in v.

    Attributes
    ----------
    driven, passive : ndarray of int
        Of the coordinates that carry an actuator, in the order of their joints, and of the others.
    """

    driven: np.ndarray
    passive: np.ndarray


def joint_names(joints: Iterable[str]) -> tuple[str, ...]:
    """Names of joints, of which one may stand alone."""
    if not isinstance(joints, Iterable):
        raise InvalidInput(f"expected names of joints, got {joints!r}")
    return (joints,) if isinstance(joints, str) else tuple(joints)


@kernel
def symmetric(lower: Any) -> Any:
    """The symmetric matrix with this lower half, in an array of its own."""
    whole = np.empty(lower.shape)
    for i in range(len(lower)):
        for k in range(i + 1):
            whole[i, k] = whole[k, i] = lower[i, k]
    return whole
