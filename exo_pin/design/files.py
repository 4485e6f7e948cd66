"""Mechanisms as TOML files: reading, writing, and the published ones that come with the package."""

from __future__ import annotations

import os
import tempfile
import tomllib
from importlib.resources import files
from os import PathLike
from pathlib import Path
from typing import Any

import numpy as np
import tomli_w
from scipy.spatial.transform import Rotation

from ..errors import ExoPinError, FileFormatError, UnknownName
from .arm import Arm
from .geometry import WristGeometry
from .limb import Limb, LimbBody, Stroke
from .mechanism import Mechanism
from .quantities import Table
from .shoulder import Shoulder

__all__ = ["preset", "presets", "read_mechanism", "write_bytes", "write_mechanism", "write_text"]

_SCHEMA = 1


def presets() -> list[str]:
    """Names of the published mechanisms that come with the package, sorted."""
    folder = files("exo_pin.design") / "presets"
    return sorted(entry.name.removesuffix(".toml") for entry in folder.iterdir() if entry.name.endswith(".toml"))


def preset(name: str) -> Mechanism:
    """Load a published mechanism.

    Raises
    ------
    UnknownName
        If there is none of that name; the message lists those there are.
    """
    if name not in presets():
        raise UnknownName("preset", name, presets())
    text = (files("exo_pin.design") / "presets" / f"{name}.toml").read_text(encoding="utf-8")
    return _parse(text, f"{name}.toml")


def read_mechanism(path: str | PathLike[str]) -> Mechanism:
    """Load a mechanism from a TOML file.

    Parameters
    ----------
    path : path-like
        The file. Keys carry their units; the presets are examples of the format.

    Raises
    ------
    FileFormatError
        If the file is not TOML, or a key is unknown, missing or has a wrong value; the key is named.
    """
    try:
        text = Path(path).read_text(encoding="utf-8")
    except (OSError, UnicodeDecodeError) as error:
        raise FileFormatError(f"cannot be read: {error}", path) from error
    return _parse(text, path)


def write_mechanism(mechanism: Mechanism, path: str | PathLike[str]) -> None:
    """Save a mechanism as a TOML file in SI units, so that it loads back bit for bit.

    The file appears whole or not at all.
    """
    write_text(path, tomli_w.dumps(_as_table(mechanism)))


def write_text(path: str | PathLike[str], text: str) -> None:
    """Write a text file so that a reader finds the old one or the new one, never half of it."""
    write_bytes(path, text.encode("utf-8"))


def write_bytes(path: str | PathLike[str], content: bytes) -> None:
    """Write a file so that a reader finds the old one or the new one, never half of it."""
    target = Path(path)
    handle, name = tempfile.mkstemp(dir=target.parent, prefix=f".{target.name}.")
    try:
        with os.fdopen(handle, "wb") as stream:
            stream.write(content)
        os.chmod(name, 0o644)
        os.replace(name, target)
    except BaseException:
        Path(name).unlink(missing_ok=True)
        raise


def _parse(text: str, path: str | PathLike[str]) -> Mechanism:
    try:
        data = tomllib.loads(text)
    except tomllib.TOMLDecodeError as error:
        raise FileFormatError(f"not TOML: {error}", path) from error
    root = Table(data, path)
    schema = root.integer("schema")
    if schema != _SCHEMA:
        raise root.error(f"this version reads schema {_SCHEMA}, got {schema}", "schema")
    try:
        return _read_root(root)
    except FileFormatError:
        raise
    except ExoPinError as error:
        # A value that its record refuses: say in which file.
        raise FileFormatError(str(error), path) from error


def _read_root(root: Table) -> Mechanism:
    sources: dict[str, str] = {}
    name, title = root.text("name"), root.text("title", required=False)
    side = root.text("side", required=False, choices=("left", "right")) or "left"
    gravity = root.quantity("acceleration", "gravity", (3,), required=False)
    document, estimated = root.text("source", required=False), root.texts("estimated")
    if document:
        sources["mechanism"] = document
    geometry_table = root.table("geometry")
    assert geometry_table is not None
    assert name is not None
    geometry = _read_geometry(geometry_table, side, sources)
    arm_table, shoulder_table = root.table("arm", required=False), root.table("shoulder", required=False)
    arm = None if arm_table is None else _read_arm(arm_table, sources)
    shoulder = Shoulder() if shoulder_table is None else _read_shoulder(shoulder_table, sources)
    limbs = tuple(_read_limb(table, index, sources) for index, table in enumerate(root.tables("limbs")))
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
        **({} if gravity is None else {"gravity": gravity}),
    )


def _note_source(table: Table, sources: dict[str, str]) -> None:
    source = table.text("source", required=False)
    if source:
        sources[table.name] = source


def _read_geometry(table: Table, side: str, sources: dict[str, str]) -> WristGeometry:
    _note_source(table, sources)
    circles, points = table.table("circles", required=False), table.table("points", required=False)
    quaternion = table.quantity("number", "neutral_quaternion_xyzw", (4,), required=False)
    table.finish()
    if (circles is None) == (points is None):
        raise table.error("expected either a table circles or a table points", "circles")
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
    body_mass = table.quantity("mass", "body_mass", required=False)
    table.finish()
    arms = [_read_body(part, body_mass) for part in parts]
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
        raise table.error("there is no inertia that it could speak of", "products_of_inertia")
    if signs == "integrals":
        flip = 2.0 * np.eye(3) - 1.0  # keeps the moments, negates the products
        about_centre = None if about_centre is None else about_centre * flip
        about_origin = None if about_origin is None else about_origin * flip
    if about_origin is not None:
        arm = Arm.from_inertia_about_origin(mass, centre, about_origin, device=device)
        return Arm(arm.mass, arm.centre_of_mass, arm.inertia, device=device, body_mass=body_mass)
    return Arm(mass, centre, about_centre, device=device, body_mass=None if device else body_mass)


def _read_shoulder(table: Table, sources: dict[str, str]) -> Shoulder:
    _note_source(table, sources)
    shoulder = Shoulder(
        table.quantity("angle", "abduction_centre", required=False),
        table.quantity("angle", "half_diagonal", required=False),
    )
    table.finish()
    return shoulder


def _read_limb(table: Table, index: int, sources: dict[str, str]) -> Limb:
    _note_source(table, sources)
    kind = table.text("kind", choices=("UPU", "SPS"))
    stroke_table = table.table("stroke", required=False)
    stroke = None
    if stroke_table is not None:
        stroke = Stroke(
            stroke_table.quantity("length", "nominal"),
            stroke_table.quantity("number", "shortest_ratio"),
            stroke_table.quantity("number", "longest_ratio"),
            stroke_table.quantity("length", "end_fitting", required=False),
        )
        stroke_table.finish()
    halves = [_read_limb_body(table.table(key, required=False)) for key in ("base_body", "platform_body")]
    limit = table.quantity("angle", "joint_half_diagonal", required=False)
    table.finish()
    return Limb(kind, halves[0], halves[1], stroke, limit)  # type: ignore[arg-type]


def _read_limb_body(table: Table | None) -> LimbBody | None:
    if table is None:
        return None
    body = LimbBody(
        table.quantity("mass", "mass"),
        table.quantity("length", "centre"),
        table.quantity("inertia", "transverse_inertia"),
        table.quantity("inertia", "axial_inertia"),
    )
    table.finish()
    return body


def _as_table(mechanism: Mechanism) -> dict[str, Any]:
    sources = mechanism.sources
    table: dict[str, Any] = {"schema": _SCHEMA, "name": mechanism.name}
    if mechanism.title:
        table["title"] = mechanism.title
    table["side"] = mechanism.side
    table["gravity_m_s2"] = mechanism.gravity.tolist()
    if "mechanism" in sources:
        table["source"] = sources["mechanism"]
    if mechanism.estimated:
        table["estimated"] = list(mechanism.estimated)
    table["geometry"] = _sourced("geometry", sources, _geometry_table(mechanism.geometry, mechanism.side))
    if mechanism.arm is not None:
        table["arm"] = _sourced("arm", sources, _arm_table(mechanism.arm))
    shoulder = _present(
        abduction_centre_rad=mechanism.shoulder.abduction_centre, half_diagonal_rad=mechanism.shoulder.half_diagonal
    )
    if shoulder:
        table["shoulder"] = _sourced("shoulder", sources, shoulder)
    table["limbs"] = [
        _sourced(f"limbs[{index}]", sources, _limb_table(limb)) for index, limb in enumerate(mechanism.limbs)
    ]
    return table


def _sourced(name: str, sources: Any, content: dict[str, Any]) -> dict[str, Any]:
    return {"source": sources[name], **content} if name in sources else content


def _present(**items: Any) -> dict[str, Any]:
    """The items that are not None, arrays as lists."""
    return {
        key: value.tolist() if isinstance(value, np.ndarray) else value
        for key, value in items.items()
        if value is not None
    }


def _geometry_table(geometry: WristGeometry, side: str) -> dict[str, Any]:
    content: dict[str, Any] = {}
    if geometry.neutral.magnitude() != 0.0:
        content["neutral_quaternion_xyzw"] = geometry.neutral.as_quat().tolist()
    circles = geometry.circles
    if circles is not None and circles.side == side:
        content["circles"] = _present(
            base_radius_m=circles.r_A,
            platform_radius_m=circles.r_B,
            base_height_m=circles.h_A,
            platform_height_m=circles.h_B,
            base_angles_rad=circles.alpha_A,
            platform_angles_rad=circles.alpha_B,
        )
    else:
        content["points"] = _present(
            base_m=geometry.base_points,
            platform_m=geometry.platform_points,
            base_axis=geometry.base_axis,
            platform_axis=geometry.platform_axis,
        )
    return content


def _arm_table(arm: Arm) -> dict[str, Any]:
    def body(part: Arm) -> dict[str, Any]:
        return _present(
            mass_kg=part.mass,
            centre_of_mass_m=part.centre_of_mass,
            inertia_about_centre_kg_m2=part.inertia,
            device=True if part.device else None,
        )

    if len(arm.parts) == 1 and arm.body_mass is None:
        return body(arm)
    return _present(body_mass_kg=arm.body_mass, parts=[body(part) for part in arm.parts])


def _limb_table(limb: Limb) -> dict[str, Any]:
    def half(part: LimbBody | None) -> dict[str, float] | None:
        if part is None:
            return None
        return {
            "mass_kg": part.mass,
            "centre_m": part.centre,
            "transverse_inertia_kg_m2": part.transverse_inertia,
            "axial_inertia_kg_m2": part.axial_inertia,
        }

    stroke = limb.stroke
    return _present(
        kind=limb.kind,
        joint_half_diagonal_rad=limb.joint_limit,
        stroke=None
        if stroke is None
        else _present(
            nominal_m=stroke.nominal_length,
            shortest_ratio=stroke.shortest,
            longest_ratio=stroke.longest,
            end_fitting_m=stroke.end_fitting,
        ),
        base_body=half(limb.base_body),
        platform_body=half(limb.platform_body),
    )
