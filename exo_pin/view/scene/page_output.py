"""Camera and output of a scene: live page, HTML file, still picture, notebook cell."""

from __future__ import annotations

from abc import ABC, abstractmethod
from collections.abc import Callable, Mapping
from html import escape
from os import PathLike
from typing import TYPE_CHECKING, Any

import numpy as np
from numpy.typing import ArrayLike

from ...core.errors import InvalidInput
from ...core.files import write_bytes, write_text
from ...core.records import OneProcess
from ...core.validation import FloatArray, as_finite, as_positive
from ..page.browser import static_page, still_page, still_picture
from ..stage.force_arrows import GOOD_LENGTH
from ..stage.stage import Stage, seen_along, widened
from .panels import notebook_cell

if TYPE_CHECKING:
    from ...exo.shoulder_exo import ShoulderExo


#: The camera's field of view that the default distance goes with, and how much more than the chain it shows.
_HALF_VIEW, _ROOM = np.radians(16.0), 1.35
#: A chain that is thinner than this share of its size is looked at from its flat side.
_FLAT = 0.08


def viewpoint(
    exo: ShoulderExo, corners: FloatArray, figure: bool, towards: FloatArray | None = None
) -> tuple[FloatArray, FloatArray, list[float]]:
    """Camera, target and extents of a device with these corners, (k, 3), on a figure or alone; maybe from a side."""
    outward = 1.0 if exo.side == "left" else -1.0
    # Before the shoulder and outside of it, a little from above.
    away = np.array([1.04, 1.32 * outward, 0.42])
    if towards is not None:
        away = np.linalg.norm(away) * towards / np.linalg.norm(towards)
    arm, points = exo.device.arm, [corners]
    if figure:
        # Head and elbow are in the picture.
        target, extent = np.array([0.05, -0.04 * outward, -0.02]), (0.36, 0.46)
    else:
        target, extent = np.array([0.05, 0.02 * outward, -0.06]), (0.28, 0.32)
        points += [] if arm is None else [arm.centre_of_mass[None] - np.array([0.0, 0.0, GOOD_LENGTH])]
    target, shown = widened(np.concatenate(points), target, away, extent)
    return target + away, target, shown


def drawable(exo: ShoulderExo) -> tuple[ShoulderExo, list[str]]:
    """The device; of a wrist whose robot is no device its limbs alone, and a note about them."""
    if exo.has_arm or exo.wrist is None:
        # Of a robot that is no device the error says what it lacks.
        _ = exo.device
        return exo, []
    return type(exo).from_device(exo.wrist.limbs_alone()), ["no forces: the robot is no device"]


def viewpoint_of_points(
    points: FloatArray, size: float, side: FloatArray | None = None
) -> tuple[FloatArray, FloatArray, list[float]]:
    """Camera, target and extents of a chain of a size, m, whose corners are ``points``, shape (n, 3), m."""
    target = (points.min(axis=0) + points.max(axis=0)) / 2
    spread, axes = np.linalg.eigh(np.cov(points.T))
    towards = np.array([1.3, 1.25, 0.7])
    if side is not None:
        towards = side.copy()
    elif spread[0] < _FLAT**2 * spread[2]:
        # From the side that shows, a little aside so that depth is visible; a flat one that lies has its y upwards.
        flat = axes[:, 0] * np.sign(axes[np.abs(axes[:, 0]).argmax(), 0])
        towards = flat + 0.15 * np.array([0.0, -1.0, 0.3])
    towards /= np.linalg.norm(towards)
    away = _ROOM * size / 2 / np.sin(_HALF_VIEW)
    aside, above = (float(np.abs((points - target) @ axis).max()) for axis in seen_along(towards))
    room = 0.12 * size
    return target + away * towards, target, [aside + room, above + room]


#: From where the buttons of the page look: x is forward, y left, and a little from above.
_SIDES = {
    "front": np.array([1.0, 0.0, 0.2]),
    "left": np.array([0.0, 1.0, 0.2]),
    "back": np.array([-1.0, 0.0, 0.2]),
    "right": np.array([0.0, -1.0, 0.2]),
}


class Pages(OneProcess, ABC):
    """Output of a scene; base class of every scene."""

    _instead = "send or copy the ShoulderExo or ClosedChain, and make a new scene of it"

    _stage: Stage

    def camera(
        self, position: ArrayLike | None = None, target: ArrayLike | None = None, field_of_view: float = 32.0
    ) -> None:
        """Place the camera.

        Parameters
        ----------
        position, target : array_like, optional
            Shape (3,), m, base frame: its position and the point it looks at. Left out: a view of the whole
            mechanism in the part of the page that no panel covers; of a wrist, from in front and outside.
        field_of_view : float
            From the bottom of the picture to the top, degrees.

        Examples
        --------
        >>> from exo_pin.view import ChainScene
        >>> scene = ChainScene(ep.load("three-linear-actuators").chain)
        >>> before = scene.serial
        >>> scene.camera(position=[2.0, 2.0, 0.5], target=[0.0, 0.0, 0.0])  # m
        >>> scene.serial - before
        1
        """
        default, centre, extent = self._viewpoint(None)
        look = centre if target is None else as_finite("target", target, (3,))
        eye = default + look - centre if position is None else as_finite("position", position, (3,))
        if float(np.linalg.norm(eye - look)) < 1e-6:
            raise InvalidInput("expected a camera position that differs from its target")
        angle = as_positive("field_of_view", field_of_view)
        if angle >= 180.0:
            raise InvalidInput(f"expected a field of view below 180 degrees, got {angle:g}")
        placed = {"position": eye.tolist(), "target": look.tolist(), "angle": angle}
        # The page fits what is to be seen beside its panels, unless the camera was placed by hand.
        by_hand = position is not None or target is not None
        placed |= {"fit": False} if by_hand else {"fit": True, "extent": extent}
        self._stage.set_panel("camera", placed | {"sides": [self._seen_from(name, angle) for name in _SIDES]})

    def _seen_from(self, name: str, angle: float) -> dict[str, Any]:
        """What a button of the page does to the camera."""
        eye, look, extent = self._viewpoint(_SIDES[name])
        seen = {"position": eye.tolist(), "target": look.tolist(), "angle": angle, "fit": True, "extent": extent}
        return {"name": name, **seen}

    @property
    def serial(self) -> int:
        """Number of the last update; a page that has drawn it has it in ``document.body.dataset.serial``."""
        return self._stage.serial

    def serve(self, port: int | None = None) -> str:
        """Open the live page on 127.0.0.1 and return its address, without whose token nobody can see it.

        Parameters
        ----------
        port : int, optional
            First port to try, 7000 if left out; a used port moves on to the next, 0 takes any free one.

        Returns
        -------
        str

        Examples
        --------
        >>> from exo_pin.view import ChainScene
        >>> scene = ChainScene(ep.load("three-linear-actuators").chain)
        >>> scene.serve(port=0).split(":")[1]  # on this machine alone
        '//127.0.0.1'
        >>> scene.close()
        """
        return self._stage.serve(port)

    def attach(self, publish: Callable[[bytes], None]) -> Callable[[], bytes]:
        """Send every change to a server of one's own, whose pages show it with the package's viewer.

        Parameters
        ----------
        publish : callable
            Gets each run of commands, in the thread that draws.

        Returns
        -------
        callable
            Gives the whole scene as a run of commands that replace what a page shows.

        Examples
        --------
        >>> from exo_pin.view import ChainScene
        >>> scene, runs = ChainScene(ep.load("three-linear-actuators").chain), []
        >>> whole = scene.attach(runs.append)
        >>> scene.camera(position=[2.0, 2.0, 0.5], target=[0.0, 0.0, 0.0])  # m
        >>> len(runs), len(whole()) > len(runs[0])
        (1, True)
        """
        return self._stage.attach(publish)

    def offer(self, free: Mapping[str, ArrayLike] | None = None, /, **points: ArrayLike) -> None:
        """Points that a page of one's own server (:meth:`attach`) lets its user drag.

        What a page sends of them is ``{"drag": name, "to": [x, y, z]}``, and at the end ``{"dropped": name}``.

        Parameters
        ----------
        free : mapping, optional
            Those that are dragged across the picture: shape (3,) each, m, base frame, by name.
        **points
            Those that stay on spheres about the origin, in the same way.

        Examples
        --------
        >>> from exo_pin.view import ChainScene
        >>> scene = ChainScene(ep.load("three-linear-actuators").chain)
        >>> before = scene.serial
        >>> scene.offer(hand=[0.0, 0.0, -0.6])
        >>> scene.serial - before
        1
        """
        placed = [
            {"name": name, "at": as_finite(name, at, (3,)).tolist(), "free": not on_sphere}
            for on_sphere, given in ((True, points), (False, free or {}))
            for name, at in given.items()
        ]
        self._stage.set_panel("handles", placed)

    @property
    def url(self) -> str:
        """Address of the live page, which is started if need be."""
        return self._stage.serve()

    def close(self) -> None:
        """Stop the live page.

        Examples
        --------
        >>> from exo_pin.view import ChainScene
        >>> scene = ChainScene(ep.load("three-linear-actuators").chain)
        >>> first = scene.serve(port=0)
        >>> scene.close()
        >>> scene.serve(port=0) != first  # another token: the old address shows nothing
        True
        >>> scene.close()
        """
        self._stage.close()

    def html(self) -> str:
        """The scene as it is now, as one page that opens without a network and can be turned about.

        Returns
        -------
        str

        Examples
        --------
        >>> from exo_pin.view import ChainScene
        >>> page = ChainScene(ep.load("three-linear-actuators").chain).html()
        >>> "<script src=" in page, len(page) > 500_000  # all that it needs is in it
        (False, True)
        """
        return static_page(self._stage.snapshot())

    def save_html(self, path: str | PathLike[str]) -> None:
        """Write :meth:`html` to a file, whole or not at all.

        Parameters
        ----------
        path : path-like
            Where to.

        Examples
        --------
        >>> from pathlib import Path
        >>> from exo_pin.view import ChainScene
        >>> scene = ChainScene(ep.load("three-linear-actuators").chain)
        >>> scene.save_html("robot.html")
        >>> Path("robot.html").read_text() == scene.html()
        True
        """
        write_text(path, self.html())

    def save_png(
        self,
        path: str | PathLike[str],
        size: tuple[int, int] = (1280, 800),
        browser: str | None = None,
        pixel_ratio: float = 1.0,
    ) -> None:
        """Write a still picture, through a headless browser.

        Parameters
        ----------
        path : path-like
            The file.
        size : (int, int)
            Width and height of the page, its pixels.
        browser : str, optional
            Program of a Chromium-like browser; searched for if left out (see :func:`exo_pin.view.find_browser`).
        pixel_ratio : float
            Pixels of the picture for each of the page, along each side; 2 for print and sharp screens.

        Raises
        ------
        BrowserNotFound
            If there is none.
        BrowserFailed
            If it cannot draw the scene.

        Examples
        --------
        >>> from pathlib import Path
        >>> from exo_pin.view import ChainScene
        >>> ChainScene(ep.load("three-linear-actuators").chain).save_png("robot.png", size=(320, 200))
        >>> [int.from_bytes(Path("robot.png").read_bytes()[k : k + 4], "big") for k in (16, 20)]  # pixels
        [320, 200]
        """
        write_bytes(path, still_picture(still_page(self._stage.snapshot()), size, browser, pixel_ratio))

    def cell(self, height: int = 520) -> Any:
        """The live page in a notebook cell.

        The cell is a frame that shows a port of the machine where Python runs. With a notebook server elsewhere, the
        port has to be forwarded as well (``ssh -L 7000:127.0.0.1:7000``); :meth:`static_cell` needs no port.

        Parameters
        ----------
        height : int
            Pixels.

        Returns
        -------
        IPython.display.HTML

        Examples
        --------
        >>> from exo_pin.view import ChainScene
        >>> scene = ChainScene(ep.load("three-linear-actuators").chain)
        >>> f'src="{scene.url}"' in scene.cell(height=400).data
        True
        >>> scene.close()
        """
        return notebook_cell(f'src="{self.url}"', height)

    def static_cell(self, height: int = 520) -> Any:
        """The scene as it is now in a notebook cell; can be turned about, does not change, works everywhere.

        Parameters
        ----------
        height : int
            Pixels.

        Returns
        -------
        IPython.display.HTML

        Examples
        --------
        >>> from exo_pin.view import ChainScene
        >>> scene = ChainScene(ep.load("three-linear-actuators").chain)
        >>> len(scene.static_cell(height=300).data) > len(scene.html())  # the cell holds the whole page
        True
        """
        return notebook_cell(f'srcdoc="{escape(self.html())}"', height)

    @abstractmethod
    def _viewpoint(self, towards: FloatArray | None) -> tuple[FloatArray, FloatArray, list[float]]:
        """Position and target of the camera, shape (3,) each, and what to see around it: by default, or from a side.

        The last are half its width and half its height at the target, all in m.
        """
