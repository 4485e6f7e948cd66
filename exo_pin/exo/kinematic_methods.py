"""Where the arm and the limbs are, how they move, how near a pose is to losing hold, and which poses can be reached."""

from __future__ import annotations

from collections.abc import Iterable

from numpy.typing import ArrayLike
from scipy.spatial.transform import Rotation

from .. import Criteria, Workspace, wrist
from ..core.validation import FloatArray
from ..load_case import CentreOffset, CentrePath, Load
from ..workspace.query import workspace
from .subject import Subject


class KinematicQuestions(Subject):
    """Poses, kinematics and singularity of a design."""

    def inverse_kinematics(self, poses: Rotation) -> wrist.LimbState:
        """Limb lengths, directions and joint angles; see :func:`exo_pin.wrist.inverse_kinematics`.

        Parameters
        ----------
        poses : Rotation
            Pose, single or a stack of shape (...).

        Returns
        -------
        LimbState

        Examples
        --------
        >>> exo = ep.load("prototype")
        >>> exo.inverse_kinematics(exo.pose(abduction=[0, 30])).lengths.round(4)  # m
        array([[0.3051, 0.3654, 0.3663],
               [0.315 , 0.3586, 0.3593]])
        """
        return wrist.inverse_kinematics(self.geometry, poses)

    def jacobian(self, poses: Rotation) -> FloatArray:
        """d(lengths)/dt = J ω, shape (..., n, 3), m/rad; see :func:`exo_pin.wrist.limb_jacobian`.

        Parameters
        ----------
        poses : Rotation
            Pose, single or a stack of shape (...).

        Returns
        -------
        ndarray
            Shape (..., n, 3), m/rad; ω is in the base frame.

        Examples
        --------
        >>> exo = ep.load("four-cables")
        >>> J = exo.jacobian(exo.pose(60))  # m/rad
        >>> (J @ [0.0, -1.0, 0.0]).round(3)  # lengths while flexion grows by 1 rad/s, m/s
        array([-0.152, -0.015, -0.122,  0.193])
        """
        return wrist.limb_jacobian(self.geometry, poses)

    def forward_kinematics(
        self, lengths: ArrayLike, near: Rotation | None = None, tolerance: float = 1e-9
    ) -> wrist.AssemblyModes:
        """All poses with given limb lengths, m; see :func:`exo_pin.wrist.forward_kinematics`.

        Parameters
        ----------
        lengths : array_like
            l_i, shape (..., n), m.
        near : Rotation, optional
            Broadcasts to (...): a pose that is known to be close, to select a mode.
        tolerance : float
            Only for more than three limbs: poses whose lengths deviate by more, m, do not count.

        Returns
        -------
        AssemblyModes

        Examples
        --------
        >>> exo = ep.load("prototype")
        >>> pose = exo.pose(30, 20, 10)
        >>> modes = exo.forward_kinematics(exo.inverse_kinematics(pose).lengths, near=pose)
        >>> found = modes.rotations[int(modes.nearest)]
        >>> int(modes.count), bool((found * pose.inv()).magnitude() < 1e-9)
        (4, True)
        """
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

        Parameters
        ----------
        theta_x, theta_y : array_like, optional
            Shape (..., n), rad, as in (4-25); at least one of them.
        near : Rotation, optional
            Broadcasts to (...): a pose that is known to be close, to select a mode.
        tolerance : float
            Only for more than three limbs and one angle of each: poses whose residual exceeds this, rad, do not count.

        Returns
        -------
        AssemblyModes

        Examples
        --------
        >>> exo = ep.load("scenario-one")
        >>> state = exo.inverse_kinematics(exo.pose(20, 10))
        >>> modes = exo.forward_kinematics_from_base_angles(state.base_theta_x, state.base_theta_y)
        >>> int(modes.count)  # six angles leave one pose
        1
        """
        return wrist.forward_kinematics_from_base_angles(self.geometry, theta_x, theta_y, near, tolerance)

    def singularity(self, poses: Rotation) -> wrist.Singularity:
        """How far poses are from losing control; see :func:`exo_pin.wrist.singularities.measures`.

        Parameters
        ----------
        poses : Rotation
            Pose, single or a stack of shape (...).

        Returns
        -------
        Singularity

        Examples
        --------
        >>> exo = ep.load("prototype")
        >>> exo.singularity(exo.pose(abduction=[0, 20])).determinant.round(4)  # a singular pose lies between
        array([-0.0143,  0.0198])
        """
        return wrist.singularity(self.geometry, poses, self.mechanism.is_upu)

    def nearest_singularity(self, poses: Rotation) -> wrist.NearestSingularity:
        """The closest singular pose and its angle; see :func:`exo_pin.wrist.nearest_singularity`.

        Parameters
        ----------
        poses : Rotation
            Pose, single or a stack of shape (...).

        Returns
        -------
        NearestSingularity

        Examples
        --------
        >>> exo = ep.load("prototype")
        >>> round(float(np.degrees(exo.nearest_singularity(exo.pose()).distance)), 2)  # degrees from rest
        5.46
        """
        return wrist.nearest_singularity(self.geometry, poses)

    def sensor_sensitivity(
        self, poses: Rotation, measured: str | Iterable[str] = "base_theta_x"
    ) -> wrist.SensorSensitivity:
        """Error of the arm per error of joint sensors; see :func:`exo_pin.wrist.sensor_sensitivity`.

        Parameters
        ----------
        poses : Rotation
            Pose, single or a stack of shape (...).
        measured : str or iterable of str
            One or more of :data:`exo_pin.wrist.QUANTITIES`, for all limbs.

        Returns
        -------
        SensorSensitivity

        Examples
        --------
        >>> exo = ep.load("prototype")
        >>> found = exo.sensor_sensitivity(exo.pose(30))
        >>> round(float(found.sensitivity), 1)  # rad of pose error a rad of joint angle
        130.8
        """
        return wrist.sensor_sensitivity(self.geometry, poses, measured)


class WorkspaceQuestions(KinematicQuestions):
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

        Examples
        --------
        >>> found = ep.load("four-linear-actuators-worn").workspace(10.0)
        >>> print(f"{found.index:.0%} of {found.inside.size} poses; clearance {found.fractions['clearance']:.0%}")
        91% of 1452 poses; clearance 95%
        """
        return workspace(self.device, poses, criteria, load, centre_offset)
