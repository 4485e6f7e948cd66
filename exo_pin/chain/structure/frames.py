"""Frames of a tree by name, placements in them, and the trees whose frames and masses Pinocchio cannot use."""

from __future__ import annotations

from collections import Counter
from collections.abc import Iterable
from dataclasses import dataclass
from typing import Any

import numpy as np
import pinocchio as pin

from ...core.errors import InvalidInput, UnknownName
from ...core.validation import as_finite

#: Joints whose motion subspace changes with q: Pinocchio's rates of Jacobians and derivatives of forces leave that out.
_TURNING = ("JointModelComposite", "JointModelUniversal", "JointModelSphericalZYX", "JointModelEllipsoid")


def require_name(what: str, value: Any) -> None:
    """Raise InvalidInput unless a value is a name, a string that is not empty."""
    if not isinstance(value, str) or not value:
        raise InvalidInput(f"expected {what} to be a name, got {value!r}")


@dataclass(frozen=True)
class Placement:
    """Pose of a closure's frame in the frame that carries it.

    Attributes
    ----------
    translation : tuple of float
        (x, y, z), m.
    quaternion : tuple of float
        (x, y, z, w), of length 1 to 1e-9.

    Examples
    --------
    >>> from exo_pin.chain import Placement
    >>> Placement((0.0, 0.0, 0.3)).quaternion  # 0.3 m along z, not turned
    (0.0, 0.0, 0.0, 1.0)
    """

    translation: tuple[float, float, float] = (0.0, 0.0, 0.0)
    quaternion: tuple[float, float, float, float] = (0.0, 0.0, 0.0, 1.0)

    def __post_init__(self) -> None:
        for name, count in (("translation", 3), ("quaternion", 4)):
            values = as_finite(name, getattr(self, name), (count,))
            object.__setattr__(self, name, tuple(values.tolist()))
        norm = float(np.linalg.norm(self.quaternion))
        if abs(norm - 1.0) > 1e-9:
            raise InvalidInput(f"expected a unit quaternion, got {self.quaternion} of length {norm:.12g}")


def se3(placement: Placement) -> pin.SE3:
    """A placement as Pinocchio's."""
    quaternion = pin.Quaternion(np.array(placement.quaternion)).normalized()
    return pin.SE3(quaternion, np.array(placement.translation))


def placement_of(pose: pin.SE3) -> Placement:
    """The opposite of :func:`se3`."""
    quaternion = np.asarray(pin.Quaternion(pose.rotation).normalized().coeffs())
    return Placement(tuple(pose.translation.tolist()), tuple(quaternion.tolist()))


class FrameTable(dict[str, int]):
    """Frame index by name.

    A link and its joint may share a name: they share their frame too. A link and a joint that share a name in different
    places, as a URDF may have them, are two frames: neither has an index, and :meth:`find` refuses their name.
    """

    def __init__(self, model: pin.Model) -> None:
        super().__init__()
        self._shared = set()
        for index, frame in enumerate(model.frames):
            other = model.frames[self.setdefault(frame.name, index)]
            if frame.parentJoint != other.parentJoint or not frame.placement.isApprox(other.placement, 1e-12):
                self._shared.add(frame.name)
        for name in self._shared:
            del self[name]

    def find(self, what: str, name: object, where: str = "", others: Iterable[str] = ()) -> int:
        """Index of a frame.

        Raises
        ------
        UnknownName
            If there is no such frame; ``what`` it is, ``where`` it is named and ``others`` beside it are for the text.
        InvalidInput
            If two frames have this name.
        """
        if isinstance(name, str) and name in self:
            return self[name]
        if isinstance(name, str) and name in self._shared:
            place = f" in {where}" if where else ""
            raise InvalidInput(f"two frames in different places have the name {name!r}{place}: rename one of them")
        raise UnknownName(what, name, (*others, *self), where)


def body_names(model: pin.Model) -> tuple[str, ...]:
    """Of every body the first link's name, else its joint's."""
    names = [str(name) for name in model.names]
    for frame in reversed(list(model.frames)):
        if frame.type == pin.FrameType.BODY and frame.parentJoint:
            names[frame.parentJoint] = frame.name
    return tuple(names)


def refuse_model(model: pin.Model) -> None:
    """Raise if Pinocchio's algorithms do not hold for a tree.

    Raises
    ------
    InvalidInput
        If two joints have one name, they are not numbered depth first, there are mimic joints, or a mass or inertia is
        none.
    """
    twice = next((name for name, number in Counter(model.names).items() if number > 1), None)
    if twice is not None:
        raise InvalidInput(f"two joints have the name {twice!r}: expected a name of its own for every joint")
    for joint in range(2, model.njoints):
        parent, before = model.parents[joint], joint - 1
        while before > parent:
            before = model.parents[before]
        if before != parent:
            raise InvalidInput(
                f"joint {model.names[joint]!r} hangs on {model.names[parent]!r} but is numbered after "
                f"{model.names[joint - 1]!r}, which does not: Pinocchio's mass matrix needs joints that are added "
                "depth first, each subtree before the next one begins"
            )
    turning = [model.names[k] for k in range(1, model.njoints) if model.joints[k].shortname() in _TURNING]
    if turning:
        raise InvalidInput(
            f"the axes of {', '.join(turning)} change in the joint's own frame: expected a sequence of simpler joints, "
            "with bodies without mass between them"
        )
    mimics = [model.names[joint] for joint in model.mimicking_joints]
    if mimics:
        raise InvalidInput(f"mimic joints ({', '.join(mimics)}) are not supported: state the coupling as a closure")
    for joint in range(1, model.njoints):
        inertia = model.inertias[joint]
        tensor = np.asarray(inertia.inertia)
        numbers = np.concatenate([[inertia.mass], np.asarray(inertia.lever), tensor.ravel()])
        if not np.isfinite(numbers).all() or inertia.mass < 0.0:
            raise InvalidInput(
                f"the body of joint {model.names[joint]!r} has mass {inertia.mass} and inertia {tensor}: expected "
                "finite numbers and a mass of zero or more"
            )
