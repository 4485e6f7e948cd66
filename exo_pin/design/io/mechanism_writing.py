"""Conversion of a mechanism to a TOML table, in SI units."""

from __future__ import annotations

import re
from collections.abc import Mapping
from typing import Any

import numpy as np

from ..actuator import Actuator
from ..arm import Arm
from ..geometry import WristGeometry
from ..guide import LimbGuide
from ..interface import Interface
from ..limb import Limb, LimbBody
from ..mechanism import Mechanism
from ..tackle import Tackle

__all__ = ["SCHEMA", "mechanism_table"]

#: Version of the file format.
SCHEMA = 1


def mechanism_table(mechanism: Mechanism) -> dict[str, Any]:
    """The table that a mechanism's file holds, keys with their units."""
    table: dict[str, Any] = {"schema": SCHEMA, "name": mechanism.name}
    if mechanism.title:
        table["title"] = mechanism.title
    table["side"] = mechanism.side
    table["gravity_m_s2"] = mechanism.gravity.tolist()
    if mechanism.estimated:
        table["estimated"] = list(mechanism.estimated)
    table["geometry"] = _geometry_table(mechanism.geometry, mechanism.side)
    if mechanism.arm is not None:
        table["arm"] = _arm_table(mechanism.arm)
    shoulder = _present(
        abduction_centre_rad=mechanism.shoulder.abduction_centre,
        half_diagonal_rad=mechanism.shoulder.half_diagonal,
        stiffness_N_m=mechanism.shoulder.stiffness,
    )
    if shoulder:
        table["shoulder"] = shoulder
    if not mechanism.interfaces.are_rigid:
        own = mechanism.interfaces
        parts = {"harness": own.harness, "cuff": own.cuff}
        table["interfaces"] = {name: _interface_table(part) for name, part in parts.items() if part is not None}
    table["limbs"] = [_limb_table(limb) for limb in mechanism.limbs]
    elsewhere = _cite(table, mechanism.sources)
    if elsewhere:
        table["sources"] = elsewhere
    return table


def _cite(root: dict[str, Any], sources: Mapping[str, str]) -> dict[str, str]:
    """Write every source into the table that its key names; return those whose table this file does not have."""
    elsewhere = {}
    for name, text in sources.items():
        table = root if name == "mechanism" else _table_at(root, name)
        if table is None:
            elsewhere[name] = text
        else:
            content = dict(table)
            table.clear()
            table.update(source=text, **content)
    return elsewhere


def _table_at(root: dict[str, Any], name: str) -> dict[str, Any] | None:
    """The table of a dotted name such as ``limbs[0].stroke``; None if there is none."""
    here: Any = root
    for step in name.split("."):
        match = re.fullmatch(r"(\w+)(?:\[(0|[1-9]\d*)\])?", step)
        if match is None or not isinstance(here, dict):
            return None
        here = here.get(match[1])
        if match[2] is not None:
            here = here[int(match[2])] if isinstance(here, list) and int(match[2]) < len(here) else None
    return here if isinstance(here, dict) else None


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
        joint_straight=None if limb.joint_straight is None else list(limb.joint_straight),
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
        guide=None if limb.guide is None else _guide_table(limb.guide),
        actuator=None if limb.actuator is None else _actuator_table(limb.actuator),
    )


def _guide_table(guide: LimbGuide) -> dict[str, float]:
    table = {
        "bending_rigidity_N_m2": guide.bending_rigidity,
        "torsional_rigidity_N_m2": guide.torsional_rigidity,
        "joint_stiffness_N_m": guide.joint_stiffness,
        "joint_twist_stiffness_N_m_rad": guide.joint_twist_stiffness,
    }
    finite = {key: value for key, value in table.items() if np.isfinite(value)}
    return finite | _present(
        largest_bending_moment_N_m=guide.largest_bending_moment, largest_torque_N_m=guide.largest_torque
    )


def _actuator_table(actuator: Actuator) -> dict[str, Any]:
    return _present(
        family=actuator.family,
        pull_limit_N=actuator.pull_limit,
        push_limit_N=None if actuator.pulls_only else actuator.push_limit,
        force_law=actuator.force_law,
        supply_Pa=actuator.supply_pressure,
        speed_limit_m_s=actuator.speed_limit,
        power_limit_W=actuator.power_limit,
        travel_limit_m=actuator.travel_limit,
        tackle=None if actuator.tackle is None else _tackle_table(actuator.tackle),
    )


def _tackle_table(tackle: Tackle) -> dict[str, Any]:
    return {
        "ratio": tackle.ratio,
        "muscle_m": tackle.muscle_length,
        "force_law": tackle.force_law,
        "supply_Pa": tackle.supply_pressure,
        "count": tackle.count,
    }


def _interface_table(interface: Interface) -> dict[str, Any]:
    K = interface.stiffness
    return _present(
        source=interface.source or None,
        stiffness_N_m=K[:3, :3],
        rotational_stiffness_N_m_rad=K[3:, 3:],
        coupling_N=K[:3, 3:] if K[:3, 3:].any() else None,
        at_m=np.asarray(interface.at),
    )
