"""Data of a joint besides its motion: damping, dry friction, armature, limits and a spring, for readers and writers.

Damping, friction and limits are the Pinocchio model's; springs are the closures file's; an armature is put from the
closures file into the model. A limit of 1e300 or more, of either sign, means that there is no limit: URDF has no
infinity, and Pinocchio uses the largest double.
"""

from __future__ import annotations

from collections.abc import Iterable, Mapping
from dataclasses import dataclass

import numpy as np
import pinocchio as pin
from numpy.typing import ArrayLike

from ...core.errors import InvalidInput
from ...core.validation import FloatArray
from ..structure.description import JointProperties
from ..structure.motion_axes import q_slice, unit_of, v_slice
from ..structure.passive import find_joint

#: Written where there is no limit: the largest double.
NO_LIMIT = float(np.finfo(np.float64).max)
_NO_LIMIT_FROM = 1e300
#: Pinocchio's own limits of quaternions and cosine-sine pairs, which limit nothing.
_BEYOND_UNIT = 1.01
#: What Pinocchio's model calls the data of joints; where there are two names, the second has the other sign.
FIELDS = {
    "damping": ("damping",), "friction": ("upperDryFrictionLimit", "lowerDryFrictionLimit"), "armature": ("armature",),
    "lower_effort": ("lowerEffortLimit",), "upper_effort": ("upperEffortLimit",),
    "speed": ("upperVelocityLimit", "lowerVelocityLimit"),
    "lower_position": ("lowerPositionLimit",), "upper_position": ("upperPositionLimit",),
}  # fmt: skip


@dataclass(frozen=True, eq=False)
class JointData:
    """One joint's data, SI units; m or rad by the joint's coordinates.

    Attributes
    ----------
    unit : {"m", "rad"} or None
        Of the joint's coordinates; None for a joint with both.
    damping, friction, armature : ndarray
        Shape (nv of the joint,): N s/m or N m s/rad; largest dry friction, N or N m; kg or kg m².
    effort, velocity : ndarray
        Shape (nv of the joint, 2), lower and upper limits, N or N m, and m/s or rad/s; infinite where there is none.
    position : ndarray
        Shape (nq of the joint, 2), m or rad; infinite where there is none, as of an endless hinge.
    stiffness : float
        Of the spring, N/m or N m/rad.
    reference : ndarray or None
        Shape (nq of the joint,), where the spring is slack; None for the joint's neutral configuration.
    """

    unit: str | None
    damping: FloatArray
    friction: FloatArray
    armature: FloatArray
    effort: FloatArray
    velocity: FloatArray
    position: FloatArray
    stiffness: float
    reference: FloatArray | None

    @property
    def present(self) -> tuple[str, ...]:
        """Names of the data that are not zero and of the limits, for messages."""
        there = {
            "damping": self.damping.any(),
            "friction": self.friction.any(),
            "armature": self.armature.any(),
            "spring": self.stiffness != 0.0,
            "effort limits": np.isfinite(self.effort).any(),
            "velocity limits": np.isfinite(self.velocity).any(),
            "position limits": np.isfinite(self.position).any(),
        }
        return tuple(name for name, is_there in there.items() if is_there)

    def ends(self, k: int) -> FloatArray:
        """Lower and upper limit of the k-th coordinate; none of an endless hinge, whose cosine is no angle."""
        return np.array([-np.inf, np.inf]) if len(self.position) > len(self.damping) else self.position[k]

    def rest(self, k: int) -> float:
        """The k-th coordinate, a hinge's or slide's, where the spring is slack, rad or m; an endless hinge has none."""
        return 0.0 if self.reference is None else float(self.reference[k])

    def symmetric(self, which: str, joint: str, file_format: str, larger: bool = False) -> float:
        """The one number for "effort" or "velocity" limits of a hinge or slide, infinite if there is none.

        With ``larger`` it is the larger of two limits that differ.

        Raises
        ------
        InvalidInput
            If the lower limit is not the upper one's opposite, which the file format has no place for.
        """
        lower, upper = (float(value) for value in getattr(self, which)[0])
        if larger:
            return max(-lower, upper)
        if lower != -upper:
            raise InvalidInput(
                f"{file_format} has one {which} limit for both directions; joint {joint!r} has {lower:g} and {upper:g}"
            )
        return upper


def joint_data(model: pin.Model, properties: Iterable[JointProperties]) -> list[JointData]:
    """The data of all joints, by joint index; index 0 is the world's and empty.

    Raises
    ------
    InvalidInput
        If a joint's friction is not the same in both directions, or it has a rotor inertia of Pinocchio's (an
        armature is what is read).
    """
    springs = {item.joint: item for item in properties}
    found = []
    for index in range(model.njoints):
        name = model.names[index]
        q, v = q_slice(model, index), v_slice(model, index)
        friction = np.array(model.upperDryFrictionLimit[v])
        if not np.array_equal(friction, -np.asarray(model.lowerDryFrictionLimit[v])):
            raise InvalidInput(f"joint {name!r}: expected a friction that is the same in both directions")
        if np.asarray(model.rotorInertia[v]).any():
            raise InvalidInput(f"joint {name!r}: expected the rotor's inertia as armature, not as rotorInertia")
        spring, position = springs.get(name), _limits(model, "Position", q)
        if model.nqs[index] != model.nvs[index]:
            position[np.abs(position) == _BEYOND_UNIT] *= np.inf
        found.append(
            JointData(
                unit_of(model, index),
                np.array(model.damping[v]),
                friction,
                np.array(model.armature[v]),
                _limits(model, "Effort", v),
                _limits(model, "Velocity", v),
                position,
                0.0 if spring is None else spring.stiffness,
                None if spring is None or spring.spring_reference is None else np.array(spring.spring_reference),
            )
        )
    return found


def refuse_data(file_format: str, joint: str, what: Iterable[str]) -> None:
    """Raise InvalidInput if there is anything that a file format cannot hold of a joint."""
    names = " and ".join(what)
    if names:
        raise InvalidInput(f"{file_format} cannot hold the {names} of joint {joint!r}: set it to zero, or to no limit")


def repair_limits(model: pin.Model) -> None:
    """Make limits infinite that mean no limit, and lower limits of velocity negative.

    Pinocchio 4.1 reads ``velocity="4"`` of a URDF as limits of 4 to 4 rad/s.
    """
    model.lowerVelocityLimit[:] = -np.abs(model.upperVelocityLimit)
    for key in ("Position", "Velocity", "Effort"):
        for side in ("lower", "upper"):
            limit = getattr(model, f"{side}{key}Limit")
            limit[:] = _endless(limit)


def apply_joint_properties(model: pin.Model, properties: Iterable[JointProperties]) -> None:
    """Check the data of joints against the model, and put the armatures into it.

    Raises
    ------
    UnknownName, InvalidInput
        As :func:`exo_pin.chain.structure.passive.find_joint`.
    """
    for item in properties:
        own = v_slice(model, find_joint(model, item))
        if item.armature is not None:
            model.armature[own] = item.armature


def part_of(model: pin.Model, joint: int, key: str) -> slice:
    """Indices of a joint's data in a field of :data:`FIELDS`: positions are by the coordinates of q."""
    return (q_slice if "Position" in key else v_slice)(model, joint)


def put_data(model: pin.Model, joint: int, data: Mapping[str, ArrayLike]) -> None:
    """Put data of a joint, by the names of :data:`FIELDS`, into its model."""
    for key, values in data.items():
        for sign, field in zip((1.0, -1.0), FIELDS[key], strict=False):
            getattr(model, field)[part_of(model, joint, field)] = np.multiply(sign, values)


def _limits(model: pin.Model, key: str, part: slice) -> FloatArray:
    lower, upper = (_endless(getattr(model, f"{side}{key}Limit")[part]) for side in ("lower", "upper"))
    if key == "Velocity":
        # See repair_limits: a model that was read elsewhere has the upper limits twice.
        lower = np.where(lower == upper, -upper, lower)
    return np.stack([lower, upper], axis=1)


def _endless(limit: FloatArray) -> FloatArray:
    values = np.array(limit, dtype=np.float64)
    return np.where(np.abs(values) >= _NO_LIMIT_FROM, np.copysign(np.inf, values), values)
