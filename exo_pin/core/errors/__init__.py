"""What can go wrong, one class a kind, each with its evidence as attributes; and categories of warnings."""

from __future__ import annotations

from .base import ExoPinError
from .chains import (
    BeyondLimits,
    InfeasibleForces,
    LoopNotClosed,
    MasslessMotion,
    MotionBlocked,
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
    StorageUnusable,
    UnknownName,
)
from .muscles import NotIdentifiable, OutsideRangeOfMotion, OutsideValidity
from .tools import BrowserFailed, BrowserNotFound, SolverFailed
from .warning_categories import CacheUnusable, ExoPinWarning, NoisyMovement, OutsideHumanRange, SuspectMeasurements

__all__ = [
    "BeyondLimits",
    "BrowserFailed",
    "BrowserNotFound",
    "CacheUnusable",
    "ExoPinError",
    "ExoPinWarning",
    "FileFormatError",
    "FileNotWritten",
    "InfeasibleBounds",
    "InfeasibleForces",
    "InvalidInput",
    "LoopNotClosed",
    "MasslessMotion",
    "MissingData",
    "MissingExtra",
    "MotionBlocked",
    "NearSingularConfiguration",
    "NoisyMovement",
    "NonConvexBound",
    "NotAWrist",
    "NotIdentifiable",
    "OutsideHumanRange",
    "OutsideRangeOfMotion",
    "OutsideValidity",
    "SimulationStopped",
    "SingularConfiguration",
    "SolverFailed",
    "StorageUnusable",
    "SuspectMeasurements",
    "UndeterminedMotion",
    "UndrivenMotion",
    "UnknownName",
    "UnsupportedDynamics",
]
