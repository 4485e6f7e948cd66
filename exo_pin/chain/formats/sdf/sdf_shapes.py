"""What of an SDF's links is drawn or may touch, which other formats carry along."""

from __future__ import annotations

import xml.etree.ElementTree as ET
from collections.abc import Iterator
from pathlib import Path

from ....core.errors import FileFormatError
from ...structure.description import Shape
from ..urdf.urdf_shapes import found_file
from ..xml_elements import Element, as_numbers, numbers_of
from .sdf_frames import place_of

_SIZES = {
    "box": ("size",),
    "sphere": ("radius",),
    "cylinder": ("radius", "length"),
    "capsule": ("radius", "length"),
    "ellipsoid": ("radii",),
}
#: Sizes of three numbers.
_THREE = ("size", "radii")


def sdf_shapes(link: Element, name: str, folder: Path | None) -> Iterator[Shape]:
    """Visuals and collision shapes of a link that have a pose in it; those with a fault are left out."""
    for picture in (child for child in link.children if child.tag in ("visual", "collision")):
        try:
            yield _shape(picture, name, folder)
        except (FileFormatError, KeyError, ValueError):
            continue


def _shape(picture: Element, name: str, folder: Path | None) -> Shape:
    pose, geometry = picture.first("pose"), picture.first("geometry")
    if pose is not None and pose.attributes.get("relative_to"):
        raise ValueError
    (shape,) = (child for child in ([] if geometry is None else geometry.children) if ":" not in child.tag)
    words = {child.tag: child.text for child in shape.children}
    colour, file, material = None, None, picture.first("material")
    diffuse = None if material is None else material.first("diffuse")
    if diffuse is not None:
        colour = tuple(numbers_of(diffuse, diffuse.text, len(diffuse.text.split())))
        colour = (*colour, 1.0)[:4]
    if shape.tag == "mesh":
        size = tuple(numbers_of(shape, words.get("scale", "1 1 1"), 3))
        file = found_file(words["uri"].replace("model://", "package://"), folder)
    else:
        keys = _SIZES[shape.tag]
        size = tuple(value for key in keys for value in numbers_of(shape, words[key], 3 if key in _THREE else 1))
    return Shape.at(name, shape.tag, size, place_of(pose), file, colour, picture.tag)


def write_sdf_shape(link: ET.Element, shape: Shape, number: int) -> None:
    """Add a shape to a link whose frame is the shape's."""
    for tag in shape.elements:
        picture = ET.SubElement(link, tag, name=f"{tag}_{number}")
        pose = ET.SubElement(picture, "pose", rotation_format="quat_xyzw")
        pose.text = as_numbers([*shape.translation, *shape.quaternion])
        kind = ET.SubElement(ET.SubElement(picture, "geometry"), shape.kind)
        if shape.kind == "mesh":
            ET.SubElement(kind, "uri").text = str(shape.file)
            ET.SubElement(kind, "scale").text = as_numbers(shape.size)
        elif _SIZES[shape.kind][0] in _THREE:
            ET.SubElement(kind, _SIZES[shape.kind][0]).text = as_numbers(shape.size)
        else:
            for key, value in zip(_SIZES[shape.kind], shape.size, strict=True):
                ET.SubElement(kind, key).text = as_numbers(value)
        if shape.colour is not None and tag == "visual":
            ET.SubElement(ET.SubElement(picture, "material"), "diffuse").text = as_numbers(shape.colour)
