"""The content of a scene as Meshcat's commands: shown live, written to a file, or recorded frame by frame.

A :class:`Stage` replaces Meshcat's own window: Pinocchio's MeshcatVisualizer and Meshcat's Visualizer send
their commands to it. It needs no server and no browser; with a server, browsers that look on get what changes.
"""

from __future__ import annotations

import struct
import threading
import warnings
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from dataclasses import dataclass, field
from typing import Any

import numpy as np
import pinocchio as pin
import umsgpack
from numpy.typing import ArrayLike

from ...core.records import OneProcess
from ...core.validation import FloatArray
from ..page.live_server import Angles, PoseRequests, Server

#: Takes a run of commands, at once.
Publish = Callable[[bytes], None]

with warnings.catch_warnings():
    # Meshcat 0.3.2 imports a deprecated part of ZeroMQ, which is not used here.
    warnings.filterwarnings("ignore", message="zmq.eventloop.ioloop", category=DeprecationWarning)
    import meshcat
    import meshcat.geometry as mg
    from pinocchio.visualize import MeshcatVisualizer

__all__ = ["Stage", "mg", "seen_along", "widened"]

#: Entries of a transform that differ by less, m or 1, are the same place: below what a screen shows, above rounding.
_SAME_PLACE = 1e-9


@dataclass
class _Node:
    """What was last said of a path in the scene."""

    object: bytes | None = None
    matrix: FloatArray | None = None
    properties: dict[str, Any] = field(default_factory=dict)


class Stage(OneProcess):
    """The scene as a record of commands.

    Attributes
    ----------
    viewer : meshcat.Visualizer
        Meshcat's handle on it.
    """

    _instead = "send or copy the ShoulderExo or ClosedChain, and make a new scene of it"

    def __init__(self) -> None:
        self._nodes: dict[str, _Node] = {}
        self._panels: dict[str, Any] = {}
        self._lock = threading.Lock()
        #: Whose turn it is to draw: the sliders of a page have a thread of their own.
        self._turn = threading.RLock()
        self._requests = PoseRequests(lambda _: None)
        self._outgoing: list[bytes] | None = None
        self._serial = 0
        self._server: Server | None = None
        self._publishers: list[Publish] = []
        self.viewer = meshcat.Visualizer(window=self)

    def serve(self, port: int | None = None) -> str:
        """Start the live page, if it has not been started, and return its address."""
        if self._server is None:
            self._server = Server(self._afresh, port, self._requests.put)
        return self._server.url

    def listen(self, draw: Callable[[Angles], None]) -> None:
        """Draw the poses that pages ask for."""
        self._requests = PoseRequests(draw)

    def attach(self, publish: Publish) -> Callable[[], bytes]:
        """Send every change to a server of somebody else's, too.

        Parameters
        ----------
        publish : callable
            Gets each run of commands.

        Returns
        -------
        callable
            Gives the whole scene as a run of commands that replace what a page shows.
        """
        self._publishers.append(publish)
        return self._afresh

    def close(self) -> None:
        """Stop the live page."""
        self._publishers.clear()
        if self._server is not None:
            self._server.close()
            self._server = None
            self._requests.finish()

    def send(self, command: Any) -> None:
        """Take a command of Meshcat's; this is what makes the stage a window to Meshcat."""
        data = command.lower()
        if data["type"] == "set_transform":
            self.set_transform(data["path"], np.reshape(data["matrix"], (4, 4)).T)
        else:
            self._apply(data)

    def picture(self, model: pin.Model, visuals: pin.GeometryModel, name: str) -> MeshcatVisualizer:
        """Pinocchio's picture of a model at a node."""
        made = MeshcatVisualizer(model, pin.GeometryModel(), visuals)
        made.initViewer(viewer=self.viewer)
        made.loadViewerModel(name)
        return made

    def set_object(self, path: str, shape: Any, material: Any) -> None:
        """Put a shape at a node."""
        self.viewer[path.removeprefix("/meshcat/")].set_object(shape, material)

    def set_transform(self, path: str, matrix: FloatArray) -> None:
        """Place a node, unless it is there already.

        Parameters
        ----------
        path : str
            Of the node.
        matrix : ndarray
            Shape (4, 4), homogeneous, may scale.
        """
        known = self._nodes[path].matrix if path in self._nodes else None
        if known is None or np.abs(known - matrix).max() > _SAME_PLACE:
            self._apply(_placed(path, matrix), np.array(matrix))

    def set_colour(self, path: str, colour: ArrayLike) -> None:
        """Colour a node and all below it, (red, green, blue, alpha) in 0 to 1, unless it has that colour."""
        self.set_property(path, "color", tuple(np.asarray(colour, dtype=float).tolist()))

    def set_property(self, path: str, name: str, value: Any) -> None:
        """Set a property of a node in three.js, unless it has that value; Meshcat's own way makes the name small."""
        if path not in self._nodes or self._nodes[path].properties.get(name) != value:
            self._apply(_property(path, name, value))

    def plain(self) -> None:
        """A light background and soft light, without Meshcat's grid and axes."""
        self.viewer["/Background"].set_property("top_color", [1.0, 1.0, 1.0])
        self.viewer["/Background"].set_property("bottom_color", [0.90, 0.92, 0.95])
        # More light from all around: the side away from the lamps is not dark.
        self.set_property("/Lights/AmbientLight/<object>", "intensity", 0.62)
        for name in ("/Grid", "/Axes"):
            self.viewer[name].set_property("visible", False)

    def set_panel(self, name: str, data: Any) -> None:
        """Write a panel of the page, unless its content is the same."""
        if self._panels.get(name) != data:
            self._apply({"type": "panel", "path": "", "name": name, "data": data})

    def panel(self, name: str) -> Any:
        """Content of a panel, None if it is empty."""
        return self._panels.get(name)

    @contextmanager
    def update(self) -> Iterator[None]:
        """Send all commands of a block together, so that no half-moved scene is drawn; one thread at a time."""
        with self._turn:
            outer, self._outgoing = self._outgoing, []
            try:
                yield
            finally:
                outgoing, self._outgoing = self._outgoing, outer
                if outer is not None:
                    outer += outgoing
                elif outgoing:
                    self._publish(outgoing)

    def snapshot(self) -> bytes:
        """The whole scene as a run of commands."""
        with self._lock:
            commands = []
            for path, node in self._nodes.items():
                if node.object is not None:
                    commands.append(node.object)
                commands += [_packed(_property(path, *each)) for each in node.properties.items()]
                if node.matrix is not None:
                    commands.append(_packed(_placed(path, node.matrix)))
            commands += [_packed({"type": "panel", "name": name, "data": data}) for name, data in self._panels.items()]
            return _run([*commands, self._stamp()])

    def _afresh(self) -> bytes:
        """The whole scene, in place of whatever a page shows."""
        return _run([_packed({"type": "delete", "path": "/meshcat"})]) + self.snapshot()

    def placements(self) -> dict[str, FloatArray]:
        """Placement of every placed node, path to matrix of shape (4, 4)."""
        return {path: node.matrix for path, node in self._nodes.items() if node.matrix is not None}

    def colours(self) -> dict[str, tuple[float, ...]]:
        """Colours given to nodes, path to (red, green, blue, alpha)."""
        return {path: node.properties["color"] for path, node in self._nodes.items() if "color" in node.properties}

    @property
    def serial(self) -> int:
        """Number of the last update; the page shows it as ``data-serial`` once the update is drawn."""
        return self._serial

    def _apply(self, data: dict[str, Any], matrix: FloatArray | None = None) -> None:
        """Remember a command, with its matrix if it places a node, and pass it on.

        The server's thread reads the same nodes, so they change only inside of the lock.
        """
        kind, path = data["type"], data["path"]
        packed = _packed(data)
        with self._lock:
            if kind == "panel":
                self._panels[data["name"]] = data["data"]
            elif kind == "delete":
                for old in [key for key in self._nodes if key == path or key.startswith(f"{path}/")]:
                    del self._nodes[old]
            else:
                node = self._nodes.setdefault(path, _Node())
                if kind == "set_object":
                    node.object = packed
                    # The viewer makes a new object, which does not have the colours of the old one.
                    node.properties.pop("color", None)
                elif kind == "set_transform":
                    node.matrix = matrix
                elif kind == "set_property":
                    node.properties[data["property"]] = data["value"]
        if self._outgoing is None:
            self._publish([packed])
        else:
            self._outgoing.append(packed)

    def _publish(self, commands: list[bytes]) -> None:
        self._serial += 1
        if self._server is not None or self._publishers:
            run = _run([*commands, self._stamp()])
            for publish in (*self._publishers, *([] if self._server is None else [self._server.publish])):
                publish(run)

    def _stamp(self) -> bytes:
        return _packed({"type": "serial", "value": self._serial})


def _placed(path: str, matrix: FloatArray) -> dict[str, Any]:
    return {"type": "set_transform", "path": path, "matrix": matrix.T.ravel().tolist()}


def _property(path: str, name: str, value: Any) -> dict[str, Any]:
    return {"type": "set_property", "path": path, "property": name, "value": value}


def _packed(data: dict[str, Any]) -> bytes:
    return bytes(umsgpack.packb(data))


def _run(commands: list[bytes]) -> bytes:
    """Commands one after the other, each behind its length."""
    return b"".join(part for command in commands for part in (struct.pack("<I", len(command)), command))


#: Free space around what is shown, as a share of it.
_ROOM = 1.06


def seen_along(towards: FloatArray) -> tuple[FloatArray, FloatArray]:
    """To the right and up in a picture, shape (3,) each, of a camera that is in a direction, with z upright."""
    right = np.array([-towards[1], towards[0], 0.0]) / np.hypot(towards[0], towards[1])
    up = np.cross(towards, right)
    return right, up / np.linalg.norm(up)


def widened(
    points: FloatArray, target: FloatArray, away: FloatArray, extent: tuple[float, float]
) -> tuple[FloatArray, list[float]]:
    """The target and the extent of a view, moved and widened so far that points are in it.

    Parameters
    ----------
    points : ndarray
        Shape (k, 3), m; all before the camera.
    target, away : ndarray
        Shape (3,), m: where the camera looks, and where it is from there.
    extent : tuple of float
        Half the width and half the height of the view at the target, m.

    Returns
    -------
    target : ndarray
        Shape (3,), m.
    extent : list of float
        As given, if all points were in it.
    """
    distance = float(np.linalg.norm(away))
    axes = np.stack(seen_along(away / distance))
    seen = points - target
    # What is nearer to the camera looks larger.
    size = distance / (distance - seen @ (away / distance))
    across = (seen @ axes.T) * size[:, None] * _ROOM
    low, high = np.minimum(across.min(axis=0), np.negative(extent)), np.maximum(across.max(axis=0), extent)
    return target + (low + high) / 2 @ axes, ((high - low) / 2).tolist()
