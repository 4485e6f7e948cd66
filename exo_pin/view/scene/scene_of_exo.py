"""The scene of a wrist: a design on a person, in a pose, with its forces."""

from __future__ import annotations

from collections.abc import Sequence
from typing import TYPE_CHECKING, Any, Unpack

import numpy as np
from numpy.typing import ArrayLike
from scipy.spatial.transform import Rotation

from ...core.errors import InvalidInput, LoopNotClosed
from ...core.errors.checked import checked
from ...core.validation import FloatArray, as_choice, as_positive, as_single_rotation, require_method
from ...device.clearance import gaps
from ...reaction import Reaction
from .. import LIMB_STYLES
from ..colours import ACTIVATIONS, scale_colours
from ..figure.bust import starts_inside
from ..figure.figure import Figure
from ..stage.force_arrows import ForcePicture, ShownForces
from ..stage.offset import Offset, offset_notes, same_offset
from ..stage.stage import Stage
from .mechanism_picture import MechanismPicture
from .panels import bar, numbers_panel
from .playing import Playing
from .pose_sliders import PoseSliders
from .what_is_shown import drawable, viewpoint

if TYPE_CHECKING:
    from ...exo.shoulder_exo import ShoulderExo
    from ...person import Person
    from ...reaction.assumptions import Question

#: Top of the scale of pressures, Pa, gauge: what the thesis drives its muscles with at most.
_PRESSURE_TOP = 4e5


@checked
class Scene(Playing):
    """A design in a pose, with forces, drawn by Meshcat, without browser or server.

    :meth:`serve` opens a live page on this machine, :meth:`save_html` writes a file that opens without a network,
    :meth:`save_png` a still picture. Base frame {O_A}: O is the shoulder centre, x forward, y left, z up. Forces are
    those on the arm, N, to the scale of the legend.

    Parameters
    ----------
    exo : ShoulderExo
        The design. Without an arm there are no forces to draw.
    human : bool, optional
        Whether a person is drawn. Left out: the whole person if the figure is installed, else chest and head alone,
        and a note on the page. It is 1.79 m tall, or as its wearer (:meth:`~exo_pin.ShoulderExo.worn_by`).
    limbs : {"rods", "muscles"}
        Rods and cables, or muscles that swell as they shorten and take their colour from tension or pressure.
    metres_per_newton : float, optional
        Scale of the arrows; left out, the largest force is about 20 cm long. Near singular poses arrows are cut.
    person : Person, optional
        Who wears it: the design is put on their arm, bones and muscles take the place of the human figure, and the
        contact force of the shoulder joint with their own muscles is drawn beside F_s.
    device : bool
        Whether the device is drawn and acts; False for the bare arm of a ``person``.

    Raises
    ------
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
        self._offset: Offset | None = None
        self._massive: list[str] = []
        self._orientation = Rotation.identity()
        self._muscle_bar: dict[str, Any] | None = None
        self._asked: Question = {}
        self._sliders = PoseSliders(self._stage, exo.side, lambda pose: self.show(pose, **self._asked))
        with self._stage.update():
            self._stage.plain()
            arm = drawable(exo)[0].arm
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
        """What could not be drawn, and why, and limbs that pass through the wearer or start inside the chest."""
        base = self._picture.mechanism.geometry.base_points
        inside = starts_inside(base, self._exo.side, self._figure.scale) if self._device else []
        offset = None if self._offset is None else (self._offset[0][None], self._offset[1][None])
        touching = gaps(self._exo.device, self._orientation.as_matrix()[None], offset).words if self._device else ""
        own = [*(self._picture.notes if self._device else ()), *inside, *([touching] if touching else [])]
        return (*self._figure.notes, *self._massive, *own)

    @property
    def metres_per_newton(self) -> float:
        """Scale of the arrows, m/N."""
        return self._arrows.scale

    def replace_exo(self, exo: ShoulderExo) -> None:
        """Draw another design of the same side, in the same pose; the forces are those of the new one.

        Parameters
        ----------
        exo : ShoulderExo
            The new one; options are those of the last :meth:`show`, but for pressures, which belong to a design.

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

    def show(self, poses: Rotation, pressures: ArrayLike | None = None, **query: Unpack[Question]) -> Reaction | None:
        """Move everything into a pose and draw its forces.

        Parameters
        ----------
        poses : Rotation
            A single pose.
        pressures : array_like, optional
            Shape (n,), Pa, gauge: muscles take their colour from them and not from their tension.
        **query
            Further arguments of :meth:`exo_pin.ShoulderExo.reaction`, such as ``split``.

        Returns
        -------
        Reaction or None
            What is drawn; None for a design without an arm.

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
            answer = None if self._exo.arm is None else self._exo.reaction(pose, **query)
            pressure = None if pressures is None else self._pressures(pressures, ())
            (centre,) = self._offsets(pose, query)
            forces = self._forces(pose, answer, query)[0]
            self._asked = query
            self._plan([forces])
            self._draw(pose, forces, pressure, centre)
        return answer

    def _forces(self, poses: Rotation, answer: Reaction | None, query: Question) -> list[ShownForces | None]:
        indices = [()] if poses.single else [(index,) for index in range(len(poses))]
        if answer is None:
            return [None for _ in indices]
        person = self._figure.person
        if person is None:
            return [ShownForces.of(answer, index) for index in indices]
        motion, load = query.get("motion"), query.get("load")
        if self._device:
            contact = self._exo.joint_contact(poses, person, answer, motion, load, outside="mark")
            return [ShownForces.of(answer, index, contact) for index in indices]
        contact = person.joint_contact(poses, motion, load, gravity=self._exo.mechanism.gravity, outside="mark")
        return [ShownForces.of(answer, index, contact).without_device() for index in indices]

    def _write_legend(self) -> None:
        scale, items = self._arrows.legend() if self._exo.arm is not None else ("No mass of the arm: no forces", [])
        bars = [] if self._muscle_bar is None else [self._muscle_bar]
        if (wearer := self._figure.wearer) is not None:
            bars.append(bar("wearer's activation, %", 0.0, 100.0 * wearer.top, ACTIVATIONS))
            items = [*items, *wearer.legend]
        self._stage.set_panel("legend", {"scale": scale, "items": items, "bars": bars})

    def _plan(self, forces: Sequence[ShownForces | None]) -> None:
        known = [each for each in forces if each is not None]
        self._arrows.plan(known)
        if self._figure.wearer is not None:
            self._figure.wearer.plan([each.contact for each in known if each.contact is not None])
        self._write_legend()

    def _draw(
        self, pose: Rotation, forces: ShownForces | None, pressures: FloatArray | None, offset: Offset | None
    ) -> None:
        with self._stage.update():
            self._orientation = pose
            self._place(offset)
            notes = list(self.messages)
            try:
                self._picture.show(pose)
            except LoopNotClosed:
                notes.append("the limbs do not close in this pose; they are left as they were")
            self._figure.show(pose)
            self._arrows.show(pose, forces, self._picture.mechanism.geometry)
            self._colour_muscles(forces, pressures)
            if self._figure.wearer is not None:
                self._figure.wearer.show_contact(None if forces is None else forces.contact)
            notes += offset_notes(offset, pose.as_matrix())
            self._sliders.follow(pose)
            self._stage.set_panel("numbers", numbers_panel(self._exo, pose, forces, notes, self._sliders.asked))

    def _place(self, offset: Offset | None) -> None:
        """Draw the design where an offset puts it, if that is another place."""
        if not same_offset(offset, self._offset):
            self._offset = offset
            self._draw_mechanism()

    def _draw_mechanism(self) -> None:
        self._picture = MechanismPicture(
            self._stage,
            self._exo.mechanism,
            "exo",
            muscles=self._style == "muscles",
            with_arm=not self._figure.has_arm,
            see_through=self._figure.wearer is not None,
            # Its shapes belong to limbs at that place.
            urdf=self._looks if self._offset is None else None,
            offset=self._offset,
        )
        self._stage.set_property("/meshcat/exo", "visible", self._device)

    def _colour_muscles(self, forces: ShownForces | None, pressures: FloatArray | None) -> None:
        if self._style != "muscles" or not self._device or (forces is None and pressures is None):
            return
        if pressures is not None:
            values, label, top = np.asarray(pressures) / 1e5, "pressure, bar", _PRESSURE_TOP / 1e5
        else:
            assert forces is not None
            # A muscle that would have to push is drawn white.
            values, label, top = forces.tensions, "muscle tension, N", self._arrows.tension_top
        self._muscle_bar = bar(label, 0.0, top)
        self._write_legend()
        colours = scale_colours(values, 0.0, top)
        colours[np.asarray(values) < 0.0] = 1.0
        self._picture.colour_muscles(colours)

    def _set_exo(self, exo: ShoulderExo) -> None:
        # Computed first, so that a design that cannot be drawn changes no part of the scene.
        person = self._figure.person
        if person is not None:
            exo = exo.worn_by(person) if self._device else exo.replace(arm=person.arm)
        self._exo, self._massive = drawable(exo)
        self._offset, self._looks = None, exo.urdf
        self._draw_mechanism()
        self._arrows = ForcePicture(self._stage, self._exo, self._asked_scale)
        self._write_legend()

    def _viewpoint(self, towards: FloatArray | None) -> tuple[FloatArray, FloatArray, list[float]]:
        return viewpoint(self._exo, self._device, self._figure.is_there, towards)
