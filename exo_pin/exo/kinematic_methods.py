"""Where the arm and the limbs are, how they move, and how near a pose is to losing hold."""

from __future__ import annotations

import functools
from collections.abc import Iterable

from numpy.typing import ArrayLike
from scipy.spatial.transform import Rotation

from .. import wrist
from ..core.validation import FloatArray
from ..load_case import Motion
from ..wrist_chain.locked_chains import ChainSingularity, LockedChains
from .subject import Subject

__all__ = ["KinematicQuestions"]


class KinematicQuestions(Subject):
    """Kinematics and singularity of a design."""

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
