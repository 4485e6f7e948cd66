"""Names of parameters, their units, and their values and bounds as numbers or as text.

A name is in SI units and rad, or ends in its unit: ``r_A`` is in m, ``r_A_mm`` in mm. ``[i]`` is a limb, counted from
1; without it the value is that of every limb.

* ``r_A``, ``r_B``, ``h_A``, ``h_B``, ``alpha[i]`` (both circles), ``alpha_A[i]``, ``alpha_B[i]``: joints on circles,
  (4-2). Without ``[i]`` an angle stands for one number a limb.
* ``A[i].radius``, ``A[i].azimuth``, ``A[i].elevation``: joint on the torso by its distance from the shoulder centre,
  the direction of its projection (0 forward, 90° outward) and its angle above the horizontal plane through O.
  ``B[i].radius``, ``B[i].azimuth``, ``B[i].drop``: joint on the arm by its distance from the arm's axis, the
  direction in which it lies from it (0 forward, 90° outward in the hanging arm) and how far below the shoulder it is.
  On a right shoulder outward is to the right, so that one set of values describes mirror images.
* ``cuff_height``: how far below the shoulder the joints on the arm lie in the mean; all move along the arm alike.
* ``scale``: size of the device as a share of what it is: joint centres, lengths of its actuators and their travels.
  Masses, forces and stiffnesses stay.
* ``nominal_length[i]``: of the actuator: a muscle at rest, a cable let out, a linear actuator extended. Its stroke is
  that of its family. ``end_fitting[i]``: what the joint-to-joint length has on top of it.
* ``pull_limit[i]``, ``push_limit[i]``, ``least_tension[i]``, ``travel_limit[i]``: of the actuator.
* ``limbs``, ``limb_kind`` (UPU or SPS).
* Of any device: ``arm``, ``person`` (keeps what the device moves), ``payload`` (a point mass), ``gravity``,
  ``lean_forward``, ``lean_left`` (of the trunk).

Those of a device that is no wrist are, besides, its dimensions: see :mod:`exo_pin.device.dimensions`.
"""

from __future__ import annotations

import math
import re
from collections.abc import Iterable, Mapping
from dataclasses import dataclass
from typing import Any

import numpy as np

from ...core.errors import InvalidInput, UnknownName
from ...core.errors.base import echo
from ...core.records import Record
from ...core.validation import as_finite

#: Units by the kind of a parameter, the SI unit first, with their SI values.
_UNITS: Mapping[str, Mapping[str, float]] = {
    "length": {"m": 1.0, "mm": 1e-3},
    "angle": {"rad": 1.0, "deg": math.pi / 180.0},
    "force": {"N": 1.0},
    "mass": {"kg": 1.0},
    "acceleration": {"m_s2": 1.0},
    "number": {},
    "record": {},
}
ANGLES = ("alpha", "alpha_A", "alpha_B")
#: Coordinates of a joint on the torso (A) and on the arm (B), and their kinds.
JOINTS = {
    "A": {"radius": "length", "azimuth": "angle", "elevation": "angle"},
    "B": {"radius": "length", "azimuth": "angle", "drop": "length"},
}
#: Parameters of one limb or of all, and their kinds.
_OF_LIMBS = {
    **dict.fromkeys(ANGLES, "angle"),
    **{f"{joint}.{part}": kind for joint, parts in JOINTS.items() for part, kind in parts.items()},
    **dict.fromkeys(("nominal_length", "end_fitting", "travel_limit"), "length"),
    **dict.fromkeys(("pull_limit", "push_limit", "least_tension"), "force"),
}
#: Kinds of the parameters of whom and what any device carries, and how its wearer stands.
OF_WEARER = {
    **dict.fromkeys(("arm", "person", "payload"), "mass"),
    "gravity": "acceleration",
    **dict.fromkeys(("lean_forward", "lean_left"), "angle"),
}
#: Kind of every parameter of a wrist.
PARAMETERS = {
    **dict.fromkeys(("r_A", "r_B", "h_A", "h_B", "cuff_height"), "length"),
    **_OF_LIMBS,
    "scale": "number",
    **dict.fromkeys(("limbs", "limb_kind"), "record"),
    **OF_WEARER,
}
#: Those whose values are objects or vectors, which no text stands for.
_OBJECTS = ("limbs", "arm", "person", "gravity")
_NAME = re.compile(r"(\w+?)(?:\[(\d{1,6})\])?(?:\.([a-z]+))?(?:_(mm|m_s2|m|rad|deg|N|kg))?", re.ASCII)
#: Most values of a range.
_MOST = 10_000


@dataclass(frozen=True)
class DesignParameter(Record):
    """A parameter as it was named.

    Attributes
    ----------
    name : str
        As given, such as ``"A[2].radius_mm"``.
    key : str
        Of :data:`PARAMETERS`, such as ``"A.radius"``; of a dimension of a chain its own name.
    limb : int or None
        Number of the limb from 1; None for all, or where it belongs to no limb.
    unit : str
        As given; "" for SI.
    kind : str
        "length", "angle", "force", "mass", "acceleration", "number" or "record".
    """

    name: str
    key: str
    limb: int | None
    unit: str
    kind: str

    @property
    def size(self) -> float:
        """SI value of the unit."""
        return _UNITS[self.kind].get(self.unit, 1.0)

    @property
    def si_name(self) -> str:
        """The name without its unit."""
        return self.name.removesuffix(f"_{self.unit}")

    @property
    def full_name(self) -> str:
        """The name with its unit, also where that is SI's."""
        unit = self.unit or next(iter(_UNITS[self.kind]), "")
        return f"{self.si_name}_{unit}" if unit else self.name

    def in_si(self, value: Any) -> Any:
        """A value in the parameter's unit in SI; what is no number stays as it is."""
        try:
            return value if self.size == 1.0 else self.size * np.asarray(value, dtype=np.float64)
        except (TypeError, ValueError, OverflowError):
            return value


def parameter(name: Any) -> DesignParameter:
    """The parameter of a name.

    Raises
    ------
    UnknownName
        If there is none; the message lists them.
    InvalidInput
        If it has no such unit, or belongs to no limb.
    """
    match = _NAME.fullmatch(name) if isinstance(name, str) else None
    head, limb, part, unit = match.groups(default="") if match else ("", "", "", "")
    key = f"{head}.{part}" if part else head
    if key not in PARAMETERS:
        # A limb that is named stays named in what is proposed instead.
        raise UnknownName("parameter", name, (_listed(each) for each in PARAMETERS))
    units = _UNITS[PARAMETERS[key]]
    if unit and unit not in units:
        raise InvalidInput(f"expected {key} in {' or '.join(units) or 'no unit'}, got {name!r}")
    if limb and key not in _OF_LIMBS:
        raise InvalidInput(f"expected {key} without a limb, got {name!r}")
    return DesignParameter(name, key, int(limb) if limb else None, unit, PARAMETERS[key])


def _listed(key: str) -> str:
    head, dot, part = key.partition(".")
    return f"{head}[i]{dot}{part}" if key in _OF_LIMBS else key


def assigned(texts: Iterable[str]) -> dict[str, str]:
    """Names and texts of ``NAME=VALUES``, such as ``"r_A_mm=100:160:4"``.

    Raises
    ------
    InvalidInput
        If a text has not this form, or a name comes twice.
    """
    found: dict[str, str] = {}
    for text in texts:
        name, _, values = text.partition("=")
        if not name or not values:
            raise InvalidInput(f"expected NAME=VALUES such as r_A_mm=100:160:4, got {text!r}")
        if name in found:
            raise InvalidInput(f"expected each parameter once, got {name} twice")
        found[name] = values
    return found


def values_of(named: DesignParameter, given: Any) -> list[Any]:
    """Values of a sweep, in the parameter's unit.

    Parameters
    ----------
    named : DesignParameter
        Of what.
    given : sequence or str
        The values; or as text LOW:HIGH:COUNT (evenly spaced, both ends), or values with commas between.

    Raises
    ------
    InvalidInput
        If there is no value, a text is not of this form, or an angle without a unit looks like degrees.
    """
    if isinstance(given, str):
        return _from_text(named, given)
    values = list(given) if np.iterable(given) else []
    if not values:
        raise InvalidInput(f"expected a sequence of values of {named.name}, got {echo(given)}")
    _question_degrees(named, values)
    return values


def bounds_of(named: DesignParameter, given: Any) -> tuple[float, float]:
    """Bounds of a search, SI.

    Parameters
    ----------
    named : DesignParameter
        Of what.
    given : (float, float) or str
        Lowest and highest in the parameter's unit; or as text LOW:HIGH.

    Raises
    ------
    InvalidInput
        If they are not two finite numbers, the lower one first, or an angle without a unit looks like degrees.
    """
    numbers = _numbers(named, given, ":") if isinstance(given, str) else given
    if isinstance(given, str) and len(numbers) != 2:
        raise InvalidInput(f"expected {named.name} as LOW:HIGH, got {given!r}")
    low, high = as_finite(named.name, numbers, (2,)).tolist()
    if not low < high:
        raise InvalidInput(f"expected bounds of {named.name} as (lowest, highest), got ({low:g}, {high:g})")
    _question_degrees(named, (low, high))
    return named.size * low, named.size * high


def _from_text(named: DesignParameter, text: str) -> list[Any]:
    if named.key == "limb_kind":
        return text.split(",")
    if named.key in _OBJECTS:
        raise InvalidInput(f"expected {named.key} as objects in Python, not as text, got {text!r}")
    if text.count(":") not in (0, 2):
        raise InvalidInput(f"expected {named.name} as LOW:HIGH:COUNT or values with commas between, got {text!r}")
    if ":" in text:
        low, high, count = _numbers(named, text, ":")
        if count != int(count) or not 1 <= count <= _MOST:
            raise InvalidInput(f"expected LOW:HIGH:COUNT with a whole count up to {_MOST}, got {text!r}")
        values = np.linspace(low, high, int(count)).tolist()
    else:
        values = _numbers(named, text, ",")
    _question_degrees(named, values)
    return values


def _numbers(named: DesignParameter, text: str, separator: str) -> list[float]:
    try:
        values = [float(part) for part in text.split(separator)]
    except ValueError:
        values = [math.nan]
    if not all(map(math.isfinite, values)):
        raise InvalidInput(f"expected finite numbers for {named.name}, got {text!r}")
    return values


def _question_degrees(named: DesignParameter, values: Iterable[Any]) -> None:
    """Refuse an angle beyond a turn that was given without a unit."""
    if named.kind != "angle" or named.unit:
        return
    for value in values:
        number = isinstance(value, int | float | np.integer | np.floating)
        if number and 2.0 * math.pi + 1e-9 < abs(value) < math.inf:
            raise InvalidInput(f"expected {named.name} in rad, got {echo(value)} (degrees? then {named.name}_deg)")
