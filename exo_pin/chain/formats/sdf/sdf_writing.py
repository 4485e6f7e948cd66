"""Writing a chain as SDF: every closure is one more joint, a linear coupling a <mimic> of joint b.

SDF holds poses of links, not positions of joints: all joints are zero in the file's configuration, which is closed.
Root joints: a free robot is not joined to the world, a ball root is a ball joint on it. A massless body between two
hinges that meet at right angles is the cross of a universal joint, ``<axis>`` and ``<axis2>``. A massless body at the
end of a joint, which a rigid closure welds to another link, is that link: the joint closes the loop itself. Any other
massless body is a link of zero mass, which a comment names, because engines may need some.

A hinge or slide has its damping, friction and spring, and its limits of position, effort and velocity. A joint
without a limit of effort that is not among the actuated ones gets a limit of zero, so that it is passive. SDF has no
armature, and no data of a ball joint. A model has no gravity of its own: that of the world counts, and another one than
the default stands in a comment. Names that SDF does not allow are replaced.
"""

from __future__ import annotations

import xml.etree.ElementTree as ET

import numpy as np

from ....core.conventions import GRAVITY
from ....core.errors import InvalidInput
from ....core.validation import FloatArray
from ...structure.chain_state import ChainState
from ..bodies import TreeBody, joined_bodies, loose_ends, one_sided, tree_bodies
from ..urdf.urdf_mimic import linear
from ..xml_numbers import as_numbers
from .sdf_elements import FORMS, SdfWriter

_VERSION, _VERSION_WITH_MIMICS = "1.9", "1.11"
#: Cosine of the angle of hinges, and their distance in m, up to which they make a universal joint.
_MEETING = 1e-9


def sdf_text(chain: ChainState, q: FloatArray) -> str:
    """The XML of a chain at a closed configuration.

    Parameters
    ----------
    chain : ChainState
        The chain.
    q : ndarray
        Shape (nq,), closed: the poses of the links in the file, where joints are zero.

    Raises
    ------
    InvalidInput
        If a joint or closure is of a kind that SDF does not have (cylindrical, distance, a
        coupling that is not linear, or a second one of the same joint b), or a joint has data that SDF cannot hold.
    """
    bodies = tree_bodies(chain)
    crosses = _crosses(bodies, set(chain.topology.joints.ravel().tolist()))
    ends = loose_ends(chain, bodies)
    links = [body for body in bodies if body.index not in {*(cross.index for cross in crosses.values()), *ends}]
    mimics, closing = _mimics(chain), {c: bodies[index - 1] for index, (c, _) in ends.items()}
    writer = SdfWriter(chain, q, links)
    writer.ground()
    for body in links:
        writer.link(body)
    for body in links:
        writer.tree_joint(body, crosses.get(body.index))
    for c, closure in enumerate(chain.closures):
        form = closure.form_in(FORMS, "SDF has no joint")
        if c in closing:
            end = closing[c]
            writer.tree_joint(end, crosses.get(end.index), ends[end.index][1])
        elif form != "mimic":
            writer.closing_joint(c, closure)
    writer.add_mimics(mimics)
    writer.add_frames()
    root = ET.Element("sdf", version=_VERSION_WITH_MIMICS if mimics else _VERSION)
    root.append(writer.model)
    ET.indent(root)
    notes = ["Written by exo_pin. Joints read zero where the loops are closed."]
    gravity = np.asarray(chain.model.gravity.linear)
    if not np.array_equal(gravity, GRAVITY):
        notes.append(f"The chain's gravity: {as_numbers(gravity)} m/s².")
    if wider := one_sided(bodies):
        notes.append(wider)
    light = [body.name for body in links if body.inertia.mass == 0.0]
    if light:
        notes.append(f"Links of zero mass, of which some engines need a little: {', '.join(light)}.")
    note = f"<!-- {' '.join(notes)} -->"
    return "\n".join(['<?xml version="1.0"?>', note, ET.tostring(root, encoding="unicode"), ""])


def _mimics(chain: ChainState) -> dict[str, tuple[str, float]]:
    """Of joints b of couplings joint a and the multiplier; positions count from the closed configuration."""
    found: dict[str, tuple[str, float]] = {}
    for closure in chain.closures:
        if closure.kind.is_coupling:
            numbers = linear(closure)
            if numbers is None or closure.frame_b in found:
                raise InvalidInput(
                    f"SDF has no joint for the coupling closure {closure.name!r}: expected a linear coupling of two "
                    "joints, one for each joint b"
                )
            found[closure.frame_b] = (closure.frame_a, numbers[1])
    return found


def _crosses(bodies: list[TreeBody], held: set[int]) -> dict[int, TreeBody]:
    """Of bodies that hang on a universal joint its cross, a massless body between hinges that meet at right angles."""
    found = {}
    for each in joined_bodies(bodies, held):
        if len(each.before) == 1 and each.body.kind == each.before[0][0].kind == "hinge":
            cross, place = each.before[0]
            assert cross.axis is not None
            assert each.body.axis is not None
            first, second = place.rotation @ cross.axis, each.body.axis
            apart = float(place.translation @ np.cross(first, second))
            if abs(first @ second) < _MEETING and abs(apart) < _MEETING:
                found[each.body.index] = cross
    return found
