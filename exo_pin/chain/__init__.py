"""Closed kinematic chains on Pinocchio, for any robot, and the wrist written as one."""

from __future__ import annotations

from .closures import ROOT_JOINTS, TYPES, Closure, Closures, ClosureType, LimbRole, Placement, Roles, Root
from .export import published_urdf, write_published_urdf, write_urdf
from .files import read_closures, write_closures
from .forces import TreeForces
from .masses import AssumedMasses
from .mobility import Mobility
from .model import CLOSED, ClosedChain
from .motion import UndeterminedMotion
from .urdf import PARTS, dummy_shoulder_urdf, mechanism_urdf

__all__ = [
    "CLOSED",
    "PARTS",
    "ROOT_JOINTS",
    "TYPES",
    "AssumedMasses",
    "ClosedChain",
    "Closure",
    "ClosureType",
    "Closures",
    "LimbRole",
    "Mobility",
    "Placement",
    "Roles",
    "Root",
    "TreeForces",
    "UndeterminedMotion",
    "dummy_shoulder_urdf",
    "mechanism_urdf",
    "published_urdf",
    "read_closures",
    "write_closures",
    "write_published_urdf",
    "write_urdf",
]
