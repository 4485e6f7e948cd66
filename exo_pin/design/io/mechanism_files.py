"""Mechanisms as TOML files, and the published mechanisms of the package."""

from __future__ import annotations

import hashlib
from functools import cache
from importlib.resources import files
from os import PathLike
from typing import Any

import numpy as np

from ...core.errors.checked import checked
from ...core.files.toml_tables import TomlTable, naming_file, parse_toml, toml_text, write_toml
from ...core.validation import as_choice
from ..arm import Arm
from ..geometry import WristGeometry
from ..limb import Limb
from ..mechanism import Mechanism
from ..shoulder import Interface
from ..wearer import Wearer
from .mechanism_reading import present, read_root, record_table

#: Version of the file format.
SCHEMA = 1


def mechanism_table(mechanism: Mechanism) -> dict[str, Any]:
    """The table that a mechanism's file holds, keys with their units."""
    own = mechanism.interfaces
    parts = {name: part and interface_table(part) for name, part in (("harness", own.harness), ("cuff", own.cuff))}
    return present(
        schema=SCHEMA,
        name=mechanism.name,
        title=mechanism.title or None,
        side=mechanism.side,
        gravity_m_s2=mechanism.gravity,
        estimated=mechanism.estimated or None,
        measures=mechanism.measures or None,
        geometry=_geometry_table(mechanism.geometry, mechanism.side),
        arm=mechanism.arm and arm_table(mechanism.arm),
        shoulder=record_table(mechanism.shoulder) or None,
        interfaces=present(cuff_area_m2=own.cuff_area, **parts) or None,
        limbs=[_limb_table(limb) for limb in mechanism.limbs],
        sources=dict(mechanism.sources) or None,
    )


def _geometry_table(geometry: WristGeometry, side: str) -> dict[str, Any]:
    turned = geometry.neutral.magnitude() != 0.0
    own = {"neutral_quaternion_xyzw": geometry.neutral.as_quat().tolist()} if turned else {}
    if geometry.circles is not None and geometry.circles.side == side:
        return own | {"circles": record_table(geometry.circles)}
    return own | {"points": record_table(geometry)}


def arm_table(arm: Arm) -> dict[str, Any]:
    """The table of an arm, each part in SI units or as its wearer's size."""

    def body(part: Arm) -> dict[str, Any]:
        wearer = None if part.wearer is None else record_table(part.wearer)
        if part.wearer is not None and _is_arm_of(part, part.wearer):
            return {"wearer": wearer}
        return present(
            wearer=wearer,
            mass_kg=part.mass,
            centre_of_mass_m=part.centre_of_mass,
            inertia_about_centre_kg_m2=part.inertia,
            device=True if part.device else None,
        )

    parts = [body(part) for part in arm.parts]
    body_mass = None if any(list(part) == ["wearer"] for part in parts) else arm.body_mass
    own = present(body_mass_kg=body_mass)
    return own | (parts[0] if len(parts) == 1 else {"parts": parts})


def _is_arm_of(arm: Arm, wearer: Wearer) -> bool:
    """Whether the arm is what the wearer's size says, and not a changed copy."""
    own, numbers = Arm.of_wearer(wearer), ("mass", "body_mass", "centre_of_mass", "inertia")
    # What belongs to a right arm differs by signs of zero alone.
    return not arm.device and all(np.array_equal(getattr(arm, name), getattr(own, name)) for name in numbers)


def _limb_table(limb: Limb) -> dict[str, Any]:
    table = record_table(limb)
    if limb.actuator is not None and limb.actuator.pulls_only:
        del table["actuator"]["push_limit_N"]  # zero, as its family says
    return table


def interface_table(interface: Interface) -> dict[str, Any]:
    """The table of a spring of six freedoms, in SI units."""
    K = interface.stiffness
    return present(
        source=interface.source or None,
        stiffness_N_m=K[:3, :3],
        rotational_stiffness_N_m_rad=K[3:, 3:],
        coupling_N=K[:3, 3:] if K[:3, 3:].any() else None,
        at_m=np.asarray(interface.at),
    )


#: The design that a question takes where none is named: of all presets the one that holds most daily poses clear of
#: everyone from a woman's 5th to a man's 95th percentile while the elbow bends to 130°.
DEFAULT_PRESET = "four-linear-actuators-worn"
#: Folders of the mechanisms that come with the package: published ones, and those that a search has found.
_PUBLISHED, _FOUND = ("presets",), ("presets", "found")


def presets() -> list[str]:
    """Names of the mechanisms that come with the package, sorted: published ones and found ones.

    Returns
    -------
    list of str

    Examples
    --------
    >>> [name for name in ep.presets() if name.endswith("worn")]
    ['four-cables-worn', 'four-linear-actuators-worn']
    """
    return sorted([*published(), *_names(_FOUND)])


def published() -> list[str]:
    """Names of the mechanisms that the thesis publishes, sorted.

    Returns
    -------
    list of str

    Examples
    --------
    >>> from exo_pin.design import published
    >>> "prototype" in published(), "four-cables" in published()
    (True, False)
    """
    return _names(_PUBLISHED)


def _names(folder: tuple[str, ...]) -> list[str]:
    entries = files("exo_pin.design").joinpath(*folder).iterdir()
    return sorted(entry.name.removesuffix(".toml") for entry in entries if entry.name.endswith(".toml"))


def preset(name: str) -> Mechanism:
    """Load a mechanism that comes with the package.

    Parameters
    ----------
    name : str
        One of :func:`exo_pin.presets`.

    Returns
    -------
    Mechanism

    Raises
    ------
    UnknownName
        If there is none of that name; the message lists those there are.

    Examples
    --------
    >>> from exo_pin.design import preset
    >>> preset("appendix-d").limbs[0].kind
    'UPU'
    """
    return _loaded(as_choice("preset", name, presets()))


def preset_file(name: str) -> str:
    """Text of the file of a mechanism that comes with the package.

    Parameters
    ----------
    name : str
        One of :func:`exo_pin.presets`.

    Returns
    -------
    str
        TOML.

    Raises
    ------
    UnknownName
        If there is none of that name; the message lists those there are.

    Examples
    --------
    >>> lines = ep.design.preset_file("prototype").splitlines()
    >>> [line for line in lines if line.startswith("base_radius")]  # Table 5-3
    ['base_radius_mm = 136.30']
    """
    folder = _PUBLISHED if as_choice("preset", name, presets()) in published() else _FOUND
    return files("exo_pin.design").joinpath(*folder, f"{name}.toml").read_bytes().decode()


@cache
def _loaded(name: str) -> Mechanism:
    """A mechanism is frozen throughout, so that all who load it may share it."""
    return _mechanism(parse_toml(preset_file(name), f"{name}.toml"))


@checked
def write_mechanism(mechanism: Mechanism, path: str | PathLike[str]) -> None:
    """Save a mechanism as a TOML file in SI units, so that it loads back bit for bit.

    The file appears whole or not at all.

    Parameters
    ----------
    mechanism : Mechanism
        What to save.
    path : path-like
        Where to, a ``.toml`` file.
    """
    write_toml(path, mechanism_table(mechanism))


def mechanism_hash(mechanism: Mechanism) -> str:
    """SHA-256 of the file that :func:`write_mechanism` writes: the same design has the same, on any machine."""
    return hashlib.sha256(toml_text(mechanism_table(mechanism)).encode("utf-8")).hexdigest()


def _mechanism(root: TomlTable) -> Mechanism:
    root.require_schema(SCHEMA)
    with naming_file(root.path):
        return read_root(root)
