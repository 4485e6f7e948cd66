"""Parameter sets of dynamic models as TOML files, and those the source prints."""

from __future__ import annotations

from collections.abc import Mapping
from functools import cache
from importlib.resources import files
from os import PathLike, fspath
from typing import Any

from ...core.errors import FileFormatError, InvalidInput, UnknownName
from ..laws.dynamic import DynamicModel
from ..laws.friction import ConstantFriction, Damping, FrictionLaw, LoadDependentFriction
from ..laws.static import BAR, StaticModel
from .muscle_toml import Reader, as_number, read_toml, write_toml
from .published import muscle_model, muscle_models
from .static_files import parameter_content, parse_parameters

__all__ = ["dynamic_model", "dynamic_models", "load_dynamic", "save_dynamic"]

_LOAD_DEPENDENT = ("N_2_N_per_m2_bar", "N_1_N_per_m_bar", "N_0_N_per_bar", "load_bar_per_kg")


def save_dynamic(
    model: DynamicModel, path: str | PathLike[str], notes: tuple[str, ...] = (), **extra: Mapping[str, Any]
) -> None:
    """Write a dynamic model with its static one as a parameter set, whole or not at all.

    Parameters
    ----------
    model : DynamicModel
        What to write.
    path : path
        File to write.
    notes : tuple of str
        What a reader must know.
    **extra : mapping
        Further tables; ``identification`` is the one that is read over.

    Raises
    ------
    InvalidInput
        If the friction law has no file format.
    """
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
        "notes": list(notes),
        "friction": friction,
        "damping": {
            "D_1_N_s2_per_m2_bar": model.damping.D_1 * BAR,
            "D_2_N_s_per_m_bar": model.damping.D_2 * BAR,
        },
        "static": parameter_content(model.static),
    }
    write_toml(content | {key: dict(value) for key, value in extra.items()}, path)


def _friction(reader: Reader) -> FrictionLaw:
    form = reader.take("form")
    law: FrictionLaw
    if form == "load-dependent":
        law = LoadDependentFriction.from_bar(*(as_number(reader.take(k), reader, k) for k in _LOAD_DEPENDENT))
    elif form == "constant":
        law = ConstantFriction(as_number(reader.take("force_N"), reader, "force_N"))
    else:
        raise FileFormatError(
            f"unknown friction form {form!r}; there are: constant, load-dependent", reader.path, "friction.form"
        )
    reader.done()
    return law


def _static(value: Any, path: str | None) -> StaticModel:
    if isinstance(value, str):
        if value not in muscle_models():
            known = ", ".join(muscle_models())
            raise FileFormatError(f"unknown muscle model {value!r}; there are: {known}", path, "static")
        return muscle_model(value)
    return parse_parameters(value, path)[0]


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
    """
    place = fspath(path)
    top = Reader(read_toml(path), place)
    damping = Reader(top.take("damping"), place, "damping.")
    D_1, D_2 = (as_number(damping.take(k), damping, k) for k in ("D_1_N_s2_per_m2_bar", "D_2_N_s_per_m_bar"))
    damping.done()
    try:
        model = DynamicModel(
            name=str(top.take("name")),
            static=_static(top.take("static"), place),
            friction=_friction(Reader(top.take("friction"), place, "friction.")),
            damping=Damping.from_bar(D_1, D_2),
            source=str(top.take("source", "")),
        )
    except FileFormatError:
        raise
    except InvalidInput as error:
        raise FileFormatError(str(error), place) from None
    top.done(allowed=("notes", "identification"))
    return model


def dynamic_models() -> list[str]:
    """Names of the dynamic parameter sets there are."""
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
    """
    if name not in dynamic_models():
        raise UnknownName("dynamic muscle model", name, dynamic_models())
    return load_dynamic(str(files("exo_pin.muscle") / "parameters" / "dynamic" / f"{name}.toml"))
