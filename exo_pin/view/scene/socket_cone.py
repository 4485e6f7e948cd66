"""The socket of the shoulder in the scene of a wrist, as a cone."""

from __future__ import annotations

from abc import ABC, abstractmethod
from typing import TYPE_CHECKING

import numpy as np
from scipy.spatial.transform import Rotation

from ...core.validation import as_positive, require_type
from ...reaction import GlenoidCone
from ..colours import SKY
from ..stage.force_arrows import ForcePicture
from ..stage.shapes import flat_material, frustum, placement
from ..stage.stage import Stage

if TYPE_CHECKING:
    from ...exo.shoulder_exo import ShoulderExo
    from ..figure.figure import Figure

__all__ = ["SocketCone"]


class SocketCone(ABC):
    """Cone of a wrist's scene; base of :class:`Scene`."""

    _stage: Stage
    _exo: ShoulderExo
    _arrows: ForcePicture
    _figure: Figure
    _orientation: Rotation
    _cone: tuple[GlenoidCone, float] | None = None

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
            self._stage.viewer["glenoid cone"].set_object(frustum(1e-6, 1.0), flat_material(SKY, 0.35))
            self._place_cone()
            self._write_legend()

    def _place_cone(self) -> None:
        """Place the cone, if there is one: it follows the scapula, and its apex moves with the arrows' scale."""
        if self._cone is None:
            return
        socket, long = self._cone
        outward, superior, anterior = socket.axes(self._exo.side, self._orientation)
        sides = long * np.column_stack([socket.anterior * anterior, socket.superior * superior, outward])
        apex = -self._arrows.scale * socket.muscle_compression * outward
        self._stage.set_transform("/meshcat/glenoid cone", placement(sides, apex))

    @abstractmethod
    def _write_legend(self) -> None:
        """Write the legend, with the cone if there is one."""
