"""Questions about what is not known of a worn device: methods of :class:`exo_pin.ShoulderExo`, kept together."""

from __future__ import annotations

from numpy.typing import ArrayLike
from scipy.spatial.transform import Rotation

from .design import CentreOffset, Load, Mechanism, Motion
from .reaction.clearance import worst_clearance
from .reaction.worst import WorstCase, worst_stiffness
from .reaction.worst_offset import worst_offset

__all__ = ["Questions"]


class Questions:
    """Worst cases of a design, and what its forces depend on; closed forms, for massless limbs."""

    _mechanism: Mechanism

    def worst_offset(
        self,
        orientation: Rotation,
        radius: float,
        split: str = "spherical",
        motion: Motion | None = None,
        load: Load | None = None,
        centre: ArrayLike = (0.0, 0.0, 0.0),
    ) -> WorstCase:
        """Largest |F_s| over all centre offsets within ``radius``, m, and whether the device turns singular there.

        See :func:`exo_pin.reaction.worst_offset.worst_offset`.
        """
        return worst_offset(self._mechanism, orientation, radius, split, motion, load, centre)

    def worst_clearance(
        self,
        orientation: Rotation,
        largest_play: ArrayLike,
        motion: Motion | None = None,
        load: Load | None = None,
        centre_offset: CentreOffset | ArrayLike = (0.0, 0.0, 0.0),
    ) -> WorstCase:
        """Largest |F_s| of the elastic split over all plays of the guides up to ``largest_play``, m.

        See :func:`exo_pin.reaction.clearance.worst_clearance`.
        """
        return worst_clearance(self._mechanism, orientation, largest_play, motion, load, centre_offset)

    def worst_stiffness(
        self,
        orientation: Rotation,
        least: float,
        largest: float,
        motion: Motion | None = None,
        load: Load | None = None,
        centre_offset: CentreOffset | ArrayLike = (0.0, 0.0, 0.0),
    ) -> WorstCase:
        """Largest |F_s| of the elastic split over isotropic shoulder stiffnesses from ``least`` to ``largest``, N/m.

        See :func:`exo_pin.reaction.worst.worst_stiffness`.
        """
        return worst_stiffness(self._mechanism, orientation, least, largest, motion, load, centre_offset)
