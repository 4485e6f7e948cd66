"""Models of muscles and their TOML files, both ways: static laws, and those with friction and damping."""

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
from ..laws.dynamic import DynamicModel
from ..laws.force_laws import ChouHannaford, PolynomialModel
from ..laws.friction import ConstantFriction, Damping, FrictionLaw, LoadDependentFriction
from ..laws.published_laws import FestoLaw, ForceTable
from ..laws.static import BAR, StaticModel
from ..laws.validity import Validity

_PARAMETERS = files("exo_pin.muscle") / "parameters"
#: Laws with constants of their own: form in the file, and the keys of the constants by attribute.
_CONSTANTS: dict[type[StaticModel], tuple[str, dict[str, str]]] = {
    ChouHannaford: ("chou-hannaford", {"braid_length": "braid_length_m", "turns": "turns"}),
    FestoLaw: ("aarl-festo", {"largest_strain": "largest_strain"}),
}
_TABLE = "force-table"
#: Read only: it is written as the polynomial that it is.
_TONDU_LOPEZ = ("tondu-lopez", {"diameter": "diameter_m", "braid_angle": "braid_angle_deg", "k": "k"})


def _unit(i: int, j: int) -> str:
    return " ".join(["N"] + [f"{base}^-{power}" for base, power in (("m", i), ("bar", j)) if power])


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
    write_toml(path, parameter_content(model) | _tables(extra))


def _tables(extra: Mapping[str, Any]) -> dict[str, Any]:
    return {key: dict(as_mapping(key, value, "keys to values")) for key, value in extra.items()}


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
        own = [
            {"symbol": coefficient_name((i, j)), "contraction_power": i, "pressure_power": j, "value": value,
             "unit": _unit(i, j)}
            for (i, j), value in model.in_bar.items()
        ]  # fmt: skip
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
            table = top.required_table("table")
            strains, bars = (table.quantity("number", key, (None,)).tolist() for key in ("strain", "pressure_bar"))
            forces = table.quantity("number", "force_N", (len(strains), len(bars))).tolist()
            table.finish()
            build = partial(ForceTable, strains=strains, pressures=[BAR * bar for bar in bars], forces=forces)
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
    return sorted(f.name[:-5] for f in _PARAMETERS.iterdir() if f.name.endswith(".toml"))


@cache
def _published(name: str) -> StaticModel:
    if is_law_text(name):
        return parse_parameters(parse_toml(name, "the force law"))
    if name not in muscle_models():
        raise UnknownName("muscle model", name, muscle_models())
    return load_parameters(str(_PARAMETERS / f"{name}.toml"))


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


_LOAD_DEPENDENT = ("N_2_N_per_m2_bar", "N_1_N_per_m_bar", "N_0_N_per_bar", "load_bar_per_kg")
_DAMPING = ("D_1_N_s2_per_m2_bar", "D_2_N_s_per_m_bar")


@checked
def save_dynamic(model: DynamicModel, path: str | PathLike[str], **extra: Mapping[str, Any]) -> None:
    """Write a dynamic model with its static one as a parameter set, whole or not at all.

    Parameters
    ----------
    model : DynamicModel
        What to write.
    path : path
        File to write.
    **extra : mapping
        Further tables; the reader leaves out ``identification`` and refuses others.

    Raises
    ------
    InvalidInput
        If the friction law has no file format.

    Examples
    --------
    >>> from pathlib import Path
    >>> from exo_pin.muscle import dynamic_model, save_dynamic
    >>> save_dynamic(dynamic_model("tang-3-31"), "mine.toml")
    >>> [line for line in Path("mine.toml").read_text().splitlines() if line.startswith("[") and "." not in line]
    ['[friction]', '[damping]', '[static]']
    """
    require_type("model", model, DynamicModel)
    law = model.friction
    if isinstance(law, LoadDependentFriction):
        values = (law.N_2 * BAR, law.N_1 * BAR, law.N_0 * BAR, law.load / BAR)
        friction: dict[str, Any] = {"form": "load-dependent", **dict(zip(_LOAD_DEPENDENT, values, strict=True))}
    elif isinstance(law, ConstantFriction):
        friction = {"form": "constant", "force_N": law.force}
    else:
        raise InvalidInput(f"expected a friction law with a file format, got {type(law).__name__}")
    content: dict[str, Any] = {
        "name": model.name,
        "source": model.source,
        "notes": list(model.notes),
        "friction": friction,
        "damping": dict(zip(_DAMPING, (model.damping.D_1 * BAR, model.damping.D_2 * BAR), strict=True)),
        "static": parameter_content(model.static),
    }
    write_toml(path, content | _tables(extra))


def load_dynamic(path: str | PathLike[str]) -> DynamicModel:
    """Read a dynamic parameter set; its ``static`` is a table or the name of a published static set.

    Parameters
    ----------
    path : path
        A TOML file.

    Returns
    -------
    DynamicModel

    Raises
    ------
    FileFormatError
        If the file cannot be read or understood; it names the key.

    Examples
    --------
    >>> from exo_pin.muscle import dynamic_model, load_dynamic, save_dynamic
    >>> save_dynamic(dynamic_model("tang-3-31"), "sliding.toml")
    >>> load_dynamic("sliding.toml").friction == dynamic_model("tang-3-31").friction
    True
    """
    top = read_toml(path)
    with naming_file(path):
        name = str(top.text("name"))
        if top.is_text("static"):
            static = muscle_model(str(top.text("static", choices=muscle_models())))
        else:
            static = parse_parameters(top.required_table("static"))
        friction = top.required_table("friction")
        law: FrictionLaw
        if friction.text("form", choices=("constant", "load-dependent")) == "load-dependent":
            law = LoadDependentFriction.from_bar(*(friction.coefficient(key) for key in _LOAD_DEPENDENT))
        else:
            law = ConstantFriction(friction.coefficient("force_N"))
        friction.finish()
        damping = top.required_table("damping")
        damped = Damping.from_bar(*(damping.coefficient(key) for key in _DAMPING))
        damping.finish()
        model = DynamicModel(
            name=name,
            static=static,
            friction=law,
            damping=damped,
            source=top.text("source", required=False) or "",
            notes=top.texts("notes"),
        )
    top.skip("identification")
    top.finish()
    return model


def dynamic_models() -> list[str]:
    """Names of the dynamic parameter sets there are.

    Returns
    -------
    list of str

    Examples
    --------
    >>> from exo_pin.muscle import dynamic_models
    >>> dynamic_models()
    ['tang-3-31', 'tang-constant-friction']
    """
    return sorted(f.name[:-5] for f in (_PARAMETERS / "dynamic").iterdir() if f.name.endswith(".toml"))


@cache
def dynamic_model(name: str) -> DynamicModel:
    """Return a named dynamic parameter set.

    Parameters
    ----------
    name : str
        One of :func:`dynamic_models`.

    Returns
    -------
    DynamicModel

    Raises
    ------
    UnknownName
        If there is no such set; it lists those there are.

    Examples
    --------
    >>> from exo_pin.muscle import dynamic_model
    >>> low, high = dynamic_model("tang-3-31").rest_band(12.74 / 9.81, 2.5e5)  # contractions that friction holds, m
    >>> round(1e3 * float(high - low), 1)  # mm
    11.1
    """
    if name not in dynamic_models():
        raise UnknownName("dynamic muscle model", name, dynamic_models())
    return load_dynamic(str(_PARAMETERS / "dynamic" / f"{name}.toml"))
