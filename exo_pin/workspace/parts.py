"""The parts of a device that a workshop orders or makes: drives, frame and cuff, what each must do, and what it weighs.

Drives are chosen by effort and travel from :data:`PRODUCTS`, whose figures are those of the named pages and no others:
what a page does not state is NaN here and "not stated" in print. Frame and cuff are those of
:mod:`exo_pin.design.holding_frame`, as drawn. What holds the frame on the torso, electronics and cables are not in it.
"""

from __future__ import annotations

from typing import Any, NamedTuple

import numpy as np

from ..core.errors.checked import checked
from ..core.tables import aligned, filled
from ..core.validation import as_positive
from ..design import Mechanism
from ..design.holding_frame import frame_parts
from ..device.protocol import Device
from ..device.wrist_device import as_device
from ..study import StudyTable
from .limb_table import limb_table
from .result import Workspace

_NAN = float("nan")


class _Product(NamedTuple):
    """A drive that can be bought; NaN where its page states nothing.

    Attributes
    ----------
    name, source : str
        What it is called, and where its figures stand.
    unit : str
        "N" of a linear actuator, "N m" of a motor in a hinge.
    effort : float
        Greatest force or moment that it moves, N or N m.
    speed : float
        Greatest speed, m/s or rad/s: without load, or at ``effort`` of the LA31.
    strokes : tuple of float
        Least and greatest stroke that is sold, m.
    mass : float
        kg.
    """

    name: str
    unit: str
    effort: float
    speed: float
    strokes: tuple[float, float]
    mass: float
    source: str


#: Least effort first, then least stroke, so that the first one that fits is the smallest.
PRODUCTS = (
    *(
        _Product(
            f"Actuonix L16, {1e3 * stroke:.0f} mm, {force:.0f} N", "N", force, speed, (0.0, stroke), mass,
            "docs.wcproducts.com",
        )
        for force, speed in ((50.0, 0.032), (100.0, 0.020), (200.0, 0.008))
        for stroke, mass in ((0.050, 0.056), (0.100, 0.074), (0.140, 0.084))
    ),
    _Product("LINAK LA31, fast", "N", 1000.0, 0.020, (_NAN, _NAN), _NAN, "scribd 127800120"),
    _Product("LINAK LA23", "N", 2500.0, _NAN, (0.020, 0.500), _NAN, "chnfcs.com"),
    _Product("LINAK LA31", "N", 3500.0, 0.005, (_NAN, _NAN), _NAN, "scribd 127800120"),
    _Product("RMD X8-90", "N m", 25.0, 130.0 * np.pi / 30.0, (_NAN, _NAN), _NAN, "docs.ros.org"),
)  # fmt: skip


def _fitting_product(unit: str, effort: float, travel: float) -> _Product | None:
    """The smallest product that has an effort and, of a linear actuator, a stroke; None if there is none."""
    for each in PRODUCTS:
        if each.unit == unit and each.effort >= effort and (unit == "N m" or each.strokes[1] >= travel):
            return each
    return None


@checked
def parts_list(mechanism: Device | Mechanism, found: Workspace, rate: float = np.radians(30.0)) -> StudyTable:
    """Parts of a device with what its drives must do over the poses inside, at a rate of the arm about its worst axis.

    Parameters
    ----------
    mechanism : Device or Mechanism
        The design.
    found : Workspace
        Its workspace, with at least one pose inside. Forces are those that make |F_s| least, of the persons of its
        criteria.
    rate : float
        How fast the arm turns, rad/s.

    Returns
    -------
    StudyTable
        One row a part: ``part``; ``count``; ``unit`` of the effort, "N" or "N m", or "" of what is no drive;
        ``shortest`` and ``longest``, lengths that occur, or the length of a tube, m (angles of a hinge, rad);
        ``effort_from``, ``effort_to``; ``speed``, m/s or rad/s, the largest that any axis of turning asks; ``power_W``,
        at most, if effort and speed of a pose point the same way; ``mass_kg`` of all of the row, NaN where it is not
        known; ``order``, what to buy or to make it of, in words.

    Raises
    ------
    InvalidInput
        If no pose is inside, or the rate is not above zero.

    Examples
    --------
    >>> from exo_pin.workspace.parts import parts_list
    >>> exo = ep.load("four-linear-actuators-worn")
    >>> table = parts_list(exo.mechanism, exo.workspace(30.0))
    >>> table["part"][-2:].tolist(), round(float(np.nansum(table["mass_kg"])), 2)  # kg, without drives
    (['sleeve of the cuff', 'joints'], 1.05)
    """
    device: Any = as_device(mechanism)
    rate = as_positive("rate", rate)
    limbs, table = device.accelerate("workspace"), limb_table(mechanism, found)
    rows = [_drive_row(device, limbs, table, k, rate) for k in range(len(table["lever"]))]
    if limbs is None:
        own = {"links on the arm": device.arm.mass - (device.arm.person.mass if device.arm.person else 0.0)}
        own["other links"] = device.links_mass
        said = "as the design states, with what drives they carry"
        made = [(name, 1, _NAN, mass, said) for name, mass in own.items()]
    else:
        made = frame_parts(limbs.geometry)
    blank = dict.fromkeys(("shortest", "longest", "effort_from", "effort_to", "speed", "power_W"), _NAN)
    for name, count, length, mass, order in made:
        rows.append({"part": name, "count": count, "unit": "", **blank, "longest": length,
                     "mass_kg": mass, "order": order})  # fmt: skip
    return StudyTable(rows)


def _drive_row(device: Any, limbs: Mechanism | None, table: StudyTable, k: int, rate: float) -> dict[str, Any]:
    """What one drive must do, and which product does it."""
    if limbs is None:
        name, unit = str(table["drive"][k]), str(table["unit"][k])
        used, effort = ("used_from", "used_to"), ("effort_from", "effort_to")
    else:
        name, unit = f"drive of limb {k + 1}", "N"
        used, effort = ("used_from_m", "used_to_m"), ("force_from_N", "force_to_N")
    short, long, low, high = (float(table[column][k]) for column in (*used, *effort))
    speed = rate * float(table["lever"][k])
    stated, drive = 0.0 if limbs is None else limbs.limbs[k].mass, device.drives[k]
    product, words = None, "a drive that only pulls: none in the table of products"
    if getattr(drive, "route", None) is None and not (drive.actuator is not None and drive.actuator.pulls_only):
        product = _fitting_product(unit, max(abs(low), abs(high)), long - short)
        words = "none in the table of products" if product is None else _order(product, speed, rate)
    mass = stated or (_NAN if product is None else product.mass)
    return {
        "part": name, "count": 1, "unit": unit, "shortest": short, "longest": long, "effort_from": low,
        "effort_to": high, "speed": speed, "power_W": rate * float(table["moment"][k]), "mass_kg": mass,
        "order": f"{words}; mass as the design states" if stated else words,
    }  # fmt: skip


def _order(product: _Product, speed: float, rate: float) -> str:
    """A product, what is not stated of it, and how slow it makes the arm."""
    lacking = [what for what, value in (("speed", product.speed), ("mass", product.mass)) if np.isnan(value)]
    lacking += ["stroke"] if product.unit == "N" and np.isnan(product.strokes[1]) else []
    texts = [product.name]
    if lacking:
        texts.append(f"{' and '.join(lacking)} not stated")
    if product.speed < speed:
        texts.append(f"turns the arm at {np.degrees(rate * product.speed / speed):.1f}°/s at most")
    return f"{'; '.join(texts)} [{product.source}]"


@checked
def parts_sheet(mechanism: Device | Mechanism, table: StudyTable) -> str:
    """The list of parts for a person, its known mass, and what is without mass in all answers.

    Parameters
    ----------
    mechanism : Device or Mechanism
        The design.
    table : StudyTable
        Of :func:`parts_list`.

    Returns
    -------
    str

    Examples
    --------
    >>> from exo_pin.workspace.parts import parts_list, parts_sheet
    >>> exo = ep.load("four-cables")
    >>> print(parts_sheet(exo.mechanism, parts_list(exo.mechanism, exo.workspace(40.0))).splitlines()[-2])
    Mass of these parts: 1.11 kg, without 4 of 4 drives, whose mass is not known. In answers limbs and
    """
    rows = [("part", "length, mm or °", "force or moment", "speed", "power, W", "mass, kg", "order")]
    for k, name in enumerate(table["part"]):
        count, turns = int(table["count"][k]), table["unit"][k] == "N m"
        scale, unit = (180.0 / np.pi, "°/s") if turns else (1e3, "mm/s")
        short, long, low, high = (float(table[column][k]) for column in
                                  ("shortest", "longest", "effort_from", "effort_to"))  # fmt: skip
        length = _cell(scale * long) if np.isnan(short) else f"{_cell(scale * short)} to {_cell(scale * long)}"
        force = "-" if np.isnan(low) else f"{_cell(low)} to {_cell(high)} {table['unit'][k]}"
        speed, power, mass = (float(table[column][k]) for column in ("speed", "power_W", "mass_kg"))
        rows.append(
            (
                f"{count} {name}" if count > 1 else str(name), length, force,
                "-" if np.isnan(speed) else f"{_cell(scale * speed)} {unit}", _cell(power), _cell(mass, 3),
                str(table["order"][k]),
            )
        )  # fmt: skip
    known = table["mass_kg"]
    unknown = int(np.isnan(known).sum())
    words = f"Mass of these parts: {np.nansum(known):.2f} kg"
    words += (
        f", without {unknown} of {int((table['unit'] != '').sum())} drives, whose mass is not known."
        if unknown
        else "."
    )
    if as_device(mechanism).accelerate("workspace") is not None:
        words += f" {_massless_words(mechanism)}"
    return "\n".join([*aligned(rows, words=1), filled(words)])


def _massless_words(mechanism: Device | Mechanism) -> str:
    """What of a device of limbs is without mass in all answers."""
    device: Any = as_device(mechanism)
    light = "limbs and drives weigh nothing, and " if device.limbs_are_massless else ""
    return f"In answers {light}the torso carries the frame."


def _cell(value: float, digits: int = 0) -> str:
    return "-" if np.isnan(value) else f"{round(value, digits) + 0.0:.{digits}f}"
