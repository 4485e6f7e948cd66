"""What is not known of a worn device: worst cases, and what its forces depend on."""

from __future__ import annotations

from collections.abc import Mapping

from numpy.typing import ArrayLike
from scipy.spatial.transform import Rotation

from ..load_case import CentreOffset, Load, Motion
from ..reaction import Split
from ..uncertainty.force_sensitivity import Sensitivity, sensitivity
from ..uncertainty.parameter_ranking import Ranking, Uncertainty, rank
from ..uncertainty.worst_case import WorstCase, worst_stiffness
from ..uncertainty.worst_centre_offset import worst_offset
from .subject import Subject

__all__ = ["UncertaintyQuestions"]


class UncertaintyQuestions(Subject):
    """Worst cases of a design, and what its forces depend on; closed forms, for massless limbs."""

    def worst_offset(
        self,
        orientation: Rotation,
        radius: float,
        split: str | Split = "spherical",
        motion: Motion | None = None,
        load: Load | None = None,
        centre: ArrayLike = (0.0, 0.0, 0.0),
    ) -> WorstCase:
        """Largest |F_s| over all centre offsets within ``radius``, m, and whether the device turns singular there.

        Base and cuff are off together.

        See :func:`exo_pin.uncertainty.worst_centre_offset.worst_offset`.
        """
        return worst_offset(self.mechanism, orientation, radius, split, motion, load, centre)

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

        See :func:`exo_pin.uncertainty.worst_case.worst_stiffness`.
        """
        return worst_stiffness(self.mechanism, orientation, least, largest, motion, load, centre_offset)

    def sensitivity(
        self,
        orientation: Rotation,
        motion: Motion | None = None,
        load: Load | None = None,
        split: str | Split = "spherical",
        centre_offset: CentreOffset | ArrayLike = (0.0, 0.0, 0.0),
    ) -> Sensitivity:
        """Exact derivatives of F_s, f and g by pose, geometry, arm, load, stiffness and offset.

        See :func:`exo_pin.uncertainty.force_sensitivity.sensitivity`.
        """
        return sensitivity(self.mechanism, orientation, motion, load, split, centre_offset)

    def ranking(
        self,
        movement: Rotation,
        motion: Motion | None = None,
        load: Load | None = None,
        split: str | Split = "spherical",
        centre_offset: CentreOffset | ArrayLike = (0.0, 0.0, 0.0),
        uncertainties: Mapping[str, Uncertainty] | None = None,
        top: int = 5,
    ) -> Ranking:
        """The parameters whose uncertainty matters most for the peak |F_s| of a movement.

        ``uncertainties`` states, by parameter, a number in its unit or a share such as "5%"; what is not stated is
        taken from :data:`exo_pin.uncertainty.parameter_ranking.ASSUMED_UNCERTAINTY`. See
        :func:`exo_pin.uncertainty.parameter_ranking.rank`.
        """
        return rank(self.sensitivity(movement, motion, load, split, centre_offset), uncertainties, top)
