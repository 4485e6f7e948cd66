"""Answers of files of muscles, as they are stored: parameter sets, printed tables, measurements with units."""

from dataclasses import replace
from pathlib import Path

import numpy as np
from answers import changes, each_of
from asked_in_turn import in_turn, with_files
from some_muscles import CONSTANT, LAWS, SLIDING

from exo_pin.muscle import (
    Damping,
    FrictionLaw,
    dynamic_model,
    dynamic_models,
    load_dynamic,
    load_parameters,
    muscle_model,
    muscle_models,
    read_measurements,
    read_response,
    save_dynamic,
    save_parameters,
    steady_states,
    table,
    tables,
)


def written(save, *content, **extra):
    save(*content, "own.toml", **extra)
    return Path("own.toml").read_text(encoding="utf-8").splitlines()


def brief(law):
    return law.name, law.source, law.reference_length, str(law.validity), law.in_bar


def asked_of_files():
    braid, notes = LAWS["braid"], {"notes": ("one", "two"), "source": "a sheet"}
    own = {
        name: replace(law, nominal_length=None, **notes)
        for name, law in LAWS.items()
        if name in ("sheet", "thread", "sold")
    }
    text = {
        name: with_files(lambda law=law: (written(save_parameters, law), load_parameters("own.toml")))
        for name, law in own.items()
    }
    plain = "\n".join(written_text("cubic"))
    swaps = {
        "twice": ("contraction_power = 2\npressure_power = 1", "contraction_power = 1\npressure_power = 2"),
        "unit": ('unit = "N bar^-2"', 'unit = "N bar^-1"'),
        "negative": ("pressure_power = 0", "pressure_power = -1"),
        "form": ('form = "polynomial"', 'form = "other"'),
        "other": ('form = "polynomial"', 'form = "aarl-festo"'),
        "slope": ("capability_slope_N_per_bar = 17", "slope = 17"),
        "no_slope": ("capability_slope_N_per_bar", "#"),
        "no_intercept": ("capability_intercept_N", "#"),
        "no_line": ("capability_", "#"),
        "no_basis": ("basis", "#"),
        "no_name": ("name", "#"),
        "no_source": ("source", "#"),
        "no_symbol": ("symbol", "#"),
        "strain": ("strain = [", "strain = [ 0.1,"),
        "more": ("[validity]", "more = 3\n[validity]"),
        "known": ("[validity]", "[identification]\nrms = 3\n[validity]"),
        "length": ("reference_length_m = 0.31", "reference_length_m = 0.0"),
        "terms": ("[[coefficients]]", "[[terms]]"),
    }
    return (
        text
        | {
            name: with_files(lambda: brief(load_parameters("own.toml")), own_toml=plain.replace(*swap))
            for name, swap in swaps.items()
        }
        | in_turn(
            scaled=lambda: save_parameters(braid, "own.toml"),
            extra=lambda: with_files(
                lambda: written(save_parameters, muscle_model("best"), identification={"rms_N": 0.4})[-3:]
            ),
            no_table=lambda: with_files(lambda: save_parameters(muscle_model("best"), "own.toml", identification=3)),
            braid=lambda: with_files(lambda: brief(load_parameters("own.toml")), own_toml=BRAID),
            text=lambda: muscle_model(BRAID, 0.2).scale,
            unknown=lambda: muscle_model("bets"),
            names=lambda: muscle_models() + dynamic_models(),
        )
    )


def written_text(name):
    return with_files(
        lambda: written(save_parameters, replace(LAWS[name], nominal_length=None, notes=("one",), source="two"))
    )


BRAID = """name = "by angle"
form = "tondu-lopez"
reference_length_m = 0.3
validity = {strain = [0.0, 0.3], pressure_bar = [0.5, 5.0]}
constants = {diameter_m = 0.011, braid_angle_deg = 24.0, k = 0.95}
"""


FRICTION = """name = "own"
static = "best"
friction = {form = "constant", force_N = 2.0}
damping = {D_1_N_s2_per_m2_bar = -1.0, D_2_N_s_per_m_bar = 2.0}
"""


def short(law):
    return law.name, law.source, law.notes, law.friction, law.damping, law.static.name


def asked_of_dynamic_files():
    sets = {"load": SLIDING, "constant": replace(CONSTANT, source="a rig", damping=Damping.from_bar(-0.3, 1.2))}
    found = {
        name: with_files(
            lambda law=law: (
                written(save_dynamic, law)[:16],
                load_dynamic("own.toml").friction,
                load_dynamic("own.toml").static.in_bar,
            )
        )
        for name, law in sets.items()
    }
    plain = FRICTION
    for name, swap in {
        "named": ("own", "own"),
        "unknown": ('"best"', '"bets"'),
        "form": ('"constant"', '"other"'),
        "force": ("force_N", "force"),
        "negative": ("2.0}", "-2.0}"),
        "more": ("2.0}", "2.0, more = 3}"),
        "top": ("name", 'more = 3\nidentification = {rms = 3.0}\nsource = "rig"\nnotes = ["one"]\nname'),
        "known": ("name", 'identification = {rms = 3.0}\nsource = "rig"\nnotes = ["one"]\nname'),
        "no_name": ("name", "#"),
    }.items():
        found[name] = with_files(lambda: short(load_dynamic("own.toml")), own_toml=plain.replace(*swap))
    return found | in_turn(
        published=lambda: [short(dynamic_model(name)) for name in dynamic_models()],
        no_such=lambda: dynamic_model("tang-3-32"),
        no_model=lambda: save_dynamic(muscle_model("best"), "own.toml"),
        no_law=lambda: save_dynamic(replace(SLIDING, friction=OtherFriction()), "own.toml"),
    )


class OtherFriction(FrictionLaw):
    """A law that files do not know."""

    def factors(self, x, pressure, mass):
        return (0.0 * x + pressure + mass,)


def asked_of_tables():
    def sheet(name):
        shown = table(name)
        parts = (shown.title, shown.source, shown.units, shown.notes, shown.rows, shown.columns, len(shown.printed))
        return parts, shown.present.sum(axis=0), shown.values, shown.errors_percent, shown.groups.reshape(-1, 5)

    heads = table("3-1")
    return in_turn({name: lambda name=name: sheet(name) for name in tables()}) | in_turn(
        heads=lambda: (heads.row_numbers, heads.column_numbers, heads.row("0.4"), heads.row("4")),
        no_row=lambda: heads.row("0.5"),
        no_table=lambda: table("3-5"),
        small=lambda: table("A-1").name,
        states=steady_states,
        valid=lambda: steady_states(valid_only=True),
        mask=lambda: steady_states().select(np.array([True])),
    )


STATES = steady_states(valid_only=True)
ROWS = np.arange(1, 25, 2)


def columns(header, *factors, unit_row="", order=(0, 1, 2), rows=ROWS):
    """A file of steady states with factors of contraction in mm, pressure in bar and force in N."""
    given = 1e3 * STATES.contraction[rows], 1e-5 * STATES.pressure[rows], STATES.force[rows]
    scaled = [factor(x) if callable(factor) else factor * x for x, factor in zip(given, factors, strict=True)]
    lines = [",".join(f"{scaled[k][i]:.9g}" for k in order) for i in range(len(rows))]
    return "\n".join([header, *([unit_row] if unit_row else []), *lines]) + "\n"


HEADERS = {
    "cm": ("Shortening in cm,P [kPa],Load in kgf", 0.1, 100.0, 1 / 9.80665),
    "strain": ("strain,pressure_psi,mass_kg", 1 / 300, 14.503773773, 1 / 9.81),
    "strain_percent": ("epsilon %,pressure in MPa,pull gf", 1 / 3, 0.1, 1e3 / 9.80665),
    "inch": ("stroke_in,pressure in mbar,f (lbf)", 1 / 25.4, 1e3, 1 / 4.4482216152605),
    "length": ("length_mm,pressure_kPa_abs,weight kN", lambda x: 300.0 - x, lambda p: 100.0 * p + 101.325, 1e-3),
    "ratio": ("ratio,p_bar absolute,force_N", 1 / 300, lambda p: p + 1.01325, 1.0),
    "row": ("contraction,pressure,force", 0.1, 1e5, 1.0),
    "no_unit": ("contraction,pressure_bar,force_N", 1.0, 1.0, 1.0),
    "no_length": ("length,pressure_bar,force_N", lambda x: 300.0 - x, 1.0, 1.0),
    "pounds": ("contraction_mm,pressure_bar,mass_lbf", 1.0, 1.0, 1.0),
    "no_pressure": ("contraction_mm,count,force_N", 1.0, 1.0, 1.0),
    "two": ("contraction_mm,length_mm,force_N", 1.0, 1.0, 1.0),
    "seconds": ("contraction_mm,pressure_bar,force_s", 1.0, 1.0, 1.0),
    "psi": ("contraction_mm,pressure_bar,force_N", 1.0, 14.5, 1.0),
    "absolute": ("contraction_mm,pressure_bar,force_N", 1.0, lambda p: p + 1.01325, 1.0),
    "other_sign": ("contraction_mm,pressure_bar,force_N", -1.0, 1.0, 1.0),
    "pushes": ("contraction_mm,pressure_bar,force_N", 1.0, 1.0, -1.0),
    "kilograms": ("contraction_mm,pressure_bar,force_N", 1.0, 1.0, 0.1),
    "metres": ("contraction_mm,pressure_bar,force_N", 1e-3, 1.0, 1.0),
    "shares": ("contraction_mm,pressure_bar,force_N", 1 / 300, 1.0, 1.0),
    "swapped": ("force_N,pressure_bar,contraction_mm", 1.0, 1.0, 1.0),
    "falls": ("contraction_mm,pressure_bar,force_N", 1.0, lambda p: 5.3 - p, 1.0),
    "one_row": ("contraction_mm,pressure_bar,force_N", lambda x: np.where(x == x[4], -3.2 * x, x), 1.0, 1.0),
    "two_rows": ("contraction_mm,pressure_bar,force_N", lambda x: np.where(x > x[2], 5 * x, x), 1.0, 1.0),
}


def asked_of_headers():
    found = {
        name: with_files(
            lambda name=name: read_measurements("own.csv", 0.3, None if name in ("cm", "metres") else 0.0062),
            own_csv=columns(*given, unit_row="cm,Pa,N" if name == "row" else ""),
        )
        for name, given in HEADERS.items()
    }
    found["empty"] = with_files(
        lambda: read_measurements("own.csv", 0.3), own_csv="contraction_mm,pressure_bar,force_N\n"
    )
    found["no_size"] = with_files(lambda: read_measurements("own.csv", 0.0), own_csv=columns(*HEADERS["cm"]))
    found["nominal"] = with_files(lambda: read_measurements("own.csv", 3.0), own_csv=columns(*HEADERS["cm"]))
    for name, header in (
        ("response", "t_ms,strain_%,pressure_psi_abs"),
        ("turned", "time_s,strain,p_bar"),
        ("no_time", "time,strain,p_bar"),
    ):
        rows = "0,10,43\n10,11,46\n20,12,47.5\n" if name == "response" else "0,0.1,2\n-1,0.2,2\n"
        found[name] = with_files(lambda: read_response("own.csv", 1.3, 0.25), own_csv=f"{header}\n{rows}")
    return found


ASKED = {
    "files": asked_of_files,
    "dynamic_files": asked_of_dynamic_files,
    "tables": asked_of_tables,
    "headers": asked_of_headers,
}
#: Those that take longer than 0.15 s.
LONGER = {"headers"}


@each_of(ASKED, LONGER)
def test_an_answer_is_as_stored(name):
    assert not changes(__file__, name, ASKED[name])
