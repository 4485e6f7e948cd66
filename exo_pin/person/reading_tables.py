"""A person's build and contact forces as short tables for reading."""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np

from ..core.tables import aligned, filled
from .limb.muscle_table import MUSCLES

if TYPE_CHECKING:
    from .contact.result import JointContact
    from .wearer import Person

#: Muscles that are named together.
_GROUPS = {
    "deltoid": ("DELT1", "DELT2", "DELT3"),
    "rotator cuff": ("SUPSP", "INFSP", "SUBSC", "TMIN"),
    "pectoralis major": ("PECM1", "PECM2", "PECM3"),
    "latissimus and teres major": ("LAT1", "LAT2", "LAT3", "TMAJ"),
    "biceps and coracobrachialis": ("BIClong", "BICshort", "CORB"),
    "triceps": ("TRIlong", "TRIlat", "TRImed"),
}
#: How many muscles are listed, and the least activation of a listed one.
_LISTED, _LEAST = 8, 0.01
#: Lines of every table, and the sizes of a contact that they show.
_SIZES = {
    "contact force, N": "magnitude",
    "  % of body weight": "percent_body_weight",
    "  compression, N": "compression",
    "  shear, N": "shear",
}


def contact_table(contact: JointContact) -> str:
    """Lay out a result: the verdict, forces, muscles and assumptions; for a stack, peaks.

    Parameters
    ----------
    contact : JointContact
        The result; with a device also the one without it.

    Returns
    -------
    str
    """
    columns = [("", contact)] if contact.without_device is None else [
        ("with device", contact),
        ("without", contact.without_device),
    ]  # fmt: skip
    rows = _pose_rows(columns) if contact.status.ndim == 0 else _stack_rows(columns)
    header = [["", *(name for name, _ in columns)]] if len(columns) > 1 else []
    notes = [f"{name}: {text}" for name, text in contact.assumptions.items()]
    return "\n".join([filled(contact.verdict), "", *aligned(header + rows, words=1), "", "Assumptions", *notes])


def _number(value: float, digits: int = 0) -> str:
    if not np.isfinite(value):
        return "-"
    return f"{0.0 if abs(value) < 0.5 * 10.0**-digits else value:.{digits}f}"


def _pose_rows(columns: list[tuple[str, JointContact]]) -> list[list[str]]:
    results = [contact for _, contact in columns]
    rows = [["status", *(str(r.status) for r in results)]]
    for label, name in _SIZES.items():
        rows.append([label, *(_number(float(getattr(r, name))) for r in results)])
    if any(str(r.status) in ("too_weak", "unstable") for r in results):
        rows.append(["missing moment, N m", *(_number(float(np.linalg.norm(r.missing_moment)), 1) for r in results)])
        rows.append(["  at elbow and forearm", *(_number(float(np.abs(r.missing_elbow).sum()), 1) for r in results)])
    for kind, forces in (("force", results[0].device_forces), ("side force", results[0].constraint_forces)):
        names = [f"{name}, {unit}" for name, unit in results[0].drive_units]
        names = names or [f"limb {limb} {kind}, N" for limb in range(1, 1 + len(forces))]
        rows += [
            [name, _number(float(force), 1 if name.endswith("N m") else 0), "-"]
            for name, force in zip(names[: len(forces)], forces, strict=True)
            if not name.startswith("wearer about ")
        ]
    strongest = np.nan_to_num(np.max([r.activations for r in results], axis=0))
    order = [k for k in np.argsort(-strongest)[:_LISTED] if strongest[k] >= _LEAST]
    for k in order:
        cells = [f"{_number(100.0 * float(r.activations[k]))} %" for r in results]
        rows.append([f"activation {results[0].muscles[k]}", *cells])
    return rows


def _stack_rows(columns: list[tuple[str, JointContact]]) -> list[list[str]]:
    results = [contact for _, contact in columns]
    rows = [["poses", *(str(r.status.size) for r in results)]]
    found = dict.fromkeys(np.concatenate([np.unique(r.status) for r in results]).tolist())
    rows += [[f"  {status}", *(str(int((r.status == status).sum())) for r in results)] for status in found]
    for label, name in _SIZES.items():
        for word, of in (("median", np.nanmedian), ("peak", np.nanmax)):
            cells = []
            for r in results:
                values = getattr(r, name)[r.has_result]
                cells.append(_number(float(of(values))) if values.size else "-")
            rows.append([f"{label}, {word}", *cells])
    relief = results[0].relief_percent
    if relief is not None and np.isfinite(relief).any():
        low, middle, high = np.nanpercentile(relief, [25.0, 50.0, 75.0])
        rows.append(["relief, %, median", _number(float(middle)), ""])
        rows.append(["  quartiles", f"{_number(float(low))} to {_number(float(high))}", ""])
        rows.append(
            ["  poses with less force, %", _number(100.0 * float((relief[np.isfinite(relief)] > 0.0).mean())), ""]
        )
    return rows


def build_table(person: Person) -> str:
    """Lengths, masses and strengths of a person.

    Parameters
    ----------
    person : Person
        Whose.

    Returns
    -------
    str
        Strengths are sums of the peak isometric forces of a group, N.
    """
    arm, forces = person.arm, person.muscle_table.force
    place = 1e3 * float(np.linalg.norm(arm.centre_of_mass))
    load = f" with {person.payload:g} kg in the hand" if person.payload else ""
    strengths = [
        f"{name} {sum(forces[MUSCLES.index(muscle)] for muscle in group):.0f}" for name, group in _GROUPS.items()
    ]
    return "\n".join(
        [
            f"{person.height:g} m, {person.mass:g} kg, {person.sex}, {person.side} arm, elbow at "
            f"{np.degrees(person.elbow_flexion):.0f}°",
            f"upper arm {-1e3 * person.elbow_centre[2]:.0f} mm; arm {arm.mass:.2f} kg{load}, its centre of mass "
            f"{place:.0f} mm from the shoulder",
            f"strength, N: {', '.join(strengths[:3])},",
            f"  {', '.join(strengths[3:])}",
        ]
    )
