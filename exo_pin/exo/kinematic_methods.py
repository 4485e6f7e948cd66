"""Where the arm and the limbs are, how they move, and how near a pose is to losing hold."""

from __future__ import annotations

import functools
from collections.abc import Iterable

from numpy.typing import ArrayLike
from scipy.spatial.transform import Rotation

from .. import wrist
from ..core.conventions import shoulder_rotation
from ..core.validation import FloatArray
from ..load_case import Motion
from ..load_case.human_range import warn_outside_human_range, warn_suspicious_angles
from ..wrist_chain.locked_chains import ChainSingularity, LockedChains
from .subject import Subject

__all__ = ["KinematicQuestions"]


class KinematicQuestions(Subject):
    """Kinematics and singularity of a design."""

    def pose(
        self, flexion: ArrayLike = 0.0, abduction: ArrayLike = 0.0, internal_rotation: ArrayLike = 0.0
    ) -> Rotation:
        """Orientation of the arm from clinical angles in degrees, on the design's own side of the body.

        Warns (:class:`exo_pin.OutsideHumanRange`) of a pose that a human shoulder of that side does not reach, and of
        angles that look like radians.

        Parameters
        ----------
        flexion, abduction, internal_rotation : array_like
            Degrees, positive as named: arm forward, away from the body, turned inward. They broadcast to shape (...).

        Returns
        -------
        Rotation
            Takes {O_B} to {O_A}; single, or a stack of shape (...). See :func:`exo_pin.shoulder_rotation`.

        Raises
        ------
        InvalidInput
            If an angle is not finite or the shapes do not broadcast.
        """
        angles = {"flexion": flexion, "abduction": abduction, "internal_rotation": internal_rotation}
        orientation = shoulder_rotation(**angles, side=self.side, degrees=True)
        warn_suspicious_angles(angles)
        warn_outside_human_range(orientation.as_matrix().reshape(-1, 3, 3), self.side)
        return orientation

    def inverse_kinematics(self, orientation: Rotation) -> wrist.LimbState:
        """Limb lengths, directions and joint angles; see :func:`exo_pin.wrist.inverse_kinematics`."""
        return wrist.inverse_kinematics(self.geometry, orientation)

    def jacobian(self, orientation: Rotation) -> FloatArray:
        """d(lengths)/dt = J ω, shape (..., n, 3), m/rad; see :func:`exo_pin.wrist.limb_jacobian`."""
        return wrist.limb_jacobian(self.geometry, orientation)

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

    def joint_motion(self, orientation: Rotation, motion: Motion) -> wrist.JointMotion:
        """Rates and accelerations of limbs and universal joints; see :func:`exo_pin.wrist.joint_motion`."""
        return wrist.joint_motion(self.geometry, orientation, motion)

    def singularity(self, orientation: Rotation) -> wrist.Singularity:
        """How far poses are from losing control; see :func:`exo_pin.wrist.singularities.measures`."""
        return wrist.singularity(self.geometry, orientation, self.mechanism.is_upu)

    def nearest_singularity(self, orientation: Rotation) -> wrist.NearestSingularity:
        """The closest singular pose and its angle; see :func:`exo_pin.wrist.nearest_singularity`."""
        return wrist.nearest_singularity(self.geometry, orientation)

    def sensor_sensitivity(
        self, orientation: Rotation, measured: str | Iterable[str] = "base_theta_x"
    ) -> wrist.SensorSensitivity:
        """Error of the arm per error of joint sensors; see :func:`exo_pin.wrist.sensor_sensitivity`."""
        return wrist.sensor_sensitivity(self.geometry, orientation, measured)

    @functools.cached_property
    def _locked_chains(self) -> LockedChains:
        return LockedChains(self.mechanism)

    def chain_singularity(self, orientation: Rotation) -> ChainSingularity:
        """A single pose's singularity from Pinocchio's constraint Jacobians, for three UPU limbs.

        See :class:`exo_pin.wrist_chain.locked_chains.LockedChains`.
        """
        return self._locked_chains.singularity(orientation)
