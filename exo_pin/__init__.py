"""The force that a parallel shoulder exoskeleton puts on the shoulder joint.

Describe a mechanism or load a published one, and ask for limb forces, shoulder reaction and singularities in any
pose and motion::

    import exo_pin as ep

    exo = ep.load("prototype").worn_by(ep.Arm.from_anthropometry(1.75, 75, sex="male"))
    print(exo.reaction(ep.shoulder_rotation(30, 20, 0, degrees=True)))
"""

from __future__ import annotations

from .chain import ClosedChain
from .conventions import shoulder_angles, shoulder_rotation, thesis_angles, thesis_rotation
from .design import (
    Arm,
    CentreOffset,
    CentrePath,
    Limb,
    LimbBody,
    LimbGuide,
    Load,
    Mechanism,
    Motion,
    Shoulder,
    Stroke,
    WristGeometry,
    presets,
)
from .errors import (
    BeyondLimits,
    ExoPinError,
    FileFormatError,
    InfeasibleBounds,
    InfeasibleForces,
    InvalidInput,
    LoopNotClosed,
    MasslessMotion,
    MissingData,
    NonConvexBound,
    NotAWrist,
    SimulationStopped,
    SingularConfiguration,
    SolverFailed,
    UndeterminedMotion,
    UndrivenMotion,
    UnknownName,
)
from .exo import ShoulderExo, load
from .reaction import (
    Elasticity,
    GlenoidCone,
    Infeasibility,
    Movement,
    Reaction,
    ReactionMap,
    Weights,
    reaction_table,
    read_movement,
)
from .study import adl_box, sweep

__all__ = [
    "Arm",
    "BeyondLimits",
    "CentreOffset",
    "CentrePath",
    "ClosedChain",
    "Elasticity",
    "ExoPinError",
    "FileFormatError",
    "GlenoidCone",
    "Infeasibility",
    "InfeasibleBounds",
    "InfeasibleForces",
    "InvalidInput",
    "Limb",
    "LimbBody",
    "LimbGuide",
    "Load",
    "LoopNotClosed",
    "MasslessMotion",
    "Mechanism",
    "MissingData",
    "Motion",
    "Movement",
    "NonConvexBound",
    "NotAWrist",
    "Reaction",
    "ReactionMap",
    "Shoulder",
    "ShoulderExo",
    "SimulationStopped",
    "SingularConfiguration",
    "SolverFailed",
    "Stroke",
    "UndeterminedMotion",
    "UndrivenMotion",
    "UnknownName",
    "Weights",
    "WristGeometry",
    "adl_box",
    "load",
    "presets",
    "reaction_table",
    "read_movement",
    "shoulder_angles",
    "shoulder_rotation",
    "sweep",
    "thesis_angles",
    "thesis_rotation",
]

__version__ = "0.1.0"
