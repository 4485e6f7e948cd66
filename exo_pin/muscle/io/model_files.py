"""Static models of muscles and their TOML files, both ways."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from functools import cache, partial
from importlib.resources import files
from math import radians
from os import PathLike
from typing import Any

from ...core.errors import InvalidInput, UnknownName
from ...core.errors.base import echo
from ...core.errors.checked import checked
from ...core.files.toml_tables import TomlTable, naming_file, parse_toml, read_toml, write_toml
from ...core.validation import as_mapping, require_type
from ...design.actuator import is_law_text
from ..identification.static_identification import coefficient_name
from ..laws.force_laws import ChouHannaford, PolynomialModel
from ..laws.published_laws import FestoLaw, ForceTable
from ..laws.static import BAR, StaticModel
from ..laws.validity import Validity

#: Laws with constants of their own: form in the file, and the keys of the constants by attribute.
_CONSTANTS: dict[type[StaticModel], tuple[str, dict[str, str]]] = {
    ChouHannaford: ("chou-hannaford", {"braid_length": "braid_length_m", "turns": "turns"}),
    FestoLaw: ("aarl-festo", {"largest_strain": "largest_strain"}),
}
_TABLE = "force-table"
#: Read only: it is written as the polynomial that it is.
_TONDU_LOPEZ = ("tondu-lopez", {"diameter": "diameter_m", "braid_angle": "braid_angle_deg", "k": "k"})


def _unit(i: int, j: int) -> str:
    parts = ["N"] + [f"{base}^-{power}" for base, power in (("m", i), ("bar", j)) if power]
    return " ".join(parts)


def _term(powers: tuple[int, int], value: float) -> dict[str, Any]:
    i, j = powers
    name, unit = coefficient_name(powers), _unit(i, j)
    return {"symbol": name, "contraction_power": i, "pressure_power": j, "value": value, "unit": unit}


@checked
def save_parameters(model: StaticModel, path: str | PathLike[str], **extra: Mapping[str, Any]) -> None:
    """Write a static model as a parameter set, a TOML file.

    Parameters
    ----------
    model : StaticModel
        As in ``parameter_content``.
    path : path
        File to write; it is written whole or not at all.
    **extra : mapping
        Further tables of the file; the reader leaves out ``identification`` and refuses others.

    Raises
    ------
    InvalidInput
        As in ``parameter_content``.

    Examples
    --------
    >>> from pathlib import Path
    >>> from exo_pin.muscle import muscle_model, save_parameters
    >>> save_parameters(muscle_model("best"), "best.toml")
    >>> "reference_length_m = 0.3" in Path("best.toml").read_text()
    True
    """
    write_toml(
        path,
        parameter_content(model)
        | {key: dict(as_mapping(key, value, "keys to values")) for key, value in extra.items()},
    )


def parameter_content(model: StaticModel) -> dict[str, Any]:
    """Content of the parameter file of a static model.

    Parameters
    ----------
    model : StaticModel
        Of its reference length: a scaled one is refused, since scaling is an assumption and not a measurement.

    Returns
    -------
    dict
        What :func:`parse_parameters` reads.

    Raises
    ------
    InvalidInput
        If the model is scaled or of a form that has no file format.
    """
    require_type("model", model, StaticModel)
    if model.scale != 1.0:
        raise InvalidInput(f"expected a model of its reference length {model.reference_length:g} m, got a scaled one")
    own: Any
    if type(model) in _CONSTANTS:
        form, keys = _CONSTANTS[type(model)]
        part, own = "constants", {key: getattr(model, name) for name, key in keys.items()}
    elif isinstance(model, PolynomialModel):
        form, part = "polynomial", "coefficients"
        own = [_term(powers, value) for powers, value in model.in_bar.items()]
    elif isinstance(model, ForceTable):
        form, part, bars = _TABLE, "table", [p / BAR for p in model.pressures]
        own = {"strain": list(model.strains), "pressure_bar": bars, "force_N": [list(row) for row in model.forces]}
    else:
        raise InvalidInput(f"expected a model with a file format, got {type(model).__name__}")
    return {
        "name": model.name,
        "source": model.source,
        "notes": list(model.notes),
        "reference_length_m": model.reference_length,
        "form": form,
        "validity": _validity_table(model.validity),
        part: own,
    }


def _validity_table(validity: Validity) -> dict[str, Any]:
    table: dict[str, Any] = {
        "strain": list(validity.strain),
        "pressure_bar": [p / BAR for p in validity.pressure],
        "basis": validity.basis,
    }
    if validity.capability is not None:
        table["capability_slope_N_per_bar"] = validity.capability[0] * BAR
        table["capability_intercept_N"] = validity.capability[1]
    return table


def parse_parameters(top: TomlTable) -> StaticModel:
    """Make a static model from the table of a parameter file.

    Parameters
    ----------
    top : TomlTable
        The file's root, or the table ``static`` of a dynamic set.

    Returns
    -------
    StaticModel

    Raises
    ------
    FileFormatError
        If a key is missing, unknown or of a wrong kind, a unit is not the expected one, or a value is impossible.
    """
    laws = {form: (law, keys) for law, (form, keys) in _CONSTANTS.items()}
    form = str(top.text("form", choices=("polynomial", _TABLE, _TONDU_LOPEZ[0], *laws)))
    common: dict[str, Any] = {
        "name": top.text("name"),
        "source": top.text("source", required=False) or "",
        "notes": top.texts("notes"),
        "reference_length": top.coefficient("reference_length_m"),
    }
    with naming_file(top.path):
        common["validity"] = _parse_validity(top.required_table("validity"))
        build: Callable[..., StaticModel]
        if form == "polynomial":
            build = partial(PolynomialModel.from_bar, _parse_terms(top))
        elif form == _TABLE:
            build = partial(ForceTable, **_parse_table(top.required_table("table")))
        else:
            constants = top.required_table("constants")
            build, keys = laws[form] if form in laws else (PolynomialModel.tondu_lopez, _TONDU_LOPEZ[1])
            common |= {name: constants.coefficient(key) for name, key in keys.items()}
            if "braid_angle" in common:
                common["braid_angle"] = radians(common["braid_angle"])
            constants.finish()
        top.skip("identification")
        top.finish()
        return build(**common)


def _parse_table(table: TomlTable) -> dict[str, Any]:
    """Strains, pressures and forces of a :class:`ForceTable`."""
    strains, bars = table.quantity("number", "strain", (None,)), table.quantity("number", "pressure_bar", (None,))
    forces = table.quantity("number", "force_N", (len(strains), len(bars)))
    table.finish()
    return {"strains": strains.tolist(), "pressures": (BAR * bars).tolist(), "forces": forces.tolist()}


def _parse_validity(table: TomlTable) -> Validity:
    strain = table.quantity("number", "strain", (2,))
    pressure = table.quantity("number", "pressure_bar", (2,)).tolist()
    line = None
    slope, intercept = "capability_slope_N_per_bar", "capability_intercept_N"
    if slope in table or intercept in table:
        line = (table.coefficient(slope) / BAR, table.coefficient(intercept))
    basis = table.text("basis", required=False) or ""
    table.finish()
    return Validity(strain=strain, pressure=(pressure[0] * BAR, pressure[1] * BAR), capability=line, basis=basis)


def _parse_terms(top: TomlTable) -> dict[tuple[int, int], float]:
    terms: dict[tuple[int, int], float] = {}
    for row in top.tables("coefficients"):
        powers = row.integer("contraction_power"), row.integer("pressure_power")
        if min(powers) < 0:
            raise row.error(f"expected powers of zero or more, got {powers}", "contraction_power")
        if powers in terms:
            raise row.error(f"two coefficients have the powers {powers}", "contraction_power")
        unit = row.text("unit")
        if unit != _unit(*powers):
            raise row.error(f"expected the unit {_unit(*powers)!r} for the powers {powers}, got {echo(unit)}", "unit")
        terms[powers] = row.coefficient("value")
        row.text("symbol", required=False)
        row.finish()
    if not terms:
        raise top.error("expected an array of tables with at least one coefficient", "coefficients")
    return terms


def load_parameters(path: str | PathLike[str]) -> StaticModel:
    """Read a parameter set that :func:`save_parameters` wrote, or one written by hand in its form.

    Parameters
    ----------
    path : path
        A TOML file.

    Returns
    -------
    StaticModel

    Raises
    ------
    FileFormatError
        If the file cannot be read or understood; it names the key.

    Examples
    --------
    >>> from exo_pin.muscle import load_parameters, muscle_model, save_parameters
    >>> save_parameters(muscle_model("best"), "law.toml")
    >>> again = load_parameters("law.toml")
    >>> bool(again.force(0.03, 3e5) == muscle_model("best").force(0.03, 3e5))
    True
    """
    return parse_parameters(read_toml(path))


def muscle_models() -> list[str]:
    """Names of the static parameter sets there are.

    Returns
    -------
    list of str

    Examples
    --------
    >>> from exo_pin.muscle import muscle_models
    >>> [name for name in muscle_models() if name.startswith("fitted")]  # to the measurements that the thesis prints
    ['fitted-chou-hannaford', 'fitted-second-order']
    """
    folder = files("exo_pin.muscle") / "parameters"
    return sorted(f.name[:-5] for f in folder.iterdir() if f.name.endswith(".toml"))


@cache
def _published(name: str) -> StaticModel:
    if is_law_text(name):
        return parse_parameters(parse_toml(name, "the force law"))
    if name not in muscle_models():
        raise UnknownName("muscle model", name, muscle_models())
    return load_parameters(str(files("exo_pin.muscle") / "parameters" / f"{name}.toml"))


@checked
def muscle_model(name: str, nominal_length: float | None = None) -> StaticModel:
    """Return the static model of a named parameter set.

    Parameters
    ----------
    name : str
        One of :func:`muscle_models`, for example "best" or "tang-optimised"; or the text of a parameter file.
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
    FileFormatError
        If a text is not that of a parameter file.
    InvalidInput
        If the length is not above zero.

    Examples
    --------
    >>> from exo_pin.muscle import muscle_model
    >>> law = muscle_model("tang-optimised")
    >>> round(float(law.force(0.03, 2e5)), 2)  # N, contracted by 30 mm of 300 at 2 bar
    18.9
    """
    model = _published(name)
    return model if nominal_length is None else model.scaled(nominal_length)
