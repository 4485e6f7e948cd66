"""The wrist in closed form, for stacks of poses, compiled, without Pinocchio."""

from __future__ import annotations

from .forces import WristForces, dynamics, statics
from .forward import forward_kinematics, forward_kinematics_from_base_angles
from .inverse import LimbState, inverse_kinematics, universal_angles
from .modes import AssemblyModes, ModePath
from .nearest import NearestSingularity, nearest_singularity
from .sensors import OrientationChain, SensorSensitivity, sensor_sensitivity
from .singularity import Singularity, centre_shift, singularity
from .velocity import (
    QUANTITIES,
    ArmMotion,
    JointMotion,
    JointRows,
    arm_motion,
    joint_jacobian_derivatives,
    joint_jacobians,
    joint_motion,
    limb_jacobian,
)

__all__ = [
    "QUANTITIES",
    "ArmMotion",
    "AssemblyModes",
    "JointMotion",
    "JointRows",
    "LimbState",
    "ModePath",
    "NearestSingularity",
    "OrientationChain",
    "SensorSensitivity",
    "Singularity",
    "WristForces",
    "arm_motion",
    "centre_shift",
    "dynamics",
    "forward_kinematics",
    "forward_kinematics_from_base_angles",
    "inverse_kinematics",
    "joint_jacobian_derivatives",
    "joint_jacobians",
    "joint_motion",
    "limb_jacobian",
    "nearest_singularity",
    "sensor_sensitivity",
    "singularity",
    "statics",
    "universal_angles",
]
