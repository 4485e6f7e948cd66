"""Ranges of the numbers of a URDF's links and joints.

Masses are zero or more. A body's principal moments of inertia are zero or more, and none is larger than the sum of
the other two; a link without mass has no inertia. Printed inertias violate this by their rounding, so each entry is
taken to be known to half a unit of its last digit: with the matrix H of these half units, a principal moment may be
negative by |H|, and larger than the sum of the others by 3 |H| (Weyl's inequality, |.| the spectral norm), but by no
more than half of itself; an entry on the diagonal may be negative by its own half unit. Computer-aided design prints
noise instead of zero as well: moments below the mass times a micrometre squared count as zero.

Mimic joints of a URDF as couplings: position = multiplier times the other joint's position + offset.

A coupling of the closures file that says the same of the same two joints stands for the mimic joint, with its own name
and place among the rows. Otherwise the coupling is called after the joint, ``finger_mimic``, and comes last.

A continuous joint that is coupled has one number for its position, which counts turns, instead of cosine and sine.
"""

from __future__ import annotations

import dataclasses
from collections.abc import Iterator, Mapping, Sequence

import numpy as np
import pinocchio as pin

from ....core.errors import InvalidInput
from ....core.validation import FloatArray
from ...structure.closures import Closure
from ...structure.description import Closures
from ..bodies import free_name, lawful_moments
from ..joint_data import NO_LIMIT
from ..leaving_out import LeftOut
from ..xml_elements import NOTHING, Element, half_unit, number, numbers, vector

#: Radius of gyration, m, below which an inertia is rounding noise.
_NOISE = 1e-6
#: Shortest axis that still has a direction.
_SHORTEST_AXIS = 1e-6
_KINDS = ("revolute", "continuous", "prismatic", "fixed", "floating", "planar")
_MOVING_ALONG_AXIS = ("revolute", "continuous", "prismatic")
_ENTRIES = (("ixx", "ixy", "ixz"), ("ixy", "iyy", "iyz"), ("ixz", "iyz", "izz"))
_FULL_TURN = 2.0 * np.pi


def check_origin(element: Element | None, version: tuple[int, int]) -> None:
    """An ``<origin>`` of three numbers each, or with a unit quaternion from version 1.1 on.

    Raises
    ------
    FileFormatError
        If it is anything else.
    """
    vector(element, "xyz", NOTHING)
    vector(element, "rpy", NOTHING)
    if element is None or "quat_xyzw" not in element.attributes:
        return
    if version < (1, 1):
        raise element.error('needs <robot version="1.1">: URDF 1.0 has no such attribute', "quat_xyzw")
    origin_of(element)


def origin_of(element: Element | None) -> pin.SE3:
    """The placement that an ``<origin>``, or the attributes of another element, state; the identity without one.

    Raises
    ------
    FileFormatError
        If these are no numbers, the quaternion is none of length 1, or there are angles, too.
    """
    place = vector(element, "xyz", NOTHING)
    if element is not None and "quat_xyzw" in element.attributes:
        if "rpy" in element.attributes:
            raise element.error("expected rpy or quat_xyzw, got both")
        turn = np.array(numbers(element, "quat_xyzw", 4))
        length = float(np.linalg.norm(turn))
        if abs(length - 1.0) > 1e-6:
            raise element.error(f"expected a quaternion of length 1, got length {length:.9g}", "quat_xyzw")
        return pin.SE3(pin.Quaternion(turn).normalized(), place)
    return pin.SE3(pin.rpy.rpyToMatrix(vector(element, "rpy", NOTHING)), place)


def inertia_of(inertial: Element, left: LeftOut) -> tuple[float, FloatArray]:
    """Mass, kg, and inertia about the centre of mass, shape (3, 3), kg m², of an ``<inertial>``.

    What no body has is left out of the check by name, "inertia_rules", and read as it stands.

    Raises
    ------
    FileFormatError
        If no body has them, see the module.
    """
    mass_element, inertia = inertial.first("mass"), inertial.first("inertia")
    assert mass_element is not None
    assert inertia is not None
    mass = number(mass_element, "value")
    if mass < 0.0:
        raise mass_element.error(f"expected a mass of zero or more, got {mass:g} kg", "value")
    matrix = np.array([[number(inertia, key) for key in row] for row in _ENTRIES])
    if mass == 0.0:
        if matrix.any():
            advice = "give it a mass, or make the inertia zero"
            left.named("inertia_rules", "the link has inertia but no mass", advice, inertia.error)
        return mass, matrix
    scale = float(np.abs(matrix).max())
    if scale == 0.0:
        return mass, matrix
    # Divided by the largest entry, so that no square of it overflows.
    moments = np.linalg.eigvalsh(matrix / scale) * scale
    half = np.array([[half_unit(inertia.attributes[key]) for key in row] for row in _ENTRIES])
    slack = scale * float(np.linalg.norm(half / scale, 2)) + 1e-14 * scale + mass * _NOISE**2
    shown = ", ".join(f"{moment:.6g}" for moment in moments)
    own = np.diag(matrix) + np.diag(half) + 1e-14 * scale + mass * _NOISE**2
    if moments[0] < -slack or own.min() < 0.0:
        what = f"no body has a negative principal moment of inertia; they are {shown} kg m²"
        left.named("inertia_rules", what, "mend the file", inertia.error)
    beyond = moments[2] - moments[1] - moments[0]
    # A negative moment makes the largest larger than the others' sum, too.
    if beyond > 1e-14 * scale:
        lawful = ", ".join(f"{moment:.6g}" for moment in lawful_moments(np.asarray(moments, dtype=np.float64)))
        said = f"{inertial.place}: principal moments of {shown} kg m², as rounded digits make them of {lawful}"
        left.say("rounding", f"{said}; read as they stand")
    # Numbers of one digit only: even then rounding makes no more than half of the largest moment.
    coarsest = 0.5 * moments[2] + 3.0 * (1e-14 * scale + mass * _NOISE**2)
    if beyond > min(3.0 * slack, coarsest):
        what = "no body has a principal moment of inertia that is larger than the sum of the other two"
        left.named("inertia_rules", f"{what}; they are {shown} kg m²", "mend the file", inertia.error)
    return mass, matrix


def check_joint(joint: Element, version: tuple[int, int], left: LeftOut) -> None:
    """A joint's type, axis, limits, damping and friction.

    Raises
    ------
    FileFormatError
        If a value is out of its range, or is not one that the joint's type has.
    """
    kind = joint.attributes["type"]
    if kind not in _KINDS:
        raise joint.error(f"expected one of {', '.join(_KINDS)}, got {kind!r}", "type")
    check_origin(joint.first("origin"), version)
    axis = vector(joint.first("axis"), "xyz", (1.0, 0.0, 0.0))
    if vector(joint.first("axis"), "rpy", NOTHING).any():
        raise (joint.first("axis") or joint).error("an axis is a direction, and has no angles: leave them out", "rpy")
    if kind in (*_MOVING_ALONG_AXIS, "planar") and float(np.abs(axis).max()) < _SHORTEST_AXIS:
        raise (joint.first("axis") or joint).error(f"expected a direction, got {axis.tolist()}", "xyz")
    if kind == "planar" and not (axis[2] > 0.0 and axis[0] == axis[1] == 0.0):
        raise (joint.first("axis") or joint).error(
            f'a planar joint is read with the axis "0 0 1" only, got {axis.tolist()} (URDF\'s default is "1 0 0"): '
            "turn the joint's origin so that the normal of the plane is its z axis"
        )
    _check_dynamics(joint, kind)
    _check_limit(joint, kind, version, left)
    for element in filter(None, map(joint.first, ("calibration", "safety_controller"))):
        for attribute in element.attributes:
            if ":" not in attribute and attribute != "reference_position":
                number(element, attribute)


def unread_physics(root: Element) -> Iterator[tuple[Element, str]]:
    """What other programs have added to a URDF that may change the motion, with the element that holds it.

    Raises
    ------
    FileFormatError
        If a link is to be ignored by another program, which leaves open what the robot is.
    """
    for link in root.all("link"):
        if link.attributes.get("drake_ignore", "false").lower() not in ("false", "0"):
            raise link.error("drake_ignore makes two robots of this file: remove the link, or the attribute")
        for tag in ("gravity", "kinematic"):
            element = link.first(tag)
            if element is not None:
                yield element, f"<{tag}>{element.text}</{tag}>"
    for joint in root.all("joint"):
        for tag, read in (("joint_properties", ()), ("dynamics", ("damping", "friction"))):
            element = joint.first(tag)
            for key, value in () if element is None else element.attributes.items():
                if key not in read and ":" not in key and value.strip() not in ("0", "0.0"):
                    yield element, f'{key}="{value}"'  # type: ignore[misc]


def _check_dynamics(joint: Element, kind: str) -> None:
    dynamics = joint.first("dynamics")
    if dynamics is None:
        return
    for attribute in ("damping", "friction"):
        value = number(dynamics, attribute, 0.0)
        if value < 0.0:
            raise dynamics.error(f"expected zero or more, got {value:g}", attribute)
        if value != 0.0 and kind in ("floating", "planar"):
            raise dynamics.error(f"a {kind} joint's {attribute} is not read; it has to be zero, got {value:g}")


def _check_limit(joint: Element, kind: str, version: tuple[int, int], left: LeftOut) -> None:
    limit = joint.first("limit")
    bounded = kind in ("revolute", "prismatic")
    if limit is None:
        if bounded:
            raise joint.error(f"<limit> is missing; a {kind} joint needs one (a continuous joint does not)")
        return
    values = {key: number(limit, key) for key in limit.attributes if key in _LIMITS}
    for key, value in values.items():
        if key not in ("lower", "upper") and value < 0.0:
            raise limit.error(f"expected zero or more, got {value:g}", key)
    if kind in ("floating", "planar") and any(values.values()):
        raise limit.error(f"the limits of a {kind} joint are not read; leave them out")
    if kind in _MOVING_ALONG_AXIS and version < (1, 2):
        for key in ("effort", "velocity"):
            if key not in values:
                raise limit.error(f"the attribute {key!r} is missing")
    if bounded and version >= (1, 2):
        for key in ("lower", "upper"):
            if key not in values:
                raise limit.error(f"the attribute {key!r} is missing; URDF 1.2 has no default for it")
    lower, upper = values.get("lower", 0.0), values.get("upper", 0.0)
    if lower > upper:
        what = f"expected lower <= upper, got {lower:g} and {upper:g}"
        left.named("empty_limits", what, "exchange them", limit.error)
        limit.attributes |= {"lower": repr(-NO_LIMIT), "upper": repr(NO_LIMIT)}
    if kind == "continuous" and 0.0 < upper - lower < _FULL_TURN - 1e-3:
        left.say("limits", f"{limit.place}: a continuous joint has no limits, got {lower:g} to {upper:g} rad")


_LIMITS = ("lower", "upper", "effort", "velocity", "acceleration", "deceleration", "jerk")


#: Largest difference, relative and absolute, of numbers that say the same: rounding of references.
_SAME = 1e-12


def mimic_couplings(joints: Mapping[str, Element], left: LeftOut) -> tuple[Closure, ...]:
    """The couplings that the joints' ``<mimic>`` elements state.

    Parameters
    ----------
    joints : mapping of str to Element
        The joints by name.
    left : LeftOut
        Where a fixed joint's ``<mimic>`` is put down, which has no effect. A joint that follows a fixed one is held.

    Raises
    ------
    FileFormatError
        If a mimic joint or the joint that it follows is no hinge or slide, or there is no such joint, or it is the
        joint itself.
    """
    found = []
    for name, joint in joints.items():
        mimic = joint.first("mimic")
        if mimic is None:
            continue
        if joint.attributes["type"] == "fixed":
            left.say("mimic", f"joint {name!r} is fixed")
            continue
        leader = mimic.attributes["joint"]
        if leader not in joints:
            raise mimic.error(f"there is no joint {leader!r}", "joint")
        if leader == name:
            raise mimic.error("a joint cannot mimic itself", "joint")
        held = joints[leader].attributes["type"] == "fixed"
        for one in (name,) if held else (name, leader):
            kind = joints[one].attributes["type"]
            if kind not in ("revolute", "continuous", "prismatic"):
                raise mimic.error(f"expected hinges and slides; joint {one!r} is {kind}", "joint")
        powers = (number(mimic, "offset", 0.0), number(mimic, "multiplier", 1.0))
        if held:
            found.append(Closure(f"{name}_mimic", "coupling", "universe", name, polynomial=powers[:1]))
        else:
            found.append(Closure(f"{name}_mimic", "coupling", leader, name, polynomial=powers))
    return tuple(found)


def linear(coupling: Closure) -> tuple[float, float] | None:
    """Offset and multiplier of a coupling, None where it is not linear or holds a joint."""
    constant, slope, *higher = (*(coupling.polynomial or ()), 0.0, 0.0)
    if coupling.frame_a == "universe" or any(higher):
        return None
    r_a, r_b = coupling.references
    return r_b + constant - slope * r_a, slope


def with_mimics(closures: Closures, mimics: Sequence[Closure]) -> Closures:
    """Closures with those couplings of mimic joints that they do not state themselves.

    Raises
    ------
    InvalidInput
        If they state another linear coupling of the same two joints, in the same order.
    """
    more = []
    taken = {closure.name for closure in closures.closures}
    for mimic in mimics:
        stated = [
            other
            for other in closures.closures
            if (other.type, other.frame_a, other.frame_b) == ("coupling", mimic.frame_a, mimic.frame_b)
        ]
        if not stated:
            more.append(dataclasses.replace(mimic, name=free_name(mimic.name, taken)))
        for other in stated:
            numbers = linear(other)
            if numbers is None or not np.allclose(numbers, mimic.polynomial or (), rtol=_SAME, atol=_SAME):
                raise InvalidInput(
                    f"joint {mimic.frame_b!r} mimics {mimic.frame_a!r} with offset and multiplier {mimic.polynomial} "
                    f"in the URDF; closure {other.name!r} couples them otherwise: take one of the two out"
                )
    return dataclasses.replace(closures, closures=(*closures.closures, *more)) if more else closures
