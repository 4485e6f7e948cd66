"""Data of a robot that a URDF cannot hold: its loops, its root, the roles of its parts, springs and armatures.

What the parts of a robot are for.
"""

from __future__ import annotations

from collections.abc import Iterable
from dataclasses import dataclass, field
from typing import Any

import numpy as np
import pinocchio as pin

from ...core.conventions import GRAVITY
from ...core.errors import InvalidInput, UnknownName
from ...core.errors.checked import checked
from ...core.validation import as_choice, as_finite, as_parts, as_positive, require_types, set_fields
from .closures import Closure
from .frames import FrameTable, require_name

#: Joints between world and root link. A hinged root is a joint of the URDF itself.
ROOT_JOINTS = ("fixed", "spherical", "free_flyer", "planar", "translation")
#: Types of joints that a URDF has no word for: it calls them floating, and its closures file says what they are.
FLOATING = ("spherical", "translation")
#: A coarser geometry says nothing about ranks.
_COARSEST = 1e-3


@checked
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
        The limb's first joint after the arm; it transmits the wrench of the arm on the limb.
    closure : str
        The closure that holds the limb to the torso.

    Examples
    --------
    >>> limb = ep.load("prototype").chain.roles.limbs[0]
    >>> limb.kind, limb.slide, limb.closure
    ('UPU', 'limb_1_slide', 'limb_1_base')
    """

    name: str
    kind: str
    slide: str
    platform_joint: str
    closure: str

    def __post_init__(self) -> None:
        as_choice("limb kind", self.kind, ("UPU", "SPS"))
        for key in ("name", "slide", "platform_joint", "closure"):
            require_name(f"limb {key}", getattr(self, key))


@checked
@dataclass(frozen=True)
class Roles:
    """Roles of the parts of the model. All of them are optional.

    Attributes
    ----------
    actuated : tuple of str
        Joints that carry an actuator.
    shoulder : str or None
        The joint or closure whose reaction is the result.
    arm : str or None
        The link that it carries.
    reference_point : str or None
        Frame with its origin at the shoulder centre O.
    limbs : tuple of LimbRole
        Limbs of an exoskeleton.
    cuff : str or None
        Frame on the arm whose origin is in the middle of the cuff.

    Examples
    --------
    >>> roles = ep.load("six-cables").chain.roles
    >>> len(roles.actuated), roles.shoulder, {limb.kind for limb in roles.limbs}
    (6, 'root_joint', {'SPS'})
    """

    actuated: tuple[str, ...] = ()
    shoulder: str | None = None
    arm: str | None = None
    reference_point: str | None = None
    limbs: tuple[LimbRole, ...] = ()
    cuff: str | None = None

    def __post_init__(self) -> None:
        for key, kind in (("actuated", str), ("limbs", LimbRole)):
            set_fields(self, **{key: as_parts(key, getattr(self, key), kind)})
        require_distinct("actuated joint", self.actuated)
        require_distinct("limb", [limb.name for limb in self.limbs])


def require_parts(roles: Roles, joints: Iterable[str], closures: Iterable[str], frames: FrameTable) -> None:
    """Raise UnknownName if a part is neither among the joints and closures, by name, nor a frame."""
    for joint in (*roles.actuated, *(name for limb in roles.limbs for name in (limb.slide, limb.platform_joint))):
        as_choice("joint", joint, joints)
    joined = {*joints, *closures}
    if roles.shoulder is not None and roles.shoulder not in joined:
        raise UnknownName("joint or closure", roles.shoulder, joined, where="roles.shoulder")
    for frame in {roles.arm, roles.reference_point, roles.cuff} - {None}:
        frames.find("frame", frame, "roles")


def require_distinct(what: str, names: Any) -> None:
    """Raise InvalidInput if two have one name."""
    twice = sorted({name for name in names if list(names).count(name) > 1})
    if twice:
        raise InvalidInput(f"{what} {twice[0]!r} is given twice: expected every name once")


@checked
@dataclass(frozen=True)
class Root:
    """Joint between the world and the root link of the URDF, and gravity.

    Attributes
    ----------
    joint : str
        One of :data:`ROOT_JOINTS`.
    name : str
        Name of that joint in the model; unused for "fixed".
    gravity : tuple of float
        (x, y, z), m/s², world frame.

    Examples
    --------
    >>> from exo_pin.chain import Root
    >>> float(np.linalg.norm(Root("fixed", gravity=(0.0, 0.0, -1.62)).gravity))  # m/s², on the Moon
    1.62
    """

    joint: str = "fixed"
    name: str = "root_joint"
    gravity: tuple[float, float, float] = tuple(GRAVITY.tolist())

    def __post_init__(self) -> None:
        as_choice("root joint", self.joint, ROOT_JOINTS)
        require_name("root name", self.name)
        object.__setattr__(self, "gravity", tuple(as_finite("gravity", self.gravity, (3,)).tolist()))


@checked
@dataclass(frozen=True)
class JointProperties:
    """Data of a joint that a URDF cannot hold.

    Attributes
    ----------
    joint : str
        A joint of the model.
    stiffness : float
        Of the spring in the joint, N/m or N m/rad. The spring's generalised force is -stiffness times the difference
        (``pinocchio.difference``) that takes the reference to the joint's configuration: the coordinate itself
        for a hinge or a slide, the rotation vector for a spherical joint.
    spring_reference : tuple of float or None
        Shape (nq of the joint,), where the spring is slack, m, rad or unit quaternion (x, y, z, w); the joint's
        neutral configuration where left out.
    armature : tuple of float or None
        Shape (nv of the joint,), inertia of the actuator's rotor reduced to the joint, kg or kg m², not negative. It is
        put into the model when the file is loaded; None leaves the model's own.
    unit : {"m", "rad"} or None
        Unit of the joint's coordinates for these values, checked when a model is loaded; None for a joint that moves in
        both, or for no check.
    type : {"spherical", "translation"}, optional
        What the joint is that a URDF calls floating, because it has no word for it. Only files state it: in a model the
        joint itself is of that type.

    Examples
    --------
    >>> from exo_pin.chain import JointProperties
    >>> spring = JointProperties("elbow", stiffness=3.0, spring_reference=(0.5,), unit="rad")
    >>> round(spring.stiffness * (0.9 - spring.spring_reference[0]), 9)  # N m towards 0.5 rad, at 0.9 rad
    1.2
    """

    joint: str
    stiffness: float = 0.0
    spring_reference: tuple[float, ...] | None = None
    armature: tuple[float, ...] | None = None
    unit: str | None = None
    type: str | None = None

    def __post_init__(self) -> None:
        require_name("joint", self.joint)
        if self.type not in (None, *FLOATING):
            raise UnknownName("joint type", self.type, FLOATING, where=f"joint {self.joint!r}")
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
class Cable:
    """A cable or spring of a robot's file along straight pieces between points of its links, or a spring in a joint.

    A chain does not feel it. A device of this chain has it as a drive along a route, as a spring, or as both.

    Attributes
    ----------
    name : str
        Its name.
    points : tuple of (str, tuple of float)
        Frames, and points in their axes, m; two or more, or none of a spring in a joint.
    tension : tuple of float or None
        Least and greatest tension that its actuator gives, N, infinite where no limit is known; None without actuator.
    stiffness, slack : float
        Of its spring, N/m, and the length at which it is slack, m; without a spring 0.
    only_pulls : bool
        Whether the spring goes slack below that length.
    constant : float
        Tension of a spring of constant force, N or N m; 0 without one.
    joint : str or None
        The hinge or slide of a spring in a joint, whose coordinate is its length.
    """

    name: str
    points: tuple[tuple[str, tuple[float, ...]], ...]
    tension: tuple[float, float] | None = None
    stiffness: float = 0.0
    slack: float = 0.0
    only_pulls: bool = False
    constant: float = 0.0
    joint: str | None = None


@dataclass(frozen=True)
class Shape:
    """What of a link is drawn or may touch; it has no effect on the motion.

    Attributes
    ----------
    frame : str
        The link.
    kind : {"box", "sphere", "cylinder", "capsule", "ellipsoid", "mesh"}
        Cylinders and capsules are along z, about their middle.
    size : tuple of float
        Lengths of a box, radius, radius and length (of a capsule between the caps), radii of an ellipsoid, m; of a mesh
        its scale along x, y, z.
    translation, quaternion : tuple of float
        Where it is in the link, m and (x, y, z, w).
    file : str or None
        Of a mesh, as a path if it was found.
    colour : tuple of float or None
        Red, green, blue, alpha.
    role : {"visual", "collision", "both"}
        What it is for. Contact itself is no part of a chain.
    """

    frame: str
    kind: str
    size: tuple[float, ...]
    translation: tuple[float, ...] = (0.0, 0.0, 0.0)
    quaternion: tuple[float, ...] = (0.0, 0.0, 0.0, 1.0)
    file: str | None = None
    colour: tuple[float, ...] | None = None
    role: str = "visual"

    @classmethod
    def at(
        cls,
        frame: str,
        kind: str,
        size: tuple[float, ...],
        place: pin.SE3,
        file: str | None = None,
        colour: tuple[float, ...] | None = None,
        role: str = "visual",
    ) -> Shape:
        """A shape at a pose in its link."""
        quaternion = pin.Quaternion(place.rotation).normalized().coeffs().tolist()
        return cls(frame, kind, size, tuple(place.translation.tolist()), tuple(quaternion), file, colour, role)

    def moved(self, placement: pin.SE3) -> Shape:
        """The same seen from where the link's frame has a placement."""
        return self.at(self.frame, self.kind, self.size, placement * self.place, self.file, self.colour, self.role)

    @property
    def elements(self) -> tuple[str, ...]:
        """The elements of URDF and SDF that hold it."""
        return ("visual", "collision") if self.role == "both" else (self.role,)

    @property
    def place(self) -> pin.SE3:
        """Its pose in the link."""
        return pin.SE3(pin.Quaternion(np.array(self.quaternion)).matrix(), np.array(self.translation))


@checked
@dataclass(frozen=True)
class Closures:
    """All data of a robot beside its URDF: its loops, its root, its roles.

    Attributes
    ----------
    name : str
        Of the robot.
    root : Root
        Joint between world and tree, and gravity.
    closures : tuple of Closure
        In the order of the constraint rows.
    roles : Roles
        Roles of the parts.
    joints : tuple of JointProperties
        Springs and armatures of joints, which a URDF cannot hold.
    left_out : tuple of str
        What the file that was read has and the chain has not, in words, such as equalities that are not active.
    tolerance : float
        How well the geometry is known, m and rad, from 0 to 1e-3: half a unit of the last digit of the file's rounded
        numbers. Rows of closures that agree within it are one row, and loops may stay open by it. 0 is an exact
        geometry.
    rounding : float
        As ``tolerance``, where that makes no difference to the loops: it counts in ranks alone.
    shapes : tuple of Shape
        What of the links is drawn or may touch; a closures file does not hold it.
    cables : tuple of Cable
        Cables and springs between links, for a device; a closures file does not hold them.

    Raises
    ------
    InvalidInput
        If a part is not of its class, two closures have one name, a limb names a closure that is not there, or the
        tolerance is out of its range.

    Examples
    --------
    >>> description = ep.load("four-cables").chain.description
    >>> len(description.closures), description.root.joint, description.roles.arm
    (4, 'spherical', 'arm')
    """

    name: str = "unnamed"
    root: Root = field(default_factory=Root)
    closures: tuple[Closure, ...] = ()
    roles: Roles = field(default_factory=Roles)
    joints: tuple[JointProperties, ...] = ()
    left_out: tuple[str, ...] = ()
    tolerance: float = 0.0
    rounding: float = 0.0
    shapes: tuple[Shape, ...] = field(default=(), repr=False)
    cables: tuple[Cable, ...] = field(default=(), repr=False)

    def __post_init__(self) -> None:
        require_name("name", self.name)
        if as_positive("tolerance of the geometry", self.tolerance, zero=True) > _COARSEST:
            raise InvalidInput(f"expected a tolerance of the geometry up to {_COARSEST:g}, got {self.tolerance}")
        kinds = {"left_out": str, "closures": Closure, "joints": JointProperties, "shapes": Shape, "cables": Cable}
        set_fields(self, **{key: as_parts(key, getattr(self, key), kind) for key, kind in kinds.items()})
        require_types(self, root=Root, roles=Roles)
        require_distinct("joint", [properties.joint for properties in self.joints])
        names = [closure.name for closure in self.closures]
        require_distinct("closure", names)
        require_distinct("cable", [cable.name for cable in self.cables])
        for limb in self.roles.limbs:
            as_choice("closure", limb.closure, names, f"limb {limb.name!r}")

    @property
    def doubts(self) -> tuple[str, ...]:
        """What was left out and may change forces, or changes the mechanism."""
        return tuple(f"Left out of the robot's file: {text}" for text in self.left_out if "(no effect: " not in text)

    @property
    def rows(self) -> int:
        """Number of constraint rows of all closures."""
        return sum(closure.rows for closure in self.closures)
