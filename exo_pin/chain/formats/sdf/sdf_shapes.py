"""What of an SDF's links is drawn, which other formats carry along."""

from __future__ import annotations

import xml.etree.ElementTree as ET
from collections.abc import Iterator
from pathlib import Path

from ....core.errors import FileFormatError
from ...structure.description import Shape
from ..urdf.urdf_shapes import found_file
from ..xml_elements import Element
from ..xml_numbers import as_numbers, numbers_of
from .sdf_frames import place_of

__all__ = ["sdf_shapes", "write_sdf_shape"]

_SIZES = {"box": ("size",), "sphere": ("radius",), "cylinder": ("radius", "length"), "capsule": ("radius", "length")}


def sdf_shapes(link: Element, name: str, folder: Path | None) -> Iterator[Shape]:
    """The visuals of a link that have a pose in it; those with a fault are left out."""
    for visual in link.all("visual"):
        try:
            yield _shape(visual, name, folder)
        except (FileFormatError, KeyError, ValueError):
            continue


def _shape(visual: Element, name: str, folder: Path | None) -> Shape:
    pose, geometry = visual.first("pose"), visual.first("geometry")
    if pose is not None and pose.attributes.get("relative_to"):
        raise ValueError
    (shape,) = (child for child in ([] if geometry is None else geometry.children) if ":" not in child.tag)
    words = {child.tag: child.text for child in shape.children}
    colour, material = None, visual.first("material")
    diffuse = None if material is None else material.first("diffuse")
    if diffuse is not None:
        colour = tuple(numbers_of(diffuse, diffuse.text, len(diffuse.text.split())))
        colour = (*colour, 1.0)[:4]
    if shape.tag == "mesh":
        scale = tuple(numbers_of(shape, words.get("scale", "1 1 1"), 3))
        file = words["uri"].replace("model://", "package://", 1)
        return Shape.at(name, "mesh", scale, place_of(pose), found_file(file, folder), colour)
    size = tuple(
        value for key in _SIZES[shape.tag] for value in numbers_of(shape, words[key], 3 if key == "size" else 1)
    )
    return Shape.at(name, shape.tag, size, place_of(pose), None, colour)


def write_sdf_shape(link: ET.Element, shape: Shape, number: int) -> None:
    """Add a ``<visual>`` to a link whose frame is the shape's."""
    visual = ET.SubElement(link, "visual", name=f"visual_{number}")
    pose = ET.SubElement(visual, "pose", rotation_format="quat_xyzw")
    pose.text = as_numbers([*shape.translation, *shape.quaternion])
    kind = ET.SubElement(ET.SubElement(visual, "geometry"), shape.kind)
    if shape.kind == "mesh":
        ET.SubElement(kind, "uri").text = str(shape.file)
        ET.SubElement(kind, "scale").text = as_numbers(shape.size)
    elif shape.kind == "box":
        ET.SubElement(kind, "size").text = as_numbers(shape.size)
    else:
        for key, value in zip(_SIZES[shape.kind], shape.size, strict=True):
            ET.SubElement(kind, key).text = as_numbers(value)
    if shape.colour is not None:
        ET.SubElement(ET.SubElement(visual, "material"), "diffuse").text = as_numbers(shape.colour)
