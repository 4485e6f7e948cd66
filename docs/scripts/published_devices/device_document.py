"""Parts of a device's URDF: the arm of one man, bars and cuffs with the mass of what they are made of, and the frame.

Every device hangs from the arm, as the wrist does (:mod:`exo_pin.wrist_chain.wrist_urdf`): the root link is ``arm``,
its origin at the shoulder's centre O, on a spherical root joint. The link ``cuff``, welded to it by ``cuff_weld``, is
all of the device that moves with the arm; the frame ``cuff_middle`` is where the cuff is on the arm. From the cuff its
joints run to the torso, where closures hold it.
All link frames are parallel to {O_B} with the arm hanging, where every joint is at zero and all loops are closed.

Assumed, where no source gives a mass: bars and joints as in :mod:`exo_pin.design.holding_frame`, 13 mm tube of
aluminium and 50 g a joint. Pictures are those bars: cylinders with a ball at each end, that is, capsules.
"""

from __future__ import annotations

import itertools
from collections.abc import Sequence
from dataclasses import dataclass
from typing import Any, NamedTuple

import numpy as np
import pinocchio as pin
from numpy.typing import ArrayLike

from exo_pin.chain.formats.joint_data import NO_LIMIT
from exo_pin.chain.formats.urdf.urdf_writing import Body, Document, Picture
from exo_pin.chain.structure.closures import Closure
from exo_pin.chain.structure.description import Closures, Roles, Root
from exo_pin.chain.structure.frames import Placement
from exo_pin.core.validation import FloatArray
from exo_pin.design.arm import Arm
from exo_pin.design.holding_frame import BAR, PER_JOINT, PER_METRE
from exo_pin.design.limb import LimbBody
from exo_pin.design.wearer import Wearer

#: The man of the middle by ANSUR II (1.755 m, 85 kg), with a straight arm by the tables of de Leva (1996).
MAN = Wearer(1.755, 85.0, "male")
UPPER_ARM = MAN.upper_arm_length
#: Radius of his upper arm, m: biceps girth of 357 mm, 50th percentile of ANSUR II. That of the forearm is assumed.
ARM_RADIUS, _FOREARM_RADIUS = 0.357 / (2.0 * np.pi), 0.040
#: Where cuffs are, fraction of the upper arm from the shoulder: the best anchor of textile suits (arXiv 2407.12978).
CUFF_SHARE = 2.0 / 3.0
#: Radius of a cuff's ring about the arm's axis, m: the 95th percentile of the biceps girth, 418 mm, goes through it.
CUFF_RADIUS = 0.418 / (2.0 * np.pi) + BAR
#: Greatest moment of a motor, N m: Carignan and Liszka, Section 2.2.1 of the thesis.
MOTOR = 92.0
_CORNERS = 16


class DeviceFiles(NamedTuple):
    """What a device's files hold.

    Attributes
    ----------
    xml : str
        The URDF.
    closures : Closures
        Loops, root and roles.
    more : dict
        Springs with laws of their own and cables, for a device file; empty where there are none.
    """

    xml: str
    closures: Closures
    more: dict[str, Any]


@dataclass(frozen=True)
class JointDrive:
    """Limits of a joint that has an actuator.

    Attributes
    ----------
    travel : tuple of float
        Least and greatest coordinate, rad or m.
    effort : float
        Greatest moment or force, N m or N; infinite where it is not known, zero for a stop without actuator.
    """

    travel: tuple[float, float]
    effort: float = np.inf


def framework(
    colour: str, bars: Sequence[FloatArray] = (), joints: Sequence[FloatArray] = ()
) -> tuple[Body, list[Picture]]:
    """A body of bars and joints with its pictures.

    Parameters
    ----------
    colour : str
        Of the pictures.
    bars : sequence of ndarray
        Middle lines, shape (k, 3) each, m.
    joints : sequence of ndarray
        Places of joints, shape (3,) each, m.
    """
    whole, pictures = pin.Inertia.Zero(), []
    for bar in bars:
        for start, end in itertools.pairwise(bar):
            whole += _rod(np.asarray(start), np.asarray(end))
            pictures.append(Picture(colour, BAR, _point(start), _point(end)))
        pictures += [Picture(colour, BAR, _point(corner)) for corner in bar]
    for joint in joints:
        whole += pin.Inertia.FromSphere(PER_JOINT, 2.0 * BAR).se3Action(pin.SE3(np.eye(3), np.asarray(joint)))
        pictures.append(Picture("cross", 2.0 * BAR, _point(joint)))
    return body_of(whole), pictures


def rod_body(colour: str, half: LimbBody, along: FloatArray, drawn: float) -> tuple[Body, list[Picture]]:
    """Half of a telescoping limb, from its own joint at the origin, drawn as long as is said, m."""
    line = np.outer(along, along)
    inertia = half.transverse_inertia * (np.eye(3) - line) + half.axial_inertia * line
    body = Body(half.mass, half.centre * along, inertia)
    return body, [Picture(colour, BAR, (0.0, 0.0, 0.0), _point(drawn * along))]


def body_of(inertia: pin.Inertia) -> Body:
    """Pinocchio's inertia as the document wants it."""
    return Body(float(inertia.mass), np.array(inertia.lever), np.array(inertia.inertia))


def arc(start: FloatArray, end: FloatArray, radius: float) -> FloatArray:
    """A bar along a circle about O from one direction to another at right angles to it, shape (k, 3), m."""
    angles = np.linspace(0.0, np.pi / 2.0, 7)
    return radius * (np.outer(np.cos(angles), start) + np.outer(np.sin(angles), end))


def ring(height: float, radius: float = CUFF_RADIUS, axis: ArrayLike = (0.0, 0.0, 1.0)) -> FloatArray:
    """A closed ring about the arm's axis, or about another one, shape (k, 3), m."""
    angles = np.linspace(0.0, 2.0 * np.pi, _CORNERS + 1)
    level = np.stack([radius * np.cos(angles), radius * np.sin(angles), np.full(_CORNERS + 1, height)], axis=1)
    return level @ pin.Quaternion.FromTwoVectors(np.array([0.0, 0.0, 1.0]), np.array(axis)).toRotationMatrix().T


class DeviceDocument:
    """A device's URDF and closures file under construction, with the arm in it.

    Parameters
    ----------
    name : str
        Of the robot and its files.
    notes : sequence of str
        Comments for the head: what it is, and the source of each dimension.
    cuff : (Body, list of Picture)
        What of the device is fixed to the arm, in {O_B}.
    height : float
        Where the middle of the cuff is on the arm's axis, z of {O_B}, m.
    """

    def __init__(
        self, name: str, notes: Sequence[str], cuff: tuple[Body, list[Picture]], height: float = -CUFF_SHARE * UPPER_ARM
    ) -> None:
        self.document = Document(name, [f"{name}. Written by exo_pin; load it with its closures file.", *notes])
        self.document.note("Arm: de Leva 1996, man of 1.755 m and 85 kg (ANSUR II, 50th percentiles), straight elbow.")
        self._name, self._closures, self._actuated = name, list[Closure](), list[str]()
        arm = Arm.of_wearer(MAN)
        assert arm.inertia is not None
        self.document.link("arm", Body(arm.mass, arm.centre_of_mass, arm.inertia), _arm_pictures())
        self.document.link("cuff", *cuff)
        self.document.joint("cuff_weld", "fixed", "arm", "cuff", np.zeros(3), [1, 0, 0])
        self.document.link("cuff_middle", None)
        self.document.joint("cuff_place", "fixed", "arm", "cuff_middle", np.array([0.0, 0.0, height]), [1, 0, 0])

    def hinge(
        self,
        name: str,
        parent: str,
        child: str,
        part: tuple[Body, list[Picture]],
        axis: FloatArray,
        at: FloatArray | None = None,
        drive: JointDrive | None = None,
        kind: str = "revolute",
    ) -> None:
        """Add a link and the joint that carries it; ``at`` is the child's origin in the parent's frame, m."""
        self.document.link(child, *part)
        limits = (-np.pi, np.pi) if drive is None else drive.travel
        effort = 0.0 if drive is None else min(drive.effort, NO_LIMIT)
        place = np.zeros(3) if at is None else at
        self.document.joint(name, kind, parent, child, place, axis, limits, strength=(effort, np.inf, 0.0, 0.0))
        if drive is not None and drive.effort > 0.0:
            self._actuated.append(name)

    def hold(self, name: str, kind: str, link: str, at: FloatArray | None = None) -> None:
        """Close a link onto the torso where it is with the arm hanging, m."""
        place = Placement() if at is None else Placement(tuple(np.asarray(at).tolist()))
        self._closures.append(Closure(name, kind, link, "universe", placement_b=place))

    def finish(self, more: dict[str, Any] | None = None) -> DeviceFiles:
        """What the files hold."""
        roles = Roles(tuple(self._actuated), "root_joint", "arm", "arm", cuff="cuff_middle")
        closures = Closures(self._name, Root("spherical"), tuple(self._closures), roles)
        return DeviceFiles(self.document.text(), closures, more or {})


def _rod(start: FloatArray, end: FloatArray) -> pin.Inertia:
    """A piece of tube as a solid rod of its mass, m."""
    line = end - start
    length = float(np.linalg.norm(line))
    turn = pin.Quaternion.FromTwoVectors(np.array([0.0, 0.0, 1.0]), line / length).toRotationMatrix()
    along = pin.Inertia.FromCylinder(PER_METRE * length, BAR, length)
    return along.se3Action(pin.SE3(turn, 0.5 * (start + end)))


def _arm_pictures() -> list[Picture]:
    """Upper arm and forearm as capsules."""
    elbow, hand = (0.0, 0.0, -UPPER_ARM), (0.0, 0.0, -UPPER_ARM - MAN.forearm_length)
    zero = (0.0, 0.0, 0.0)
    upper = [
        Picture("arm", ARM_RADIUS, zero, elbow),
        Picture("arm", ARM_RADIUS, zero),
        Picture("arm", ARM_RADIUS, elbow),
    ]
    return [*upper, Picture("arm", _FOREARM_RADIUS, elbow, hand), Picture("arm", _FOREARM_RADIUS, hand)]


def _point(values: FloatArray) -> tuple[float, ...]:
    return tuple(np.asarray(values).tolist())
