"""The wrist in closed form, for stacks of poses, compiled, without Pinocchio."""

from __future__ import annotations

from .clearing import arm_clearance, limb_clearance
from .forces import WristForces, dynamics, statics
from .forward import forward_kinematics, forward_kinematics_from_base_angles
from .holding import Holding, holding
from .inverse import LimbState, inverse_kinematics, universal_angles
from .loci import (
    LocusSlice,
    SingularSurface,
    locus_function,
    shoulder_slice,
    singular_surface,
    tilt_torsion_slice,
)
from .modes import AssemblyModes, ModePath
from .nearest import NearestSingularity, nearest_singularity
from .region import FreeRegion, RangeCrossing, daily_crossings, free_region
from .sensors import OrientationChain, SensorSensitivity, sensor_sensitivity
from .singularity import Singularity, centre_shift, singularity
from .stiffness import rotational_stiffness
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
    "FreeRegion",
    "Holding",
    "JointMotion",
    "JointRows",
    "LimbState",
    "LocusSlice",
    "ModePath",
    "NearestSingularity",
    "OrientationChain",
    "RangeCrossing",
    "SensorSensitivity",
    "SingularSurface",
    "Singularity",
    "WristForces",
    "arm_clearance",
    "arm_motion",
    "centre_shift",
    "daily_crossings",
    "dynamics",
    "forward_kinematics",
    "forward_kinematics_from_base_angles",
    "free_region",
    "holding",
    "inverse_kinematics",
    "joint_jacobian_derivatives",
    "joint_jacobians",
    "joint_motion",
    "limb_clearance",
    "limb_jacobian",
    "locus_function",
    "nearest_singularity",
    "rotational_stiffness",
    "sensor_sensitivity",
    "shoulder_slice",
    "singular_surface",
    "singularity",
    "statics",
    "tilt_torsion_slice",
    "universal_angles",
]
