"""Closed kinematic chains on Pinocchio, for any robot, and the wrist written as one."""

from __future__ import annotations

from .closures import (
    ROOT_JOINTS,
    TYPES,
    Closure,
    Closures,
    ClosureType,
    JointProperties,
    LimbRole,
    Placement,
    Roles,
    Root,
)
from .derivatives import Derivatives, ReactionDerivatives
from .export import published_urdf, write_published_urdf, write_urdf
from .files import read_closures, write_closures
from .forces import TreeForces
from .forward_dynamics import ClosedMotion
from .inverse_dynamics import PULL, PUSH
from .kinematics import Split
from .margins import Margins
from .masses import AssumedMasses
from .mobility import Mobility
from .model import ClosedChain
from .reactions import ClosedForces, JointReaction
from .recognition import Recognised, wrist_of
from .simulation import Simulation
from .structure import CLOSED
from .urdf import PARTS, dummy_shoulder_urdf, mechanism_urdf

__all__ = [
    "CLOSED",
    "PARTS",
    "PULL",
    "PUSH",
    "ROOT_JOINTS",
    "TYPES",
    "AssumedMasses",
    "ClosedChain",
    "ClosedForces",
    "ClosedMotion",
    "Closure",
    "ClosureType",
    "Closures",
    "Derivatives",
    "JointProperties",
    "JointReaction",
    "LimbRole",
    "Margins",
    "Mobility",
    "Placement",
    "ReactionDerivatives",
    "Recognised",
    "Roles",
    "Root",
    "Simulation",
    "Split",
    "TreeForces",
    "dummy_shoulder_urdf",
    "mechanism_urdf",
    "published_urdf",
    "read_closures",
    "wrist_of",
    "write_closures",
    "write_published_urdf",
    "write_urdf",
]
