"""The wrist in closed form, for stacks of poses, compiled, without Pinocchio."""

from __future__ import annotations

from .forces import WristForces, dynamics, statics
from .holding import Holding, holding
from .inverse import LimbState, inverse_kinematics, universal_angles
from .singularity import Singularity, singularity
from .stiffness import rotational_stiffness
from .velocity import limb_jacobian

__all__ = [
    "Holding",
    "LimbState",
    "Singularity",
    "WristForces",
    "dynamics",
    "holding",
    "inverse_kinematics",
    "limb_jacobian",
    "rotational_stiffness",
    "singularity",
    "statics",
    "universal_angles",
]
