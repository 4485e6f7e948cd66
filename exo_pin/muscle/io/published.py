"""Named parameter sets: those the source prints, and those fitted to its tables by this package.

The fitted ones (their names begin with "fitted-", and "best") are generated: :func:`refit` makes them again from
the printed tables, and ``for name, set in refit().items(): save_parameters(set, ...)`` writes their files.
"""

from __future__ import annotations

from dataclasses import dataclass, replace
from functools import cache
from importlib.resources import files

from ...core.errors import UnknownName
from ...core.files.toml_tables import read_toml
from ..identification.fitted_forms import candidates
from ..identification.region import SECOND_ORDER, find_region
from ..identification.selection import select_model
from ..identification.static_identification import identify_static
from ..laws.static import StaticModel
from .measured import NOMINAL_LENGTH, steady_states
from .static_files import parse_parameters

#: Row 3 of Table 2-4 with the fourth-order passive term of its source.
_PUJANA_ARRESE = ((2, 1), (1, 1), (0, 1), (4, 0), (3, 0), (2, 0), (1, 0), (0, 0))


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
        "best" (chosen by cross-validation), "fitted-second-order" (3-10), "fitted-pujana-arrese",
        "fitted-chou-hannaford", "fitted-tondu-lopez", "fitted-colbrunn", "fitted-wickramatunge".
    """
    states = steady_states()
    region = find_region(states.contraction, states.pressure, states.force, NOMINAL_LENGTH)
    selected = states.select(region.selected)
    columns = (selected.contraction, selected.pressure, selected.force)
    source = f"fitted to the {len(selected.force)} steady states of Tables 3-1 and 3-2 that lie in the region found"
    fitted = {
        "best": select_model(*columns, NOMINAL_LENGTH).model,
        "fitted-second-order": identify_static(*columns, NOMINAL_LENGTH, SECOND_ORDER).model,
        "fitted-pujana-arrese": identify_static(*columns, NOMINAL_LENGTH, _PUJANA_ARRESE).model,
    }
    for form in candidates(len(selected.force)):
        if form.powers is None:
            fitted[f"fitted-{form.name}"] = form.fit(*columns, NOMINAL_LENGTH)
    return {name: replace(model, name=name, source=source, validity=region.validity) for name, model in fitted.items()}
