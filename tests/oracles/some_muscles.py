"""Muscles of which questions are asked: force laws of each kind, with and without friction."""

from dataclasses import replace

from exo_pin.muscle import (
    ChouHannaford,
    ConstantFriction,
    Damping,
    DynamicModel,
    FestoLaw,
    ForceTable,
    LoadDependentFriction,
    PolynomialModel,
    Validity,
    muscle_model,
)

WIDE = Validity(strain=(-0.04, 0.3), pressure=(0.2e5, 6e5), capability=(1.7e-4, -3.0), basis="a sheet")
COMMON = {"name": "own", "reference_length": 0.31, "validity": WIDE, "nominal_length": 0.24}
SHEET = ForceTable(
    strains=(-0.05, 0.07, 0.19, 0.3),
    pressures=(0.1e5, 2e5, 7e5),
    forces=((3.0, 48.0, 171.0), (1.2, 29.0, 104.0), (-0.4, 13.0, 57.0), (-2.0, 1.0, 21.0)),
    **COMMON,
)
LAWS = {
    "best": muscle_model("best", 0.26),
    "printed": muscle_model("tang-optimised", 0.22),
    "sheet": SHEET,
    "cubic": PolynomialModel.from_bar(
        {(3, 0): -900.0, (1, 2): -11.0, (0, 2): 2.5, (2, 1): 60.0, (0, 1): 9.0}, **COMMON
    ),
    "braid": PolynomialModel.tondu_lopez(0.011, 0.42, 0.31, 0.9, name="own", validity=WIDE, nominal_length=0.24),
    "thread": ChouHannaford(braid_length=0.35, turns=2.7, **COMMON),
    "sold": FestoLaw(largest_strain=0.27, **COMMON),
}


RUBBING = LoadDependentFriction.from_bar(228.9, -90.4, 6.87, 0.8)
SLIDING = DynamicModel(
    name="own", static=muscle_model("best"), friction=RUBBING, damping=Damping.from_bar(-1.1, 0.7), notes=("a note",)
)
CONSTANT = replace(SLIDING, friction=ConstantFriction(3.1), damping=Damping.from_bar(0.0, 0.0))
