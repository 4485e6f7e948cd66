"""The same tree with joints whose axes are constant in their own frame, for what Pinocchio computes only of those.

Pinocchio's time variation of the joint Jacobian and its derivatives of RNEA leave out the change of a joint's motion
subspace S with q. It changes for composite, universal and SphericalZYX joints, which are sequences of simpler joints:
written as such, with massless bodies in between, they have the same q, v and world Jacobian, and S is constant. The
ellipsoid joint cannot be written so. Its rate of S follows from what Pinocchio gives, the bias c(q, v) = Ṡ(v) v, and
from the Maurer-Cartan equation Ṡ(u) w - Ṡ(w) u = -(S u) × (S w), which holds because its v is the rate of q::

    Ṡ(u) w = (c(u + w) - c(u) - c(w) - (S u) × (S w)) / 2
"""

from __future__ import annotations

from collections.abc import Iterator
from typing import Any

import numpy as np
import pinocchio as pin

from ...core.compiled import kernel
from ...core.errors import InvalidInput
from ...core.records import Record
from ...core.validation import FloatArray, frozen
from .motion_axes import v_slice

#: Joints whose motion subspace changes with q and that are a sequence of others.
_SEQUENCES = ("JointModelComposite", "JointModelUniversal", "JointModelSphericalZYX")
_ELLIPSOID = "JointModelEllipsoid"


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
