"""Conversion of a TOML table to a mechanism."""

from __future__ import annotations

import numpy as np
from scipy.spatial.transform import Rotation

from ...core.files.toml_tables import Table
from ..actuator import ACTUATOR_FAMILIES, Actuator
from ..arm import Arm
from ..geometry import WristGeometry
from ..guide import LimbGuide
from ..interface import Interface, Interfaces
from ..limb import Limb, LimbBody, Stroke
from ..mechanism import Mechanism
from ..shoulder import Shoulder
from ..tackle import Tackle

__all__ = ["read_root"]


def read_root(root: Table) -> Mechanism:
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
    arm_table, shoulder_table = root.table("arm"), root.table("shoulder")
    arm = None if arm_table is None else _read_arm(arm_table, sources)
    shoulder = Shoulder() if shoulder_table is None else _read_shoulder(shoulder_table, sources)
    interfaces = _read_interfaces(root.table("interfaces"))
    limbs = tuple(_read_limb(table, sources) for table in root.tables("limbs"))
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


def _note_source(table: Table, sources: dict[str, str]) -> None:
    source = table.text("source", required=False)
    if source is not None:
        sources[table.name] = source


def _read_geometry(table: Table, side: str, sources: dict[str, str]) -> WristGeometry:
    _note_source(table, sources)
    circles, points = table.table("circles"), table.table("points")
    quaternion = table.quantity("number", "neutral_quaternion_xyzw", (4,), required=False)
    table.finish()
    if (circles is None) == (points is None):
        raise table.error("expected either a table circles or a table points", "circles")
    for kind in (circles, points):
        if kind is not None:
            _note_source(kind, sources)
    if circles is not None:
        geometry = WristGeometry.from_circles(
            circles.quantity("length", "base_radius"),
            circles.quantity("length", "platform_radius"),
            circles.quantity("length", "base_height"),
            circles.quantity("length", "platform_height"),
            circles.quantity("angle", "base_angles", (None,)),
            circles.quantity("angle", "platform_angles", (None,), required=False),
            side=side,
        )
        circles.finish()
    else:
        assert points is not None
        geometry = WristGeometry(
            points.quantity("length", "base", (None, 3)),
            points.quantity("length", "platform", (None, 3)),
            base_axis=points.quantity("number", "base_axis", (3,), required=False),
            platform_axis=points.quantity("number", "platform_axis", (3,), required=False),
        )
        points.finish()
    if quaternion is None:
        return geometry
    if abs(np.linalg.norm(quaternion) - 1.0) > 1e-9:
        raise table.error("expected a unit quaternion", "neutral_quaternion_xyzw")
    return geometry.replace(neutral=Rotation.from_quat(quaternion))


def _read_arm(table: Table, sources: dict[str, str]) -> Arm:
    _note_source(table, sources)
    parts = table.tables("parts")
    if not parts:
        return _read_body(table)
    for body in parts:
        _note_source(body, sources)
    body_mass = table.quantity("mass", "body_mass", required=False)
    table.finish()
    # The person's mass belongs to the person's parts; where all is device it goes with the device.
    worn = not all(part.is_true("device") for part in parts)
    arms = [_read_body(part, None if worn and part.is_true("device") else body_mass) for part in parts]
    total = arms[0]
    for part in arms[1:]:
        total = total + part
    return total


def _read_body(table: Table, body_mass: float | None = None) -> Arm:
    mass = table.quantity("mass", "mass")
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
    return Arm(mass, centre, about_centre, device=device, body_mass=body_mass)


def _read_shoulder(table: Table, sources: dict[str, str]) -> Shoulder:
    _note_source(table, sources)
    shoulder = Shoulder(
        table.quantity("angle", "abduction_centre", required=False),
        table.quantity("angle", "half_diagonal", required=False),
        table.quantity("stiffness", "stiffness", (3, 3), required=False),
    )
    table.finish()
    return shoulder


def _read_interfaces(table: Table | None) -> Interfaces:
    if table is None:
        return Interfaces()
    parts = [None if own is None else _read_interface(own) for own in (table.table("harness"), table.table("cuff"))]
    table.finish()
    return Interfaces(*parts)


def _read_interface(table: Table) -> Interface:
    force = table.quantity("stiffness", "stiffness", (3, 3))
    moment = table.quantity("twist stiffness", "rotational_stiffness", (3, 3))
    coupling = table.quantity("coupling stiffness", "coupling", (3, 3), required=False)
    at = table.quantity("length", "at", (3,), required=False)
    source = table.text("source", required=False)
    table.finish()
    between = np.zeros((3, 3)) if coupling is None else coupling
    stiffness = np.block([[force, between], [between.T, moment]])
    return Interface(stiffness, np.zeros(3) if at is None else at, source or "")


def _read_limb(table: Table, sources: dict[str, str]) -> Limb:
    _note_source(table, sources)
    kind = table.text("kind", choices=("UPU", "SPS"))
    stroke_table = table.table("stroke")
    stroke = None
    if stroke_table is not None:
        _note_source(stroke_table, sources)
        stroke = Stroke(
            stroke_table.quantity("length", "nominal"),
            stroke_table.quantity("number", "shortest_ratio"),
            stroke_table.quantity("number", "longest_ratio"),
            stroke_table.quantity("length", "end_fitting", required=False),
        )
        stroke_table.finish()
    halves = [_read_limb_body(table.table(key), sources) for key in ("base_body", "platform_body")]
    limit = table.quantity("angle", "joint_half_diagonal", required=False)
    straight = table.quantity("number", "joint_straight", (3,), required=False)
    guide = _read_guide(table.table("guide"), sources)
    actuator = _read_actuator(table.table("actuator"), sources)
    table.finish()
    return Limb(kind, halves[0], halves[1], stroke, limit, straight, guide, actuator)  # type: ignore[arg-type]


def _read_actuator(table: Table | None, sources: dict[str, str]) -> Actuator | None:
    if table is None:
        return None
    _note_source(table, sources)
    family = table.text("family", choices=ACTUATOR_FAMILIES)
    actuator = Actuator(
        family,  # type: ignore[arg-type]
        table.quantity("force", "pull_limit", required=False),
        table.quantity("force", "push_limit", required=False),
        table.text("force_law", required=False),
        table.quantity("pressure", "supply", required=False),
        table.quantity("speed", "speed_limit", required=False),
        table.quantity("power", "power_limit", required=False),
        table.quantity("length", "travel_limit", required=False),
        _read_tackle(table.table("tackle"), sources),
    )
    table.finish()
    return actuator


def _read_tackle(table: Table | None, sources: dict[str, str]) -> Tackle | None:
    if table is None:
        return None
    _note_source(table, sources)
    count, law = table.quantity("number", "count", required=False), table.text("force_law")
    assert law is not None
    tackle = Tackle(
        table.quantity("number", "ratio"),
        table.quantity("length", "muscle"),
        law,
        table.quantity("pressure", "supply"),
        1 if count is None else count,
    )
    table.finish()
    return tackle


def _read_guide(table: Table | None, sources: dict[str, str]) -> LimbGuide | None:
    if table is None:
        return None
    _note_source(table, sources)
    joint = table.quantity("stiffness", "joint_stiffness", required=False)
    twist = table.quantity("twist stiffness", "joint_twist_stiffness", required=False)
    guide = LimbGuide(
        table.quantity("rigidity", "bending_rigidity"),
        table.quantity("rigidity", "torsional_rigidity"),
        np.inf if joint is None else joint,
        np.inf if twist is None else twist,
        table.quantity("couple", "largest_bending_moment", required=False),
        table.quantity("couple", "largest_torque", required=False),
    )
    table.finish()
    return guide


def _read_limb_body(table: Table | None, sources: dict[str, str]) -> LimbBody | None:
    if table is None:
        return None
    _note_source(table, sources)
    body = LimbBody(
        table.quantity("mass", "mass"),
        table.quantity("length", "centre"),
        table.quantity("inertia", "transverse_inertia"),
        table.quantity("inertia", "axial_inertia"),
    )
    table.finish()
    return body
