"""Dynamic models of muscles and their TOML files, both ways: a static law with friction and damping."""

from __future__ import annotations

from collections.abc import Mapping
from functools import cache
from importlib.resources import files
from os import PathLike
from typing import Any

from ...core.errors import InvalidInput, UnknownName
from ...core.errors.checked import checked
from ...core.files.toml_tables import naming_file, read_toml, write_toml
from ...core.validation import as_mapping, require_type
from ..laws.dynamic import DynamicModel
from ..laws.friction import ConstantFriction, Damping, FrictionLaw, LoadDependentFriction
from ..laws.static import BAR
from .model_files import muscle_model, muscle_models, parameter_content, parse_parameters

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
    write_toml(path, content | {key: dict(as_mapping(key, value, "keys to values")) for key, value in extra.items()})


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
    folder = files("exo_pin.muscle") / "parameters" / "dynamic"
    return sorted(f.name[:-5] for f in folder.iterdir() if f.name.endswith(".toml"))


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
    return load_dynamic(str(files("exo_pin.muscle") / "parameters" / "dynamic" / f"{name}.toml"))
