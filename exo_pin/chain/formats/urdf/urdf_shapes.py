"""What of a URDF's links is drawn, which other formats carry along."""

from __future__ import annotations

import xml.etree.ElementTree as ET
from collections.abc import Iterator
from pathlib import Path

import pinocchio as pin

from ....core.errors import FileFormatError
from ...structure.description import Shape
from ..xml_elements import Element
from ..xml_numbers import as_numbers, number, vector

__all__ = ["found_file", "urdf_shapes", "write_urdf_shape"]

#: Of every kind the attributes that are its size.
_SIZES = {"box": ("size",), "sphere": ("radius",), "cylinder": ("radius", "length"), "capsule": ("radius", "length")}


def urdf_shapes(root: Element, folder: Path | None) -> Iterator[Shape]:
    """The visuals of a checked document; those with a fault, which the check has named, are left out.

    Parameters
    ----------
    root : Element
        The ``<robot>``.
    folder : Path or None
        Where its file stands.
    """
    colours = {item.attributes.get("name"): _colour(item) for item in root.all("material")}
    for link in root.all("link"):
        for visual in link.all("visual"):
            try:
                yield _shape(link.attributes["name"], visual, colours, folder)
            except (FileFormatError, KeyError, ValueError):
                continue


def found_file(name: str, folder: Path | None) -> str:
    """A mesh as a path, if it is there; as written if not.

    Of ``package://robot/mesh.stl`` the package is a folder of this name, which an ancestor of the file is or holds.
    """
    scheme, _, rest = name.partition("://")
    if not rest:
        path = Path(name) if folder is None else folder / name
        return str(path.resolve()) if path.is_file() else name
    if scheme == "file":
        return rest
    package, _, inside = rest.partition("/")
    for parent in () if folder is None else (folder, *folder.resolve().parents):
        for path in (parent / inside if parent.name == package else parent / rest, parent / rest):
            if path.is_file():
                return str(path.resolve())
    return name


def _colour(material: Element) -> tuple[float, ...] | None:
    try:
        return tuple(vector(material.first("color"), "rgba", (0.0,) * 4).tolist()) if material.first("color") else None
    except FileFormatError:
        return None


def _shape(
    link: str, visual: Element, colours: dict[str | None, tuple[float, ...] | None], folder: Path | None
) -> Shape:
    geometry, origin, material = visual.first("geometry"), visual.first("origin"), visual.first("material")
    (shape,) = (child for child in ([] if geometry is None else geometry.children) if ":" not in child.tag)
    place = pin.SE3(pin.rpy.rpyToMatrix(vector(origin, "rpy", (0.0,) * 3)), vector(origin, "xyz", (0.0,) * 3))
    colour = None
    if material is not None:
        colour = _colour(material) if material.first("color") else colours.get(material.attributes.get("name"))
    if shape.tag == "mesh":
        size = tuple(vector(shape, "scale", (1.0, 1.0, 1.0)).tolist())
        return Shape.at(link, "mesh", size, place, found_file(shape.attributes["filename"], folder), colour)
    if shape.tag == "box":
        return Shape.at(link, "box", tuple(vector(shape, "size", (0.0,) * 3).tolist()), place, None, colour)
    size = tuple(number(shape, key) for key in _SIZES[shape.tag])
    return Shape.at(link, shape.tag, size, place, None, colour)


def write_urdf_shape(link: ET.Element, shape: Shape) -> None:
    """Add a ``<visual>`` to a link."""
    visual = ET.SubElement(link, "visual")
    angles = pin.rpy.matrixToRpy(shape.place.rotation)
    ET.SubElement(visual, "origin", xyz=as_numbers(shape.translation), rpy=as_numbers(angles))
    geometry = ET.SubElement(visual, "geometry")
    if shape.kind == "mesh":
        ET.SubElement(geometry, "mesh", filename=str(shape.file), scale=as_numbers(shape.size))
    elif shape.kind == "box":
        ET.SubElement(geometry, "box", size=as_numbers(shape.size))
    else:
        given = dict(zip(_SIZES[shape.kind], map(as_numbers, shape.size), strict=True))
        ET.SubElement(geometry, shape.kind, given)
    if shape.colour is not None:
        material = ET.SubElement(visual, "material", name="_".join(f"{value:g}" for value in shape.colour))
        ET.SubElement(material, "color", rgba=as_numbers(shape.colour))
