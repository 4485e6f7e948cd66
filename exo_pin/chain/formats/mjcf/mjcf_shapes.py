"""What of a chain's links is drawn, as geoms of MJCF that neither weigh nor collide."""

from __future__ import annotations

import xml.etree.ElementTree as ET
from pathlib import Path

import numpy as np

from ....core.records import OneProcess
from ...structure.chain_state import ChainState
from ...structure.description import Shape
from ..xml_numbers import as_numbers

__all__ = ["ShapeWriter"]

#: Meshes that MuJoCo reads.
_MESHES = (".stl", ".obj")
_HALVES = {"box": [0.5, 0.5, 0.5], "sphere": [1.0], "cylinder": [1.0, 0.5], "capsule": [1.0, 0.5]}


class ShapeWriter(OneProcess):
    """Writes the shapes of each joint's bodies, and the meshes that they need.

    Attributes
    ----------
    meshes : Element
        ``<asset>``.
    left_out : list of str
        Meshes that are not there or that MuJoCo does not read.
    """

    def __init__(self, chain: ChainState) -> None:
        self.meshes, self.left_out = ET.Element("asset"), list[str]()
        self._names: dict[tuple[str, tuple[float, ...]], str] = {}
        self._shapes: dict[int, list[Shape]] = {}
        frames = chain.model.frames
        for shape in chain.description.shapes:
            if shape.frame in chain.frames:
                frame = frames[chain.frames[shape.frame]]
                self._shapes.setdefault(int(frame.parentJoint), []).append(shape.moved(frame.placement))

    def add(self, element: ET.Element, joint: int) -> None:
        """Add the geoms of a joint's body."""
        for shape in self._shapes.get(joint, ()):
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
            ET.SubElement(element, "geom", given, contype="0", conaffinity="0", group="2", mass="0")

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
