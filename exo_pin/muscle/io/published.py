"""Named parameter sets: those the source prints, and those fitted to its tables by this package.

The fitted ones (their names begin with "fitted-", and "best") are generated: :func:`refit` makes them again from
the printed tables, and ``for name, set in refit().items(): save_parameters(set, ...)`` writes their files.
"""

from __future__ import annotations

from dataclasses import dataclass, replace
from functools import cache
from importlib.resources import files
from math import pi, sqrt

import numpy as np

from ...core.errors import UnknownName
from ...core.files.toml_tables import read_toml
from ..identification.region import find_region
from ..identification.selection import select_model
from ..identification.static_identification import identify_static
from ..laws.literature import ChouHannaford
from ..laws.static import StaticModel
from ..laws.validity import Validity
from .measured import NOMINAL_LENGTH, SteadyStates, steady_states
from .static_files import parse_parameters


@dataclass(frozen=True)
class ParameterSet:
    """A named parameter set.

    Attributes
    ----------
    model : StaticModel
    notes : tuple of str
        Corrected misprints, limits of use.
    """

    model: StaticModel
    notes: tuple[str, ...]


def muscle_models() -> list[str]:
    """Names of the static parameter sets there are."""
    folder = files("exo_pin.muscle") / "parameters"
    return sorted(f.name[:-5] for f in folder.iterdir() if f.name.endswith(".toml"))


@cache
def parameter_set(name: str) -> ParameterSet:
    """Return a named parameter set with its notes.

    Parameters
    ----------
    name : str
        One of :func:`muscle_models`.

    Returns
    -------
    ParameterSet

    Raises
    ------
    UnknownName
        If there is no such set; it lists those there are.
    """
    if name not in muscle_models():
        raise UnknownName("muscle model", name, muscle_models())
    path = str(files("exo_pin.muscle") / "parameters" / f"{name}.toml")
    return ParameterSet(*parse_parameters(read_toml(path)))


def muscle_model(name: str, nominal_length: float | None = None) -> StaticModel:
    """Return the static model of a named parameter set.

    Parameters
    ----------
    name : str
        One of :func:`muscle_models`, for example "best" or "tang-optimised".
    nominal_length : float or None
        Nominal length in m of the muscle that is meant; None for the one that was measured. Another length is
        reached by equal strain, which is an assumption: a 150 mm muscle at 25 % and 4 bar pulls 13.0 N with
        "tang-optimised", where its 37.5 mm of contraction would be worth 47.6 N on the 300 mm muscle.

    Returns
    -------
    StaticModel

    Raises
    ------
    UnknownName
        If there is no such set; it lists those there are.
    InvalidInput
        If the length is not above zero.
    """
    model = parameter_set(name).model
    return model if nominal_length is None else model.scaled(nominal_length)


def refit() -> dict[str, StaticModel]:
    """Fit the generated sets anew to the steady states of Tables 3-1 and 3-2, in the region found from them.

    Returns
    -------
    dict of str to StaticModel
        "best" (chosen by cross-validation), "fitted-second-order" (3-10), "fitted-chou-hannaford" (3-5).
    """
    states = steady_states()
    region = find_region(states.contraction, states.pressure, states.force, NOMINAL_LENGTH)
    selected = states.select(region.selected)
    columns = (selected.contraction, selected.pressure, selected.force)
    source = f"fitted to the {len(selected.force)} steady states of Tables 3-1 and 3-2 that lie in the region found"
    fitted: dict[str, StaticModel] = {
        "best": select_model(*columns, NOMINAL_LENGTH).model,
        "fitted-second-order": identify_static(*columns, NOMINAL_LENGTH).model,
        "fitted-chou-hannaford": _fitted_braid(selected, region.validity),
    }
    return {name: replace(model, name=name, source=source, validity=region.validity) for name, model in fitted.items()}


def _fitted_braid(states: SteadyStates, validity: Validity) -> ChouHannaford:
    """(3-5) as F = P (A L² - B) with A = 3/(4 π n²) and B = b²/(4 π n²), by least squares.

    Source: thesis (3-5).
    """
    lengths = NOMINAL_LENGTH - states.contraction
    matrix = np.column_stack([states.pressure * lengths**2, -states.pressure])
    a, b = np.linalg.lstsq(matrix, states.force, rcond=None)[0].tolist()
    turns = sqrt(3 / (4 * pi * a))
    return ChouHannaford(
        name="", reference_length=NOMINAL_LENGTH, validity=validity, braid_length=sqrt(3 * b / a), turns=turns
    )
