"""Pneumatic muscles: force laws, their dynamics, and how both are identified.

The source is R. Tang, Design of a Parallel Shoulder Assistive Robot with Pneumatic Muscle Actuators, Chapter 3 and
Appendices A and B. Contraction x is in m, positive when shorter than nominal; gauge pressure P in Pa; force in N,
positive when pulling.

>>> from exo_pin.muscle import Muscle, muscle_model
>>> model = muscle_model("best")
>>> round(float(model.force(0.050, 3.5e5)), 2)
28.88
>>> limb = Muscle(model=model.scaled(0.150), end_fitting=0.100)
>>> lower, upper = limb.force_limits([0.220, 0.240])
>>> upper.round(1).tolist()
[27.8, 68.1]

Modules: ``static`` and ``literature`` (force laws), ``validity`` (where they hold), ``measured`` (printed tables),
``published`` (named parameter sets), ``region``, ``identify``, ``forms``, ``selection`` (from measurements to a
law), ``friction``, ``dynamic``, ``pressure``, ``simulate``, ``response`` (a hung mass in motion),
``identify_dynamic``, ``actuator`` (a muscle in a limb), ``ledger`` (published numbers recomputed), ``plots``.
"""

from __future__ import annotations

from .actuator import Muscle
from .dynamic import DynamicModel
from .dynamic_files import dynamic_model, dynamic_models, load_dynamic, save_dynamic
from .errors import NotIdentifiable, OutsideValidity
from .files import load_parameters, save_parameters
from .friction import ConstantFriction, Damping, FrictionLaw, LoadDependentFriction
from .identify import StaticIdentification, identify_static
from .identify_dynamic import DynamicIdentification, Recording, identify_dynamic
from .literature import ChouHannaford, Colbrunn, TonduLopez, Wickramatunge, pujana_arrese
from .measured import SteadyStates, Table, steady_states, table, tables
from .polynomial import PolynomialModel
from .pressure import PressureInput, PressureStep, PressureTrace
from .published import ParameterSet, muscle_model, muscle_models, parameter_set
from .region import Region, find_region
from .response import Mode, StepResponse
from .selection import Selection, select_model
from .simulate import simulate
from .static import StaticModel
from .validity import Validity

__all__ = [
    "ChouHannaford",
    "Colbrunn",
    "ConstantFriction",
    "Damping",
    "DynamicIdentification",
    "DynamicModel",
    "FrictionLaw",
    "LoadDependentFriction",
    "Mode",
    "Muscle",
    "NotIdentifiable",
    "OutsideValidity",
    "ParameterSet",
    "PolynomialModel",
    "PressureInput",
    "PressureStep",
    "PressureTrace",
    "Recording",
    "Region",
    "Selection",
    "StaticIdentification",
    "StaticModel",
    "SteadyStates",
    "StepResponse",
    "Table",
    "TonduLopez",
    "Validity",
    "Wickramatunge",
    "dynamic_model",
    "dynamic_models",
    "find_region",
    "identify_dynamic",
    "identify_static",
    "load_dynamic",
    "load_parameters",
    "muscle_model",
    "muscle_models",
    "parameter_set",
    "pujana_arrese",
    "save_dynamic",
    "save_parameters",
    "select_model",
    "simulate",
    "steady_states",
    "table",
    "tables",
]
