"""The scene of a device: on a person, with its forces, in a pose, or in motion, played or recorded."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from typing import TYPE_CHECKING, NamedTuple, Unpack

import numpy as np
from numpy.typing import ArrayLike
from scipy.spatial.transform import Rotation

from ...core.errors import InvalidInput
from ...core.errors.checked import checked
from ...core.tables import NOTES
from ...core.validation import FloatArray, as_choice, as_positive, as_rotation, as_single_rotation, require_method
from ...reaction import Reaction
from .. import LIMB_STYLES
from ..colours import ACTIVATIONS, scale_colours
from ..figure.figure import Figure
from ..picture.drawn_device import ROOT, DrawnDevice, DrawnLinks, Placed
from ..picture.drawn_limbs import DrawnLimbs, offset_notes, offsets
from ..stage.force_arrows import DrawnForce, ForcePicture, ShownForces
from ..stage.stage import Stage
from .page_output import Pages, drawable, viewpoint
from .panels import PoseSliders, bar, numbers_panel
from .scene_recording import SceneRecording, as_times, play_frames, record_frames

if TYPE_CHECKING:
    from ...exo.shoulder_exo import ShoulderExo
    from ...person import Person
    from ...reaction.assumptions import Question


class Frame(NamedTuple):
    """What is drawn of a pose: forces and arrows where the device has an arm."""

    placed: Placed
    forces: ShownForces | None
    arrows: list[DrawnForce]


@checked
class Scene(Pages):
    """A device of any kind in a pose, with forces, drawn by Meshcat, without browser or server.

    :meth:`serve` opens a live page on this machine, :meth:`save_html` writes a file that opens without a network,
    :meth:`save_png` a still picture. Base frame {O_A}: O is the shoulder centre, x forward, y left, z up. Forces are
    those on the arm, N, to the scale of the legend.

    Parameters
    ----------
    exo : ShoulderExo
        The device. A wrist without an arm has no forces to draw.
    human : bool, optional
        Whether a person is drawn. Left out: the whole person if the figure is installed, else chest and head alone,
        and a note on the page. It is 1.79 m tall, or as its wearer (:meth:`~exo_pin.ShoulderExo.worn_by`).
    limbs : {"rods", "muscles"}
        Of a wrist: rods and cables, or muscles that swell as they shorten and take their colour from tension.
    metres_per_newton : float, optional
        Scale of the arrows; left out, the largest force is about 20 cm long. Near singular poses arrows are cut.
    person : Person, optional
        Who wears it: the design is put on their arm, bones and muscles take the place of the human figure, and the
        contact force of the shoulder joint with their own muscles is drawn beside F_s.
    device : bool
        Whether the device is drawn and acts; False for the bare arm of a ``person``.

    Raises
    ------
    InvalidInput
        If ``exo`` is a robot without an arm (see :class:`.ChainScene`), or ``limbs`` are muscles and it has no limbs.
    MissingExtra
        If ``human`` is True and the figure is not installed, or the extra ``person`` is not, with a ``person``.
    UnknownName
        If ``limbs`` is no style.

    Examples
    --------
    >>> from exo_pin.view import Scene
    >>> exo = ep.load("four-linear-actuators")
    >>> scene = Scene(exo, human=False)
    >>> answer = scene.show(exo.pose(flexion=60))
    >>> round(float(answer.magnitude), 1)  # N, the length of the arrow at the shoulder
    46.8
    """

    def __init__(
        self,
        exo: ShoulderExo,
        human: bool | None = None,
        limbs: str = "rods",
        metres_per_newton: float | None = None,
        person: Person | None = None,
        device: bool = True,
    ) -> None:
        require_method("exo", exo, "reaction", "a ShoulderExo")
        as_choice("limb style", limbs, LIMB_STYLES)
        if metres_per_newton is not None:
            metres_per_newton = as_positive("metres_per_newton", metres_per_newton)
        if not device and person is None:
            raise InvalidInput("without a device there is nothing to draw but a person: give one")
        self._stage = Stage()
        self._device = device
        self._style, self._asked_scale = limbs, metres_per_newton
        self._without_forces: list[str] = []
        self._cautions: list[str] = []
        self._orientation = Rotation.identity()
        self._asked: Question = {}
        self._sliders = PoseSliders(self._stage, exo.side, lambda pose: self.show(pose, **self._asked))
        with self._stage.update():
            self._stage.plain()
            arm = drawable(exo)[0].device.arm
            self._figure = Figure(self._stage, exo.side, human, None if arm is None else arm.wearer, person)
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
        """What could not be drawn, and why, parts that pass through the wearer, and cautions of the answer."""
        own: list[str] = []
        if self._device:
            offset = None if self._offset is None else (np.array(self._offset[:1]), np.array(self._offset[1:]))
            touching = self._exo.device.gaps(self._orientation.as_matrix()[None], offset).words
            own = [*self._drawn.notes, *([touching] if touching else []), *self._cautions]
        return (*self._figure.notes, *self._without_forces, *own)

    @property
    def metres_per_newton(self) -> float:
        """Scale of the arrows, m/N."""
        return self._arrows.scale

    def replace_exo(self, exo: ShoulderExo) -> None:
        """Draw another design of the same side, in the same pose; the forces are those of the new one.

        Parameters
        ----------
        exo : ShoulderExo
            The new one; options are those of the last :meth:`show`.

        Raises
        ------
        InvalidInput
            If it is for the other side of the body.

        Examples
        --------
        >>> from exo_pin.view import Scene
        >>> scene = Scene(ep.load("four-linear-actuators"), human=False)
        >>> scene.replace_exo(ep.load("three-linear-actuators"))
        >>> scene.exo.mechanism.limb_count
        3
        """
        require_method("exo", exo, "reaction", "a ShoulderExo")
        if exo.side != self._exo.side:
            raise InvalidInput(f"expected a design for the {self._exo.side} shoulder, got one for the {exo.side}")
        with self._stage.update():
            # Numbers can be compared only if the arrows keep their scale.
            self._asked_scale = self._arrows.scale
            self._set_exo(exo)
            self.show(self._orientation, **self._asked)

    def show(self, poses: Rotation, **query: Unpack[Question]) -> Reaction | None:
        """Move everything into a pose and draw its forces.

        Parameters
        ----------
        poses : Rotation
            A single pose.
        **query
            Further arguments of :meth:`exo_pin.ShoulderExo.reaction`, such as ``split``.

        Returns
        -------
        Reaction or None
            What is drawn; None for a design without an arm. A device that does not reach the pose is not drawn, and
            the page says so.

        Examples
        --------
        >>> from exo_pin.view import Scene
        >>> exo = ep.load("four-linear-actuators")
        >>> least = Scene(exo, human=False).show(exo.pose(flexion=60), split="minimal")
        >>> bool(least.magnitude <= exo.reaction(exo.pose(flexion=60)).magnitude)  # the least shoulder force
        True
        """
        pose = as_single_rotation("poses", poses)
        with self._stage.update():
            answer, frames = self._frames(pose, query)
            self._asked = query
            self._plan(frames)
            self._draw(frames[0])
        return answer

    def play(self, poses: Rotation, times: ArrayLike, **query: Unpack[Question]) -> Reaction | None:
        """Play a motion in the live page, in real time.

        Parameters
        ----------
        poses : Rotation
            Poses, shape (k,), {O_B} to {O_A}.
        times : array_like
            Shape (k,), s, rising.
        **query
            Further arguments of :meth:`exo_pin.ShoulderExo.reaction`, such as ``motion``, which broadcast to (k,).

        Returns
        -------
        Reaction or None
            Forces of all poses.

        Examples
        --------
        >>> from exo_pin.view import Scene
        >>> exo = ep.load("three-linear-actuators")
        >>> answer = Scene(exo, human=False).play(exo.pose(flexion=[30, 31]), [0.0, 0.02])  # s
        >>> answer.magnitude.round(1)  # N
        array([26.3, 25.9])
        """
        stamps, answer, draw = self._motion(poses, times, query)
        play_frames(stamps, draw)
        return answer

    def record(self, poses: Rotation, times: ArrayLike, **query: Unpack[Question]) -> SceneRecording:
        """Record a motion; the arguments are those of :meth:`play`, and no time passes.

        Parameters
        ----------
        poses, times, **query
            As for :meth:`play`: k poses {O_B} to {O_A} at rising times, s.

        Returns
        -------
        SceneRecording
            Its ``save`` writes one file that plays without a network.

        Examples
        --------
        >>> from exo_pin.view import Scene
        >>> exo = ep.load("four-linear-actuators")
        >>> path = exo.pose(flexion=[0, 45, 90])
        >>> film = Scene(exo, human=False).record(path, [0.0, 1.0, 2.0], load=ep.Load([0.0, 0.0, -10.0]))
        >>> film.reaction.magnitude.round(1)  # N, with 10 N in the hand
        array([51.9, 41.7, 53.1])
        """
        stamps, answer, draw = self._motion(poses, times, query)
        return record_frames(self._stage, stamps, draw, answer)

    def _motion(
        self, poses: Rotation, times: ArrayLike, query: Question
    ) -> tuple[FloatArray, Reaction | None, Callable[[int], None]]:
        """Times, forces, and what draws a frame; scale and legend are those of the motion from here on."""
        poses = as_rotation("poses", poses)
        stamps = as_times(times, "pose", poses.shape)
        answer, frames = self._frames(poses, query)
        self._plan(frames)
        return stamps, answer, lambda index: self._draw(frames[index])

    def _frames(self, poses: Rotation, query: Question) -> tuple[Reaction | None, list[Frame]]:
        """The answer for poses of shape () or (k,), and 1 or k frames."""
        answer = None if self._exo.device.arm is None else self._exo.reaction(poses, **query)
        self._cautions = [] if answer is None else [text for text in answer.cautions if not text.startswith(NOTES)]
        frames = []
        off = offsets(query.get("centre_offset"), poses, query.get("split", "spherical"))
        places = self._drawn.places(poses, off)
        for placed, forces in zip(places, self._forces(poses, answer, query), strict=True):
            frames.append(Frame(placed, forces, [] if forces is None else self._drawn.forces(placed, forces)))
        return answer, frames

    def _forces(self, poses: Rotation, answer: Reaction | None, query: Question) -> list[ShownForces | None]:
        indices = [()] if poses.single else [(index,) for index in range(len(poses))]
        if answer is None:
            return [None for _ in indices]
        person, contact, motion, load = self._figure.person, None, query.get("motion"), query.get("load")
        if person is not None and self._device:
            contact = self._exo.joint_contact(poses, person, answer, motion, load, outside="mark")
        elif person is not None:
            contact = person.joint_contact(poses, motion, load, gravity=self._exo.device.gravity, outside="mark")
        shown = [ShownForces.of(answer, index, contact) for index in indices]
        return [each if self._device else each.without_device() for each in shown]

    def _plan(self, frames: Sequence[Frame]) -> None:
        """Choose the scales of a pose or a motion, and write the legend."""
        known = [each.forces for each in frames if each.forces is not None]
        self._arrows.plan(known, [each.arrows for each in frames])
        scale, items = self._arrows.legend()
        if self._exo.device.arm is None:
            scale, items = "No mass of the arm: no forces", []
        bars = []
        if self._style == "muscles" and self._device and known:
            bars.append(bar("muscle tension, N", 0.0, self._arrows.tension_top))
        if self._device and self._drawn.parts is not None:
            items = [*items, *self._drawn.parts.legend]
        if (wearer := self._figure.wearer) is not None:
            wearer.plan([each.contact for each in known if each.contact is not None])
            bars.append(bar("wearer's activation, %", 0.0, 100.0 * wearer.top, ACTIVATIONS))
            items = [*items, *wearer.legend]
        self._stage.set_panel("legend", {"scale": scale, "items": items, "bars": bars})

    def _draw(self, frame: Frame) -> None:
        with self._stage.update():
            pose, forces = frame.placed.pose, frame.forces
            self._orientation, self._offset = pose, frame.placed.offset
            notes = []
            reached = self._drawn.show(frame.placed)
            self._stage.set_property(f"/meshcat/{ROOT}", "visible", self._device and reached)
            if not reached:
                notes.append("the device does not reach this pose, and is not drawn")
            self._figure.show(pose)
            self._arrows.show(frame.arrows)
            if self._style == "muscles" and self._device and forces is not None:
                values = self._drawn.tensions(forces)
                colours = scale_colours(values, 0.0, self._arrows.tension_top)
                # A muscle that would have to push is drawn white.
                colours[np.asarray(values) < 0.0] = 1.0
                self._drawn.colour_muscles(colours)
            if self._figure.wearer is not None:
                self._figure.wearer.show_contact(None if forces is None else forces.contact)
            off = offset_notes(frame.placed.offset, pose.as_matrix())
            if off and frame.placed.drawn is None:
                off.append("its links are drawn as if its centre were the shoulder's: only what gives way follows")
            notes = [*self.messages, *notes, *off]
            self._sliders.follow(pose)
            self._stage.set_panel("numbers", numbers_panel(self._exo, pose, forces, notes, self._sliders.asked))

    def _set_exo(self, exo: ShoulderExo) -> None:
        # Computed first, so that a design that cannot be drawn changes no part of the scene.
        person = self._figure.person
        if person is not None:
            exo = exo.worn_by(person) if self._device else exo.replace(arm=person.arm)
        exo, without = drawable(exo)
        self._drawn = self._drawn_of(exo)
        self._exo, self._without_forces, self._offset = exo, without, None
        self._arrows = ForcePicture(self._stage, self._asked_scale)

    def _drawn_of(self, exo: ShoulderExo) -> DrawnDevice:
        muscles, with_arm = self._style == "muscles", not self._figure.has_arm
        if exo.wrist is not None:
            return DrawnLimbs(self._stage, exo, muscles, with_arm, self._figure.wearer is not None)
        if muscles:
            raise InvalidInput(
                f"limbs are drawn as muscles in a wrist, and {exo.name!r} is none: leave limbs='muscles' out"
            )
        return DrawnLinks(self._stage, exo, with_arm)

    def _viewpoint(self, towards: FloatArray | None) -> tuple[FloatArray, FloatArray, list[float]]:
        corners = self._drawn.corners() if self._device else np.zeros((1, 3))
        return viewpoint(self._exo, corners, self._figure.is_there, towards)
