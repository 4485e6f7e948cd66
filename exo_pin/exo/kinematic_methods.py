"""Where the arm and the limbs are, how they move, how near a pose is to losing hold, and which poses can be reached."""

from __future__ import annotations

from collections.abc import Iterable

from numpy.typing import ArrayLike
from scipy.spatial.transform import Rotation

from .. import wrist
from ..core.validation import FloatArray
from ..load_case import CentreOffset, CentrePath, Load, Motion
from ..workspace.criteria import Criteria
from ..workspace.query import workspace
from ..workspace.result import Workspace
from .subject import Subject


class KinematicQuestions(Subject):
    """Kinematics and singularity of a design."""

    def inverse_kinematics(self, poses: Rotation) -> wrist.LimbState:
        """Limb lengths, directions and joint angles; see :func:`exo_pin.wrist.inverse_kinematics`."""
        return wrist.inverse_kinematics(self.geometry, poses)

    def jacobian(self, poses: Rotation) -> FloatArray:
        """d(lengths)/dt = J ω, shape (..., n, 3), m/rad; see :func:`exo_pin.wrist.limb_jacobian`."""
        return wrist.limb_jacobian(self.geometry, poses)

    def forward_kinematics(
        self, lengths: ArrayLike, near: Rotation | None = None, tolerance: float = 1e-9
    ) -> wrist.AssemblyModes:
        """All poses with given limb lengths, m; see :func:`exo_pin.wrist.forward_kinematics`."""
        return wrist.forward_kinematics(self.geometry, lengths, near, tolerance)

    def forward_kinematics_from_base_angles(
        self,
        theta_x: ArrayLike | None = None,
        theta_y: ArrayLike | None = None,
        near: Rotation | None = None,
        tolerance: float = 1e-9,
    ) -> wrist.AssemblyModes:
        """All poses with given angles of the base joints, rad.

        Both angles, θ_x alone or θ_y alone; see :func:`exo_pin.wrist.forward_kinematics_from_base_angles`.
        """
        return wrist.forward_kinematics_from_base_angles(self.geometry, theta_x, theta_y, near, tolerance)

    def joint_motion(self, poses: Rotation, motion: Motion) -> wrist.JointMotion:
        """Rates and accelerations of limbs and universal joints; see :func:`exo_pin.wrist.joint_motion`."""
        return wrist.joint_motion(self.geometry, poses, motion)

    def singularity(self, poses: Rotation) -> wrist.Singularity:
        """How far poses are from losing control; see :func:`exo_pin.wrist.singularities.measures`."""
        return wrist.singularity(self.geometry, poses, self.mechanism.is_upu)

    def nearest_singularity(self, poses: Rotation) -> wrist.NearestSingularity:
        """The closest singular pose and its angle; see :func:`exo_pin.wrist.nearest_singularity`."""
        return wrist.nearest_singularity(self.geometry, poses)

    def sensor_sensitivity(
        self, poses: Rotation, measured: str | Iterable[str] = "base_theta_x"
    ) -> wrist.SensorSensitivity:
        """Error of the arm per error of joint sensors; see :func:`exo_pin.wrist.sensor_sensitivity`."""
        return wrist.sensor_sensitivity(self.geometry, poses, measured)


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
