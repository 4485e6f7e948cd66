"""What force the exoskeleton puts on the shoulder joint, and how much of it is determined at all."""

from __future__ import annotations

from .active_set import LeastForces, least_forces
from .bounds import ConstraintBounds
from .certificate import Certificate
from .equilibrium import EquilibriumModel
from .map import ReactionMap, reaction_map
from .program import LeastForce, least_force
from .query import reaction
from .result import Reaction
from .stiffness import Elasticity
from .table import reaction_table

__all__ = [
    "Certificate",
    "ConstraintBounds",
    "Elasticity",
    "EquilibriumModel",
    "LeastForce",
    "LeastForces",
    "Reaction",
    "ReactionMap",
    "least_force",
    "least_forces",
    "reaction",
    "reaction_map",
    "reaction_table",
]
