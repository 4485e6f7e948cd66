"""Additions to the scene of a wrist: a second pose or design as a ghost, and the socket of the shoulder as a cone."""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np
from scipy.spatial.transform import Rotation

from ...core.errors import InvalidInput
from ...core.validation import as_positive, as_rotation, require_method, require_type
from ...reaction import GlenoidCone
from ..colours import SKY
from ..stage.additions import Additions
from ..stage.force_arrows import ForcePicture
from ..stage.shapes import flat_material, frustum, placement
from .mechanism_picture import MechanismPicture

if TYPE_CHECKING:
    from ...exo.shoulder_exo import ShoulderExo
    from ..figure.figure import Figure

__all__ = ["WristAdditions", "single_pose"]

#: Colour and opacity of a ghost, and its colour on white, as its entry in the legend.
_GHOST, _GHOST_SHOWN = (0.34, 0.40, 0.48, 0.30), "#AEB3BA"
_CONE = "additions/glenoid cone"


class WristAdditions(Additions):
    """Ghost and socket of a wrist's scene; base of :class:`Scene`."""

    _exo: ShoulderExo
    _arrows: ForcePicture
    _figure: Figure
    _orientation: Rotation
    _ghost: MechanismPicture | None = None
    _cone: tuple[GlenoidCone, float]

    def ghost(self, poses: Rotation | None = None, exo: ShoulderExo | None = None) -> None:
        """Draw a second pose, or a second design, as a grey ghost for comparison.

        Parameters
        ----------
        poses : Rotation, optional
            Its pose; the one of the scene if left out.
        exo : ShoulderExo, optional
            Its design; the one of the scene if left out.
        """
        pose = self._orientation if poses is None else single_pose(poses)
        design = self._exo if exo is None else exo
        require_method("exo", design, "reaction", "a ShoulderExo")
        with self._stage.update():
            if self._ghost is None or self._ghost.mechanism is not design.mechanism:
                self._ghost = MechanismPicture(self._stage, design.mechanism, "ghost", _GHOST)
            self._ghost.show(pose)
            self._items["ghost"] = {"glyph": "line", "colour": _GHOST_SHOWN, "text": "ghost, for comparison"}
            self._write_legend()

    def remove_ghost(self) -> None:
        """Take the ghost away."""
        with self._stage.update():
            self._stage.viewer["ghost"].delete()
            self._ghost = None
            self._items.pop("ghost", None)
            self._write_legend()

    def glenoid_cone(self, cone: GlenoidCone | None = None, length: float = 0.12) -> None:
        """Draw the cone that the shoulder reaction should stay in, to the scale of the arrows.

        While the arrow of F_s ends in the cone, the socket keeps the head of the humerus.

        Parameters
        ----------
        cone : GlenoidCone, optional
            Which; that of the scene's person if left out. Compression by the person's own muscles moves its apex from
            O into the body, by as much as their arrow would be long.
        length : float
            Of the drawn part along its axis, m.

        Raises
        ------
        MissingData
            If the cone has no orientation, or is left out and the scene has no person.
        """
        require_type("cone", cone, GlenoidCone | None)
        if cone is None:
            person = self._figure.person
            cone = GlenoidCone() if person is None else person.glenoid_cone()
        cone.axes(self._exo.side, self._orientation)  # its checks
        self._cone = cone, as_positive("length", length)
        with self._stage.update():
            self._stage.viewer[_CONE].set_object(frustum(1e-6, 1.0), flat_material(SKY, 0.35))
            self._items["glenoid cone"] = {"glyph": "cone", "colour": SKY, "text": "F_s ends in here: socket holds"}
            self._place_cone()
            self._write_legend()

    def _place_cone(self) -> None:
        """Place the cone, if there is one: it follows the scapula, and its apex moves with the arrows' scale."""
        if "glenoid cone" not in self._items:
            return
        socket, long = self._cone
        outward, superior, anterior = socket.axes(self._exo.side, self._orientation)
        sides = long * np.column_stack([socket.anterior * anterior, socket.superior * superior, outward])
        apex = -self._arrows.scale * socket.muscle_compression * outward
        self._stage.set_transform(f"/meshcat/{_CONE}", placement(sides, apex))


def single_pose(poses: Rotation) -> Rotation:
    """A checked pose, which is no stack."""
    pose = as_rotation("poses", poses)
    if pose.shape != ():
        raise InvalidInput(f"expected a single pose, got a stack of shape {pose.shape}; play and record take stacks")
    return pose
