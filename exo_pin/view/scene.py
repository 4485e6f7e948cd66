"""The scene a user holds: a design on a person, in a pose, with its forces."""

from __future__ import annotations

import time
from collections.abc import Iterator
from typing import Any

import numpy as np
from numpy.typing import ArrayLike
from scipy.spatial.transform import Rotation

from ..errors import InvalidInput, LoopNotClosed, MissingExtra, UnknownName
from ..exo import ShoulderExo
from ..reaction import Reaction
from ..validation import FloatArray, as_finite, as_positive, as_rotation
from . import LIMB_STYLES
from .additions import Additions, bar
from .colours import scale_colours
from .forces import LONGEST, ForcePicture, PoseForces, nice_step
from .human import Human
from .mechanism import MechanismPicture
from .pages import Pages
from .panels import numbers_panel
from .recording import FrameTaker, Recording
from .stage import Stage

__all__ = ["Scene"]

#: Colour and opacity of a ghost.
_GHOST = (0.34, 0.40, 0.48, 0.30)
#: Top of the scale of pressures, Pa, gauge: what the thesis drives its muscles with at most.
_PRESSURE_TOP = 4e5


class Scene(Additions, Pages):
    """A design in a pose, with forces, drawn by Meshcat.

    A scene needs no browser and no server. :meth:`serve` opens a live page on this machine, :meth:`save_html` writes
    a file that opens without a network, :meth:`save_png` a still picture. Base frame {O_A}: O is the shoulder centre,
    x forward, y left, z up. Forces are those on the arm, N, all to one scale, which the legend states.

    Parameters
    ----------
    exo : ShoulderExo
        The design. Without an arm there are no forces to draw.
    human : bool, optional
        Whether a person is drawn. Left out: if the figure is installed, else the scene says that it is not.
    limbs : {"rods", "muscles"}
        Telescoping rods, or muscles that swell as they shorten and take their colour from tension or pressure.
    metres_per_newton : float, optional
        The arrows' scale; one that suits the arm's weight if left out.
    elbow_flexion : float
        Of the human figure, rad. For the picture only.

    Raises
    ------
    MissingExtra
        If ``human`` is True and the figure is not installed.
    UnknownName
        If ``limbs`` is no style.
    """

    def __init__(
        self,
        exo: ShoulderExo,
        human: bool | None = None,
        limbs: str = "rods",
        metres_per_newton: float | None = None,
        elbow_flexion: float = 0.0,
    ) -> None:
        if not isinstance(exo, ShoulderExo):
            raise InvalidInput(f"expected a ShoulderExo, got {type(exo).__name__}")
        if limbs not in LIMB_STYLES:
            raise UnknownName("limb style", limbs, LIMB_STYLES)
        if metres_per_newton is not None:
            metres_per_newton = as_positive("metres_per_newton", metres_per_newton)
        elbow = float(as_finite("elbow_flexion", elbow_flexion, ()))
        Additions.__init__(self, Stage())
        self._style, self._asked_scale = limbs, metres_per_newton
        self._notes: list[str] = []
        self._asides: list[str] = []
        self._human: Human | None = None
        self._ghost: MechanismPicture | None = None
        self._orientation = Rotation.identity()
        self._muscle_bar: dict[str, Any] | None = None
        self._asked: dict[str, Any] = {}
        with self._stage.update():
            self._background()
            if human is not False:
                try:
                    self._human = Human(self._stage, exo.side, elbow_flexion=elbow)
                except MissingExtra as error:
                    if human:
                        raise
                    self._notes.append(f"no human figure: {error}")
            self._set_exo(exo)
            self.camera()
            self.show(Rotation.identity())

    @property
    def exo(self) -> ShoulderExo:
        """The design that is drawn."""
        return self._exo

    @property
    def orientation(self) -> Rotation:
        """The pose that is drawn."""
        return self._orientation

    @property
    def messages(self) -> tuple[str, ...]:
        """What could not be drawn, and why."""
        return tuple(self._notes)

    @property
    def metres_per_newton(self) -> float:
        """Scale of the arrows, m/N."""
        return self._arrows.scale

    @property
    def serial(self) -> int:
        """Number of the last update; a page that has drawn it says so in ``document.body.dataset.serial``."""
        return self._stage.serial

    def replace_exo(self, exo: ShoulderExo) -> None:
        """Draw another design of the same side, in the same pose; the forces are those of the new one.

        They are asked for as in the last :meth:`show`, but for pressures, which belong to a design.

        Raises
        ------
        InvalidInput
            If it is for the other side of the body.
        """
        if exo.side != self._exo.side:
            raise InvalidInput(f"expected a design for the {self._exo.side} shoulder, got one for the {exo.side}")
        with self._stage.update():
            # Numbers can be compared only if the arrows keep their scale.
            self._asked_scale = self._arrows.scale
            self._set_exo(exo)
            self.show(self._orientation, **self._asked)

    def show(
        self,
        orientation: Rotation,
        pressures: ArrayLike | None = None,
        **query: Any,
    ) -> Reaction | None:
        """Move everything into a pose and draw its forces.

        Parameters
        ----------
        orientation : Rotation
            A single pose.
        pressures : array_like, optional
            Shape (n,), Pa, gauge: muscles take their colour from them and not from their tension.
        **query
            Further arguments of :meth:`exo_pin.ShoulderExo.reaction`, such as ``split``.

        Returns
        -------
        Reaction or None
            What is drawn; None for a design without an arm.
        """
        pose = _single(orientation)
        answer = None if self._exo.arm is None else self._exo.reaction(pose, **query)
        pressure = None if pressures is None else self._pressures(pressures, ())
        self._asked = query
        self._aside(query)
        self._draw(pose, None if answer is None else PoseForces.of(answer, ()), pressure)
        return answer

    def play(
        self, orientations: Rotation, times: ArrayLike, pressures: ArrayLike | None = None, **query: Any
    ) -> Reaction | None:
        """Play a motion in the live page, in real time.

        Parameters
        ----------
        orientations : Rotation
            Poses, shape (k,).
        times : array_like
            Shape (k,), s, rising.
        pressures : array_like, optional
            As in :meth:`show`, shape (k, n).
        **query
            Further arguments of :meth:`exo_pin.ShoulderExo.reaction`, such as ``motion``, which broadcast to (k,).

        Returns
        -------
        Reaction or None
            Forces of all poses.
        """
        poses, stamps, air = self._motion(orientations, times, pressures)
        answer = None if self._exo.arm is None else self._exo.reaction(poses, **query)
        self._aside(query)
        start = time.monotonic()
        for index in self._frames(poses, answer, air):
            pause = start + float(stamps[index] - stamps[0]) - time.monotonic()
            if pause > 0:
                time.sleep(pause)
        return answer

    def record(
        self, orientations: Rotation, times: ArrayLike, pressures: ArrayLike | None = None, **query: Any
    ) -> Recording:
        """Record a motion; the arguments are those of :meth:`play`, and no time passes.

        Returns
        -------
        Recording
            Its ``save`` writes one file that plays without a network.
        """
        poses, stamps, air = self._motion(orientations, times, pressures)
        answer = None if self._exo.arm is None else self._exo.reaction(poses, **query)
        self._aside(query)
        taker = FrameTaker(self._stage)
        for _ in self._frames(poses, answer, air):
            taker.take()
        return taker.finish(stamps, answer)

    def ghost(self, orientation: Rotation | None = None, exo: ShoulderExo | None = None) -> None:
        """Draw a second pose, or a second design, as a grey ghost for comparison.

        Parameters
        ----------
        orientation : Rotation, optional
            Its pose; the one of the scene if left out.
        exo : ShoulderExo, optional
            Its design; the one of the scene if left out.
        """
        pose = self._orientation if orientation is None else _single(orientation)
        design = self._exo if exo is None else exo
        with self._stage.update():
            if self._ghost is None or self._ghost.mechanism is not design.mechanism:
                self._ghost = MechanismPicture(self._stage, design.mechanism, "ghost", _GHOST)
            self._ghost.show(pose)

    def remove_ghost(self) -> None:
        """Take the ghost away."""
        self._stage.viewer["ghost"].delete()
        self._ghost = None

    def camera(
        self, position: ArrayLike | None = None, target: ArrayLike | None = None, field_of_view: float = 32.0
    ) -> None:
        """Place the camera.

        Parameters
        ----------
        position, target : array_like, optional
            Shape (3,), m, base frame: where it stands and where it looks. Left out: from in front of the shoulder
            and a little outside.
        field_of_view : float
            From the bottom of the picture to the top, degrees.
        """
        outward = 1.0 if self._exo.side == "left" else -1.0
        look = np.array([0.0, 0.02 * outward, -0.06]) if target is None else as_finite("target", target, (3,))
        default = look + np.array([1.30, 1.25 * outward, 0.36])
        eye = default if position is None else as_finite("position", position, (3,))
        if float(np.linalg.norm(eye - look)) < 1e-6:
            raise InvalidInput("expected the camera to stand away from where it looks")
        angle = as_positive("field_of_view", field_of_view)
        if angle >= 180.0:
            raise InvalidInput(f"expected a field of view below 180 degrees, got {angle:g}")
        self._stage.set_panel("camera", {"position": eye.tolist(), "target": look.tolist(), "angle": angle})

    def _write_legend(self) -> None:
        scale, items = self._arrows.legend() if self._exo.arm is not None else ("No arm mass: no forces", [])
        bars = [] if self._muscle_bar is None else [self._muscle_bar]
        legend = {"scale": scale, "items": [*items, *self._items.values()], "bars": [*bars, *self._bars.values()]}
        self._stage.set_panel("legend", legend)

    def _draw(self, pose: Rotation, forces: PoseForces | None, pressures: FloatArray | None) -> None:
        notes = [*self._notes, *self._asides]
        with self._stage.update():
            self._orientation = pose
            try:
                self._picture.show(pose)
            except LoopNotClosed:
                notes.append("the limbs do not close in this pose; they are left as they were")
            if self._human is not None:
                self._human.show(pose)
            self._arrows.show(pose, forces)
            self._colour_muscles(forces, pressures)
            self._stage.set_panel("numbers", numbers_panel(self._exo, pose, forces, notes))

    def _colour_muscles(self, forces: PoseForces | None, pressures: FloatArray | None) -> None:
        if self._style != "muscles" or (forces is None and pressures is None):
            return
        if pressures is not None:
            values, label, top = np.asarray(pressures) / 1e5, "pressure, bar", _PRESSURE_TOP / 1e5
        else:
            assert forces is not None
            # A muscle that would have to push is drawn white.
            values, label, top = forces.tensions, "muscle tension, N", self._tension_top
        self._muscle_bar = bar(label, 0.0, top)
        self._write_legend()
        colours = scale_colours(values, 0.0, top)
        colours[np.asarray(values) < 0.0] = 1.0
        self._picture.colour_muscles(colours)

    def _set_exo(self, exo: ShoulderExo) -> None:
        muscles, with_arm = self._style == "muscles", self._human is None
        self._picture = MechanismPicture(self._stage, exo.mechanism, "exo", muscles=muscles, with_arm=with_arm)
        self._exo = exo
        self._arrows = ForcePicture(self._stage, exo, self._asked_scale)
        # As long as the longest arrow.
        self._tension_top = nice_step(LONGEST / self._arrows.scale)
        self._write_legend()

    def _background(self) -> None:
        viewer = self._stage.viewer
        viewer["/Background"].set_property("top_color", [1.0, 1.0, 1.0])
        viewer["/Background"].set_property("bottom_color", [0.90, 0.92, 0.95])
        for name in ("/Grid", "/Axes"):
            viewer[name].set_property("visible", False)

    def _motion(
        self, orientations: Rotation, times: ArrayLike, pressures: ArrayLike | None
    ) -> tuple[Rotation, FloatArray, FloatArray | None]:
        """Poses, times and pressures that fit each other."""
        poses = as_rotation("orientations", orientations)
        stamps = as_finite("times", times, (None,))
        if poses.shape != stamps.shape or not len(stamps):
            raise InvalidInput(f"expected a time for every pose, got poses {poses.shape} and times {stamps.shape}")
        if (np.diff(stamps) <= 0).any():
            raise InvalidInput("expected times that rise")
        return poses, stamps, None if pressures is None else self._pressures(pressures, stamps.shape)

    def _frames(self, poses: Rotation, answer: Reaction | None, pressures: FloatArray | None) -> Iterator[int]:
        """Draw pose after pose; a frame begins when the one before has been dealt with."""
        for index, pose in enumerate(poses):
            self._draw(
                pose,
                None if answer is None else PoseForces.of(answer, (index,)),
                None if pressures is None else pressures[index],
            )
            yield index

    def _aside(self, query: dict[str, Any]) -> None:
        """Say what a query counts and the drawing does not show."""
        offset = query.get("centre_offset") is not None
        self._asides = ["forces with the centre offset, drawing without it"] if offset else []

    def _pressures(self, pressures: ArrayLike, shape: tuple[int, ...]) -> FloatArray:
        values = as_finite("pressures", pressures, (self._exo.geometry.limb_count,), stack=True)
        if values.shape[:-1] != shape:
            raise InvalidInput(f"expected pressures of shape {(*shape, values.shape[-1])}, got {values.shape}")
        return values


def _single(orientation: Rotation) -> Rotation:
    pose = as_rotation("orientation", orientation)
    if pose.shape != ():
        raise InvalidInput(f"expected a single pose, got a stack of shape {pose.shape}; play and record take stacks")
    return pose
