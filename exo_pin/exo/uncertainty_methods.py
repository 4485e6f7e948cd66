"""How sure the shoulder force of a worn device is."""

from __future__ import annotations

from collections.abc import Mapping

from numpy.typing import ArrayLike
from scipy.spatial.transform import Rotation

from ..load_case import Case, CentreOffset, CentrePath, Load, Motion, Movement
from ..reaction import Assumptions, ConstraintBounds, Limits, Split
from ..uncertainty.force_uncertainty import ForceUncertainty, force_uncertainty
from .subject import Subject


class UncertaintyQuestions(Subject):
    """What a designer asks of a number: which uncertain quantity matters, and what the worst fit does."""

    def uncertainty(
        self,
        poses: Rotation | Movement,
        motion: Motion | None = None,
        load: Load | None = None,
        split: str | Split = "spherical",
        constraint_bounds: ConstraintBounds = None,
        centre_offset: CentreOffset | CentrePath | ArrayLike | None = None,
        *,
        limits: Limits = "design",
        uncertainties: Mapping[str, float] | None = None,
    ) -> ForceUncertainty:
        """How much |F_s| changes with what is uncertain, largest first, and at the worst offset of the device.

        Parameters
        ----------
        poses : Rotation or Movement
            A pose; of a stack or a movement the peak of the poses that can be held is asked.
        motion, load, split, constraint_bounds, centre_offset, limits
            As in :meth:`reaction`.
        uncertainties : mapping, optional
            By name of the quantity, with the unit in the name, to both sides: ``{"offset_mm": 20, "A[1]_mm": 5}``;
            zero takes it as certain. Names are those of :mod:`exo_pin.uncertainty.quantities` and dimensions of the
            design (``"cuff_height_mm"``, ``"r_A_mm"``, ...). What is not stated is taken from
            :data:`exo_pin.uncertainty.quantities.ASSUMED_UNCERTAINTY`.

        Returns
        -------
        ForceUncertainty

        Raises
        ------
        UnknownName
            If an uncertainty is stated for a name that is no quantity of the question.
        InvalidInput
            If it is no number of zero or more, or another argument does not fit.
        SolverFailed
            If no pose has an answer.

        Examples
        --------
        >>> exo = ep.load("four-linear-actuators-worn")
        >>> sure = exo.uncertainty(exo.pose(60, 30), uncertainties={"offset_mm": 10})
        >>> round(float(sure.worst_offset.magnitude), 1)  # N, the device 10 mm off in the worst direction
        84.8
        """
        case = Case(poses, motion, load, centre_offset)
        return force_uncertainty(self, case, Assumptions(split, limits, constraint_bounds), uncertainties)
