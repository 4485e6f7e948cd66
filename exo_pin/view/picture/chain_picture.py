"""Any closed chain in the scene: its URDF's visuals, rods between the joints of links that have none, its closures."""

from __future__ import annotations

import itertools
from collections.abc import Iterable, Iterator
from os import PathLike
from pathlib import Path
from typing import Any

import coal
import numpy as np
import pinocchio as pin

from ...chain import ClosedChain, Closure
from ...chain.formats.urdf.urdf_writing import COLOURS
from ...chain.structure.frames import se3
from ...core.records import OneProcess
from ...core.validation import FloatArray
from ..colours import BLUE, GREY, ORANGE, PURPLE, channels
from ..stage.shapes import along, flat_material, frustum, placement, segment
from ..stage.stage import Stage, mg

#: Radius of a link's rod, of a joint's ball and of a closure's mark, of the size of the whole.
_ROD, _JOINT, _MARK = 0.006, 0.011, 0.015
#: Links shorter than this are points, m; a smaller gap of a loop is not visible.
_POINT = 1e-6
#: Makes a bar of unit height six long, with its middle at zero.
_LONG = placement([1.0, 1.0, 6.0], [0.0, 0.0, -3.0])
_HERE = np.zeros(3)
_LINKS = ((0.45, 0.55, 0.68), (0.64, 0.60, 0.50), (0.50, 0.62, 0.58), (0.62, 0.52, 0.60))


class ChainPicture(OneProcess):
    """A closed chain in a configuration.

    Parameters
    ----------
    stage : Stage
        Where it is drawn.
    chain : ClosedChain
        What is drawn.
    urdf : path-like or str, optional
        The URDF that it was read from, or its XML, for its visuals; a chain does not keep them. Meshes are looked for
        beside it.
    q : ndarray
        Shape (nq,), a configuration to take the size from.
    root : str
        Name of its node.
    marks : bool
        Whether closures are marked.
    with_arm : bool
        Whether the arm is drawn; a human figure brings its own.
    moved : ndarray
        Shape (3,), m, arm frame: displacement of what the arm carries, but not of the arm itself.

    Attributes
    ----------
    notes : list of str
        What could not be drawn, and why.
    loops : list of Closure
        The closures that are drawn: all but couplings, which are nowhere.
    balls : set of str
        Joints that are drawn as balls.
    size : float
        Diagonal of the box about all of it at ``q``, m.
    """

    def __init__(
        self,
        stage: Stage,
        chain: ClosedChain,
        urdf: str | PathLike[str] | None,
        q: FloatArray,
        root: str = "chain",
        marks: bool = True,
        with_arm: bool = True,
        moved: FloatArray = _HERE,
    ) -> None:
        self._stage, self._chain = stage, chain
        # Closures of a given distance are links that the tree does not have.
        loops = [closure for closure in chain.closures if not closure.kind.is_coupling]
        self.loops = [closure for closure in loops if marks or closure.distance is not None]
        node = "closures" if marks else f"{root}/closures"
        self._paths = [f"/meshcat/{node}/chain_{k}" for k in range(len(self.loops))]
        visuals, self.notes = (None, []) if urdf is None else urdf_visuals(chain.model, urdf, "by its joints")
        self._looks = shapes = pin.GeometryModel() if visuals is None else visuals
        self.size = max(float(np.linalg.norm(np.ptp(self.corners(q), axis=0))), 1e-3)
        drawn = {shape.parentJoint for shape in shapes.geometryObjects}
        self.balls = set(chain.model.names[1:]) - {chain.model.names[joint] for joint in drawn}
        for shape in self._skeleton(drawn):
            shapes.addGeometryObject(shape)
        for name, of_link in self._of_arm(shapes):
            if not with_arm:
                shapes.removeGeometryObject(name)
            elif of_link:
                shapes.geometryObjects[shapes.getGeometryId(name)].placement.translation -= moved
        self._picture = stage.picture(chain.model, shapes, root)
        self._load_closures()

    def show(self, q: FloatArray) -> None:
        """Draw it at q, shape (nq,), closed or not."""
        self._picture.display(q)
        size = _MARK * self.size
        for path, closure, (a, b) in zip(self._paths, self.loops, self.closure_frames(q), strict=True):
            for end, frame in (("a", a), ("b", b)):
                placed = placement(size * along(_axis(closure, frame)), frame.translation)
                self._stage.set_transform(f"{path}/{end}", placed)
            gap = b.translation - a.translation
            # No shape is drawn at zero size: where the loop is closed the line is a speck inside the mark.
            wide = 0.3 * size if np.linalg.norm(gap) > _POINT else _POINT
            self._stage.set_transform(f"{path}/gap", segment(a.translation, b.translation, wide))

    def closure_frames(self, q: FloatArray) -> Iterator[tuple[pin.SE3, pin.SE3]]:
        """Both frames of every closure in the world, without couplings, which have none."""
        frames = self._chain.placements(q)
        for closure in self.loops:
            yield (
                frames[closure.frame_a] * se3(closure.placement_a),
                frames[closure.frame_b] * se3(closure.placement_b),
            )

    def corners(self, q: FloatArray) -> FloatArray:
        """Joints, closures, links' origins and corners of the boxes about what is drawn, shape (k, 3), m."""
        frames = [place.translation for place in self._chain.placements(q).values()]
        closures = [frame.translation for pair in self.closure_frames(q) for frame in pair]
        return np.vstack([*frames, *closures, _boxes(self._chain.model, self._looks, q)])

    def _skeleton(self, drawn: set[int]) -> Iterator[Any]:
        """Rods and balls for the bodies that have no visuals, the ground among them."""
        model, actuated = self._chain.model, set(self._chain.roles.actuated)
        for joint in range(model.njoints):
            if joint in drawn:
                continue
            name = model.names[joint]
            colour = (0.55, 0.58, 0.62) if joint == 0 else _LINKS[joint % len(_LINKS)]
            for k, point in enumerate(self._corners(joint)):
                length = float(np.linalg.norm(point))
                if length > _POINT:
                    rod = pin.SE3(along(point / length), point / 2)
                    yield _shape(f"{name}_rod_{k}", joint, rod, coal.Cylinder(_ROD * self.size, length), colour)
            if joint > 0:
                driven = name in actuated
                ball = coal.Sphere((1.3 if driven else 1.0) * _JOINT * self.size)
                yield _shape(f"{name}_joint", joint, pin.SE3.Identity(), ball, channels(BLUE if driven else GREY))

    def _corners(self, joint: int) -> list[FloatArray]:
        """What a body joins, in the axes of its joint: next joints, closures, links fixed to it; else its far end."""
        model = self._chain.model
        found = [model.jointPlacements[k].translation for k in range(1, model.njoints) if model.parents[k] == joint]
        top, drawn = self._chain._state.topology, [closure in self.loops for closure in self._chain.closures]
        found += list(top.local[:, :, 3][(top.joints == joint) & np.array(drawn, dtype=bool)[:, None]])
        found += [
            frame.placement.translation
            for frame in model.frames
            if frame.parentJoint == joint and frame.type == pin.FrameType.BODY
        ]
        far = [point for point in found if np.linalg.norm(point) > _POINT]
        if not far and joint > 0 and model.inertias[joint].mass > 0.0:
            # A last link, whose end has no frame: as far again as its centre of mass.
            far = [2.0 * model.inertias[joint].lever]
        return [np.array(point) for point in np.unique(np.round(far, 9), axis=0)] if far else []

    def _load_closures(self) -> None:
        for path, closure in zip(self._paths, self.loops, strict=True):
            for end in "ab":
                material = flat_material(PURPLE, on_top=True)
                self._stage.set_object(f"{path}/{end}/ball", mg.Sphere(1.0), material)
                if closure.axis is not None:
                    self._stage.set_object(f"{path}/{end}/axis", frustum(0.35, 0.35), material)
                    self._stage.set_transform(f"{path}/{end}/axis", _LONG)
            self._stage.set_object(f"{path}/gap", frustum(1.0, 1.0), flat_material(ORANGE, on_top=True))

    def _of_arm(self, shapes: Any) -> list[tuple[str, bool]]:
        """What is the arm's own: of its link the shapes in the colour of arms (True), and its rods (False)."""
        model, link, own = self._chain.model, self._chain.roles.arm, []
        if link is None:
            return []
        arm = model.frames[model.getFrameId(link)].parentJoint
        for shape in shapes.geometryObjects:
            coloured = np.allclose(shape.meshColor, COLOURS["arm"], atol=1e-6)
            # A shape of a joint names no frame.
            framed = shape.parentFrame < model.nframes and model.frames[shape.parentFrame].name == link
            of_link = framed and coloured
            if shape.parentJoint == arm and (of_link or shape.name.startswith(f"{model.names[arm]}_")):
                own.append((shape.name, of_link))
        return own


def _boxes(model: Any, shapes: Any, q: FloatArray) -> FloatArray:
    """Corners of the boxes about all shapes at q, shape (k, 3), m."""
    data, placed = model.createData(), shapes.createData()
    pin.updateGeometryPlacements(model, data, shapes, placed, q)
    corners = np.array(list(itertools.product((0, 1), repeat=3)), dtype=bool)
    found = [np.zeros((0, 3))]
    for shape, place in zip(shapes.geometryObjects, placed.oMg, strict=True):
        shape.geometry.computeLocalAABB()
        box = shape.geometry.aabb_local
        local = np.where(corners, np.asarray(box.max_).ravel(), np.asarray(box.min_).ravel())
        found.append(local @ place.rotation.T + place.translation)
    return np.vstack(found)


def _axis(closure: Closure, frame: pin.SE3) -> FloatArray:
    """Unit vector along which the mark of a closure lies, base frame."""
    own = np.array([0.0, 0.0, 1.0] if closure.axis is None else closure.axis)
    turned: FloatArray = frame.rotation @ (own / np.linalg.norm(own))
    return turned


def _shape(name: str, joint: int, placement: pin.SE3, geometry: Any, colour: Iterable[float]) -> Any:
    shape = pin.GeometryObject(name, joint, placement, geometry)
    shape.meshColor = np.array([*colour, 1.0])
    return shape


def closure_words(closure: Closure) -> str:
    """A closure in words, for a label."""
    return f"{closure.name}: {closure.type if closure.distance is None else f'{closure.distance:g} m apart'}"


def urdf_visuals(
    model: pin.Model, urdf: str | PathLike[str], instead: str
) -> tuple[pin.GeometryModel | None, list[str]]:
    """Visuals of a URDF or of its XML, on the links of the model that have the same names.

    None where they cannot be read, and then a note that says why, and how the robot is drawn ``instead``.
    """
    try:
        return read_visuals(model, urdf), []
    except (RuntimeError, ValueError) as error:
        reason = " ".join(str(error).split())
        return None, [f"drawn {instead}: the URDF's visuals cannot be read ({reason:.200})"]


def read_visuals(model: pin.Model, urdf: str | PathLike[str]) -> pin.GeometryModel:
    """Visuals of a URDF or of its XML, on the links of the model that have the same names."""
    if isinstance(urdf, str) and urdf.lstrip().startswith("<"):
        return pin.buildGeomFromUrdfString(model, urdf, pin.GeometryType.VISUAL)
    folder = Path(urdf).resolve().parent
    folders = [str(folder), *(str(above) for above in list(folder.parents)[:2])]
    return pin.buildGeomFromUrdf(model, str(urdf), pin.GeometryType.VISUAL, package_dirs=folders)
