"""Parameter sets of static models as TOML files: units in the keys, the source beside the numbers."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from os import PathLike, fspath
from typing import Any

from ...core.errors import FileFormatError, InvalidInput
from ..identification.static_identification import coefficient_name
from ..laws.literature import ChouHannaford, Colbrunn, TonduLopez, Wickramatunge
from ..laws.polynomial_law import PolynomialModel
from ..laws.static import BAR, StaticModel
from ..laws.validity import Validity
from .muscle_toml import Reader, as_number, read_toml, write_toml

__all__ = ["load_parameters", "parameter_content", "parse_parameters", "save_parameters"]

#: (attribute, key in the file, power of bar in its unit) of the constants of each form.
_CONSTANTS: dict[str, tuple[type[StaticModel], tuple[tuple[str, str, int], ...]]] = {
    "chou-hannaford": (ChouHannaford, (("braid_length", "braid_length_m", 0), ("turns", "turns", 0))),
    "tondu-lopez": (TonduLopez, (("radius", "radius_m", 0), ("a", "a", 0), ("b", "b", 0))),
    "colbrunn": (
        Colbrunn,
        (
            ("braid_length", "braid_length_m", 0),
            ("turns", "turns", 0),
            ("limit_force", "limit_force_N", 0),
            ("least_length", "least_length_m", 0),
        ),
    ),
    "wickramatunge": (
        Wickramatunge,
        (
            ("rest_length", "rest_length_m", 0),
            ("a_0", "a_0_N_per_m_bar2", -2),
            ("a_1", "a_1_N_per_m2_bar", -1),
            ("a_2", "a_2_N_per_m3", 0),
            ("a_3", "a_3_N_per_m", 0),
        ),
    ),
}


def _unit(i: int, j: int) -> str:
    parts = ["N"] + [f"{base}^-{power}" for base, power in (("m", i), ("bar", j)) if power]
    return " ".join(parts)


def save_parameters(
    model: StaticModel, path: str | PathLike[str], notes: tuple[str, ...] = (), **extra: Mapping[str, Any]
) -> None:
    """Write a static model as a parameter set, a TOML file.

    Parameters
    ----------
    model, notes
        As in :func:`parameter_content`.
    path : path
        File to write; it is written whole or not at all.
    **extra : mapping
        Further tables of the file; ``identification`` is the one that is read over.

    Raises
    ------
    InvalidInput
        As in :func:`parameter_content`.
    """
    write_toml(parameter_content(model, notes) | {key: dict(value) for key, value in extra.items()}, path)


def parameter_content(model: StaticModel, notes: tuple[str, ...] = ()) -> dict[str, Any]:
    """Content of the parameter file of a static model.

    Parameters
    ----------
    model : StaticModel
        Of its reference length: a scaled one is refused, since scaling is an assumption and not a measurement.
    notes : tuple of str
        What a reader must know.

    Returns
    -------
    dict
        What :func:`parse_parameters` reads.

    Raises
    ------
    InvalidInput
        If the model is scaled or of a form that has no file format.
    """
    if model.scale != 1.0:
        raise InvalidInput(f"expected a model of its reference length {model.reference_length:g} m, got a scaled one")
    content: dict[str, Any] = {"name": model.name, "source": model.source, "notes": list(notes)}
    content["reference_length_m"] = model.reference_length
    if isinstance(model, PolynomialModel):
        content["form"] = "polynomial"
        content["validity"] = _validity_table(model.validity)
        content["coefficients"] = [
            {
                "symbol": coefficient_name((i, j)),
                "contraction_power": i,
                "pressure_power": j,
                "value": value,
                "unit": _unit(i, j),
            }
            for (i, j), value in model.in_bar.items()
        ]
    else:
        form = next((key for key, (kind, _) in _CONSTANTS.items() if type(model) is kind), None)
        if form is None:
            raise InvalidInput(f"expected a model with a file format, got {type(model).__name__}")
        content["form"] = form
        content["validity"] = _validity_table(model.validity)
        constants = {key: getattr(model, name) / BAR**power for name, key, power in _CONSTANTS[form][1]}
        if isinstance(model, Colbrunn):
            constants["efficiency_per_bar"] = [c * BAR**k for k, c in enumerate(model.efficiency)]
        content["constants"] = constants
    return content


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


def parse_parameters(content: Mapping[str, Any], path: str | None = None) -> tuple[StaticModel, tuple[str, ...]]:
    """Make a static model from the content of a parameter file.

    Parameters
    ----------
    content : mapping
        As read from TOML.
    path : str or None
        The file, for messages.

    Returns
    -------
    model : StaticModel
    notes : tuple of str

    Raises
    ------
    FileFormatError
        If a key is missing, unknown or of a wrong kind, a unit is not the expected one, or a value is impossible.
    """
    top = Reader(dict(content), path)
    form = top.take("form")
    notes = tuple(str(note) for note in top.take("notes", []))
    common: dict[str, Any] = {
        "name": str(top.take("name")),
        "source": str(top.take("source", "")),
        "reference_length": as_number(top.take("reference_length_m"), top, "reference_length_m"),
    }
    try:
        common["validity"] = _parse_validity(Reader(top.take("validity"), path, "validity."))
        build: Callable[[], StaticModel]
        if form == "polynomial":
            terms = _parse_terms(top.take("coefficients"), path)
            build = lambda: PolynomialModel.from_bar(terms, **common)  # noqa: E731
        elif form in _CONSTANTS:
            kind, _ = _CONSTANTS[form]
            constants = _parse_constants(form, Reader(top.take("constants"), path, "constants."))
            build = lambda: kind(**constants, **common)  # noqa: E731
        else:
            known = ", ".join(sorted(["polynomial", *_CONSTANTS]))
            raise FileFormatError(f"unknown form {form!r}; there are: {known}", path, "form")
        top.done(allowed=("identification",))
        return build(), notes
    except FileFormatError:
        raise
    except InvalidInput as error:
        raise FileFormatError(str(error), path) from None


def _parse_validity(reader: Reader) -> Validity:
    strain, pressure = reader.take("strain"), reader.take("pressure_bar")
    if not isinstance(pressure, list) or len(pressure) != 2:
        raise FileFormatError("expected validity.pressure_bar to be two numbers", reader.path, "validity.pressure_bar")
    slope = reader.take("capability_slope_N_per_bar", None)
    intercept = reader.take("capability_intercept_N", None)
    if (slope is None) != (intercept is None):
        raise FileFormatError("expected capability slope and intercept together", reader.path, "validity")
    line = None
    if slope is not None:
        line = (
            as_number(slope, reader, "capability_slope_N_per_bar") / BAR,
            as_number(intercept, reader, "capability_intercept_N"),
        )
    basis = str(reader.take("basis", ""))
    reader.done()
    bounds = [as_number(p, reader, "pressure_bar") * BAR for p in pressure]
    return Validity(strain=strain, pressure=(bounds[0], bounds[1]), capability=line, basis=basis)


def _parse_terms(rows: Any, path: str | None) -> dict[tuple[int, int], float]:
    if not isinstance(rows, list) or not rows:
        raise FileFormatError("expected coefficients to be a list of tables", path, "coefficients")
    terms: dict[tuple[int, int], float] = {}
    for row in rows:
        reader = Reader(row, path, "coefficients.")
        powers = (reader.take("contraction_power"), reader.take("pressure_power"))
        if not all(isinstance(p, int) and not isinstance(p, bool) and p >= 0 for p in powers):
            raise FileFormatError(f"expected whole powers of zero or more, got {powers}", path, "coefficients")
        if powers in terms:
            raise FileFormatError(f"two coefficients have the powers {powers}", path, "coefficients")
        unit = reader.take("unit")
        if unit != _unit(*powers):
            raise FileFormatError(
                f"expected the unit {_unit(*powers)!r} for the powers {powers}, got {unit!r}",
                path,
                "coefficients.unit",
            )
        terms[powers] = as_number(reader.take("value"), reader, "value")
        reader.take("symbol", "")
        reader.done()
    return terms


def _parse_constants(form: str, reader: Reader) -> dict[str, Any]:
    constants: dict[str, Any] = {
        name: as_number(reader.take(key), reader, key) * BAR**power for name, key, power in _CONSTANTS[form][1]
    }
    if form == "colbrunn":
        rows = reader.take("efficiency_per_bar")
        if not isinstance(rows, list):
            raise FileFormatError("expected constants.efficiency_per_bar to be a list", reader.path, "constants")
        constants["efficiency"] = [as_number(c, reader, "efficiency_per_bar") / BAR**k for k, c in enumerate(rows)]
    reader.done()
    return constants


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
    """
    return parse_parameters(read_toml(path), fspath(path))[0]
