"""Conversion of a TOML table to a mechanism."""

from __future__ import annotations

import functools
import operator
import tomllib
from pathlib import Path
from typing import Any, NamedTuple

import numpy as np
from scipy.spatial.transform import Rotation

from ...core.files.atomic import read_text
from ...core.files.toml_tables import UNITS, TomlTable, toml_text
from ..actuator import ACTUATOR_FAMILIES, Actuator, Tackle, is_law_text
from ..arm import Arm
from ..geometry import CircleDimensions, WristGeometry
from ..limb import Limb, LimbBody, LimbGuide, Stroke
from ..mechanism import Mechanism
from ..shoulder import Interface, Interfaces, Shoulder
from ..wearer import Wearer


class _Key(NamedTuple):
    """Where a field of a record stands in the record's table.

    Attributes
    ----------
    field : str
        Its name.
    kind : str or type
        A kind of quantity (:data:`UNITS`), "text", "law" of a muscle, or the record that a table within holds.
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
        _Key("force_law", "law", required=False),
        _Key("supply_pressure", "pressure", "supply", required=False),
        _Key("speed_limit", "speed", required=False),
        _Key("power_limit", "power", required=False),
        _Key("travel_limit", "length", required=False),
        _Key("least_tension", "force", required=False),
        _Key("play", "length", required=False),
        _Key("resolution", "length", required=False),
        _Key("tackle", Tackle),
    ),
    Wearer: (
        _Key("height", "length"),
        _Key("mass", "mass"),
        _Key("sex", "text", choices=("male", "female")),
        _Key("elbow_flexion", "angle", required=False),
        _Key("payload", "mass", required=False),
        _Key("arm_girth", "length", required=False),
        _Key("clothing", "length", required=False),
    ),
    Tackle: (
        _Key("ratio", "number"),
        _Key("muscle_length", "length", "muscle"),
        _Key("force_law", "law"),
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
            if table.is_text(key.name) and kind is Actuator and table.content[key.name] == "spring":
                raise table.error("a spring is none of the limbs: it stands in [[springs]] of the file", key.name)
            fields[key.field] = table.text(key.name, key.required, key.choices)
        elif key.kind == "law":
            fields[key.field] = _read_law(table, key)
        else:
            fields[key.field] = table.quantity(key.kind, key.name, key.shape, key.required)
    return {name: value for name, value in fields.items() if value is not None}


def _read_law(table: TomlTable, key: _Key) -> str | None:
    """The law of a muscle: a name, or the text of a parameter file, which may stand in the table itself."""
    if key.name not in table or table.is_text(key.name):
        given = table.text(key.name, key.required)
        # Only what lies beside the design: a design that came over a network names no other file of this machine.
        if given is not None and given.endswith(".toml"):
            place = Path(given)
            if table.path is None or place.is_absolute() or ".." in place.parts:
                raise table.error("expected a file in the folder of the design or below it", key.name)
            return law_of(str(Path(table.path).parent / place))
        return given
    return toml_text(table.required_table(key.name).content)


def law_of(given: str) -> str:
    """The name of a published law as it is; of a parameter file its text."""
    return read_text(given) if given.endswith(".toml") else given


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
        elif key.kind == "law" and value is not None and is_law_text(value):
            items[key.name] = tomllib.loads(value)
        elif key.kind in ("text", "law"):
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


#: Distance of the farthest joint from the shoulder, m, below which metres are likely to stand under a key in mm.
_NEAREST = 3e-3


def read_root(root: TomlTable) -> Mechanism:
    """The mechanism that the root table of a file describes; every key must be known."""
    sources: dict[str, str] = {}
    name, title = root.text("name"), root.text("title", required=False)
    side = root.text("side", required=False, choices=("left", "right")) or "left"
    gravity = root.quantity("acceleration", "gravity", (3,), required=False)
    document, estimated = root.text("source", required=False), root.texts("estimated")
    measures = root.texts("measures")
    if document is not None:
        sources["mechanism"] = document
    assert name is not None
    geometry = _read_geometry(root.required_table("geometry"), side, sources)
    arm_table = root.table("arm")
    arm = None if arm_table is None else read_arm(arm_table, sources)
    shoulder = read_record(Shoulder, root.table("shoulder"), sources) or Shoulder()
    interfaces = _read_interfaces(root.table("interfaces"))
    limbs = tuple(read_record(Limb, table, sources) for table in root.tables("limbs"))
    for key, text in root.mapping("sources").items():
        if key in sources:
            raise root.error(f"given twice, here and in {key} itself", "sources")
        sources[key] = text
    root.finish()
    return Mechanism(
        geometry,
        arm=arm,
        limbs=limbs,
        shoulder=shoulder,
        side=side,  # type: ignore[arg-type]
        name=name,
        title=title or "",
        sources=sources,
        estimated=estimated,
        interfaces=interfaces,
        measures=measures,
        **({} if gravity is None else {"gravity": gravity}),
    )


def _read_geometry(table: TomlTable, side: str, sources: dict[str, str]) -> WristGeometry:
    note_source(table, sources)
    circles, points = table.table("circles"), table.table("points")
    quaternion = table.quantity("number", "neutral_quaternion_xyzw", (4,), required=False)
    table.finish()
    if (circles is None) == (points is None):
        raise table.error("expected either a table circles or a table points", "circles")
    if quaternion is not None and abs(np.linalg.norm(quaternion) - 1.0) > 1e-9:
        raise table.error("expected a unit quaternion", "neutral_quaternion_xyzw")
    neutral = Rotation.identity() if quaternion is None else Rotation.from_quat(quaternion)
    if circles is not None:
        geometry = WristGeometry.from_circles(**read_fields(CircleDimensions, circles, sources), side=side)
        circles.finish()
        return geometry.replace(neutral=neutral)
    assert points is not None
    # With its neutral pose at once: in another one its limbs may be folded.
    geometry = WristGeometry(**read_fields(WristGeometry, points, sources), neutral=neutral)
    points.finish()
    farthest = float(np.linalg.norm([*geometry.base_points, *geometry.platform_points], axis=1).max())
    if farthest < _NEAREST:
        raise table.error(f"the farthest joint is {1e3 * farthest:.3g} mm from the shoulder (metres?)", "points")
    return geometry


def read_arm(table: TomlTable, sources: dict[str, str]) -> Arm:
    """An arm, one body or its parts; what was taken from where goes into ``sources``."""
    note_source(table, sources)
    parts = table.tables("parts")
    body_mass = table.quantity("mass", "body_mass", required=False)
    if not parts:
        return _read_body(table, body_mass)
    for body in parts:
        note_source(body, sources)
    table.finish()
    # The person's mass belongs to the person's parts; where all is device it goes with the device.
    worn = not all(part.is_true("device") for part in parts)
    arms = [_read_body(part, None if worn and part.is_true("device") else body_mass) for part in parts]
    return functools.reduce(operator.add, arms)


def _read_body(table: TomlTable, body_mass: float | None = None) -> Arm:
    wearer = read_record(Wearer, table.table("wearer"), {})
    mass = table.quantity("mass", "mass", required=wearer is None)
    if mass is None:
        # The person's size says it all.
        table.finish()
        if body_mass not in (None, wearer.mass):
            raise table.error(f"given twice: the wearer weighs {wearer.mass:g} kg", "body_mass_kg")
        return Arm.of_wearer(wearer)
    centre = table.quantity("length", "centre_of_mass", (3,))
    about_centre = table.quantity("inertia", "inertia_about_centre", (3, 3), required=False)
    about_origin = table.quantity("inertia", "inertia_about_origin", (3, 3), required=False)
    signs = table.text("products_of_inertia", required=False, choices=("tensor", "integrals"))
    device = table.flag("device")
    table.finish()
    if about_centre is not None and about_origin is not None:
        raise table.error("give the inertia once", "inertia_about_centre and inertia_about_origin")
    if signs is not None and about_centre is None and about_origin is None:
        raise table.error(
            "given without an inertia; give the inertia too, or leave this key out", "products_of_inertia"
        )
    if signs == "integrals":
        flip = 2.0 * np.eye(3) - 1.0  # leaves the moments, negates the products
        about_centre = None if about_centre is None else about_centre * flip
        about_origin = None if about_origin is None else about_origin * flip
    if about_origin is not None:
        about_centre = Arm.from_inertia_about_origin(mass, centre, about_origin).inertia
    return Arm(mass, centre, about_centre, device=device, body_mass=body_mass, wearer=wearer)


def _read_interfaces(table: TomlTable | None) -> Interfaces:
    if table is None:
        return Interfaces()
    harness, cuff = (
        None if own is None else read_interface(own) for own in (table.table("harness"), table.table("cuff"))
    )
    area = table.quantity("area", "cuff_area", required=False)
    table.finish()
    return Interfaces(harness, cuff, area)


def read_interface(table: TomlTable) -> Interface:
    """A spring of six freedoms by its 3 x 3 blocks."""
    force = table.quantity("stiffness", "stiffness", (3, 3))
    moment = table.quantity("twist stiffness", "rotational_stiffness", (3, 3))
    coupling = table.quantity("coupling stiffness", "coupling", (3, 3), required=False)
    at = table.quantity("length", "at", (3,), required=False)
    source = table.text("source", required=False)
    table.finish()
    between = np.zeros((3, 3)) if coupling is None else coupling
    stiffness = np.block([[force, between], [between.T, moment]])
    return Interface(stiffness, np.zeros(3) if at is None else at, source or "")
