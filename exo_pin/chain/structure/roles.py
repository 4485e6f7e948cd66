"""What the parts of a robot are for."""

from __future__ import annotations

from collections.abc import Iterable
from dataclasses import dataclass
from typing import Any

from ...core.errors import InvalidInput, UnknownName
from ...core.errors.checked import checked
from ...core.validation import as_texts
from .frames import FrameTable, require_name


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
        if self.kind not in ("UPU", "SPS"):
            raise UnknownName("limb kind", self.kind, ("UPU", "SPS"))
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
        for key in ("actuated", "limbs"):
            given = getattr(self, key)
            object.__setattr__(self, key, given if isinstance(given, str) else tuple(given))
        require_distinct("actuated joint", as_texts("actuated", self.actuated))
        require_distinct("limb", [limb.name for limb in self.limbs])


def require_parts(roles: Roles, joints: Iterable[str], closures: Iterable[str], frames: FrameTable) -> None:
    """Raise UnknownName if a part is neither among the joints and closures, by name, nor a frame."""
    for joint in (*roles.actuated, *(name for limb in roles.limbs for name in (limb.slide, limb.platform_joint))):
        if joint not in joints:
            raise UnknownName("joint", joint, joints)
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
