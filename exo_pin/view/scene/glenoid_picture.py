"""Picture of the glenoid cone."""

from __future__ import annotations

from abc import abstractmethod
from typing import TYPE_CHECKING

import numpy as np

from ...core.validation import as_positive
from ...reaction import GlenoidCone
from ..colours import SKY
from .additions import Additions
from .shapes import flat_material, frustum

if TYPE_CHECKING:
    from ...exo.shoulder_exo import ShoulderExo

__all__ = ["Socket"]

_NODE = "additions/glenoid cone"


class Socket(Additions):
    """The socket of a wrist's scene; base of :class:`Scene`."""

    _cone: tuple[GlenoidCone, float]

    def glenoid_cone(self, cone: GlenoidCone | None = None, length: float = 0.12) -> None:
        """Draw the cone that the shoulder reaction should stay in, to the scale of the arrows.

        While the arrow of F_s ends in the cone, the socket keeps the head of the humerus.

        Parameters
        ----------
        cone : GlenoidCone, optional
            Which; the default one if left out. Compression by the person's own muscles moves its apex from O into
            the body, by as much as their arrow would be long.
        length : float
            Of the drawn part along its axis, m.
        """
        self._cone = GlenoidCone() if cone is None else cone, as_positive("length", length)
        with self._stage.update():
            self._stage.viewer[_NODE].set_object(frustum(1e-6, 1.0), flat_material(SKY, 0.35))
            self._items["glenoid cone"] = {"glyph": "cone", "colour": SKY, "text": "F_s ends in here: socket holds"}
            self._place_cone()
            self._write_legend()

    def _place_cone(self) -> None:
        """Place the cone, if there is one: its apex moves with the arrows' scale."""
        if "glenoid cone" not in self._items:
            return
        socket, long = self._cone
        outward, superior, anterior = socket.axes(self.exo.side)
        placed = np.eye(4)
        placed[:3, :3] = long * np.column_stack([socket.anterior * anterior, socket.superior * superior, outward])
        placed[:3, 3] = -self.metres_per_newton * socket.muscle_compression * outward
        self._stage.set_transform(f"/meshcat/{_NODE}", placed)

    @property
    @abstractmethod
    def exo(self) -> ShoulderExo:
        """The design that is drawn."""

    @property
    @abstractmethod
    def metres_per_newton(self) -> float:
        """Scale of the arrows, m/N."""
