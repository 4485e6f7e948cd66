"""What force the exoskeleton puts on the shoulder joint, and how much of it is determined at all."""

from __future__ import annotations

from .bounds import ConstraintBounds
from .certificate import Certificate, Components
from .equilibrium import EquilibriumModel
from .program import LeastForce, least_force
from .query import reaction
from .result import Reaction
from .table import reaction_table

__all__ = [
    "Certificate",
    "Components",
    "ConstraintBounds",
    "EquilibriumModel",
    "LeastForce",
    "Reaction",
    "least_force",
    "reaction",
    "reaction_table",
]
