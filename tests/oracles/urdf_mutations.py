"""Seeded changes of a URDF, each with what a reader owes: the same robot, an error, or the robot that it now says.

``mutated(rng, xml)`` gives the changed file and one of

* SAME: the change means nothing in XML or URDF (blanks, comments, order, spelling of numbers, extensions, encoding);
* REFUSED: the file is no URDF any more, or describes no robot that can be;
* READ: another robot, or an error.
"""

import copy
import xml.etree.ElementTree as ET

import numpy as np
from urdf_changes import CHANGES, READ, REFUSED, SAME, comment, pick

EXTENSIONS = (
    '<gazebo reference="l1"><material>Gazebo/Grey</material><mu1 value="x,y"/></gazebo>',
    '<transmission name="t"><type>simple</type><joint name="j0"><hardwareInterface>E</hardwareInterface></joint>'
    '<actuator name="m"><mechanicalReduction>1</mechanicalReduction></actuator></transmission>',
    '<ros2_control name="c" type="system"><joint name="j0"><param name="x">1</param></joint></ros2_control>',
    '<sensor name="s" type="imu"/>',
    '<drake:joint_limits drake:value="nothing">1</drake:joint_limits>',
    '<my:note>what <my:b/> you like</my:note>',
)  # fmt: skip


def as_file(rng, root):
    """The text, or bytes in some encoding, of a tree; the extension is written as it stands in a file."""
    body = (
        ET.tostring(root, encoding="unicode")
        .replace("<EXTENSION />", pick(rng, EXTENSIONS))
        .replace("my_note", "my:note")
    )
    if "my:" in body or "drake:" in body or "xacro:" in body:
        prefixes = " ".join(f'xmlns:{name}="http://{name}"' for name in ("my", "drake", "xacro"))
        body = body.replace("<robot ", f"<robot {prefixes} ", 1)
    kind = int(rng.integers(7))
    if kind == 0:
        body = body.replace("\n", "\r\n")
    if kind == 1:
        return "\ufeff" + body
    if kind == 2:
        return ('<?xml version="1.0" encoding="utf-16"?>\n' + body).encode("utf-16")
    if kind == 3:
        return ('<?xml version="1.0" encoding="UTF-8"?>\n' + body).encode("utf-8-sig")
    if kind == 4:
        return ('<?xml version="1.0" encoding="ISO-8859-1"?>\n' + body).encode("iso-8859-1", "xmlcharrefreplace")
    return body


def effect(root):
    """What of a tree has an effect on the motion: no picture, no mimic of a fixed joint, nothing that is said twice."""
    root = copy.deepcopy(root)
    for element in list(root.iter()):
        for child in list(element):
            fixed = child.tag == "mimic" and element.get("type") == "fixed"
            if child.tag in ("visual", "collision", "material") or fixed:
                element.remove(child)
        if element is not root:
            seen = set()
            for child in list(element):
                if repr(content(child)) in seen:
                    element.remove(child)
                seen.add(repr(content(child)))
    return content(root)


def content(element):
    return element.tag, sorted(element.items()), (element.text or "").strip(), [content(child) for child in element]


def mutated(rng, xml):
    """The changed file, what is owed, the name of the change, and the tree that another reader is to read."""
    root = ET.fromstring(xml)
    owed = pick(rng, (SAME, REFUSED, REFUSED, REFUSED, READ))
    change = pick(rng, CHANGES[owed])
    change(rng, root)
    if owed == REFUSED and effect(root) == effect(ET.fromstring(xml)):
        owed = SAME
    if owed == REFUSED and rng.random() < 0.3:
        comment(rng, root)
    plain = ET.tostring(root, encoding="unicode")
    return as_file(rng, root), owed, change.__name__, plain


def damaged(rng, xml):
    """A file that is cut off, has a byte changed or a document type."""
    content = bytearray(xml.encode())
    kind = int(rng.integers(3))
    if kind == 0:
        return bytes(content[: int(rng.integers(len(content.rstrip()) - 2))])
    if kind == 1:
        at = int(rng.integers(len(content)))
        content[at : at + 1] = pick(rng, (b"\x00", b"\xff", b"\xc3\x28", b"<", b"&", b"\x07"))
        return bytes(content)
    return b'<!DOCTYPE robot [<!ENTITY m "1">]>' + content


def seeded(seed):
    return np.random.default_rng(np.append(2026, seed))
