"""Fit the static laws of the package to Tables 3-1 and 3-2: what the parameter sets "best" and "fitted-..." hold.

    python docs/scripts/fitted_laws.py FOLDER

It writes one file a law into the folder, without the notes of those in exo_pin/muscle/parameters.
"""

import sys
from dataclasses import replace
from math import pi, sqrt
from pathlib import Path

import numpy as np

from exo_pin.muscle import (
    ChouHannaford,
    find_region,
    identify_static,
    save_parameters,
    select_model,
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
        "best": select_model(*columns, NOMINAL_LENGTH).model,
        "fitted-second-order": identify_static(*columns, NOMINAL_LENGTH).model,
        "fitted-chou-hannaford": braid(*columns, region.validity),
    }
    return {name: replace(model, name=name, source=source, validity=region.validity) for name, model in fitted.items()}


def braid(contraction, pressure, force, validity):
    """(3-5) as F = P (A L² - B) with A = 3/(4 π n²) and B = b²/(4 π n²), by least squares."""
    matrix = np.column_stack([pressure * (NOMINAL_LENGTH - contraction) ** 2, -pressure])
    a, b = np.linalg.lstsq(matrix, force, rcond=None)[0].tolist()
    length, turns = sqrt(3 * b / a), sqrt(3 / (4 * pi * a))
    return ChouHannaford(name="", reference_length=NOMINAL_LENGTH, validity=validity, braid_length=length, turns=turns)


if __name__ == "__main__":
    for name, model in refit().items():
        save_parameters(model, Path(sys.argv[1]) / f"{name}.toml")
