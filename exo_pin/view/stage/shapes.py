"""Shapes besides the URDF's visuals: arrows, cones, tubes and bodies of revolution."""

from __future__ import annotations

from typing import Any

import numpy as np
from numpy.typing import ArrayLike, NDArray

from ...core.records import OneProcess
from ...core.validation import FloatArray
from ..colours import channels, number
from .stage import Stage, mg

IntArray = NDArray[np.intp]

#: No shape is drawn at zero size, because a matrix without an inverse has no normals: it is drawn this small, m.
_NOTHING = 1e-6


def along(direction: FloatArray) -> FloatArray:
    """A rotation, shape (3, 3), that takes z to a unit vector."""
    helper = np.eye(3)[int(np.argmin(np.abs(direction)))]
    x = np.cross(helper, direction)
    x /= np.linalg.norm(x)
    return np.column_stack([x, np.cross(direction, x), direction])


def placement(scale: ArrayLike, at: ArrayLike = (0.0, 0.0, 0.0)) -> FloatArray:
    """Transform, shape (4, 4), that scales, then moves; ``scale`` is one factor, three, or a matrix of shape (3, 3)."""
    placed = np.eye(4)
    placed[:3, :3] = scale if np.ndim(scale) == 2 else np.diag(np.broadcast_to(scale, 3))
    placed[:3, 3] = at
    return placed


def circle(corners: int) -> FloatArray:
    """Points on the unit circle about z, shape (corners, 3)."""
    turn = np.linspace(0.0, 2 * np.pi, corners, endpoint=False)
    return np.column_stack([np.cos(turn), np.sin(turn), np.zeros(corners)])


def segment(start: FloatArray, end: FloatArray, radius: float = 1.0) -> FloatArray:
    """Transform, shape (4, 4), of a shape of unit height and radius on z so that it runs from start to end."""
    line = end - start
    length = float(np.linalg.norm(line))
    direction = line / length if length > _NOTHING else np.array([0.0, 0.0, 1.0])
    return placement(along(direction) * np.array([radius, radius, max(length, _NOTHING)]), start)


def flat_material(colour: str, on_top: bool = False) -> Any:
    """A material whose colour hardly depends on the light, so that a legend can name it.

    Parameters
    ----------
    colour : str
        ``#RRGGBB``.
    on_top : bool
        Whether it shows through objects in front of it.
    """
    rgb = channels(colour)
    # Drawn among the transparent things, and so after the opaque ones, where it must not be painted over.
    extra: dict[str, Any] = {"depthTest": False, "transparent": True} if on_top else {}
    return mg.MeshLambertMaterial(color=number(0.4 * rgb), emissive=number(0.6 * rgb), side=0, **extra)


def matt_material(rgb: tuple[float, ...], opacity: float = 1.0) -> Any:
    """A material that takes its shades from the light; ``rgb`` in 0 to 1."""
    return mg.MeshLambertMaterial(color=number(rgb), opacity=opacity, transparent=opacity < 1.0, side=2)


def lathe(profile: FloatArray, segments: int = 28) -> Any:
    """A surface of revolution about z.

    Parameters
    ----------
    profile : ndarray
        Shape (k, 2), radius and height of its rings, from below.
    segments : int
        Corners of a ring.
    """
    return loft(rings_about_z(profile, segments))


def rings_about_z(profile: FloatArray, corners: int) -> FloatArray:
    """Rings of given radius and height, shape (k, 2), m, as :func:`skin_of` takes them."""
    round_z = circle(corners)
    return np.array([radius * round_z + [0.0, 0.0, height] for radius, height in profile])


def skin_of(rings: FloatArray) -> tuple[FloatArray, IntArray]:
    """Vertices, shape (k m, 3), and triangles, shape (2 (k - 1) m, 3), of a skin over k closed rings of m corners.

    Parameters
    ----------
    rings : ndarray
        Shape (k, m, 3), m. Every ring runs anticlockwise as seen from the last one.
    """
    count, corners = rings.shape[:2]
    index = np.arange(corners)
    following = (index + 1) % corners
    faces = []
    for ring in range(count - 1):
        low, high = ring * corners, (ring + 1) * corners
        faces.append(np.column_stack([low + index, low + following, high + following]))
        faces.append(np.column_stack([low + index, high + following, high + index]))
    return rings.reshape(-1, 3), np.vstack(faces)


def mesh_of(parts: list[tuple[FloatArray, IntArray]]) -> Any:
    """One mesh of several skins."""
    starts = np.cumsum([0, *(len(vertices) for vertices, _ in parts[:-1])])
    faces = [triangles + start for (_, triangles), start in zip(parts, starts, strict=True)]
    return mg.TriangularMeshGeometry(np.vstack([vertices for vertices, _ in parts]), np.vstack(faces))


def loft(rings: FloatArray) -> Any:
    """A mesh over rings, shape (k, m, 3), as :func:`skin_of` takes them."""
    return mesh_of([skin_of(rings)])


def tube(line: FloatArray, radius: float, segments: int = 12) -> tuple[FloatArray, IntArray]:
    """Skin of a round bar with closed ends along a line of points, shape (k, 3), m; see :func:`skin_of`."""
    steps = np.gradient(line, axis=0)
    tangents = steps / np.maximum(np.linalg.norm(steps, axis=1), _NOTHING)[:, None]
    turn = np.linspace(0.0, 2 * np.pi, segments, endpoint=False)
    x = along(tangents[0])[:, 0]
    rings = []
    for point, tangent in zip(line, tangents, strict=True):
        # The frame is carried along the line without a turn about it.
        x = x - (x @ tangent) * tangent
        x /= np.linalg.norm(x)
        rings.append(point + radius * (np.outer(np.cos(turn), x) + np.outer(np.sin(turn), np.cross(tangent, x))))
    ends = [np.tile(line[k], (segments, 1)) for k in (0, -1)]
    return skin_of(np.array([ends[0], *rings, ends[1]]))


def draw_ground(stage: Stage, height: float, radius: float) -> None:
    """A level disc, m: what is in the scene stands above it."""
    node = stage.viewer["ground"]
    for name, share, grey in (("inner", 0.992, 0.925), ("edge", 1.0, 0.86)):
        disc = lathe(np.array([[1e-6, 0.0], [share * radius, 0.0]]), 96)
        node[name].set_object(disc, mg.MeshBasicMaterial(color=number(3 * [grey]), side=2))
        level = height - 2e-3 * radius * (name == "edge")
        stage.set_transform(f"/meshcat/ground/{name}", placement(1.0, [0.0, 0.0, level]))


def frustum(bottom: float, top: float) -> Any:
    """A closed cone from z = 0 to 1 with the given radii."""
    return lathe(np.array([[_NOTHING, 0.0], [bottom, 0.0], [top, 1.0], [_NOTHING, 1.0]]))


def trimmed(vector: FloatArray, longest: float) -> tuple[FloatArray, bool]:
    """A vector cut to a length, and whether it had to be."""
    length = float(np.linalg.norm(vector))
    return (vector * (longest / length), True) if length > longest else (vector, False)


class Arrow(OneProcess):
    """An arrow in the scene, of fixed thickness, with one head or two.

    Parameters
    ----------
    stage : Stage
        Where it is drawn.
    path : str
        Its node.
    colour : str
        ``#RRGGBB``.
    radius : float
        Of the shaft, m.
    heads : int
        1 or 2: a second sign beside the colour.
    tail : bool
        Whether a disc marks where it starts.
    """

    def __init__(self, stage: Stage, path: str, colour: str, radius: float, heads: int = 1, tail: bool = False) -> None:
        self._stage, self._radius = stage, radius
        self._paths = [f"{path}/shaft", *(f"{path}/head_{i}" for i in range(heads)), *([f"{path}/tail"] * tail)]
        self._heads, self._tail = heads, tail
        for part in self._paths:
            shape = frustum(1.0, _NOTHING if "/head_" in part else 1.0)
            stage.set_object(part, shape, flat_material(colour, on_top=True))
            # After the human's translucent arm, which would tint it.
            stage.set_property(part, "renderOrder", 10)
        self.hide()

    def show(self, start: FloatArray, vector: FloatArray) -> None:
        """Draw it from ``start`` along ``vector``, both in m, shape (3,); the vector has a length."""
        length = float(np.linalg.norm(vector))
        direction = vector / length
        # A head keeps its shape, unless the arrow is shorter than it.
        head = min(4.6 * self._radius, length / self._heads)
        size = head / 4.6
        neck = length - head * self._heads
        parts = [segment(start, start + neck * direction, self._radius if neck > _NOTHING else _NOTHING)]
        for i in range(self._heads):
            foot = start + (neck + i * head) * direction
            parts.append(segment(foot, foot + head * direction, 2.4 * size))
        if self._tail:
            parts.append(segment(start, start + 0.5 * self._radius * direction, 2.2 * self._radius))
        for path, placed in zip(self._paths, parts, strict=True):
            self._stage.set_transform(path, placed)

    def hide(self) -> None:
        """Hide the shapes."""
        for path in self._paths:
            self._stage.set_transform(path, placement(_NOTHING))


#: How far the arrow of a moment goes round, and its thickness and that of its head over the circle's radius.
_ROUND, _WIRE, _HEAD = np.radians(255.0), 0.10, 0.26


class TurningArrow(OneProcess):
    """An arrow round an axis, of fixed size, for a moment.

    Parameters
    ----------
    stage, path, colour
        As for :class:`Arrow`.
    radius : float
        Of its circle, m.
    """

    def __init__(self, stage: Stage, path: str, colour: str, radius: float) -> None:
        self._stage, self._path, self._radius = stage, f"{path}/round", radius
        turn = np.linspace(0.0, _ROUND, 40)
        arc = np.column_stack([np.cos(turn), np.sin(turn), np.zeros_like(turn)])
        ahead = np.array([-np.sin(_ROUND), np.cos(_ROUND), 0.0])
        cone = np.array([(_NOTHING, 0.0), (_HEAD, 0.0), (_NOTHING, 2.2 * _HEAD)])
        shape = mesh_of([tube(arc, _WIRE), skin_of(rings_about_z(cone, 16) @ along(ahead).T + arc[-1])])
        stage.set_object(self._path, shape, flat_material(colour, on_top=True))
        stage.set_property(self._path, "renderOrder", 10)

    def show(self, at: FloatArray, moment: FloatArray) -> None:
        """Draw it about ``moment``, by the right hand, round ``at``, shape (3,) each, m."""
        axis = moment / np.linalg.norm(moment)
        self._stage.set_transform(self._path, placement(self._radius * along(axis), at))

    def hide(self) -> None:
        """Hide it."""
        self._stage.set_transform(self._path, placement(_NOTHING))


def coil(turns: int, length: float, radius: float, wire: float) -> Any:
    """A helical spring about z from 0 to 1, to be drawn ``length`` long, with the radius of its turns, all in m."""
    along_z = np.linspace(0.0, 1.0, 16 * turns + 1)
    wide = radius * np.clip(12.0 * np.minimum(along_z, 1.0 - along_z), 0.0, 1.0)
    turn = 2.0 * np.pi * turns * along_z
    line = np.column_stack([wide * np.cos(turn), wide * np.sin(turn), length * along_z])
    vertices, faces = tube(line, wire, 8)
    return mesh_of([(vertices * [1.0, 1.0, 1.0 / length], faces)])
