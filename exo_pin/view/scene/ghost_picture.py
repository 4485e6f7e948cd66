"""Picture of a second pose or design, for comparison."""

from __future__ import annotations

from typing import TYPE_CHECKING

from scipy.spatial.transform import Rotation

from ...core.errors import InvalidInput
from ...core.validation import as_rotation
from .glenoid_picture import Socket
from .mechanism_picture import MechanismPicture

if TYPE_CHECKING:
    from ...exo.shoulder_exo import ShoulderExo

__all__ = ["Ghosts", "single_pose"]

#: Colour and opacity of a ghost, and its colour on white, as its entry in the legend.
_GHOST, _GHOST_SHOWN = (0.34, 0.40, 0.48, 0.30), "#AEB3BA"


class Ghosts(Socket):
    """The ghost of a wrist's scene; base of :class:`Scene`."""

    _orientation: Rotation
    _ghost: MechanismPicture | None = None

    def ghost(self, orientation: Rotation | None = None, exo: ShoulderExo | None = None) -> None:
        """Draw a second pose, or a second design, as a grey ghost for comparison.

        Parameters
        ----------
        orientation : Rotation, optional
            Its pose; the one of the scene if left out.
        exo : ShoulderExo, optional
            Its design; the one of the scene if left out.
        """
        pose = self._orientation if orientation is None else single_pose(orientation)
        design = self.exo if exo is None else exo
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


def single_pose(orientation: Rotation) -> Rotation:
    """A checked pose, which is no stack."""
    pose = as_rotation("orientation", orientation)
    if pose.shape != ():
        raise InvalidInput(f"expected a single pose, got a stack of shape {pose.shape}; play and record take stacks")
    return pose
