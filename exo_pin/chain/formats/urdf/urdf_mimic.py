"""Mimic joints of a URDF as couplings: position = multiplier times the other joint's position + offset.

A coupling of the closures file that says the same of the same two joints stands for the mimic joint, with its own name
and place among the rows. Otherwise the coupling is called after the joint, ``finger_mimic``, and comes last.

A continuous joint that is coupled has one number for its position, which counts turns, instead of cosine and sine.
"""

from __future__ import annotations

import dataclasses
from collections.abc import Mapping, Sequence

import numpy as np

from ....core.errors import InvalidInput
from ...structure.closures import Closure
from ...structure.description import Closures
from ..bodies import free_name
from ..leaving_out import LeftOut
from ..xml_elements import Element, number

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


def coupled_joints(couplings: Sequence[Closure]) -> frozenset[str]:
    """Names of the joints of all couplings among closures."""
    return frozenset(name for item in couplings if item.polynomial is not None for name in (item.frame_a, item.frame_b))


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
