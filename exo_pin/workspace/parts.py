"""The parts of a device that a workshop orders or makes: drives, frame and cuff, what each must do, and what it weighs.

Drives are chosen by effort and travel from :data:`PRODUCTS`, whose figures are those of the named pages and no others:
what a page does not state is NaN here and "not stated" in print. A cable is wound on a drum of 40 mm on a motor of a
hinge (as in :class:`exo_pin.control.Winch`). Frame and cuff are those of :mod:`exo_pin.design.holding_frame`, as drawn.
What holds the frame on the torso, electronics and cables are not in it.
"""

from __future__ import annotations

from dataclasses import replace
from typing import Any, NamedTuple

import numpy as np
from numpy.typing import ArrayLike

from ..core.errors import InvalidInput, MissingData
from ..core.errors.checked import checked
from ..core.tables import aligned, filled
from ..core.validation import as_positive, as_real, require_type
from ..design import LimbBody, Mechanism
from ..design.holding_frame import frame_parts
from ..device.protocol import Device
from ..device.wrist_device import as_device
from ..study import StudyTable
from ..wrist.clearance.clearance import LIMB_RADII
from .limb_table import limb_table
from .result import Workspace

_NAN = float("nan")
#: Radius of a cable's drum, m.
_DRUM = 0.02
#: Share of a linear actuator's mass in its rod: assumed.
_ROD = 0.15


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
        Greatest speed, m/s or rad/s: without load, or at ``effort`` of the LA31 and of the ROBOTIS motors, whose
        efforts are those that they give for long.
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


def _motor(name: str, moment: float, turns: float, mass: float, page: str) -> _Product:
    """A motor of a hinge: N m, turns a minute, kg."""
    return _Product(name, "N m", moment, turns * np.pi / 30.0, (_NAN, _NAN), mass, page)


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
    *(
        _Product(f"Actuonix P16-{1e3 * stroke:.0f}-256", "N", 300.0, 0.0048, (0.0, stroke), mass, "actuonix.com")
        for stroke, mass in ((0.050, 0.095), (0.100, 0.110))
    ),
    _Product("LINAK LA31, fast", "N", 1000.0, 0.020, (_NAN, _NAN), _NAN, "scribd 127800120"),
    _Product("LINAK LA23", "N", 2500.0, _NAN, (0.020, 0.500), _NAN, "chnfcs.com"),
    _Product("LINAK LA31", "N", 3500.0, 0.005, (_NAN, _NAN), _NAN, "scribd 127800120"),
    _motor("ROBOTIS M54-40-S250-R", 3.9, 24.2, 0.710, "emanual.robotis.com"),
    _motor("ROBOTIS M54-60-S250-R", 10.1, 28.3, 0.853, "emanual.robotis.com"),
    _motor("ROBOTIS L54-50-S500-R", 14.0, 13.7, 0.656, "emanual.robotis.com"),
    _motor("RMD X8-90", 25.0, 130.0, _NAN, "docs.ros.org"),
    _motor("ROBOTIS H54-100-S500-R", 25.3, 29.2, 0.732, "emanual.robotis.com"),
    _motor("RMD X8-60", 30.0, 40.0, _NAN, "docs.ros.org"),
    _motor("ROBOTIS H54-200-S500-R", 44.7, 29.0, 0.855, "emanual.robotis.com"),
)  # fmt: skip


def _fitting_product(unit: str, effort: float, travel: float) -> _Product | None:
    """The smallest product that has an effort and, of a linear actuator, a stroke; None if there is none.

    One whose mass is known comes first.
    """
    fit = [
        each
        for each in PRODUCTS
        if each.unit == unit and each.effort >= effort and (unit == "N m" or each.strokes[1] >= travel)
    ]
    return min(fit, key=lambda each: bool(np.isnan(each.mass)), default=None)


@checked
def parts_list(
    mechanism: Device | Mechanism,
    found: Workspace,
    rate: float = np.radians(30.0),
    drive_mass: float | None = None,
) -> StudyTable:
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
    drive_mass : float, optional
        Of each drive whose mass is not known, kg.

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
    given = None if drive_mass is None else as_positive("drive_mass", drive_mass)
    rows = [_drive_row(device, limbs, table, k, rate, given) for k in range(len(table["lever"]))]
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


def _drive_row(
    device: Any, limbs: Mechanism | None, table: StudyTable, k: int, rate: float, given: float | None
) -> dict[str, Any]:
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
    product, words, actuator = None, "a drive that only pulls: none in the table of products", drive.actuator
    winds = getattr(drive, "route", None) is not None or (
        actuator is not None and actuator.family == "cable" and actuator.tackle is None
    )
    if winds or actuator is None or not actuator.pulls_only:
        drum, needed = (_DRUM, "N m") if winds else (1.0, unit)
        product = _fitting_product(needed, drum * max(abs(low), abs(high)), long - short)
        words = "none in the table of products" if product is None else _order(product, speed / drum, rate, winds)
    mass = stated or (_NAN if product is None else product.mass)
    if stated:
        words += "; mass as the design states"
    elif given is not None and np.isnan(mass):
        mass, words = given, f"{words}; mass as given"
    return {
        "part": name, "count": 1, "unit": unit, "shortest": short, "longest": long, "effort_from": low,
        "effort_to": high, "speed": speed, "power_W": rate * float(table["moment"][k]), "mass_kg": mass,
        "order": words,
    }  # fmt: skip


def _order(product: _Product, speed: float, rate: float, winds: bool) -> str:
    """A product, what is not stated of it, and how slow it makes the arm."""
    lacking = [what for what, value in (("speed", product.speed), ("mass", product.mass)) if np.isnan(value)]
    texts = [f"{product.name} with a drum of {2e3 * _DRUM:.0f} mm" if winds else product.name]
    if lacking:
        texts.append(f"{' and '.join(lacking)} not stated")
    if product.speed < speed:
        texts.append(f"turns the arm at {np.degrees(rate * product.speed / speed):.1f}°/s at most")
    return f"{'; '.join(texts)} [{product.source}]"


@checked
def with_drive_masses(mechanism: Mechanism, masses: ArrayLike) -> Mechanism:
    """A design of limbs whose drives have mass, so that all answers count it.

    Parameters
    ----------
    mechanism : Mechanism
        With limbs whose stroke and actuator are known.
    masses : array_like
        Shape (n,), kg, of the drive of each limb; NaN leaves a limb as it is.

    Returns
    -------
    Mechanism

    Raises
    ------
    InvalidInput
        If there is not one mass a limb, above zero.
    MissingData
        If a stroke or actuator is not known.

    Notes
    -----
    A linear actuator is a rod with 15 % of the mass and a case, uniform both and as long as the retracted limb; a
    muscle is as long as the shortest limb, half of it on either side. A cable's motor is on the torso, and adds nothing
    to the limb. The shares are assumed.

    Examples
    --------
    >>> from exo_pin.workspace.parts import with_drive_masses
    >>> exo = ep.load("four-linear-actuators-worn")
    >>> heavy = ep.ShoulderExo.from_mechanism(with_drive_masses(exo.mechanism, [0.325] * 4))
    >>> light, more = (each.reaction(each.pose(flexion=60), split="minimal").magnitude for each in (exo, heavy))
    >>> bool(more > light)  # N
    True
    """
    require_type("mechanism", mechanism, Mechanism, "a Mechanism")
    given = np.asarray(as_real("masses", masses))
    if given.shape != (mechanism.limb_count,) or (given <= 0.0).any() or np.isinf(given).any():
        raise InvalidInput(f"expected {mechanism.limb_count} masses of drives above zero, kg, got {given.tolist()}")
    limbs = []
    for k, (limb, mass) in enumerate(zip(mechanism.limbs, given.tolist(), strict=True)):
        stroke, actuator = limb.stroke, limb.actuator
        if stroke is None or stroke.end_fitting is None or actuator is None:
            raise MissingData([f"limbs[{k}].stroke and actuator"], "masses of drives", mechanism.name)
        if np.isnan(mass) or actuator.family == "cable":
            limbs.append(limb)
            continue
        length = stroke.nominal_length * stroke.shortest + stroke.end_fitting
        share, part = (_ROD, 1.0) if actuator.family == "linear" else (0.5, 0.5)
        base, platform = (
            LimbBody.rod(own * mass, part * length, LIMB_RADII[actuator.family]) for own in (1.0 - share, share)
        )
        limbs.append(replace(limb, base_body=base, platform_body=platform))
    return mechanism.replace(limbs=limbs)


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
    count = int((table["unit"] != "").sum())
    without = f", without {unknown} of {count} drives, whose mass is not known" if unknown else ""
    words = f"Mass of these parts: {np.nansum(known):.2f} kg{without}."
    limbs = as_device(mechanism).accelerate("workspace")
    if limbs is None:
        words += " Links that the design states may hold the drives' mass already."
    else:
        light = "limbs and drives weigh nothing, and " if limbs.limbs_are_massless else ""
        words += f" In answers {light}the torso carries the frame."
    return "\n".join([*aligned(rows, words=1), filled(words)])


def _cell(value: float, digits: int = 0) -> str:
    return "-" if np.isnan(value) else f"{round(value, digits) + 0.0:.{digits}f}"
