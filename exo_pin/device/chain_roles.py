"""What the roles of a chain say about its arm and its drives."""

from __future__ import annotations

from collections.abc import Iterable
from typing import TYPE_CHECKING

import numpy as np
import pinocchio as pin

from ..chain import ClosedChain
from ..chain.formats.bodies import welded_to_arm, without
from ..chain.structure.description import Cable
from ..core.errors import InvalidInput
from ..core.validation import FloatArray
from ..design import Arm
from .parts.drives import Drive, Spring
from .parts.laws import ConstantForce, LinearSpring
from .parts.routes import Route

if TYPE_CHECKING:
    from .chain_device import ChainDevice

#: Placement of the arm's joint or link, m and rad, that is rounding.
_SAME = 1e-9
#: Share of an arm's mass, and of its moments of mass, that is rounding of a file.
SAME_ARM = 1e-6


def arm_of(chain: ClosedChain) -> Arm | None:
    """The arm's mass properties: the arm's own link is the person's, links that are welded to it are the device's."""
    model, index = chain.model, arm_index_of(chain)
    whole = model.inertias[index]
    if whole.mass <= 0.0:
        return None
    parts = welded_to_arm(chain._state)
    own = without(whole, index, parts)
    placed = [part.placement.act(part.inertia) for part in parts]
    welded = [Arm(part.mass, part.lever, part.inertia, device=True) for part in placed]
    return sum(welded, Arm(own.mass, own.lever, own.inertia))


def is_same_arm(one: Arm | None, other: Arm | None) -> bool:
    """Whether two arms weigh the same in the same places, up to rounding; whose their parts are does not count.

    An inertia that is not known is a point mass's in a robot's file.
    """
    if one is None or other is None:
        return one is other
    scale = one.mass * np.array([1.0] * 4 + [0.1] * 9)  # kg, kg m and kg m²: a length of arm is some 0.3 m

    def numbers(arm: Arm) -> FloatArray:
        known = one.inertia is not None and other.inertia is not None
        inertia = arm.inertia if known and arm.inertia is not None else np.zeros((3, 3))
        return np.concatenate([[arm.mass], arm.mass * arm.centre_of_mass, inertia.ravel()])

    return bool((np.abs(numbers(one) - numbers(other)) <= SAME_ARM * scale).all())


def with_arm(chain: ClosedChain, arm: Arm | None) -> ClosedChain:
    """The chain with another arm in its arm's link; the chain itself where that is its own."""
    if arm is None or is_same_arm(arm_of(chain), arm):
        return chain
    model = chain.model.copy()
    inertia = np.zeros((3, 3)) if arm.inertia is None else arm.inertia
    model.inertias[arm_index_of(chain)] = pin.Inertia(arm.mass, arm.centre_of_mass, inertia)
    return type(chain)(model, chain.description)


def drives_of(chain: ClosedChain) -> tuple[Drive, ...]:
    """The drives, with the limits that the model has for them; those of limbs between two joints pull."""
    slides = dict.fromkeys(limb.slide for limb in chain.roles.limbs)
    joints = {**dict.fromkeys(chain.roles.actuated), **slides}
    own = tuple(_drive_of(chain.model, joint, joint in slides) for joint in joints)
    routed = (
        Drive(
            cable.name,
            route=Route.over(*cable.points),
            lower=cable.tension[0],
            upper=None if np.isinf(cable.tension[1]) else cable.tension[1],
        )
        for cable in chain.description.cables
        if cable.tension is not None
    )
    return (*own, *routed)


def springs_of(chain: ClosedChain) -> tuple[Spring, ...]:
    """The springs between links, and those in joints beside the chain's own, that the robot's file has."""
    return tuple(
        Spring(
            own.name,
            ConstantForce(own.constant) if own.constant else LinearSpring(own.stiffness, own.slack, own.only_pulls),
            own.joint,
            None if own.joint is not None else Route.over(*own.points),
        )
        for own in chain.description.cables
        if own.stiffness or own.constant
    )


def cables_of(drives: Iterable[Drive], springs: Iterable[Spring]) -> tuple[Cable, ...]:
    """Routed drives, and springs that are linear or of constant force, as a robot's file may have them."""
    found = []
    for drive in drives:
        if drive.route is not None:
            least, greatest = drive.effort_range
            tension = (float(np.nan_to_num(least)), float("inf") if np.isnan(greatest) else greatest)
            found.append(Cable(drive.name, _points(drive.route), tension))
    for spring in springs:
        law, points = spring.law, () if spring.route is None else _points(spring.route)
        if isinstance(law, ConstantForce) and law.value:
            found.append(Cable(spring.name, points, constant=law.value, joint=spring.joint))
        # MuJoCo takes a length of -1 for that as drawn.
        elif (
            isinstance(law, LinearSpring) and law.slack != -1.0 and (law.slack >= 0.0 if points else not law.only_pulls)
        ):
            own = law.stiffness, law.slack, law.only_pulls
            found.append(Cable(spring.name, points, None, *own, joint=spring.joint))
    return tuple(found)


def _points(route: Route) -> tuple[tuple[str, tuple[float, float, float]], ...]:
    return tuple((point.link, point.point) for point in route.points)


def _drive_of(model: pin.Model, joint: str, pulls: bool) -> Drive:
    """The drive of a joint, with the limits that the model has for it."""
    index = model.getJointId(joint)
    if model.nvs[index] != 1:
        raise InvalidInput(f"expected a drive in a joint of one coordinate, got {joint!r} with {model.nvs[index]}")
    q, v = model.idx_qs[index], model.idx_vs[index]
    low, high = float(model.lowerEffortLimit[v]), float(model.upperEffortLimit[v])
    lower, upper = (0.0 - high, 0.0 - low) if pulls else (low, high)  # no -0.0, which a file would print
    # A joint without ends has two numbers for its angle.
    has_ends = model.nqs[index] == 1
    speed = float(model.upperVelocityLimit[v])

    def known(value: float, is_told: bool = True) -> float | None:
        # Pinocchio's joints have the largest number of a computer where a file has no place for a limit.
        return value if abs(value) < np.finfo(float).max and is_told else None

    # A robot's file that states no limit, or zero, says nothing about the drive.
    return Drive(
        joint,
        joint,
        pulls=pulls,
        lower=known(lower, low < high),
        upper=known(upper, low < high),
        least=known(float(model.lowerPositionLimit[q]), has_ends),
        greatest=known(float(model.upperPositionLimit[q]), has_ends),
        speed_limit=known(speed, speed > 0.0),
    )


def soft_bodies(device: ChainDevice) -> dict[int, str]:
    """Joints whose bodies give way, with the names of the links.

    Raises
    ------
    InvalidInput
        If a link that gives way is part of the arm or of the torso, or two are one body.
    """
    state, found = device.chain._state, dict[int, str]()
    for soft in device.soft_links:
        joint = int(state.model.frames[state.frame_index(soft.link)].parentJoint)
        if joint in (0, device.arm_index):
            body = "torso" if joint == 0 else "arm"
            raise InvalidInput(f"expected a link that moves on its own, got {soft.link!r}, which is part of the {body}")
        if joint in found:
            raise InvalidInput(f"{soft.link!r} and {found[joint]!r} are one body: give it one spring")
        found[joint] = soft.link
    return found


def arm_index_of(chain: ClosedChain) -> int:
    """Index of the joint that the arm hangs on, in the model.

    Raises
    ------
    InvalidInput
        If the roles name no arm.
    """
    arm = chain.roles.arm
    if arm is None:
        raise InvalidInput(f"robot {chain.description.name!r} names no arm among its roles: [roles] arm = LINK")
    return int(chain.model.frames[chain._state.frame_index(arm)].parentJoint)


def carries_arm(chain: ClosedChain) -> bool:
    """Whether a device can be made of a chain."""
    try:
        check_arm(chain)
    except InvalidInput:
        return False
    return True


def check_arm(chain: ClosedChain) -> None:
    """Raise unless the arm hangs on the torso by a spherical joint, with the arm's axes."""
    name, model = chain.description.name, chain.model
    index = arm_index_of(chain)
    kind = model.joints[index].shortname() if index else "none"
    if kind != "JointModelSpherical" or model.parents[index] != 0:
        raise InvalidInput(
            f"expected the arm {chain.roles.arm!r} of robot {name!r} on a spherical joint of the torso at the "
            f"shoulder's centre, got joint {model.names[index]!r} ({kind}): in a URDF the arm is the root link, with "
            '[root] joint = "spherical"'
        )
    frame = model.frames[chain._state.frame_index(str(chain.roles.arm))]
    for what, place in (("joint", model.jointPlacements[index].rotation), ("link", frame.placement.rotation)):
        if np.abs(place - np.eye(3)).max() > _SAME:
            raise InvalidInput(f"expected the axes of the arm's {what} along those of the world at rest, got {place}")
