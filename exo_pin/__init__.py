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
    Limb,
    LimbBody,
    Load,
    Mechanism,
    Motion,
    Shoulder,
    Stroke,
    WristGeometry,
    presets,
)
from .errors import (
    ExoPinError,
    FileFormatError,
    InfeasibleBounds,
    InvalidInput,
    LoopNotClosed,
    MissingData,
    NonConvexBound,
    SolverFailed,
    UnknownName,
)
from .exo import ShoulderExo, load
from .reaction import Elasticity, Reaction, ReactionMap, reaction_table

__all__ = [
    "Arm",
    "ClosedChain",
    "Elasticity",
    "ExoPinError",
    "FileFormatError",
    "InfeasibleBounds",
    "InvalidInput",
    "Limb",
    "LimbBody",
    "Load",
    "LoopNotClosed",
    "Mechanism",
    "MissingData",
    "Motion",
    "NonConvexBound",
    "Reaction",
    "ReactionMap",
    "Shoulder",
    "ShoulderExo",
    "SolverFailed",
    "Stroke",
    "UnknownName",
    "WristGeometry",
    "load",
    "presets",
    "reaction_table",
    "shoulder_angles",
    "shoulder_rotation",
    "thesis_angles",
    "thesis_rotation",
]

__version__ = "0.1.0"
