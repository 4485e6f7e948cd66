"""What of the links of a URDF or SDF is drawn or may touch, which other formats carry along."""

from __future__ import annotations

import xml.etree.ElementTree as ET
from collections.abc import Callable, Iterator
from pathlib import Path

import numpy as np
import pinocchio as pin

from ...core.errors import FileFormatError
from ..structure.chain_state import ChainState
from ..structure.description import Shape
from .leaving_out import LeftOut
from .sdf.sdf_frames import place_of
from .urdf.urdf_values import check_origin, origin_of
from .xml_elements import Element, as_numbers, numbers_of, vector

#: Of every kind its sizes, and the numbers that each has.
_SIZES = {
    "box": {"size": 3},
    "sphere": {"radius": 1},
    "cylinder": {"radius": 1, "length": 1},
    "capsule": {"radius": 1, "length": 1},
    "ellipsoid": {"radii": 3},
    "mesh": {"scale": 3},
}


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
        for picture in _pictures(link):
            try:
                origin, material, colour = picture.first("origin"), picture.first("material"), None
                check_origin(origin, version)
                if material is not None and picture.tag == "visual":
                    own = material.first("color")
                    colour = _colour(material, left) if own else colours.get(material.attributes.get("name"))
                name, place = link.attributes["name"], origin_of(origin)
                yield _shape(name, picture, _words_of_urdf, place, colour, folder, left)
            except FileFormatError as error:
                left.say("pictures", str(error))
            except KeyError:  # what is missing or unknown was said before
                continue


def _pictures(link: Element) -> Iterator[Element]:
    return (child for child in link.children if child.tag in ("visual", "collision"))


def _colour(material: Element, left: LeftOut) -> tuple[float, ...] | None:
    try:
        return tuple(vector(material.first("color"), "rgba", (0.0,) * 4).tolist()) if material.first("color") else None
    except FileFormatError as error:
        left.say("pictures", str(error))
        return None


def sdf_shapes(link: Element, name: str, folder: Path | None, left: LeftOut) -> Iterator[Shape]:
    """Visuals and collision shapes of a link that have a pose in it; those with a fault are left out."""
    for picture in _pictures(link):
        try:
            yield sdf_shape(picture, name, folder, left)
        except (FileFormatError, KeyError):
            continue


def sdf_shape(picture: Element, name: str, folder: Path | None, left: LeftOut) -> Shape:
    """A visual or collision shape of an SDF's link of this name.

    Raises
    ------
    FileFormatError, KeyError
        If it is none that has a pose in the link, or has a size below zero, which is said.
    """
    pose, material, colour = picture.first("pose"), picture.first("material"), None
    if pose is not None and pose.attributes.get("relative_to"):
        raise pose.error("the pose is not relative to the link", "relative_to")
    diffuse = None if material is None else material.first("diffuse")
    if diffuse is not None:
        colour = (*numbers_of(diffuse, diffuse.text, len(diffuse.text.split())), 1.0)[:4]
    return _shape(name, picture, _words_of_sdf, place_of(pose), colour, folder, left)


def _words_of_urdf(shape: Element) -> dict[str, str]:
    """The sizes of a shape as written, and the file of a mesh; URDF has no ellipsoids."""
    given = {} if shape.tag == "ellipsoid" else {"size": "0 0 0"} | shape.attributes
    return given | {"file": given["filename"]} if shape.tag == "mesh" else given


def _words_of_sdf(shape: Element) -> dict[str, str]:
    given = {child.tag: child.text for child in shape.children}
    return given | {"file": given["uri"].replace("model://", "package://")} if shape.tag == "mesh" else given


def _shape(
    link: str,
    picture: Element,
    words_of: Callable[[Element], dict[str, str]],
    place: pin.SE3,
    colour: tuple[float, ...] | None,
    folder: Path | None,
    left: LeftOut,
) -> Shape:
    geometry = picture.first("geometry")
    shapes = [child for child in ([] if geometry is None else geometry.children) if ":" not in child.tag]
    if len(shapes) != 1:
        raise picture.error(f"expected one shape, got {len(shapes)}")
    shape, kind = shapes[0], shapes[0].tag
    words = {"scale": "1 1 1"} | words_of(shape)
    size = tuple(x for key, count in _SIZES[kind].items() for x in numbers_of(shape, words[key], count, key))
    file = None
    if kind == "mesh":
        file = _found_file(words["file"], folder)
    elif min(size) < 0.0:
        fault = shape.error(f"expected sizes of zero or more, got {size}")
        left.say("pictures", str(fault))
        raise fault
    return Shape.at(link, kind, size, place, file, colour, picture.tag)


def _found_file(name: str, folder: Path | None) -> str:
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


def shapes_of_bodies(chain: ChainState) -> dict[int, list[tuple[int, Shape]]]:
    """The shapes on each joint's body, in the joint's frame, with their numbers."""
    found: dict[int, list[tuple[int, Shape]]] = {}
    for number, shape in enumerate(chain.description.shapes):
        if shape.frame in chain.frames:
            frame = chain.model.frames[chain.frames[shape.frame]]
            found.setdefault(int(frame.parentJoint), []).append((number, shape.moved(frame.placement)))
    return found


def _size_texts(shape: Shape) -> dict[str, str]:
    """The sizes of a shape by their names."""
    numbers = iter(shape.size)
    return {key: as_numbers([next(numbers) for _ in range(count)]) for key, count in _SIZES[shape.kind].items()}


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
        file = {"filename": str(shape.file)} if shape.kind == "mesh" else {}
        ET.SubElement(ET.SubElement(picture, "geometry"), shape.kind, file | _size_texts(shape))
        if shape.colour is not None and tag == "visual":
            material = ET.SubElement(picture, "material", name="_".join(f"{value:g}" for value in shape.colour))
            ET.SubElement(material, "color", rgba=as_numbers(shape.colour))
    return True


def write_sdf_shape(link: ET.Element, shape: Shape, number: int) -> None:
    """Add a shape to a link whose frame is the shape's."""
    for tag in shape.elements:
        picture = ET.SubElement(link, tag, name=f"{tag}_{number}")
        pose = ET.SubElement(picture, "pose", rotation_format="quat_xyzw")
        pose.text = as_numbers([*shape.translation, *shape.quaternion])
        kind = ET.SubElement(ET.SubElement(picture, "geometry"), shape.kind)
        file = {"uri": str(shape.file)} if shape.kind == "mesh" else {}
        for key, text in (file | _size_texts(shape)).items():
            ET.SubElement(kind, key).text = text
        if shape.colour is not None and tag == "visual":
            ET.SubElement(ET.SubElement(picture, "material"), "diffuse").text = as_numbers(shape.colour)
