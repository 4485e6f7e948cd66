"""Named parameter sets: those the source prints, and those fitted to its tables by this package.

``docs/scripts/fitted_laws.py`` fits the latter (their names begin with "fitted-", and "best") again from the printed
tables.
"""

from __future__ import annotations

from functools import cache
from importlib.resources import files

from ...core.errors import UnknownName
from ..laws.static import StaticModel
from .static_files import load_parameters


def muscle_models() -> list[str]:
    """Names of the static parameter sets there are."""
    folder = files("exo_pin.muscle") / "parameters"
    return sorted(f.name[:-5] for f in folder.iterdir() if f.name.endswith(".toml"))


@cache
def _published(name: str) -> StaticModel:
    if name not in muscle_models():
        raise UnknownName("muscle model", name, muscle_models())
    return load_parameters(str(files("exo_pin.muscle") / "parameters" / f"{name}.toml"))


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
    model = _published(name)
    return model if nominal_length is None else model.scaled(nominal_length)
