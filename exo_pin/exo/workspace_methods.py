"""Which poses a design can reach, hold and keep safe."""

from __future__ import annotations

from collections.abc import Iterable

from numpy.typing import ArrayLike
from scipy.spatial.transform import Rotation

from ..load_case import CentreOffset, Load
from ..load_case.centre_path import CentrePath
from ..workspace.criteria import Criteria
from ..workspace.query import workspace
from ..workspace.result import Workspace
from .subject import Subject

__all__ = ["WorkspaceQuestions"]


class WorkspaceQuestions(Subject):
    """The workspace of a design; closed forms, for massless limbs."""

    def workspace(
        self,
        poses: Rotation | float | None = None,
        criteria: Criteria | Iterable[str] | None = None,
        load: Load | None = None,
        centre_offset: CentreOffset | CentrePath | ArrayLike | None = None,
    ) -> Workspace:
        """Which poses the device can reach, hold and keep safe, with a margin to every criterion.

        Parameters
        ----------
        poses : Rotation or float, optional
            Stack of shape (...), or the step, degrees, of the grid of daily activities; the grid of 4° with 19,656
            poses of Appendix C if left out.
        criteria : Criteria or iterable of str, optional
            Which of :data:`exo_pin.workspace.CRITERIA`, and their limits; all that the design's data allow if left
            out. The result names those that were not checked.
        load : Load, optional
            On the arm, besides its weight.
        centre_offset : CentreOffset, CentrePath or array_like, optional
            Where the device's centre lies, seen from the anatomical one, as in :meth:`reaction`: one for all poses, or
            one a pose; ``person.centre_path()`` for a frame that the torso holds while the shoulder moves. All criteria
            are checked in the displaced geometry.

        Returns
        -------
        Workspace
            ``index`` (Φ), ``fractions``, ``inside``, ``reasons`` and more; prints as a table.

        Raises
        ------
        MissingData
            If a criterion that is named needs what the design does not have.
        """
        return workspace(self.mechanism, poses, criteria, load, centre_offset)
