"""Answers of force laws, as they are stored: laws and their ranges, friction, a muscle in a limb, air in valves."""

from dataclasses import replace

import numpy as np
from answers import changes, each_of
from asked_in_turn import in_turn
from some_muscles import COMMON, CONSTANT, LAWS, RUBBING, SHEET, SLIDING, WIDE

from exo_pin.muscle import (
    ChouHannaford,
    ConstantFriction,
    Damping,
    FestoLaw,
    LoadDependentFriction,
    Muscle,
    PolynomialModel,
    Supply,
    Validity,
    Valve,
    ValveUnit,
    muscle_model,
)


def marked(values):
    """Numbers, and which of them are outside the range."""
    return np.ma.getdata(values), np.ma.getmaskarray(values)


def asked_of_law(law):
    x, p = np.array([-0.013, 0.0, 0.021, 0.047, 0.061]), np.array([1.3e5, 0.4e5, 3.1e5, 5.2e5, 2.6e5])
    forces = np.array([4.0, 9.0, 31.0, 56.0, 0.5])
    return in_turn(
        force=lambda: marked(law.force(x, p, "mark")),
        beyond=lambda: law.force([-0.07, 0.09, 0.07, 0.0], [2e5, 4e5, 1e5, 0.0], "mark").data,
        stiffness=lambda: marked(law.stiffness(x, p, "mark")),
        gain=lambda: 1e5 * law.pressure_gain(x, p, "mark").data,
        pressure=lambda: marked(law.pressure_for(forces, x, "mark")),
        contraction=lambda: marked(law.contraction_for(forces, p, "mark")),
        short=lambda: law.contraction_for([60.0, 5.0], [3.1e5, 1.3e5], "mark").data,
        not_reached=lambda: law.contraction_for([3.0, 900.0], 2.3e5),
        no_pressure=lambda: law.pressure_for([3.0, 900.0], 0.02),
        capability=lambda: marked(law.capability(p, "mark")),
        powers=lambda: law.contraction_powers(2.3e5),
        outside=lambda: law.force(0.5 * law.length, 2e5),
        fields=lambda: (law.scale, law.length, law.scaled(0.4).length, str(law)),
    )


def polynomial(coefficients=None, **fields):
    return PolynomialModel(coefficients={(0, 1): 1e-4} if coefficients is None else coefficients, **COMMON | fields)


REFUSED_LAWS = {
    "no_terms": lambda: polynomial({}),
    "odd_powers": lambda: polynomial({(1, 2, 3): 1.0}),
    "half_power": lambda: polynomial({(1.5, 0): 1.0}),
    "half_pressure": lambda: polynomial({(0, 0.5): 1.0}),
    "negative": lambda: polynomial({(-1, 0): 1.0}),
    "negative_pressure": lambda: polynomial({(0, -1): 1.0}),
    "not_finite": lambda: polynomial({(0, 1): np.inf}),
    "whole": lambda: polynomial({(2.0, 1.0): 3.0}).coefficients,
    "no_length": lambda: polynomial(reference_length=0.0),
    "no_nominal": lambda: polynomial(nominal_length=-1.0),
    "no_validity": lambda: polynomial(validity=None),
    "notes": lambda: polynomial(notes=(3,)),
    "steep_braid": lambda: PolynomialModel.tondu_lopez(0.011, 1.571, 0.31),
    "right_braid": lambda: PolynomialModel.tondu_lopez(0.011, 1.57, 0.31, name="own", validity=WIDE).in_bar,
    "no_braid": lambda: PolynomialModel.tondu_lopez(0.0, 0.4, 0.31),
    "no_turns": lambda: ChouHannaford(braid_length=0.35, turns=0.0, **COMMON),
    "no_thread": lambda: ChouHannaford(braid_length=0.0, turns=2.0, **COMMON),
    "width": lambda: LAWS["thread"].diameter([0.0, 0.03]),
    "too_long": lambda: LAWS["thread"].diameter([0.0, -0.04]),
    "large_strain": lambda: FestoLaw(largest_strain=0.4, **COMMON),
    "strain": lambda: FestoLaw(largest_strain=0.399, **COMMON).largest_strain,
    "falling": lambda: replace(SHEET, strains=(-0.05, 0.07, 0.07, 0.3)),
    "one_pressure": lambda: replace(SHEET, pressures=(2e5,)),
    "two_pressures": lambda: replace(SHEET, pressures=(0.2e5, 6e5), forces=((1.0, 2.0),) * 4).forces,
    "shape": lambda: replace(SHEET, pressures=(0.1e5, 7e5)),
    "wider": lambda: replace(SHEET, validity=replace(WIDE, strain=(-0.06, 0.3))),
    "higher": lambda: replace(SHEET, validity=replace(WIDE, pressure=(0.2e5, 7.1e5))),
    "choice": lambda: SHEET.force(0.0, 2e5, "leave"),
    "constant": lambda: [
        getattr(polynomial({(0, 0): 3.0}), name)([0.01, 0.02], [2e5, 0.0], "mark").data
        for name in ("force", "stiffness", "pressure_gain")
    ],
    "nearly_empty": lambda: polynomial().pressure_for([0.4e-4, 0.0, -0.1e-4], 0.01, "mark").data,
    "contracted": lambda: (
        polynomial({(1, 0): -900.0, (0, 1): 1e-4}, validity=replace(WIDE, strain=(0.1, 0.3)))
        .contraction_for([19.0, 21.0, -30.0, -63.0, -64.0], 2e5, "mark")
        .data
    ),
    "rising_at_first": lambda: (
        polynomial({(2, 0): -4e4, (1, 0): 2e3, (0, 1): 1e-4}, validity=replace(WIDE, strain=(0.0, 0.3)))
        .contraction_for([19.5, 20.5, 44.0, 46.0], 2e5, "mark")
        .data
    ),
    "shapes": lambda: SHEET.force([0.0, 0.1], [1e5, 2e5, 3e5]),
}


def asked_of_ranges():
    near = 1.0 + 1e-9 * np.array([-1.15, -0.95, 0.95, 1.15])
    none, push = Validity(strain=(0.1, 0.3), pressure=(1e5, 4e5)), 1e-9 * np.array([-1.15, -0.95])
    state = {"strain": np.full(4, 0.2), "pressure": np.full(4, 2e5)}
    return in_turn(
        strain=lambda: [none.contains(bound * near, state["pressure"]) for bound in none.strain],
        pressure=lambda: [none.contains(state["strain"], bound * near) for bound in none.pressure],
        push=lambda: none.contains(state["strain"][:2], state["pressure"][:2], push),
        line=lambda: WIDE.contains(state["strain"], state["pressure"], 31.0 * near),
        not_known=lambda: none.contains(np.array([np.nan, 0.2]), np.array([2e5, np.nan])),
        strains=lambda: 1e9 * (np.array(none.strains_at(2e5)) - none.strain),
        none=lambda: [str(end) for pressure in (0.9e5, 4.1e5) for end in none.strains_at(pressure)],
        lines=lambda: (WIDE.capability_line(np.array([1e5, 2e5])), none.capability_line(np.array([1e5]))),
        said=lambda: [
            WIDE.explain(*state)
            for state in (
                (-0.05, 2e5),
                (0.31, 2e5),
                (0.1, 1e4),
                (0.1, 7e5),
                (0.1, 2e5, -1.0),
                (0.1, 2e5, 32.0),
                (0.1, 2e5),
            )
        ],
        raised=lambda: WIDE.enforce("own", np.ones((2, 2)), np.array([0.1, 0.4]), np.full(2, 2e5), None, "raise"),
        force=lambda: WIDE.enforce(
            "own", np.ones(3), np.full(3, 0.1), np.array(2e5), np.array([1.0, 2.0, 40.0]), "raise"
        ),
        kept=lambda: WIDE.enforce("own", np.ones(2), np.array([0.1, 0.2]), np.full(2, 2e5), None, "raise"),
        marked=lambda: WIDE.enforce("own", np.ones(2), np.array([0.1, 0.4]), np.full(2, 2e5), None, "mark").mask,
        turned=lambda: Validity(strain=(0.2, 0.2), pressure=(1e5, 2e5)),
        negative=lambda: Validity(strain=(0.1, 0.2), pressure=(-1.0, 2e5)),
        zero=lambda: Validity(strain=(0.1, 0.2), pressure=(0.0, 2e5), capability=[1e-4, 2.0]),
        capability=lambda: Validity(strain=(0.1, 0.2), pressure=(0.0, 2e5), capability=(1.0,)),
    )


def asked_of_friction():
    x, v, p = np.array([0.03, 0.045, 0.05, 0.17]), np.array([0.0, 0.1, -0.1, 1.0]), np.array([2.2e5, 2.8e5, 3e5, 9e5])
    return in_turn(
        records=lambda: (RUBBING, SLIDING.damping, ConstantFriction(), ConstantFriction(0.0)),
        force=lambda: {
            name: [marked(each) for each in law.force(x, v, p, 1.4, "mark")]
            for name, law in (("load", SLIDING), ("no", CONSTANT))
        },
        limits=lambda: [SLIDING.limits(), CONSTANT.limits()],
        margins=lambda: SLIDING.margins(x, v, p, 1.4),
        inside=lambda: [SLIDING.contains(x, v, p, mass) for mass in (1.4, 2.75, 3.5)],
        bounds=lambda: [RUBBING.bound(0.03, pressure, 1.4) for pressure in (1.0e5, 1.2e5, 2.2e5)],
        both_negative=lambda: (
            RUBBING.bound(0.2, 1e5, 1.4),
            LoadDependentFriction(0.0, 0.0, -1.0, 1e5).bound(0.1, 1e5, 2.0),
        ),
        zero=lambda: [
            replace(CONSTANT, damping=Damping.from_bar(-1.0, 0.5)).contains(0.03, v, 2.2e5, 1.4) for v in (0.5, 0.51)
        ],
        said=lambda: [
            SLIDING.explain(*state)
            for state in ((0.03, 0.0, 9e5, 1.4), (0.03, 0.0, 2.2e5, 3.5), (0.03, 0.9, 2.2e5, 1.4))
        ],
        fine=lambda: SLIDING.explain(0.03, 0.1, 2.2e5, 1.4),
        raised=lambda: SLIDING.force(x, v, p, 1.4),
        choice=lambda: SLIDING.force(x, v, p, 1.4, "leave"),
        rest=lambda: {
            f"{m} kg, {p} Pa": 1e3 * np.array(SLIDING.rest_band(m, p)) for m, p in ((1.4, 2.2e5), (0.9, 3e5))
        },
        stopped=lambda: [1e3 * np.array(CONSTANT.rest_band(m, p)) for m, p in ((5.5, 2.5e5), (2.5, 2.5e5), (0.9, 2e5))],
        # Where it stays from a stretch of the first part of the stroke on, or up to one of the last.
        nearly=lambda: [1e3 * np.array(CONSTANT.rest_band(0.9, p)) for p in (94555.0, 312630.0)],
        falls=lambda: SLIDING.rest_band(40.0, 2e5),
        no_mass=lambda: SLIDING.rest_band(0.0, 2e5),
        no_pressure=lambda: SLIDING.rest_band(1.0, 0.0),
        scaled=lambda: replace(SLIDING, static=muscle_model("best", 0.2)),
        wrong=lambda: replace(SLIDING, damping=RUBBING),
        notes=lambda: replace(SLIDING, notes=(1,)),
        negative=lambda: ConstantFriction(-1.0),
        not_finite=lambda: LoadDependentFriction(1.0, np.nan, 1.0, 1.0),
        no_damping=lambda: Damping(0.0, np.inf),
        no_first_damping=lambda: Damping(np.nan, 1.0),
        no_friction=lambda: replace(SLIDING, friction=2.5),
    )


def asked_of_limb():
    limb = Muscle(model=muscle_model("best", 0.26), end_fitting=0.07, supply_pressure=3.3e5)
    lengths = [0.29, 0.277, 0.3]
    bare, unknown = Muscle(model=LAWS["sheet"], end_fitting=0.0), Muscle(model=LAWS["sheet"], end_fitting=None)
    return in_turn(
        limb=lambda: limb,
        bare=lambda: (
            bare.supply,
            bare.contraction([0.22, 0.25]),
            bare.length_range(),
            [marked(each) for each in bare.force_limits([0.23, 0.25], "mark")],
        ),
        ranges=lambda: (
            limb.contraction(lengths),
            limb.length_range(),
            [marked(each) for each in limb.force_limits([*lengths, 0.335], "mark")],
        ),
        capped=lambda: Muscle(model=LAWS["sheet"], end_fitting=0.02).force_limits([0.262, 0.2]),
        pressures=lambda: marked(limb.pressure_for([12.0, 22.0, 20.0], lengths, "mark")),
        out_of_range=lambda: limb.force_limits(0.335),
        no_length=lambda: limb.contraction([0.3, 0.07]),
        unknown=lambda: unknown.contraction(0.3),
        unknown_range=lambda: unknown.length_range(),
        no_supply=lambda: replace(limb, supply_pressure=0.0),
        negative=lambda: replace(limb, end_fitting=-0.01),
        no_law=lambda: replace(limb, model="best"),
    )


def asked_of_air():
    valve, choke = Valve(1.7e-9, 0.31), Valve(0.9e-9, 0.44)
    unit = ValveUnit(fill=valve, vent=choke, restrictor=Valve(2.2e-9, 0.2))
    high = [6e5, 6e5, 6e5, 6e5, 1e5, 5.9999e5, 0.0, 5e5]
    two = replace(unit, layout="fill and vent", restrictor=None)
    return in_turn(
        flow=lambda: 1e3 * valve.flow(high, [1e5, 1.86e5, 1.9e5, 5.97e5, 5e5, 6e5, 0.0, 4.9951e5]),
        close=lambda: 1e5 * valve.flow(6e5, 6e5 * np.array([0.9988, 0.99899, 0.99901, 0.9995])),
        default=lambda: Valve(1e-9).critical_ratio,
        none=lambda: (Valve(0.0).flow([5e5, 1e5], [1e5, 5e5]), valve.flow([], 1e5), valve.flow(1e5, [])),
        paths=lambda: [(1e9 * path.conductance, path.critical_ratio) for each in (unit, two) for path in each.paths],
        series=lambda: [
            (1e9 * one.conductance, one.critical_ratio)
            for one in (valve.in_series(), valve.in_series(choke, Valve(0.5e-9, 0.0)), valve.in_series(Valve(0.0, 0.2)))
        ],
        least=lambda: Valve(1e-9, 0.0).in_series(Valve(0.2e-9, 0.0)).critical_ratio,
        shares=lambda: [each.shares(u) for each in (unit, two) for u in (-1.7, -0.3, 0.0, 0.6, 1.2)],
        supply=lambda: Supply(5.1e5, Valve(3e-9), 0.002).absolute,
        unit=lambda: unit,
        open_air=lambda: Supply(2e6).volume,
        large=lambda: Valve(1.1e-5),
        largest=lambda: Valve(1e-5).conductance * 1e5,
        ratio=lambda: Valve(1e-9, 0.999),
        ratios=lambda: Valve(1e-9, 0.9989).critical_ratio,
        negative=lambda: valve.flow([1e5, -1.0], 1e5),
        negative_behind=lambda: valve.flow(1e5, -1.0),
        not_valves=lambda: valve.in_series(choke, 3.0),
        high=lambda: Supply(2.1e6),
        no_volume=lambda: Supply(5e5, Valve(3e-9)),
        no_regulator=lambda: Supply(5e5, volume=0.002),
        no_air=lambda: Supply(0.0),
        layout=lambda: replace(unit, layout="4/2"),
        frequency=lambda: replace(unit, frequency=0.0),
        part=lambda: replace(unit, vent=None),
    )


ASKED = {
    "laws": lambda: {name: asked_of_law(law) for name, law in LAWS.items()},
    "refused": lambda: in_turn(REFUSED_LAWS),
    "ranges": asked_of_ranges,
    "friction": asked_of_friction,
    "limb": asked_of_limb,
    "air": asked_of_air,
}


@each_of(ASKED)
def test_an_answer_is_as_stored(name):
    assert not changes(__file__, name, ASKED[name])
