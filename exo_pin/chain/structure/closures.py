"""What a URDF cannot say, as data: what closes its loops, how its root hangs, what its parts are for, its springs."""

from __future__ import annotations

from dataclasses import dataclass, field
from typing import Any

import numpy as np
from numpy.typing import ArrayLike
from scipy.spatial.transform import Rotation

from ...core.conventions import GRAVITY
from ...core.errors import InvalidInput, UnknownName
from ...core.validation import as_finite, as_positive, as_unit_vector
from ..kinematics.projection import CODES

__all__ = [
    "ROOT_JOINTS",
    "TYPES",
    "Closure",
    "ClosureType",
    "Closures",
    "JointProperties",
    "LimbRole",
    "Placement",
    "Roles",
    "Root",
]

#: How the root link can hang in the world. A hinged root is a joint of the URDF itself.
ROOT_JOINTS = ("fixed", "spherical", "free_flyer", "planar", "translation")


@dataclass(frozen=True)
class ClosureType:
    """A kind of closure.

    Attributes
    ----------
    name : str
        As in the file.
    translations, rotations : int
        Number of constraint rows in metres, which come first, and in radians: what the closure forbids of the motion
        of frame a against frame b.
    has_axis : bool
        Whether it turns or slides about an axis that can be stated.
    """

    name: str
    translations: int
    rotations: int
    has_axis: bool = False

    @property
    def code(self) -> int:
        """Number by which the compiled functions know it."""
        return CODES[self.name]

    @property
    def rows(self) -> int:
        """Number of constraint rows."""
        return self.translations + self.rotations


_ALL_TYPES = (
    ClosureType("rigid", 3, 3),
    ClosureType("spherical", 3, 0),
    ClosureType("revolute", 3, 2, has_axis=True),
    ClosureType("universal", 3, 1),
    ClosureType("prismatic", 2, 3, has_axis=True),
    ClosureType("cylindrical", 2, 2, has_axis=True),
    ClosureType("distance", 1, 0),
)

#: The closure types by name; "point" is another name for "spherical".
TYPES: dict[str, ClosureType] = {kind.name: kind for kind in _ALL_TYPES} | {"point": _ALL_TYPES[1]}

#: Swaps x and y, and turns z around: the frames of a universal closure seen from its other side.
_SWAP = np.array([0.5**0.5, 0.5**0.5, 0.0, 0.0])


@dataclass(frozen=True)
class Placement:
    """Where a closure's frame stands in the frame that carries it.

    Attributes
    ----------
    translation : tuple of float
        (x, y, z), m.
    quaternion : tuple of float
        (x, y, z, w), of length 1 to 1e-9.
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

    def turned(self, quaternion: ArrayLike) -> Placement:
        """The placement with its frame turned in itself by a unit quaternion (x, y, z, w)."""
        turned = Rotation.from_quat(self.quaternion) * Rotation.from_quat(np.array(quaternion))
        return Placement(self.translation, tuple(turned.as_quat().tolist()))


@dataclass(frozen=True)
class Closure:
    """One loop closure between two frames.

    Attributes
    ----------
    name : str
        Unique among the closures.
    type : str
        Name in :data:`TYPES`; an alias is stored under its own name.
    frame_a, frame_b : str
        Frames (links or joints) of the URDF, or "universe".
    placement_a, placement_b : Placement
        Of the closure's frame in ``frame_a`` and ``frame_b``.
    axis : tuple of float or None
        Direction about (along) which a revolute, prismatic or cylindrical closure turns (slides), in the closure's
        frame, of length 1; by default its z axis. A universal closure turns about the y axis of frame b and the x
        axis of frame a.
    distance : float or None
        What a distance closure keeps between the origins of its two frames, m; other types have none.

    Raises
    ------
    UnknownName
        If there is no such closure type.
    InvalidInput
        If an axis or a distance is given to a type that has none, or a distance closure has no distance.
    """

    name: str
    type: str
    frame_a: str
    frame_b: str
    placement_a: Placement = field(default_factory=Placement)
    placement_b: Placement = field(default_factory=Placement)
    axis: tuple[float, float, float] | None = None
    distance: float | None = None

    def __post_init__(self) -> None:
        for key in ("name", "type", "frame_a", "frame_b"):
            _require_name(f"closure {key}", getattr(self, key))
        if self.type not in TYPES:
            raise UnknownName("closure type", self.type, TYPES, where=f"closure {self.name!r}")
        kind = TYPES[self.type]
        object.__setattr__(self, "type", kind.name)
        if self.axis is not None:
            if not kind.has_axis:
                having = ", ".join(name for name, other in TYPES.items() if other.has_axis)
                raise InvalidInput(f"closure {self.name!r}: a {kind.name} closure has no axis, only {having} have")
            axis = as_finite(f"axis of closure {self.name!r}", self.axis, (3,))
            if abs(float(np.linalg.norm(axis)) - 1.0) > 1e-12:
                # An axis of length 1 is kept as it is, so that a file loads back bit for bit.
                axis = as_unit_vector(f"axis of closure {self.name!r}", axis)
            object.__setattr__(self, "axis", tuple(axis.tolist()))
        if (self.distance is None) != (kind.name != "distance"):
            raise InvalidInput(
                f"closure {self.name!r}: expected a distance for a distance closure and for no other, "
                f"got {self.distance} for type {kind.name!r}"
            )
        if self.distance is not None:
            object.__setattr__(self, "distance", as_positive(f"distance of closure {self.name!r}", self.distance))

    def reversed(self) -> Closure:
        """The same closure with a and b exchanged: what it allows is the same, its rows are told by the other body."""
        a, b = self.placement_a, self.placement_b
        if self.type == "universal":
            a, b = a.turned(_SWAP), b.turned(_SWAP)
        return Closure(self.name, self.type, self.frame_b, self.frame_a, b, a, self.axis, self.distance)

    @property
    def rows(self) -> int:
        """Number of constraint rows."""
        return TYPES[self.type].rows


@dataclass(frozen=True)
class Root:
    """How the root link of the URDF hangs in the world.

    Attributes
    ----------
    joint : str
        One of :data:`ROOT_JOINTS`.
    name : str
        Name of that joint in the model; unused for "fixed".
    gravity : tuple of float
        (x, y, z), m/s², world frame.
    """

    joint: str = "fixed"
    name: str = "root_joint"
    gravity: tuple[float, float, float] = tuple(GRAVITY.tolist())

    def __post_init__(self) -> None:
        if self.joint not in ROOT_JOINTS:
            raise UnknownName("root joint", self.joint, ROOT_JOINTS)
        _require_name("root name", self.name)
        object.__setattr__(self, "gravity", tuple(as_finite("gravity", self.gravity, (3,)).tolist()))


@dataclass(frozen=True)
class JointProperties:
    """What a URDF cannot say about a joint.

    Attributes
    ----------
    joint : str
        A joint of the model.
    stiffness : float
        Of the spring in the joint, N/m or N m/rad. The spring's generalised force is -stiffness times the difference
        (:func:`pinocchio.difference`) that takes the reference to the joint's configuration: the coordinate itself
        for a hinge or a slide, the rotation vector for a spherical joint.
    spring_reference : tuple of float or None
        Shape (nq of the joint,), where the spring is slack, m, rad or unit quaternion (x, y, z, w); the joint's
        neutral configuration where left out.
    armature : tuple of float or None
        Shape (nv of the joint,), inertia of the actuator's rotor seen from the joint, kg or kg m², not negative. It is
        put into the model when the file is loaded; None leaves the model's own.
    unit : {"m", "rad"} or None
        What the joint has to move in for these values, which is checked when a model is loaded; None for a joint that
        moves in both, or without a check.
    """

    joint: str
    stiffness: float = 0.0
    spring_reference: tuple[float, ...] | None = None
    armature: tuple[float, ...] | None = None
    unit: str | None = None

    def __post_init__(self) -> None:
        _require_name("joint", self.joint)
        if self.unit not in (None, "m", "rad"):
            raise UnknownName("unit", self.unit, ("m", "rad"), where=f"joint {self.joint!r}")
        stiffness = float(as_finite(f"stiffness of joint {self.joint!r}", self.stiffness, ()))
        object.__setattr__(self, "stiffness", stiffness)
        for key in ("spring_reference", "armature"):
            value = getattr(self, key)
            if value is not None:
                array = as_finite(f"{key} of joint {self.joint!r}", value, (None,))
                object.__setattr__(self, key, tuple(array.tolist()))
        if self.armature is not None and min(self.armature, default=0.0) < 0.0:
            raise InvalidInput(f"expected an armature of zero or more for joint {self.joint!r}, got {self.armature}")


@dataclass(frozen=True)
class LimbRole:
    """Which parts of the model make one limb of an exoskeleton.

    Attributes
    ----------
    name : str
        Of the limb.
    kind : {"UPU", "SPS"}
        Universal or spherical joints at both ends.
    slide : str
        The actuated joint.
    platform_joint : str
        The limb's first joint after the arm: what it transmits is what the arm puts on the limb.
    closure : str
        The closure that holds the limb to the torso.
    """

    name: str
    kind: str
    slide: str
    platform_joint: str
    closure: str

    def __post_init__(self) -> None:
        if self.kind not in ("UPU", "SPS"):
            raise UnknownName("limb kind", self.kind, ("UPU", "SPS"))
        for key in ("name", "slide", "platform_joint", "closure"):
            _require_name(f"limb {key}", getattr(self, key))


@dataclass(frozen=True)
class Roles:
    """What the parts of the model are for. All of it is optional.

    Attributes
    ----------
    actuated : tuple of str
        Joints that carry an actuator.
    shoulder : str or None
        The joint or closure whose reaction is asked for.
    arm : str or None
        The link that it carries.
    reference_point : str or None
        Frame with its origin at the shoulder centre O.
    limbs : tuple of LimbRole
        Limbs of an exoskeleton.
    """

    actuated: tuple[str, ...] = ()
    shoulder: str | None = None
    arm: str | None = None
    reference_point: str | None = None
    limbs: tuple[LimbRole, ...] = ()

    def __post_init__(self) -> None:
        for key in ("actuated", "limbs"):
            object.__setattr__(self, key, tuple(getattr(self, key)))
        _require_distinct("actuated joint", self.actuated)
        _require_distinct("limb", [limb.name for limb in self.limbs])


@dataclass(frozen=True)
class Closures:
    """Everything that a URDF leaves out: its loops, its root, its roles.

    Attributes
    ----------
    name : str
        Of the robot.
    root : Root
        How the tree hangs in the world.
    closures : tuple of Closure
        In the order of the constraint rows.
    roles : Roles
        What the parts are for.
    joints : tuple of JointProperties
        Springs and armatures of joints, which a URDF cannot hold.

    Raises
    ------
    InvalidInput
        If two closures have one name, or a limb names a closure that is not there.
    """

    name: str = "unnamed"
    root: Root = field(default_factory=Root)
    closures: tuple[Closure, ...] = ()
    roles: Roles = field(default_factory=Roles)
    joints: tuple[JointProperties, ...] = ()

    def __post_init__(self) -> None:
        _require_name("name", self.name)
        object.__setattr__(self, "closures", tuple(self.closures))
        object.__setattr__(self, "joints", tuple(self.joints))
        _require_distinct("joint", [properties.joint for properties in self.joints])
        names = [closure.name for closure in self.closures]
        _require_distinct("closure", names)
        for limb in self.roles.limbs:
            if limb.closure not in names:
                raise UnknownName("closure", limb.closure, names, where=f"limb {limb.name!r}")

    @property
    def rows(self) -> int:
        """Number of constraint rows of all closures."""
        return sum(closure.rows for closure in self.closures)


def _require_name(what: str, value: Any) -> None:
    if not isinstance(value, str) or not value:
        raise InvalidInput(f"expected {what} to be a name, got {value!r}")


def _require_distinct(what: str, names: Any) -> None:
    twice = sorted({name for name in names if list(names).count(name) > 1})
    if twice:
        raise InvalidInput(f"{what} {twice[0]!r} is given twice")
