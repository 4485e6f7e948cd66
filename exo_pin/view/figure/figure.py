"""Who wears the device in the scene: the wearer's skeleton, the mannequin, chest and head alone, or nobody."""

from __future__ import annotations

from typing import TYPE_CHECKING

from scipy.spatial.transform import Rotation

from ...core.errors import MissingExtra
from ...core.records import OneProcess
from ...core.validation import require_method
from ..stage.shapes import draw_ground
from ..stage.stage import Stage
from .bust import OWN_STATURE, draw_bust
from .human_figure import Human

if TYPE_CHECKING:
    from ...design import Wearer
    from ...person import Person
    from .wearer_figure import WearerFigure

#: Height of the ground under O for the figure's own stature, and how far it reaches, m.
_GROUND, _GROUND_RADIUS = -1.385, 2.6


class Figure(OneProcess):
    """The one who wears the device.

    Parameters
    ----------
    stage : Stage
        Where it is drawn.
    side : {"left", "right"}
        Which of its shoulders is at O.
    human : bool or None
        Whether somebody is drawn; None draws the mannequin where it is installed.
    worn_by : Wearer or None
        Whose height and bend of the elbow the mannequin has.
    person : Person or None
        Whose skeleton and muscles are drawn in place of the mannequin.

    Attributes
    ----------
    person : Person or None
        With the arm of this side.
    wearer : WearerFigure or None
        The skeleton.
    is_there : bool
        Whether somebody is drawn.
    scale : float
        Stature over that of the mannequin.
    notes : list of str
        What could not be drawn, and why.

    Raises
    ------
    MissingExtra
        If what is wanted is not installed.
    """

    def __init__(
        self,
        stage: Stage,
        side: str,
        human: bool | None,
        worn_by: Wearer | None,
        person: Person | None,
    ) -> None:
        if person is not None:
            require_method("person", person, "joint_contact", "a Person")
        shown = worn_by if person is None else person
        self.person = None if person is None else person.on_side(side)
        self.wearer: WearerFigure | None = None
        self._human: Human | None = None
        self.is_there = human is not False
        self.scale = 1.0 if shown is None else shown.height / OWN_STATURE
        self.notes: list[str] = []
        if self.person is not None and self.is_there:
            from .wearer_figure import WearerFigure  # here, because it needs an extra

            # Without legs it stands on no ground.
            self.wearer = WearerFigure(stage, self.person)
            return
        draw_ground(stage, self.scale * _GROUND, _GROUND_RADIUS)
        if not self.is_there:
            return
        try:
            self._human = Human(stage, side, 0.0 if shown is None else shown.elbow_flexion, self.scale)
        except MissingExtra as error:
            if human:
                raise
            self.notes.append(f"chest and head alone, no human figure: {error}")
            draw_bust(stage, side, self.scale)

    @property
    def has_arm(self) -> bool:
        """Whether it brings an arm of its own."""
        return self._human is not None or self.wearer is not None

    def show(self, poses: Rotation) -> None:
        """Turn the arm into a pose."""
        if self._human is not None:
            self._human.show(poses)
        if self.wearer is not None:
            self.wearer.show(poses.as_matrix())
