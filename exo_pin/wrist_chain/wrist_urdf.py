"""The wrist as URDF: the tree, and the closures that make a mechanism of it.

The tree hangs from the arm, because URDF has no ball joint and a chain of three hinges locks inside the daily
range: the root link is ``arm``, its frame is {O_B} with the origin at O, and the shoulder is a root joint that the
closures file names. From the arm each limb i (from 1) runs to the torso and is closed onto the world at A_i:

========================= ================= ==================== =========================================
joint                     type              axis                 child link
========================= ================= ==================== =========================================
``limb_i_platform_y``     revolute at B_i   -B_i/|B_i|, to O     ``limb_i_platform_cross``
``limb_i_platform_x``     revolute at B_i   X_i                  ``limb_i_platform_body``
``limb_i_slide``          prismatic at A_i  -s_i, to the torso   ``limb_i_base_body``
``limb_i_base_x``         revolute at A_i   X_i                  ``limb_i_base_cross`` (UPU only)
``limb_i_base_y``         revolute at A_i   -A_i/|A_i|, to O     ``limb_i_base`` (UPU only)
========================= ================= ==================== =========================================

X_i is the normal of the limb's plane (D-11) and s_i its direction from A_i to B_i, both in the neutral pose. A UPU
limb ends in a rigid closure of ``limb_i_base``; an SPS limb ends in a spherical closure of ``limb_i_base_body`` (its
idle spin about its own line is left out). Every link frame is parallel to {O_B} in the neutral pose, where all
joint angles are zero and all loops are closed. A positive slide lengthens the limb: q = l_i - l_i(neutral).

``part`` selects what is written:

* "whole": spherical root at O, with the arm's inertia; three UPU limbs give 18 coordinates, 18 rows, rank 15;
* "wrist": the same tree without the shoulder, free-flyer root; 21 coordinates, rank 18;
* "floating": free-flyer root and the shoulder as a spherical closure at O; 21 coordinates, 21 rows, rank 18;
* "shoulder": the arm alone on a spherical root.

A link whose mass is not known has no ``<inertial>``; an arm of unknown inertia is written as a point mass. Callers
have to refuse motions of such an arm. Files for simulators have assumed masses, which they state.

Writing mechanisms as files: one URDF and one closures file each, and the published set.

Pictures of the mechanism: cylinders and balls, so that a URDF needs no mesh files.
"""

from __future__ import annotations

import itertools
from collections.abc import Sequence
from os import PathLike
from pathlib import Path
from typing import Literal

import numpy as np

from ..chain.formats.closures_file import closures_text
from ..chain.formats.urdf.urdf_writing import Body, Document, Picture
from ..chain.structure.closures import Closure
from ..chain.structure.description import Closures, LimbRole, Roles, Root
from ..chain.structure.frames import Placement
from ..core.errors import InvalidInput
from ..core.errors.checked import checked
from ..core.files import as_file_stem, write_files
from ..core.validation import FloatArray, as_choice
from ..design.arm import Arm
from ..design.limb import LimbBody
from ..design.mechanism import Mechanism
from .assumed_masses import AssumedMasses

_ARM_RADIUS, _ROD_RADIUS, _CROSS_RADIUS = 0.035, 0.006, 0.012
_OUTER_RADIUS, _INNER_RADIUS = 0.012, 0.007
#: Rods of a ring turn by at most so much each, and a gap wider than this stays open, rad.
_LONGEST_ARC, _OPEN_GAP = np.radians(15.0), np.radians(150.0)


Part = Literal["whole", "wrist", "shoulder", "floating"]
#: Parts of a mechanism that can be written.
PARTS: tuple[Part, ...] = ("whole", "wrist", "shoulder", "floating")
#: Sine of the angle A_i O B_i below which the limb's plane has no direction.
_FOLDED_SINE = 1e-9
_TURN = float(np.pi)
_SUFFIX = {"whole": "", "wrist": "-wrist", "shoulder": "-shoulder", "floating": "-floating"}


def _point(values: FloatArray) -> tuple[float, ...]:
    return tuple(values.tolist())


def _ring(points: Sequence[FloatArray], axis: FloatArray | None, origin: FloatArray, colour: str) -> list[Picture]:
    """Rods through the points, seen from ``origin``: round ``axis`` through zero, or straight where there is none.

    A wide gap between neighbours on the ring has no rod, so that the ring can be put on from the side.
    """
    corners = [np.asarray(point) for point in points]
    closed = True
    if axis is not None:
        corners, closed = _bent(np.array(corners), axis)
    nexts = corners[1:] + corners[: 1 if closed else 0]
    return [
        Picture(colour, _ROD_RADIUS, _point(one - origin), _point(other - origin))
        for one, other in zip(corners, nexts, strict=False)
    ]


def _bent(points: FloatArray, axis: FloatArray) -> tuple[list[FloatArray], bool]:
    """Corners of short rods round an axis from point to point, and whether they close."""
    heights = points @ axis
    spokes = points - heights[:, None] * axis
    radii = np.linalg.norm(spokes, axis=1)
    x = spokes[0] / radii[0]
    y = np.cross(axis, x)
    angles = np.arctan2(spokes @ y, spokes @ x)
    order = np.argsort(angles)
    gaps = np.diff(angles[order], append=angles[order[0]] + 2 * np.pi)
    widest = int(np.argmax(gaps))
    closed = bool(gaps[widest] < _OPEN_GAP)
    # Start behind the widest gap.
    turn = [*order[widest + 1 :], *order[: widest + 1]]
    if closed:
        turn.append(turn[0])
    corners = [points[turn[0]]]
    for one, other in itertools.pairwise(turn):
        span = (angles[other] - angles[one]) % (2 * np.pi)
        count = max(int(np.ceil(span / _LONGEST_ARC)), 1)
        for share in np.arange(1, count + 1) / count:
            angle = angles[one] + share * span
            radius = radii[one] + share * (radii[other] - radii[one])
            height = heights[one] + share * (heights[other] - heights[one])
            corners.append(radius * (np.cos(angle) * x + np.sin(angle) * y) + height * axis)
        corners[-1] = points[other]
    return (corners[:-1] if closed else corners), closed


def arm_visuals(points: FloatArray, with_platform: bool, axis: FloatArray | None = None) -> list[Picture]:
    """The arm as a capsule down -z, and the platform's joints as a ring about ``axis``, held by struts."""
    depth = float(min(points[:, 2].min(), -0.1))
    tip = np.array([0.0, 0.0, 1.4 * depth])
    pictures = [
        Picture("arm", _ARM_RADIUS, (0.0, 0.0, 0.0), _point(tip)),
        Picture("arm", _ARM_RADIUS, (0.0, 0.0, 0.0)),
        Picture("arm", _ARM_RADIUS, _point(tip)),
    ]
    if with_platform:
        pictures += _ring(list(points), axis, np.zeros(3), "platform")
        pictures += [
            Picture("platform", _ROD_RADIUS, (0.0, 0.0, float(point[2])), _point(point))
            for point in points
            if np.hypot(point[0], point[1]) > _ARM_RADIUS
        ]
    return pictures


@checked
def mechanism_urdf(
    mechanism: Mechanism, part: str = "whole", assumed: AssumedMasses | None = None, visuals: bool = True
) -> tuple[str, Closures]:
    """Write a mechanism as URDF, in the layout of the module's description.

    Parameters
    ----------
    mechanism : Mechanism
        The design.
    part : {"whole", "wrist", "shoulder", "floating"}
        How much of it, and how it hangs.
    assumed : AssumedMasses, optional
        Masses for links that have none, for simulators; comments in the file state that they are assumed.
    visuals : bool
        Whether to write what the links look like.

    Returns
    -------
    str
        The XML.
    Closures
        Loops, root joint, gravity and roles.

    Raises
    ------
    InvalidInput
        If a limb has no length in the neutral pose, or a UPU limb no plane there.
    UnknownName
        If there is no such part.

    Examples
    --------
    >>> from exo_pin.wrist_chain import mechanism_urdf
    >>> urdf, closures = mechanism_urdf(ep.load("prototype").mechanism, part="floating", visuals=False)
    >>> chain = ep.ClosedChain.from_urdf(urdf, closures)
    >>> q = chain.close(chain.neutral())
    >>> chain.mobility(q).rank, len(chain.constraint_jacobian(q))  # of so many rows
    (18, 21)
    """
    as_choice("part", part, PARTS)
    document = Document(f"{mechanism.name}-{part}", _head(mechanism, part, assumed))
    limbs = [] if part == "shoulder" else [_Limb(mechanism, index) for index in range(mechanism.limb_count)]
    arm_points = mechanism.geometry.platform_points
    looks = arm_visuals(arm_points, bool(limbs), mechanism.geometry.platform_axis) if visuals else []
    document.link("arm", arm_body(mechanism.arm, arm_points, assumed, document), looks)
    closures = [Closure("shoulder", "spherical", "arm", "universe")] if part == "floating" else []
    first_upu = next((limb.name for limb in limbs if limb.is_upu), None)
    for limb in limbs:
        # The base ring does not move, so its picture belongs to the link that the closed loop fixes.
        ring = [other.a for other in limbs] if limb.name == first_upu else []
        limb.write(document, assumed, limb.visuals(ring) if visuals else {})
        closures.append(limb.closure())
    shoulder = {"whole": "root_joint", "shoulder": "root_joint", "floating": "shoulder", "wrist": None}[part]
    roles = Roles(
        tuple(f"{limb.name}_slide" for limb in limbs), shoulder, "arm", "arm", tuple(limb.role() for limb in limbs)
    )
    hangs = "spherical" if part in ("whole", "shoulder") else "free_flyer"
    root = Root(hangs, "root_joint", tuple(mechanism.gravity.tolist()))
    return document.text(), Closures(document.name, root, tuple(closures), roles)


class _Limb:
    """One limb in the neutral pose, everything in {O_B}."""

    def __init__(self, mechanism: Mechanism, index: int) -> None:
        geometry, self.limb = mechanism.geometry, mechanism.limbs[index]
        self.name = f"limb_{index + 1}"
        self.neutral = geometry.neutral
        self.a_world = geometry.base_points[index]
        self.a = self.neutral.as_matrix().T @ self.a_world
        base_axis = geometry.base_axis
        self.ring_axis = None if base_axis is None else self.neutral.as_matrix().T @ base_axis
        self.b = geometry.platform_points[index]
        reach_a, reach_b = float(np.linalg.norm(self.a)), float(np.linalg.norm(self.b))
        self.length = float(np.linalg.norm(self.b - self.a))
        if self.length < _FOLDED_SINE * (reach_a + reach_b):
            raise InvalidInput(f"{self.name} has no length in the neutral pose: choose another one")
        self.s = (self.b - self.a) / self.length
        self.y_base, self.y_platform = -self.a / reach_a, -self.b / reach_b
        normal = -np.cross(self.a, self.b)
        size = float(np.linalg.norm(normal))
        if size >= _FOLDED_SINE * reach_a * reach_b:
            self.x = normal / size
        elif self.is_upu:
            raise InvalidInput(
                f"{self.name} lies on a line through O in the neutral pose, so its joints have no common axis: "
                "choose another neutral pose"
            )
        else:
            # A limb without side force may have its cross axis anywhere across B_i.
            self.x = across(self.b)
        # The joint distance of every pose lies between these.
        self.travel = np.array([abs(reach_a - reach_b), reach_a + reach_b]) - self.length

    @property
    def is_upu(self) -> bool:
        return self.limb.kind == "UPU"

    @property
    def end(self) -> str:
        """The link that the closure holds."""
        return f"{self.name}_base" if self.is_upu else f"{self.name}_base_body"

    @property
    def greatest_effort(self) -> float:
        """The limit of effort in both directions, N; infinite if it is not known, or not the same in both."""
        least, greatest = self.limb.effort_range
        return greatest if least == -greatest else np.inf

    def closure(self) -> Closure:
        """What holds the limb to the torso."""
        quaternion = tuple(self.neutral.as_quat().tolist())
        place = Placement(tuple(self.a_world.tolist()), quaternion)
        kind = "rigid" if self.is_upu else "spherical"
        return Closure(f"{self.name}_base", kind, self.end, "universe", placement_b=place)

    def role(self) -> LimbRole:
        name = self.name
        return LimbRole(name, self.limb.kind, f"{name}_slide", f"{name}_platform_y", f"{name}_base")

    def visuals(self, ring: list[FloatArray]) -> dict[str, list[Picture]]:
        """What its links look like: halves that telescope, crosses, and the base ring through the points ``ring``."""
        zero, along = (0.0, 0.0, 0.0), self.length * self.s
        return {
            "cross": [Picture("cross", _CROSS_RADIUS, zero)],
            "platform_body": [Picture("platform_half", _OUTER_RADIUS, zero, _point(-0.55 * along))],
            "base_body": [Picture("base_half", _INNER_RADIUS, zero, _point(0.75 * along))],
            "base": _ring(ring, self.ring_axis, self.a, "base") if ring else [Picture("base", _CROSS_RADIUS, zero)],
        }

    def write(self, document: Document, assumed: AssumedMasses | None, looks: dict[str, list[Picture]]) -> None:
        """Add the limb's links and joints."""
        name, limb = self.name, self.limb
        cross = None if assumed is None else assumed.cross_body()
        platform_half, base_half = limb.platform_body, limb.base_body
        if assumed is not None:
            platform_half = platform_half or assumed.platform_half(self.length)
            base_half = base_half or assumed.base_half(self.length)
        turn = np.array([-_TURN, _TURN])
        zero = np.zeros(3)
        links = [f"{name}_{key}" for key in ("platform_cross", "platform_body", "base_body", "base_cross", "base")]
        document.link(links[0], cross, looks.get("cross", []))
        document.joint(f"{name}_platform_y", "revolute", "arm", links[0], self.b, self.y_platform, turn)
        document.link(links[1], _half_body(platform_half, -self.s), looks.get("platform_body", []))
        document.joint(f"{name}_platform_x", "revolute", links[0], links[1], zero, self.x, turn)
        document.link(links[2], _half_body(base_half, self.s), looks.get("base_body", []))
        strength = (self.greatest_effort, np.inf, 0.0, 0.0)
        document.joint(
            f"{name}_slide", "prismatic", links[1], links[2], self.a - self.b, -self.s, self.travel, strength=strength
        )
        if self.is_upu:
            document.link(links[3], cross, looks.get("cross", []))
            document.joint(f"{name}_base_x", "revolute", links[2], links[3], zero, self.x, turn)
            document.link(links[4], cross, looks.get("base", []))
            document.joint(f"{name}_base_y", "revolute", links[3], links[4], zero, self.y_base, turn)


def across(vector: FloatArray) -> FloatArray:
    """Unit vector at right angles to ``vector``: its cross product with the coordinate axis it is farthest from."""
    axis = np.cross(vector, np.eye(3)[np.abs(vector).argmin()])
    return np.asarray(axis / np.linalg.norm(axis))


def _half_body(half: LimbBody | None, along: FloatArray) -> Body | None:
    """A half of a limb; ``along`` points from its own joint to the other end."""
    if half is None:
        return None
    line = np.outer(along, along)
    inertia = half.transverse_inertia * (np.eye(3) - line) + half.axial_inertia * line
    return Body(half.mass, half.centre * along, inertia)


def arm_body(arm: Arm | None, points: FloatArray, assumed: AssumedMasses | None, document: Document) -> Body | None:
    """The arm's body, as far as it is known, with a note in the file where it is not."""
    if arm is None:
        return None if assumed is None else assumed.platform(points)
    if arm.inertia is not None:
        return Body(arm.mass, arm.centre_of_mass, arm.inertia)
    document.note("The inertia of the arm about its centre of mass is not known.")
    inertia = np.zeros((3, 3)) if assumed is None else assumed.arm_inertia(arm.mass)
    return Body(arm.mass, arm.centre_of_mass, inertia)


def _head(mechanism: Mechanism, part: str, assumed: AssumedMasses | None) -> list[str]:
    """Comments at the head of the file."""
    lines = [f"{mechanism.title or mechanism.name}: {part}. Written by exo_pin; load it with its closures file."]
    lines += [f"{key}: {text}" for key, text in mechanism.sources.items() if key in ("mechanism", "geometry", "arm")]
    lines.append(
        "URDF wants limits of effort and velocity: the largest number is none, or one that is not the same both ways. "
        "The slides' range is the geometry's."
    )
    if assumed is not None:
        lines.append(assumed.statement)
    return lines


@checked
def write_urdf(
    mechanism: Mechanism, folder: str | PathLike[str], part: str = "whole", assumed: AssumedMasses | None = None
) -> Path:
    """Write a mechanism's URDF and the closures file beside it.

    Each file appears whole or not at all, first the URDF, then the closures: if writing stops between the two, the
    URDF is new and the closures file is old.

    Parameters
    ----------
    mechanism : Mechanism
        The design; the files are called after it.
    folder : path-like
        Where to; made if it is not there.
    part : {"whole", "wrist", "shoulder", "floating"}
        See :func:`mechanism_urdf`.
    assumed : AssumedMasses, optional
        Masses for links that have none; simulators need them.

    Returns
    -------
    Path
        The URDF.

    Raises
    ------
    InvalidInput
        If the folder cannot be made, the mechanism's name is no file name, or for what :func:`mechanism_urdf`
        refuses.
    """
    as_file_stem(mechanism.name)
    xml, closures = mechanism_urdf(mechanism, part, assumed)
    stem = f"{mechanism.name}{_SUFFIX[part]}"
    return write_files(folder, {f"{stem}.urdf": xml, f"{stem}.closures.toml": closures_beside(closures, stem)})[0]


def closures_beside(closures: Closures, stem: str) -> str:
    """The closures file of ``stem.urdf``."""
    return closures_text(closures, f"What {stem}.urdf leaves out: its root, its loops, its roles. Written by exo_pin.")
