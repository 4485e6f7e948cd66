"""What of a URDF's links is drawn or may touch, which other formats carry along."""

from __future__ import annotations

import xml.etree.ElementTree as ET
from collections.abc import Iterator
from pathlib import Path

import numpy as np
import pinocchio as pin

from ....core.errors import FileFormatError
from ...structure.description import Shape
from ..leaving_out import LeftOut
from ..xml_elements import NOTHING, Element, as_numbers, number, vector
from .urdf_values import check_origin

#: Of every kind the attributes that are its size.
SIZES = {"box": ("size",), "sphere": ("radius",), "cylinder": ("radius", "length"), "capsule": ("radius", "length")}


def urdf_shapes(root: Element, folder: Path | None, version: tuple[int, int], left: LeftOut) -> Iterator[Shape]:
    """Visuals and collision shapes of a checked document; those with a fault, which is said, are left out.

    Parameters
    ----------
    root : Element
        The ``<robot>``.
    folder : Path or None
        Where its file stands.
    version : tuple of int
        Of URDF.
    left : LeftOut
        Where faults are put down.
    """
    colours = {item.attributes.get("name"): _colour(item, left) for item in root.all("material")}
    for link in root.all("link"):
        for picture in (child for child in link.children if child.tag in ("visual", "collision")):
            try:
                check_origin(picture.first("origin"), version)
                yield _shape(link.attributes["name"], picture, colours, folder, left)
            except FileFormatError as error:
                left.say("pictures", str(error))
            except (KeyError, ValueError):  # what is missing or unknown was said before
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


def _colour(material: Element, left: LeftOut) -> tuple[float, ...] | None:
    try:
        return tuple(vector(material.first("color"), "rgba", (0.0,) * 4).tolist()) if material.first("color") else None
    except FileFormatError as error:
        left.say("pictures", str(error))
        return None


def _shape(
    link: str, picture: Element, colours: dict[str | None, tuple[float, ...] | None], folder: Path | None, left: LeftOut
) -> Shape:
    geometry, origin, material = picture.first("geometry"), picture.first("origin"), picture.first("material")
    shapes = [child for child in ([] if geometry is None else geometry.children) if ":" not in child.tag]
    if len(shapes) != 1:
        raise picture.error(f"expected one shape, got {len(shapes)}")
    shape = shapes[0]
    place = pin.SE3(pin.rpy.rpyToMatrix(vector(origin, "rpy", NOTHING)), vector(origin, "xyz", NOTHING))
    colour = None
    if material is not None and picture.tag == "visual":
        colour = _colour(material, left) if material.first("color") else colours.get(material.attributes.get("name"))
    file = None
    if shape.tag == "mesh":
        size = tuple(vector(shape, "scale", (1.0, 1.0, 1.0)).tolist())
        file = found_file(shape.attributes["filename"], folder)
    elif shape.tag == "box":
        size = tuple(vector(shape, "size", NOTHING).tolist())
    else:
        size = tuple(number(shape, key) for key in SIZES[shape.tag])
    if shape.tag != "mesh" and min(size) < 0.0:
        raise shape.error(f"expected sizes of zero or more, got {size}")
    return Shape.at(link, shape.tag, size, place, file, colour, picture.tag)


def write_urdf_shape(link: ET.Element, shape: Shape) -> bool:
    """Add a shape to a link, and return whether URDF has one of its kind.

    URDF has capsules from version 1.1 on, which few programs read: one is written as a cylinder and two spheres.
    """
    if shape.kind == "ellipsoid":
        return False
    if shape.kind == "capsule":
        radius, length = shape.size
        parts = [Shape.at(shape.frame, "cylinder", shape.size, shape.place, None, shape.colour, shape.role)]
        for end in (-0.5, 0.5):
            tip = shape.place * pin.SE3(np.eye(3), np.array([0.0, 0.0, end * length]))
            parts.append(Shape.at(shape.frame, "sphere", (radius,), tip, None, shape.colour, shape.role))
        return all(write_urdf_shape(link, part) for part in parts)
    for tag in shape.elements:
        picture = ET.SubElement(link, tag)
        angles = pin.rpy.matrixToRpy(shape.place.rotation)
        ET.SubElement(picture, "origin", xyz=as_numbers(shape.translation), rpy=as_numbers(angles))
        geometry = ET.SubElement(picture, "geometry")
        if shape.kind == "mesh":
            ET.SubElement(geometry, "mesh", filename=str(shape.file), scale=as_numbers(shape.size))
        elif shape.kind == "box":
            ET.SubElement(geometry, "box", size=as_numbers(shape.size))
        else:
            given = dict(zip(SIZES[shape.kind], map(as_numbers, shape.size), strict=True))
            ET.SubElement(geometry, shape.kind, given)
        if shape.colour is not None and tag == "visual":
            material = ET.SubElement(picture, "material", name="_".join(f"{value:g}" for value in shape.colour))
            ET.SubElement(material, "color", rgba=as_numbers(shape.colour))
    return True
