"""Loop closures as data: what closes the loops of a URDF tree, how its root hangs, what its parts are for."""

from __future__ import annotations

from dataclasses import dataclass, field
from typing import Any

import numpy as np

from ..conventions import GRAVITY
from ..errors import InvalidInput, UnknownName
from ..validation import as_finite

__all__ = ["ROOT_JOINTS", "TYPES", "Closure", "ClosureType", "Closures", "LimbRole", "Placement", "Roles", "Root"]

#: How the root link can hang in the world. A hinged root is a joint of the URDF itself.
ROOT_JOINTS = ("fixed", "spherical", "free_flyer", "planar", "translation")


@dataclass(frozen=True)
class ClosureType:
    """A kind of closure.

    Attributes
    ----------
    name : str
        As in the file.
    code : int
        Number by which the compiled kernels know it.
    rows : int
        Number of constraint rows: of the six components of the motion of frame a against frame b (translation,
        rotation, in the axes of a) those that the closure forbids.
    """

    name: str
    code: int
    rows: int


_ALL_TYPES = (ClosureType("rigid", 0, 6), ClosureType("spherical", 1, 3))

#: The closure types by name; "point" is another name for "spherical".
TYPES: dict[str, ClosureType] = {kind.name: kind for kind in _ALL_TYPES} | {"point": _ALL_TYPES[1]}


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

    Raises
    ------
    UnknownName
        If there is no such closure type.
    """

    name: str
    type: str
    frame_a: str
    frame_b: str
    placement_a: Placement = field(default_factory=Placement)
    placement_b: Placement = field(default_factory=Placement)

    def __post_init__(self) -> None:
        for key in ("name", "type", "frame_a", "frame_b"):
            _require_name(f"closure {key}", getattr(self, key))
        if self.type not in TYPES:
            raise UnknownName("closure type", self.type, TYPES, where=f"closure {self.name!r}")
        object.__setattr__(self, "type", TYPES[self.type].name)

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

    Raises
    ------
    InvalidInput
        If two closures have one name, or a limb names a closure that is not there.
    """

    name: str = "unnamed"
    root: Root = field(default_factory=Root)
    closures: tuple[Closure, ...] = ()
    roles: Roles = field(default_factory=Roles)

    def __post_init__(self) -> None:
        _require_name("name", self.name)
        object.__setattr__(self, "closures", tuple(self.closures))
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
