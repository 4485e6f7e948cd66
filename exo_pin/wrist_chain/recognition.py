"""Is a chain a wrist in the layout of :mod:`exo_pin.wrist_chain.wrist_urdf`? Then the closed forms hold for it, too."""

from __future__ import annotations

from typing import NamedTuple

import numpy as np
import pinocchio as pin
from scipy.spatial.transform import Rotation

from ..chain import ClosedChain
from ..chain.formats.joint_data import joint_data
from ..chain.formats.urdf.urdf_loading import load_model
from ..chain.structure.chain_state import ChainState
from ..chain.structure.motion_axes import motion_axes
from ..core.conventions import Side
from ..core.errors import ExoPinError, NotAWrist
from ..core.errors.checked import checked
from ..design.arm import Arm
from ..design.geometry import WristGeometry
from ..design.limb import Limb, LimbBody
from ..design.mechanism import Mechanism
from .wrist_urdf import mechanism_urdf

#: Largest difference of a placement, m, or of a mass or an inertia relative to the arm's, that is rounding.
_SAME = 1e-9


class Recognised(NamedTuple):
    """A chain as a wrist.

    Attributes
    ----------
    mechanism : Mechanism
        Geometry, limbs' kinds, and the masses as far as a mechanism's record holds them.
    heavier : tuple of str
        Joints whose links have mass that the record cannot hold (crosses, anchors): kinematics is the chain's,
        statics is not.
    unheld : tuple of str
        Data of joints that the record cannot hold and forces depend on, such as "damping of limb_1_slide": damping,
        friction, armature and springs. Kinematics is the chain's, statics and dynamics are not.

    Examples
    --------
    >>> from exo_pin.wrist_chain import wrist_of
    >>> wrist_of(ep.load("prototype").chain_with_masses()).heavier[:2]  # crosses, which no design file holds
    ('limb_1_platform_y', 'limb_1_base_x')
    """

    mechanism: Mechanism
    heavier: tuple[str, ...]
    unheld: tuple[str, ...] = ()

    @property
    def beyond_record(self) -> str:
        """What the chain has that the record cannot hold, in words; empty if there is nothing."""
        lost = []
        if self.heavier:
            lost.append(f"the masses of {len(self.heavier)} links, the first of them after {self.heavier[0]}")
        if self.unheld:
            lost.append(f"the {', '.join(self.unheld[:4])}{', ...' if len(self.unheld) > 4 else ''}")
        return " and ".join(lost)


@checked
def wrist_of(chain: ClosedChain, side: Side = "left") -> Recognised:
    """Read a chain as a wrist, and check it against the chain that this wrist would be written as.

    Parameters
    ----------
    chain : ClosedChain
        The chain, with limbs among its roles.
    side : {"left", "right"}
        Side of the body; a chain does not contain it.

    Returns
    -------
    Recognised

    Raises
    ------
    NotAWrist
        If it has no limbs among its roles, or its tree has another layout; the error names the reason.

    Examples
    --------
    >>> from exo_pin.wrist_chain import wrist_of
    >>> exo = ep.load("prototype")
    >>> found = wrist_of(exo.chain).mechanism
    >>> round(float(np.abs(found.geometry.base_points - exo.geometry.base_points).max()), 12)  # m
    0.0
    """
    state = chain._state
    roles, name = state.roles, state.description.name
    if len(roles.limbs) < 3 or roles.arm is None:
        raise NotAWrist(name, "its closures file names no arm with three limbs or more among its roles")
    try:
        mechanism = _read(state, side)
        part = _part(state)
        written, closures = load_model(*mechanism_urdf(mechanism, part), None, 0.0, ())
        same = ChainState(written, closures)
    except NotAWrist:
        raise
    except ExoPinError as error:
        raise NotAWrist(name, str(error)) from error
    _compare(name, state, same)
    arm = state.model.inertias[1]
    scale = arm.mass if arm.mass > 0.0 else 1.0
    heavier = tuple(
        state.model.names[joint]
        for joint in range(1, state.model.njoints)
        if np.abs(_ten(state.model.inertias[joint]) - _ten(written.inertias[joint])).max() > _SAME * scale
    )
    try:
        return Recognised(mechanism, heavier, _unheld(state))
    except ExoPinError as error:
        raise NotAWrist(name, str(error)) from error


def _unheld(chain: ChainState) -> tuple[str, ...]:
    data = joint_data(chain.model, chain.description.joints)
    return tuple(
        f"{what} of {chain.model.names[joint]}"
        for joint in range(1, chain.model.njoints)
        for what in data[joint].present
        if what in ("damping", "friction", "armature", "spring")
    )


def _part(chain: ChainState) -> str:
    kind = chain.model.joints[1].shortname() if chain.model.njoints > 1 else "none"
    if kind == "JointModelSpherical":
        return "whole"
    return "floating" if chain.roles.shoulder in {closure.name for closure in chain.closures} else "wrist"


def _read(chain: ChainState, side: Side) -> Mechanism:
    """The mechanism that the roles describe."""
    model, roles, name = chain.model, chain.roles, chain.description.name
    closures = {closure.name: closure for closure in chain.closures}
    base, platform, limbs = [], [], []
    for role in roles.limbs:
        joint = chain.joint_index(role.platform_joint)
        closure = closures[role.closure]
        if model.parents[joint] != 1 or closure.frame_b != "universe":
            raise NotAWrist(name, f"limb {role.name!r} does not go from the root link to a closure on the world")
        platform.append(np.array(model.jointPlacements[joint].translation))
        base.append(np.array(closure.placement_b.translation))
        slide = chain.joint_index(role.slide)
        neutral = Rotation.from_quat(closure.placement_b.quaternion)
        halves = {"platform_body": _half(model, model.parents[slide]), "base_body": _half(model, slide)}
        limbs.append(Limb(role.kind, **halves))  # type: ignore[arg-type]
    geometry = WristGeometry(np.array(base), np.array(platform), neutral=neutral)
    inertia = model.inertias[1]
    arm = Arm(inertia.mass, inertia.lever, inertia.inertia) if inertia.mass > 0.0 else None
    gravity = np.array(model.gravity.linear)
    return Mechanism(geometry, arm=arm, limbs=tuple(limbs), gravity=gravity, side=side, name=name)


def _half(model: pin.Model, joint: int) -> LimbBody | None:
    """A limb's half, if it has mass: a body of revolution about its centre's direction."""
    inertia = model.inertias[joint]
    if inertia.mass <= 0.0:
        return None
    lever = np.array(inertia.lever)
    centre = float(np.linalg.norm(lever))
    along = lever / centre if centre > 0.0 else np.array([0.0, 0.0, 1.0])
    axial = float(along @ inertia.inertia @ along)
    return LimbBody(inertia.mass, centre, float((np.trace(inertia.inertia) - axial) / 2), axial)


def _compare(name: str, given: ChainState, written: ChainState) -> None:
    """Raise NotAWrist unless every joint has the same place and axes in both chains; hinges may count the other way."""
    model, other = given.model, written.model
    if model.njoints != other.njoints or len(given.closures) != len(written.closures):
        raise NotAWrist(name, f"a wrist of its limbs has {other.njoints - 1} joints, it has {model.njoints - 1}")
    axes = motion_axes(model), motion_axes(other)
    for joint in range(1, model.njoints):
        one, two = model.joints[joint], other.joints[joint]
        places = model.jointPlacements[joint], other.jointPlacements[joint]
        same = model.parents[joint] == other.parents[joint] and (one.nq, one.nv) == (two.nq, two.nv)
        if not same or not places[0].isApprox(places[1], _SAME) or not _same_axes(axes[0][joint], axes[1][joint]):
            raise NotAWrist(name, f"joint {model.names[joint]!r} is placed or directed otherwise than in a wrist")
    here, there = (chain.topology for chain in (given, written))
    order = [[item.name for item in given.closures].index(item.name) for item in written.closures]
    if (
        not np.array_equal(here.joints[order], there.joints)
        or not np.array_equal(here.kinds[order], there.kinds)
        or np.abs(here.local[order] - there.local).max() > _SAME
    ):
        raise NotAWrist(name, "its closures join the limbs to the world otherwise than in a wrist")


def _same_axes(one: np.ndarray, two: np.ndarray) -> bool:
    """Whether two joints move alike; a hinge may count its turns the other way, as in a mirror image."""
    ways = (1.0, -1.0) if one.shape[1] == 1 and not one[:3].any() else (1.0,)
    return min(float(np.abs(one - way * two).max()) for way in ways) <= _SAME


def _ten(inertia: pin.Inertia) -> np.ndarray:
    return np.concatenate([[inertia.mass], inertia.mass * inertia.lever, np.asarray(inertia.inertia).reshape(-1)])
