"""Fit the static laws of the package to Tables 3-1 and 3-2: what the parameter sets "best" and "fitted-..." hold.

    python docs/scripts/fitted_laws.py FOLDER

It writes one file a law into the folder, without the notes of those in exo_pin/muscle/parameters.
"""

import sys
from dataclasses import replace
from itertools import product
from math import pi, sqrt
from pathlib import Path

import numpy as np

from exo_pin.muscle import (
    ChouHannaford,
    NotIdentifiable,
    find_region,
    identify_static,
    save_parameters,
    steady_states,
)
from exo_pin.muscle.io.measured import NOMINAL_LENGTH


def refit():
    """Laws by name, fitted in the region found: chosen by cross-validation, (3-10) and (3-5)."""
    states = steady_states()
    region = find_region(states.contraction, states.pressure, states.force, NOMINAL_LENGTH)
    selected = states.select(region.selected)
    columns = (selected.contraction, selected.pressure, selected.force)
    source = f"fitted to the {len(selected.force)} steady states of Tables 3-1 and 3-2 that lie in the region found"
    fitted = {
        "best": chosen(*columns).model,
        "fitted-second-order": identify_static(*columns, NOMINAL_LENGTH).model,
        "fitted-chou-hannaford": braid(*columns, region.validity),
    }
    return {name: replace(model, name=name, source=source, validity=region.validity) for name, model in fitted.items()}


def chosen(contraction, pressure, force):
    """The polynomial with fewest coefficients within one standard error of the least leave-one-out error.

    Tried are x^0 ... x^g times P, x^0 ... x^s alone and x^0 ... x^q times P², with three measurements a coefficient or
    more (so that the choice does not end at an interpolation), in which a muscle pulls less when shorter and more with
    more air.
    """
    found = []
    for g, s, q in product(range(5), range(-1, 5), range(-1, 3)):
        powers = [(i, j) for j, top in ((1, g), (0, s), (2, q)) for i in range(top, -1, -1)]
        if 3 * len(powers) > len(force):
            continue
        try:
            fit = identify_static(contraction, pressure, force, NOMINAL_LENGTH, tuple(powers))
        except NotIdentifiable:
            continue
        slopes, gains = (
            rate(contraction, pressure, "mark").data for rate in (fit.model.stiffness, fit.model.pressure_gain)
        )
        if (slopes < 0).all() and (gains > 0).all():
            found.append(fit)
    least = min(found, key=lambda fit: fit.leave_one_out_rms)
    limit = least.leave_one_out_rms**2 + np.std(least.leave_one_out**2, ddof=1) / sqrt(len(force))
    alike = [fit for fit in found if fit.leave_one_out_rms**2 <= limit]
    return min(alike, key=lambda fit: (len(fit.powers), fit.leave_one_out_rms))


def braid(contraction, pressure, force, validity):
    """(3-5) as F = P (A L² - B) with A = 3/(4 π n²) and B = b²/(4 π n²), by least squares."""
    matrix = np.column_stack([pressure * (NOMINAL_LENGTH - contraction) ** 2, -pressure])
    a, b = np.linalg.lstsq(matrix, force, rcond=None)[0].tolist()
    length, turns = sqrt(3 * b / a), sqrt(3 / (4 * pi * a))
    return ChouHannaford(name="", reference_length=NOMINAL_LENGTH, validity=validity, braid_length=length, turns=turns)


if __name__ == "__main__":
    for name, model in refit().items():
        save_parameters(model, Path(sys.argv[1]) / f"{name}.toml")
