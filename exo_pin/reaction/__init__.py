"""What force the exoskeleton puts on the shoulder joint, and how much of it is determined at all."""

from __future__ import annotations

from .bounds import ConstraintBounds
from .certificate import Certificate, Components
from .choice import Weights
from .cone import GlenoidCone
from .equilibrium import EquilibriumModel
from .infeasibility import Infeasibility
from .limits import ActuatorBounds, ForceLimited, PressureActuator
from .movement import Movement, MovementReaction, movement_reaction
from .movement_files import read_movement, write_movement_reaction
from .pressures import PressurePlan, plan_pressures
from .program import LeastForce, least_force
from .query import reaction
from .result import Optimum, Reaction
from .table import reaction_table

__all__ = [
    "ActuatorBounds",
    "Certificate",
    "Components",
    "ConstraintBounds",
    "EquilibriumModel",
    "ForceLimited",
    "GlenoidCone",
    "Infeasibility",
    "LeastForce",
    "Movement",
    "MovementReaction",
    "Optimum",
    "PressureActuator",
    "PressurePlan",
    "Reaction",
    "Weights",
    "least_force",
    "movement_reaction",
    "plan_pressures",
    "reaction",
    "reaction_table",
    "read_movement",
    "write_movement_reaction",
]
