"""What of a chain's links is drawn or may touch, as geoms of MJCF, read and written.

A geom that is in contact with others is a collision shape; one in the groups that MuJoCo shows at the start, 0 to 2, is
drawn. In a file that is written no geom weighs anything, and contact is switched off, because a chain has none.
"""

from __future__ import annotations

import xml.etree.ElementTree as ET
from collections.abc import Iterator
from pathlib import Path
from typing import Any

import numpy as np

from ....core.records import OneProcess
from ...structure.chain_state import ChainState
from ...structure.description import Shape
from ..leaving_out import LeftOut
from ..shapes import shapes_of_bodies
from ..xml_elements import as_numbers
from .mjcf_compiling import Compiled
from .mjcf_tree import pose

#: Meshes that MuJoCo reads.
_MESHES = (".stl", ".obj", ".msh")
#: MuJoCo's sizes over those of shapes.
_HALVES = {
    "box": [0.5, 0.5, 0.5],
    "sphere": [1.0],
    "cylinder": [1.0, 0.5],
    "capsule": [1.0, 0.5],
    "ellipsoid": [1.0, 1.0, 1.0],
}
#: Groups of geoms that MuJoCo draws at the start, and the group of written geoms by their role.
_SHOWN, _GROUPS = 3, {"visual": "2", "both": "2", "collision": "3"}
#: MuJoCo's colour of a geom that states none.
_GREY = (0.5, 0.5, 0.5, 1.0)


def mjcf_shapes(source: Compiled, frames: dict[int, str], left: LeftOut) -> Iterator[Shape]:
    """The geoms of a compiled model; planes, height fields, and meshes without a file or moved in it are left out.

    Parameters
    ----------
    source : Compiled
        The file.
    frames : dict of int to str
        Of every body its frame.
    left : LeftOut
        What is left out.
    """
    model = source.model
    for geom in range(model.ngeom):
        kind = source.kind("mjtGeom", model.geom_type[geom])
        place, file = pose(model.geom_pos[geom], model.geom_quat[geom]), None
        if kind == "mesh":
            mesh = int(model.geom_dataid[geom])
            size, file = model.mesh_scale[mesh], _path(source, mesh)
            # MuJoCo moves a mesh to its own centre and axes.
            place = place * pose(model.mesh_pos[mesh], model.mesh_quat[mesh]).inverse()
        elif kind in _HALVES:
            size = model.geom_size[geom][: len(_HALVES[kind])] / _HALVES[kind]
        if kind not in _HALVES and file is None:
            why = " without a file, or with refpos or refquat" if kind == "mesh" else ""
            left.say("geoms", f"geom {source.called('GEOM', geom)}, a {kind}{why}")
            continue
        touches = bool(model.geom_contype[geom] | model.geom_conaffinity[geom])
        is_shown = bool(model.geom_group[geom] < _SHOWN)
        role = ("both" if is_shown else "collision") if touches or not is_shown else "visual"
        own = frames[int(model.geom_bodyid[geom])]
        yield Shape.at(own, kind, tuple(size.tolist()), place, file, _colour(model, geom), role)


def _path(source: Compiled, mesh: int) -> str | None:
    """A mesh's file, None for one of the model's own, or whose corners are moved."""
    model, name = source.model, source.name("MESH", mesh)
    start = int(model.mesh_pathadr[mesh])
    if start < 0 or any(name.endswith(own) for own in source.moved):
        return None
    return bytes(model.paths[start : model.paths.index(b"\0", start)]).decode(errors="replace")


def _colour(model: Any, geom: int) -> tuple[float, ...] | None:
    """The geom's own colour, or its material's; None for neither."""
    own, material = tuple(float(f"{value:.7g}") for value in model.geom_rgba[geom]), int(model.geom_matid[geom])
    if own != _GREY:
        return own
    return None if material < 0 else tuple(float(f"{value:.7g}") for value in model.mat_rgba[material])


class ShapeWriter(OneProcess):
    """Writes the shapes of each joint's bodies, and the meshes that they need.

    Attributes
    ----------
    meshes : Element
        ``<asset>``.
    left_out : list of str
        Meshes that are not there or that MuJoCo does not read.
    touches : bool
        Whether a shape may touch others.
    """

    def __init__(self, chain: ChainState) -> None:
        self.meshes, self.left_out = ET.Element("asset"), list[str]()
        self._names: dict[tuple[str, tuple[float, ...]], str] = {}
        self._shapes = shapes_of_bodies(chain)
        self.touches = any(shape.role != "visual" for shape in chain.description.shapes)

    def add(self, element: ET.Element, joint: int) -> None:
        """Add the geoms of a joint's body."""
        for _, shape in self._shapes.get(joint, ()):
            x, y, z, w = shape.quaternion
            given = {"pos": as_numbers(shape.translation), "quat": as_numbers([w, x, y, z])}
            if shape.kind == "mesh":
                name = self._mesh(shape)
                if name is None:
                    continue
                given |= {"type": "mesh", "mesh": name}
            else:
                given |= {"type": shape.kind, "size": as_numbers(np.multiply(shape.size, _HALVES[shape.kind]))}
            if shape.colour is not None:
                given["rgba"] = as_numbers(shape.colour)
            if shape.role == "visual":
                given |= {"contype": "0", "conaffinity": "0"}
            ET.SubElement(element, "geom", given, group=_GROUPS[shape.role], mass="0")

    def _mesh(self, shape: Shape) -> str | None:
        path = Path(str(shape.file))
        if path.suffix.lower() not in _MESHES or not path.is_file():
            self.left_out.append(str(shape.file))
            return None
        key = (str(path), shape.size)
        if key not in self._names:
            name = self._names[key] = f"mesh_{len(self._names)}"
            ET.SubElement(self.meshes, "mesh", name=name, file=str(path), scale=as_numbers(shape.size), inertia="shell")
        return self._names[key]
