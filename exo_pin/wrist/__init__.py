"""The wrist in closed form, for stacks of poses, compiled, without Pinocchio."""

from __future__ import annotations

from .forces import WristForces, dynamics, statics
from .inverse import LimbState, inverse_kinematics, universal_angles
from .singularity import Singularity, singularity
from .velocity import limb_jacobian

__all__ = [
    "LimbState",
    "Singularity",
    "WristForces",
    "dynamics",
    "inverse_kinematics",
    "limb_jacobian",
    "singularity",
    "statics",
    "universal_angles",
]
