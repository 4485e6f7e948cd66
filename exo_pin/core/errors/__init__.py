"""What can go wrong, one class a kind, each with its evidence as attributes."""

from __future__ import annotations

from .base import ExoPinError
from .chains import (
    BeyondLimits,
    InfeasibleForces,
    LoopNotClosed,
    MasslessMotion,
    NearSingularConfiguration,
    SimulationStopped,
    SingularConfiguration,
    UndeterminedMotion,
    UndrivenMotion,
    UnsupportedDynamics,
)
from .inputs import (
    FileFormatError,
    FileNotWritten,
    InfeasibleBounds,
    InvalidInput,
    MissingData,
    MissingExtra,
    NonConvexBound,
    NotAWrist,
    UnknownName,
)
from .muscles import NotIdentifiable, OutsideRangeOfMotion, OutsideValidity
from .tools import BrowserFailed, BrowserNotFound, SolverFailed

__all__ = [
    "BeyondLimits",
    "BrowserFailed",
    "BrowserNotFound",
    "ExoPinError",
    "FileFormatError",
    "FileNotWritten",
    "InfeasibleBounds",
    "InfeasibleForces",
    "InvalidInput",
    "LoopNotClosed",
    "MasslessMotion",
    "MissingData",
    "MissingExtra",
    "NearSingularConfiguration",
    "NonConvexBound",
    "NotAWrist",
    "NotIdentifiable",
    "OutsideRangeOfMotion",
    "OutsideValidity",
    "SimulationStopped",
    "SingularConfiguration",
    "SolverFailed",
    "UndeterminedMotion",
    "UndrivenMotion",
    "UnknownName",
    "UnsupportedDynamics",
]
