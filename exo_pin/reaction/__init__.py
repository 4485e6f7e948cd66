"""What force the exoskeleton puts on the shoulder joint, and how much of it is determined at all."""

from __future__ import annotations

from .bounds import ConstraintBounds
from .certificate import Certificate
from .choice import Weights
from .cone import GlenoidCone
from .equilibrium import EquilibriumModel
from .infeasible import Infeasibility
from .limits import ActuatorBounds, ForceLimited, PressureActuator
from .program import LeastForce, least_force
from .query import reaction
from .result import Optimum, Reaction
from .table import reaction_table

__all__ = [
    "ActuatorBounds",
    "Certificate",
    "ConstraintBounds",
    "EquilibriumModel",
    "ForceLimited",
    "GlenoidCone",
    "Infeasibility",
    "LeastForce",
    "Optimum",
    "PressureActuator",
    "Reaction",
    "Weights",
    "least_force",
    "reaction",
    "reaction_table",
]
