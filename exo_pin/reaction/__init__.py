"""What force the exoskeleton puts on the shoulder joint, and how much of it is determined at all."""

from __future__ import annotations

from .active_set import LeastForces, least_forces
from .bounds import ConstraintBounds
from .certificate import Certificate, Components
from .choice import Weights
from .cone import GlenoidCone
from .equilibrium import EquilibriumModel
from .infeasibility import Infeasibility
from .limits import ActuatorBounds, ForceLimited, PressureActuator
from .map import ReactionMap, reaction_map
from .movement import Movement, MovementReaction, movement_reaction
from .movement_files import read_movement, write_movement_reaction
from .pressures import PressurePlan, plan_pressures
from .program import LeastForce, least_force
from .query import reaction
from .result import Optimum, Reaction
from .stiffness import Elasticity
from .table import reaction_table

__all__ = [
    "ActuatorBounds",
    "Certificate",
    "Components",
    "ConstraintBounds",
    "Elasticity",
    "EquilibriumModel",
    "ForceLimited",
    "GlenoidCone",
    "Infeasibility",
    "LeastForce",
    "LeastForces",
    "Movement",
    "MovementReaction",
    "Optimum",
    "PressureActuator",
    "PressurePlan",
    "Reaction",
    "ReactionMap",
    "Weights",
    "least_force",
    "least_forces",
    "movement_reaction",
    "plan_pressures",
    "reaction",
    "reaction_map",
    "reaction_table",
    "read_movement",
    "write_movement_reaction",
]
