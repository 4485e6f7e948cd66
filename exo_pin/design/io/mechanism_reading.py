"""Conversion of a TOML table to a mechanism."""

from __future__ import annotations

import numpy as np
from scipy.spatial.transform import Rotation

from ...core.files.toml_tables import TomlTable
from ..arm import Arm
from ..circle_dimensions import CircleDimensions
from ..geometry import WristGeometry
from ..interface import Interface, Interfaces
from ..limb import Limb
from ..mechanism import Mechanism
from ..shoulder import Shoulder
from ..wearer import Wearer
from .mechanism_keys import note_source, read_fields, read_record

#: Distance of the farthest joint from the shoulder, m, below which metres are likely to stand under a key in mm.
_NEAREST = 3e-3


def read_root(root: TomlTable) -> Mechanism:
    """The mechanism that the root table of a file describes; every key must be known."""
    sources: dict[str, str] = {}
    name, title = root.text("name"), root.text("title", required=False)
    side = root.text("side", required=False, choices=("left", "right")) or "left"
    gravity = root.quantity("acceleration", "gravity", (3,), required=False)
    document, estimated = root.text("source", required=False), root.texts("estimated")
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
        **({} if gravity is None else {"gravity": gravity}),
    )


def _read_geometry(table: TomlTable, side: str, sources: dict[str, str]) -> WristGeometry:
    note_source(table, sources)
    circles, points = table.table("circles"), table.table("points")
    quaternion = table.quantity("number", "neutral_quaternion_xyzw", (4,), required=False)
    table.finish()
    if (circles is None) == (points is None):
        raise table.error("expected either a table circles or a table points", "circles")
    if circles is not None:
        geometry = WristGeometry.from_circles(**read_fields(CircleDimensions, circles, sources), side=side)
        circles.finish()
    else:
        geometry = read_record(WristGeometry, points, sources)
        _check_size(geometry, table)
    if quaternion is None:
        return geometry
    if abs(np.linalg.norm(quaternion) - 1.0) > 1e-9:
        raise table.error("expected a unit quaternion", "neutral_quaternion_xyzw")
    return geometry.replace(neutral=Rotation.from_quat(quaternion))


def _check_size(geometry: WristGeometry, table: TomlTable) -> None:
    """Raise for joints so near the shoulder that metres were typed for millimetres."""
    joints = np.concatenate([geometry.base_points, geometry.platform_points])
    farthest = float(np.linalg.norm(joints, axis=1).max())
    if farthest < _NEAREST:
        raise table.error(f"the farthest joint is {1e3 * farthest:.3g} mm from the shoulder (metres?)", "points")


def read_arm(table: TomlTable, sources: dict[str, str]) -> Arm:
    """An arm, one body or its parts; what was taken from where goes into ``sources``."""
    note_source(table, sources)
    parts = table.tables("parts")
    if not parts:
        return _read_body(table)
    for body in parts:
        note_source(body, sources)
    body_mass = table.quantity("mass", "body_mass", required=False)
    table.finish()
    # The person's mass belongs to the person's parts; where all is device it goes with the device.
    worn = not all(part.is_true("device") for part in parts)
    arms = [_read_body(part, None if worn and part.is_true("device") else body_mass) for part in parts]
    total = arms[0]
    for part in arms[1:]:
        total = total + part
    return total


def _read_body(table: TomlTable, body_mass: float | None = None) -> Arm:
    wearer = read_record(Wearer, table.table("wearer"), {})
    mass = table.quantity("mass", "mass", required=wearer is None)
    if mass is None:
        # The person's size says it all.
        table.finish()
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
