"""Seeded changes of random SDF files: another robot, or no robot at all."""

import xml.etree.ElementTree as ET

import numpy as np
from sdf_robots import KINDS, random_sdf


def _pick(rng, items):
    return items[int(rng.integers(len(items)))]


def _numbers(root):
    return [element for element in root.iter() if element.text and element.text.strip() and not list(element)]


def number(rng, root):
    element = _pick(rng, _numbers(root))
    words = element.text.split()
    words[int(rng.integers(len(words)))] = _pick(
        rng, ("0", "1", "-2", "1e-3", "1e9", "nan", "x", "", "1,5", "0x10", "inf")
    )
    element.text = " ".join(words)


def renamed(rng, root):
    element = _pick(rng, [each for each in root.iter() if each.get("name")])
    element.set("name", _pick(rng, ("link0", "joint1", "frame0", "", "world", "__model__", "other", "a::b")))


def redirected(rng, root):
    keys = ("relative_to", "expressed_in", "attached_to", "placement_frame", "canonical_link")
    found = [(each, key) for each in root.iter() for key in keys if each.get(key)]
    names = [each.get("name") for each in root.iter() if each.get("name")] + ["__model__", "nothing", "world", ""]
    if found:
        element, key = _pick(rng, found)
        element.set(key, _pick(rng, names))


def rehung(rng, root):
    ends = [each for each in root.iter() if each.tag in ("parent", "child")]
    names = [each.get("name") for each in root.iter() if each.tag in ("link", "frame")] + ["world", "nothing"]
    if ends:
        _pick(rng, ends).text = _pick(rng, names)


def retyped(rng, root):
    joints = list(root.iter("joint"))
    if joints:
        _pick(rng, joints).set("type", _pick(rng, (*KINDS, "revolute2", "screw", "gearbox", "hinge", "")))


def removed(rng, root):
    pairs = [(parent, child) for parent in root.iter() for child in parent if parent is not root]
    parent, child = _pick(rng, pairs)
    parent.remove(child)


def repeated(rng, root):
    pairs = [(parent, child) for parent in root.iter() for child in parent if parent is not root]
    parent, child = _pick(rng, pairs)
    parent.append(child)


def unknown(rng, root):
    element = _pick(rng, list(root.iter()))
    if rng.random() < 0.5:
        element.set(_pick(rng, ("nmae", "frame", "units")), "x")
    else:
        ET.SubElement(element, _pick(rng, ("psoe", "gravity", "static", "drag", "mass"))).text = _pick(
            rng, ("1", "true")
        )


def harmless(rng, root):
    link = _pick(rng, list(root.iter("link")))
    ET.SubElement(link, _pick(rng, ("visual", "collision", "sensor")), name="more")
    ET.SubElement(link, "gravity").text = "true"


def looped(rng, root):
    """One more joint, which closes a loop."""
    model = _pick(rng, list(root.iter("model")))
    links = [each.get("name") for each in model.findall("link")]
    joint = ET.SubElement(model, "joint", name="more", type=_pick(rng, ("revolute", "ball", "prismatic")))
    for tag in ("parent", "child"):
        ET.SubElement(joint, tag).text = _pick(rng, links)
    if joint.get("type") != "ball":
        ET.SubElement(ET.SubElement(joint, "axis"), "xyz").text = "0 1 1"


CHANGES = (number, number, renamed, redirected, redirected, rehung, rehung, retyped, removed, repeated, unknown,
           harmless, harmless, looped, looped, looped)  # fmt: skip


def mutated_sdf(seed):
    """A mutated text; the same for the same seed."""
    rng = np.random.default_rng([seed, 7])
    root = ET.fromstring(random_sdf(int(rng.integers(1000))))
    for _ in range(int(rng.integers(1, 3))):
        _pick(rng, CHANGES)(rng, root)
    text = ET.tostring(root, encoding="unicode")
    if rng.random() < 0.03:
        at = int(rng.integers(len(text)))
        text = text[:at] + _pick(rng, ("<", "&", "\x00", ">")) + text[at:]
    return text
