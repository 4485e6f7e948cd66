"""Where the fields of a mechanism's records stand in its file: for reading and writing alike."""

from __future__ import annotations

from typing import Any, NamedTuple

import numpy as np

from ...core.files.toml_tables import UNITS, TomlTable
from ..actuator import ACTUATOR_FAMILIES, Actuator, Tackle
from ..circle_dimensions import CircleDimensions
from ..geometry import WristGeometry
from ..limb import Limb, LimbBody, LimbGuide, Stroke
from ..shoulder import Shoulder
from ..wearer import Wearer


class _Key(NamedTuple):
    """Where a field of a record stands in the record's table.

    Attributes
    ----------
    field : str
        Its name.
    kind : str or type
        A kind of quantity (:data:`UNITS`), "text", or the record that a table within holds.
    key : str
        Its key without the unit, if that is not the field's name.
    shape : tuple
        Of a quantity.
    required : bool
        Whether a file must have it. Otherwise the record's default stands for a key that is missing.
    choices : tuple of str or None
        Of a text.
    """

    field: str
    kind: str | type
    key: str = ""
    shape: tuple[int | None, ...] = ()
    required: bool = True
    choices: tuple[str, ...] | None = None

    @property
    def name(self) -> str:
        """The key without its unit."""
        return self.key or self.field


#: The fields of each record, in the order in which they are written.
_KEYS: dict[type, tuple[_Key, ...]] = {
    CircleDimensions: (
        _Key("r_A", "length", "base_radius"),
        _Key("r_B", "length", "platform_radius"),
        _Key("h_A", "length", "base_height"),
        _Key("h_B", "length", "platform_height"),
        _Key("alpha_A", "angle", "base_angles", (None,)),
        _Key("alpha_B", "angle", "platform_angles", (None,), required=False),
    ),
    WristGeometry: (
        _Key("base_points", "length", "base", (None, 3)),
        _Key("platform_points", "length", "platform", (None, 3)),
        _Key("base_axis", "number", shape=(3,), required=False),
        _Key("platform_axis", "number", shape=(3,), required=False),
    ),
    Shoulder: (
        _Key("abduction_centre", "angle", required=False),
        _Key("half_diagonal", "angle", required=False),
        _Key("stiffness", "stiffness", shape=(3, 3), required=False),
    ),
    Limb: (
        _Key("kind", "text", choices=("UPU", "SPS")),
        _Key("joint_limit", "angle", "joint_half_diagonal", required=False),
        _Key("joint_straight", "number", shape=(3,), required=False),
        _Key("stroke", Stroke),
        _Key("base_body", LimbBody),
        _Key("platform_body", LimbBody),
        _Key("guide", LimbGuide),
        _Key("actuator", Actuator),
    ),
    Stroke: (
        _Key("nominal_length", "length", "nominal"),
        _Key("shortest", "number", "shortest_ratio"),
        _Key("longest", "number", "longest_ratio"),
        _Key("end_fitting", "length", required=False),
    ),
    LimbBody: (
        _Key("mass", "mass"),
        _Key("centre", "length"),
        _Key("transverse_inertia", "inertia"),
        _Key("axial_inertia", "inertia"),
    ),
    LimbGuide: (
        _Key("bending_rigidity", "rigidity"),
        _Key("torsional_rigidity", "rigidity"),
        _Key("joint_stiffness", "stiffness", required=False),
        _Key("joint_twist_stiffness", "twist stiffness", required=False),
        _Key("largest_bending_moment", "couple", required=False),
        _Key("largest_torque", "couple", required=False),
    ),
    Actuator: (
        _Key("family", "text", choices=ACTUATOR_FAMILIES),
        _Key("pull_limit", "force", required=False),
        _Key("push_limit", "force", required=False),
        _Key("force_law", "text", required=False),
        _Key("supply_pressure", "pressure", "supply", required=False),
        _Key("speed_limit", "speed", required=False),
        _Key("power_limit", "power", required=False),
        _Key("travel_limit", "length", required=False),
        _Key("least_tension", "force", required=False),
        _Key("tackle", Tackle),
    ),
    Wearer: (
        _Key("height", "length"),
        _Key("mass", "mass"),
        _Key("sex", "text", choices=("male", "female")),
        _Key("elbow_flexion", "angle", required=False),
        _Key("payload", "mass", required=False),
    ),
    Tackle: (
        _Key("ratio", "number"),
        _Key("muscle_length", "length", "muscle"),
        _Key("force_law", "text"),
        _Key("supply_pressure", "pressure", "supply"),
        _Key("count", "number", required=False),
    ),
}


def note_source(table: TomlTable, sources: dict[str, str]) -> None:
    """Put what a table cites into ``sources``, under the table's name."""
    source = table.text("source", required=False)
    if source is not None:
        sources[table.name] = source


def read_record(kind: type, table: TomlTable | None, sources: dict[str, str]) -> Any:
    """The record that a table holds, all of whose keys must be known; None without a table."""
    if table is None:
        return None
    record = kind(**read_fields(kind, table, sources))
    table.finish()
    return record


def read_fields(kind: type, table: TomlTable, sources: dict[str, str]) -> dict[str, Any]:
    """The fields of a record that a table has."""
    note_source(table, sources)
    if kind is Stroke and (between := _lengths_of_stroke(table)) is not None:
        return between
    fields: dict[str, Any] = {}
    for key in _KEYS[kind]:
        if isinstance(key.kind, type):
            fields[key.field] = read_record(key.kind, table.table(key.name), sources)
        elif key.kind == "text":
            fields[key.field] = table.text(key.name, key.required, key.choices)
        else:
            fields[key.field] = table.quantity(key.kind, key.name, key.shape, key.required)
    return {name: value for name, value in fields.items() if value is not None}


def _lengths_of_stroke(table: TomlTable) -> dict[str, Any] | None:
    """The fields of a stroke that is given as two lengths between the joint centres; None if it is not."""
    shortest, longest = (table.quantity("length", name, required=False) for name in ("shortest", "longest"))
    if shortest is None and longest is None:
        return None
    if shortest is None or longest is None:
        raise table.error("missing beside the other length", "shortest" if shortest is None else "longest")
    if not 0.0 < shortest <= longest:
        raise table.error(
            f"expected more than 0 and at most the longest, {longest:g} m; got {shortest:g} m", "shortest"
        )
    return {"nominal_length": longest, "shortest": shortest / longest, "longest": 1.0, "end_fitting": 0.0}


def record_table(record: object) -> dict[str, Any]:
    """The table of a record, in SI units. What is None, and a stiffness that is infinite, is left out."""
    items: dict[str, Any] = {}
    kind = next(kind for kind in type(record).__mro__ if kind in _KEYS)
    for key in _KEYS[kind]:
        value = getattr(record, key.field)
        if isinstance(key.kind, type):
            items[key.name] = None if value is None else record_table(value)
        elif key.kind == "text":
            items[key.name] = value
        elif not (isinstance(value, float) and np.isinf(value)):
            items[key.name + next(iter(UNITS[key.kind]))] = value
    return present(**items)


def present(**items: Any) -> dict[str, Any]:
    """The items that are not None, arrays as lists."""
    return {
        key: np.asarray(value).tolist() if isinstance(value, np.ndarray | tuple) else value
        for key, value in items.items()
        if value is not None
    }
