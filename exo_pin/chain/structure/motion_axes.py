"""Coordinates of the joints of a model: motion subspaces, units, limits, and what each coordinate moves.

The same tree with joints whose axes are constant in their own frame, for what Pinocchio computes only of those.

Pinocchio's time variation of the joint Jacobian and its derivatives of RNEA leave out the change of a joint's motion
subspace S with q. It changes for composite, universal and SphericalZYX joints, which are sequences of simpler joints:
written as such, with massless bodies in between, they have the same q, v and world Jacobian, and S is constant. The
ellipsoid joint cannot be written so. Its rate of S follows from what Pinocchio gives, the bias c(q, v) = Ṡ(v) v, and
from the Maurer-Cartan equation Ṡ(u) w - Ṡ(w) u = -(S u) × (S w), which holds because its v is the rate of q::

    Ṡ(u) w = (c(u + w) - c(u) - c(w) - (S u) × (S w)) / 2
"""

from __future__ import annotations

from collections.abc import Iterable, Iterator
from dataclasses import dataclass
from typing import Any, NamedTuple

import numpy as np
import pinocchio as pin
from numpy.typing import NDArray
from scipy.spatial.distance import pdist

from ...core.compiled import kernel
from ...core.errors import InvalidInput
from ...core.records import Record, keeps_read_only
from ...core.validation import FloatArray, frozen

#: Joints whose motion subspace changes with q and that are a sequence of others.
_SEQUENCES = ("JointModelComposite", "JointModelUniversal", "JointModelSphericalZYX")
_ELLIPSOID = "JointModelEllipsoid"


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


def moving_coordinates(model: pin.Model) -> FloatArray:
    """Shape (njoints, nv): 1 for coordinates that move the joint's body."""
    moved = np.zeros((model.njoints, model.nv))
    for joint in range(1, model.njoints):
        moved[joint] = moved[model.parents[joint]]
        moved[joint, v_slice(model, joint)] = 1.0
    return moved


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


def has_constant_axes(model: pin.Model, joint: int) -> bool:
    """Whether a joint's motion subspace is constant in the joint's own frame."""
    steps = [kind for _, kind in _steps(model.joints[joint])]
    return len(steps) == 1 and steps[0].shortname() != _ELLIPSOID


def _steps(joint: Any) -> Iterator[tuple[pin.SE3, Any]]:
    """The simpler joints that a joint is a sequence of, each with its placement in the frame of the one before."""
    name = joint.shortname()
    inner = joint.extract() if isinstance(joint, pin.JointModel) else joint
    if name == "JointModelComposite":
        for place, part in zip(inner.jointPlacements, inner.joints, strict=True):
            steps = list(_steps(part))
            yield place * steps[0][0], steps[0][1]
            yield from steps[1:]
    elif name == "JointModelUniversal":
        for axis in (inner.axis1, inner.axis2):
            yield pin.SE3.Identity(), pin.JointModelRevoluteUnaligned(np.array(axis))
    elif name == "JointModelSphericalZYX":
        for kind in (pin.JointModelRZ, pin.JointModelRY, pin.JointModelRX):
            yield pin.SE3.Identity(), kind()
    else:
        yield pin.SE3.Identity(), inner


@kernel
def symmetric(lower: Any) -> Any:
    """The symmetric matrix with this lower half, in an array of its own."""
    whole = np.empty(lower.shape)
    for i in range(len(lower)):
        for k in range(i + 1):
            whole[i, k] = whole[k, i] = lower[i, k]
    return whole


class ConstantAxes(Record):
    """A model whose joints, ellipsoids apart, have constant axes, with the same q and v as another.

    Attributes
    ----------
    model : pinocchio.Model
        The other model itself where its joints are like that already.
    differs : bool
        Whether it is not.
    ellipsoids : tuple of int
        Its ellipsoid joints.
    tree : tuple of ndarray
        For the kernels: the parent of each of its joints, the joint of each coordinate, and the joint that carries the
        body of each joint of the other model.
    """

    def __init__(self, model: pin.Model) -> None:
        self._given = model
        names = [model.joints[joint].shortname() for joint in range(model.njoints)]
        self.differs = any(name in _SEQUENCES for name in names)
        self._carriers = list(range(model.njoints))
        self.model = self._expanded() if self.differs else model
        self.ellipsoids = tuple(
            joint for joint in range(1, self.model.njoints) if self.model.joints[joint].shortname() == _ELLIPSOID
        )

        owners = np.repeat(np.arange(self.model.njoints), list(self.model.nvs))
        self.tree = tuple(
            frozen(np.array(part, dtype=np.int64)) for part in (self.model.parents, owners, self._carriers)
        )

    def _expanded(self) -> pin.Model:
        given, new = self._given, pin.Model()
        for joint in range(1, given.njoints):
            carrier, place = self._carriers[given.parents[joint]], given.jointPlacements[joint]
            for k, (between, kind) in enumerate(_steps(given.joints[joint])):
                name = given.names[joint] if k == 0 else f"{given.names[joint]}/{k}"
                carrier = new.addJoint(carrier, kind, place * between, name)
                place = pin.SE3.Identity()
            self._carriers[joint] = carrier
        for frame in list(given.frames)[1:]:
            carrier = self._carriers[frame.parentJoint]
            new.addFrame(pin.Frame(frame.name, carrier, 0, frame.placement, frame.type), False)
        return new

    def follow(self) -> None:
        """Take over gravity, masses and armatures of the given model, which may have changed."""
        if not self.differs:
            return
        self.model.gravity = self._given.gravity
        self.model.armature = self._given.armature
        for joint in range(1, self._given.njoints):
            self.model.inertias[self._carriers[joint]] = self._given.inertias[joint]

    def jacobian_rate(self, data: pin.Data, q: FloatArray, v: FloatArray) -> None:
        """Fill ``data.J`` and ``data.dJ``, the world Jacobian and its rate, shape (6, nv); data is the model's."""
        pin.computeJointJacobiansTimeVariation(self.model, data, q, v)
        for joint in self.ellipsoids:
            self._add_subspace_rate(data, joint, q, v)

    def _add_subspace_rate(self, data: pin.Data, joint: int, q: FloatArray, v: FloatArray) -> None:
        """Add the ellipsoid's Ṡ, turned into world axes about the world's origin, to its columns of ``data.dJ``."""
        kind, columns = self.model.joints[joint], v_slice(self.model, joint)
        local = kind.createData()

        def bias(motion: FloatArray) -> FloatArray:
            whole = np.zeros(self.model.nv)
            whole[columns] = motion
            kind.calc(local, q, whole)
            return np.array(local.c.vector)

        own = np.asarray(v[columns])
        steady = bias(own)
        subspace = np.array(local.S)
        moving = pin.Motion(subspace @ own)
        for k, unit in enumerate(np.eye(len(own))):
            turned = moving.cross(pin.Motion(subspace[:, k])).vector
            rate = (bias(own + unit) - steady - bias(unit) - turned) / 2.0
            data.dJ[:, columns.start + k] += data.oMi[joint].act(pin.Motion(rate)).vector

    def rnea_derivatives(self, data: pin.Data, q: FloatArray, v: FloatArray, a: FloatArray) -> None:
        """Fill the derivatives of the generalised forces with respect to q, v and a; data is the model's.

        Raises
        ------
        InvalidInput
            If the tree has an ellipsoid joint, whose derivatives Pinocchio gets wrong.
        """
        if self.ellipsoids:
            names = ", ".join(self.model.names[joint] for joint in self.ellipsoids)
            raise InvalidInput(
                f"no derivatives of forces for ellipsoid joints ({names}), because Pinocchio has none: expected other "
                "joints, use differences of inverse_dynamics"
            )
        self.follow()
        pin.computeRNEADerivatives(self.model, data, q, v, a)
