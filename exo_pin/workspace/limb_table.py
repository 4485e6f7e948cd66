"""What each limb or drive of a design has to do over the poses of its workspace.

And what is left of it when one limb gives no force: a torn cable, an actuator that has gone limp.
"""

from __future__ import annotations

from typing import Any

import numpy as np
from numpy.typing import NDArray

from ..core.errors import InvalidInput
from ..core.errors.checked import checked
from ..core.tables import aligned, percent
from ..core.validation import FloatArray
from ..design import Mechanism
from ..design.holding_frame import mass_text
from ..device.device_singularity import position_rates
from ..device.protocol import Device
from ..device.wrist_device import as_device
from ..numerics.cones import fork_tilt, smallest_cone
from ..reaction.constraints.actuator_limits import length_limits
from ..study import StudyTable
from ..wrist.clearance.clearance import limb_gaps, limb_radii
from .device_values import mass_words, values_of
from .evaluation import PoseOffsets
from .result import Workspace

#: Columns of a drive that is no limb between two joint centres.
_COLUMNS = ("stroke_from", "stroke_to", "used_from", "used_to", "effort_from", "effort_to")


@checked
def limb_table(mechanism: Device | Mechanism, found: Workspace) -> StudyTable:
    """Lengths, forces, clearances and joint angles of every limb over the poses inside.

    Parameters
    ----------
    mechanism : Device or Mechanism
        The design.
    found : Workspace
        Its workspace, with at least one pose inside.

    Returns
    -------
    StudyTable
        One row a limb: ``limb``, from 1; ``stroke_from_m``, ``stroke_to_m``, the lengths that its actuator takes (NaN
        where not known), and ``used_from_m``, ``used_to_m``, those that occur inside; ``force_from_N``, ``force_to_N``,
        of the tensions that make |F_s| least; ``gap_arm_m``, ``gap_torso_m``, ``gap_limbs_m``, least distances of its
        surface (NaN where there is no body); ``base_cone_deg``, ``arm_cone_deg``, half the opening of the smallest cone
        that holds all its directions at either end: what a ball joint there must allow (180 where no half space holds
        them); ``arm_tilt_deg``, what a fork on the arm must allow that turns freely about an axis of its own
        (:func:`exo_pin.numerics.cones.fork_tilt`); ``lever``, by how much its length changes at most while the arm
        turns about any axis, m/rad, and ``moment``, the largest of its force times this lever, N m. Of a device without
        limbs between two joint centres, one row a drive: ``drive``, ``unit`` of its effort, and ``stroke_from``,
        ``used_from``, ``effort_from`` with their ``to``, rad and N m of a hinge, m and N of others, besides ``lever``
        (about the device's own centre) and ``moment``; efforts are those that make |F_s| least.

    Raises
    ------
    InvalidInput
        If no pose is inside, or the workspace is that of another number of limbs.

    Examples
    --------
    >>> from exo_pin.workspace import limb_table
    >>> exo = ep.load("four-linear-actuators-worn")
    >>> table = limb_table(exo.mechanism, exo.workspace(30.0))
    >>> sorted(table)[:2]  # columns, one row a limb
    ['arm_cone_deg', 'arm_tilt_deg']
    """
    device: Any = as_device(mechanism)
    rows, limbs = rows_inside(device, found), device.accelerate("workspace")
    n, total = device.limb_count, found.inside.size
    lengths, tensions = found.lengths.reshape(total, n)[rows], found.tensions.reshape(total, n)[rows]
    low, high = length_limits(device)
    if limbs is None:
        rates = np.linalg.norm(position_rates(device.as_chain(), found.poses).reshape(total, -1, 3)[rows], axis=2)
        values = dict(zip(_COLUMNS, (low, high, *_ends(lengths), *_ends(tensions)), strict=True))
        values |= _levers(rates, tensions[:, : rates.shape[1]])
        return StudyTable(
            [
                {"drive": name, "unit": unit} | {column: each[i] for column, each in values.items()}
                for i, (name, unit) in enumerate(device.drive_units[: len(device.drives)])
            ]
        )
    mechanism, geometry = limbs, limbs.geometry
    R = np.ascontiguousarray(found.poses.as_matrix().reshape(total, 3, 3)[rows])
    offsets = PoseOffsets.of(found.centre_offset, found.poses).rows(rows)
    gaps = _gaps(limbs, found, R, offsets)
    base, cuff = offsets.spread(len(R))
    table = []
    for i in range(n):
        ends = np.einsum("kij,kj->ki", R, geometry.platform_points[i] + cuff)
        along = (ends - geometry.base_points[i] - base) / lengths[:, i, None]
        levers = np.linalg.norm(np.cross(ends, along), axis=1)
        # Seen from the arm. Openings are those of lines, whichever way they point.
        turned = np.einsum("kji,kj->ki", R, along)
        table.append(
            {
                "limb": i + 1,
                "stroke_from_m": low[i],
                "stroke_to_m": high[i],
                "used_from_m": lengths[:, i].min(),
                "used_to_m": lengths[:, i].max(),
                "force_from_N": tensions[:, i].min(),
                "force_to_N": tensions[:, i].max(),
                "gap_arm_m": gaps[i, 0],
                "gap_torso_m": gaps[i, 1],
                "gap_limbs_m": gaps[i, 2],
                "base_cone_deg": np.degrees(smallest_cone(along)[1]),
                "arm_cone_deg": np.degrees(smallest_cone(turned)[1]),
                "arm_tilt_deg": np.degrees(fork_tilt(turned)[1]),
                **_levers(levers, tensions[:, i]),
            }
        )
    return StudyTable(table)


def _levers(rates: FloatArray, efforts: FloatArray) -> dict[str, Any]:
    """Largest rate of each drive per rate of the arm, and largest power per rate, about each pose's worst axis."""
    return {"lever": rates.max(axis=0), "moment": (rates * np.abs(efforts)).max(axis=0)}


def _ends(values: FloatArray) -> tuple[FloatArray, FloatArray]:
    return values.min(axis=0), values.max(axis=0)


def rows_inside(mechanism: Device, found: Workspace) -> NDArray[np.intp]:
    """Numbers of the poses inside, of the flat stack.

    Raises
    ------
    InvalidInput
        If there is none, the workspace is that of another number of limbs, or the design has no drives.
    """
    if not mechanism.drives:
        raise InvalidInput(f"expected a design with drives, got {mechanism.name!r}, which has none")
    if found.lengths.shape[-1] != mechanism.limb_count:
        raise InvalidInput(
            f"expected the workspace of {mechanism.limb_count} limbs, got one of {found.lengths.shape[-1]}"
        )
    rows = np.flatnonzero(found.inside.ravel())
    if not rows.size:
        raise InvalidInput(f"expected a workspace with poses inside, got none of {found.inside.size}")
    return rows


@checked
def limb_sheet(mechanism: Device | Mechanism, table: StudyTable) -> str:
    """What a workshop needs of each limb, a column a limb: points, lengths, forces, clearances, joint angles.

    Parameters
    ----------
    mechanism : Device or Mechanism
        The design.
    table : StudyTable
        Of :func:`limb_table`.

    Returns
    -------
    str

    Examples
    --------
    >>> from exo_pin.workspace import limb_sheet, limb_table
    >>> exo = ep.load("four-linear-actuators-worn")
    >>> lines = limb_sheet(exo.mechanism, limb_table(exo.mechanism, exo.workspace(40.0))).splitlines()
    >>> " ".join(lines[3].split())
    'actuator, mm 374 to 650 365 to 631 369 to 639 354 to 609'
    """
    if "drive" in table:
        return "\n".join([*_drive_lines(table), mass_words(mechanism)])
    limbs: Any = as_device(mechanism).accelerate("workspace")
    names, n = ("arm", "torso", "other limbs"), limbs.limb_count
    points = (("frame", limbs.geometry.base_points), ("cuff", limbs.geometry.platform_points))
    rows = [
        (f"joint on the {where}, mm", [_millimetres(*point, join=", ") for point in joints]) for where, joints in points
    ]
    for words, low, high in (("actuator", "stroke_from_m", "stroke_to_m"), ("used", "used_from_m", "used_to_m")):
        rows.append((f"{words}, mm", [_millimetres(*pair) for pair in zip(table[low], table[high], strict=True)]))
    forces = zip(table["force_from_N"], table["force_to_N"], strict=True)
    rows.append(("force for the least |F_s|, N", [f"{low.round() + 0.0:.0f} to {high:.0f}" for low, high in forces]))
    gaps = [table[f"gap_{name}_m"] for name in ("arm", "torso", "limbs")]
    rows += [
        (f"clear of {name}, mm", [_millimetres(gap) for gap in each]) for name, each in zip(names, gaps, strict=True)
    ]
    for words, name in (("cone at the frame", "base_cone_deg"), ("cone at the cuff", "arm_cone_deg"),
                        ("tilt of a turning fork on the cuff", "arm_tilt_deg")):  # fmt: skip
        rows.append((f"{words}, °", [f"{angle:.0f}" for angle in table[name]]))
    head = ("limb", *(str(i + 1) for i in range(n)))
    lines = aligned([head, *((words, *cells) for words, cells in rows)], words=1)
    return "\n".join([*lines, mass_text(limbs)])


def _drive_lines(table: StudyTable) -> list[str]:
    """A column a drive: its range, what occurs of it, and its efforts."""
    turns = table["unit"] == "N m"
    factors, digits = np.where(turns, 180.0 / np.pi, 1e3), np.where(turns, 1, 0)

    def ends(name: str, scales: FloatArray) -> list[str]:
        pairs = zip(scales * table[f"{name}_from"], scales * table[f"{name}_to"], digits.tolist(), strict=True)
        return [" to ".join("-" if np.isnan(each) else f"{each + 0.0:.{d}f}" for each in pair) for *pair, d in pairs]

    return aligned(
        [
            ("drive", *table["drive"]),
            ("range, mm or °", *ends("stroke", factors)),
            ("used, mm or °", *ends("used", factors)),
            ("effort for the least |F_s|, N or N m", *ends("effort", np.ones(len(turns)))),
        ],
        words=1,
    )


def _millimetres(*lengths: float, join: str = " to ") -> str:
    return join.join("-" if np.isnan(length) else f"{1e3 * length + 0.0:.0f}" for length in lengths)


def _gaps(mechanism: Mechanism, found: Workspace, R: FloatArray, offsets: PoseOffsets) -> FloatArray:
    """Least distances of each limb to arm, torso and other limbs, shape (n, 3), m; NaN where they are not known."""
    body, radii = found.criteria.body_of(mechanism), limb_radii(mechanism, found.criteria.limb_radius)
    if body is None or np.isnan(radii).any():
        return np.full((mechanism.limb_count, 3), np.nan)
    return limb_gaps(R, mechanism, radii, body, (offsets.base, offsets.cuff))


@checked
def limb_loss(mechanism: Device | Mechanism, found: Workspace) -> StudyTable:
    """Which of the poses inside are still held without each of the limbs, and how the arm goes in the others.

    Parameters
    ----------
    mechanism : Device or Mechanism
        The design.
    found : Workspace
        Its workspace, with at least one pose inside.

    Returns
    -------
    StudyTable
        One row a limb or drive: ``limb``, from 1; ``held``, the share of the poses inside in which the others hold
        every arm of the criteria within their limits, strokes left out; ``missing_Nm``, the largest moment that they
        lack, 0 where they hold all; ``missing_share``, the largest such moment over that of the arm's weight in the
        same pose: 1 is an arm that falls as if nothing held it, 0.1 one that sinks ten times as slowly;
        ``shoulder_force_N``, the largest |F_s| where the arm is held, NaN where it nowhere is. The arm is at rest, and
        the lost limb carries nothing: a drive that locks itself holds the arm in every pose.

    Raises
    ------
    InvalidInput
        If no pose is inside, or the workspace is that of another number of limbs.

    Examples
    --------
    >>> from exo_pin.workspace import limb_loss
    >>> exo = ep.load("four-linear-actuators-worn")
    >>> print(limb_loss(exo.mechanism, exo.workspace(30.0)))
    limb    held  missing_Nm  missing_share  shoulder_force_N
    ----  ------  ----------  -------------  ----------------
       1  0.9615         1.4         0.1259             353.4
       2       1           0              0             103.8
       3       1           0              0             295.7
       4  0.9808      0.5134         0.0382              91.6
    """
    device: Any = as_device(mechanism)
    rows = rows_inside(device, found)
    matrices = np.ascontiguousarray(found.poses.as_matrix().reshape(found.inside.size, 3, 3)[rows])
    offsets = PoseOffsets.of(found.centre_offset, found.poses).rows(rows)
    posture = found.posture
    if posture is not None:
        own = isinstance(posture, dict)
        posture = {name: each[rows] for name, each in posture.items()} if own else posture[rows]
    values = values_of(device, matrices, found.criteria, ("forces",), None, offsets, None, posture)
    weight = values.weight_moments()
    table = []
    for lost in range(len(device.drives)):
        margin, _, shoulder = values.held_by_arm(lost)
        least, force = margin.min(axis=0), np.linalg.norm(shoulder, axis=-1)
        held = least >= 0.0
        lacking = np.maximum(-np.nan_to_num(margin), 0.0)
        table.append(
            {
                "limb": lost + 1,
                "held": float(held.mean()),
                "missing_Nm": float(lacking.max()),
                "missing_share": float((lacking / np.maximum(weight, 1e-9)).max()),
                "shoulder_force_N": float(force[:, held].max()) if held.any() else float("nan"),
            }
        )
    return StudyTable(table)


def limb_loss_words(table: StudyTable) -> str:
    """Which limb matters most, and how the arm goes where the others fail, of a table of :func:`limb_loss`."""
    worst, share = int(np.argmin(table["held"])), float(np.max(table["missing_share"]))
    if not share > 0.0:
        return "Whichever limb fails, the others hold every pose inside."
    how = f"sinks, with at most {percent(share, 0)} of its free acceleration" if share < 1.0 else "drops"
    held = 100.0 * table["held"][worst]
    lost = f"Drive {table['limb'][worst]} matters most: without it {held:.3g} % of the poses are held."
    return f"{lost} Where the others do not hold the arm, it {how}."
