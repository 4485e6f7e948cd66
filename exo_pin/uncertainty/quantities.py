"""What may be uncertain of a device, its wearer and a pose, and the question with it changed.

Names end in the unit of the uncertainty. Beside the parameters of a design (:mod:`exo_pin.design.parameters.names`):

* ``pose_deg``: the arm is turned about any axis. ``offset_mm``: the device's centre lies elsewhere, base and cuff
  together. ``A[i]_mm``, ``B[i]_mm``: the joint of limb i lies elsewhere. ``centre_of_mass_mm``: of all that moves.
  These are balls: a change of that size in any direction.
* Of joints and loops that are no limbs', in the place of the dimensions of a design: ``joint[NAME]_mm``,
  ``loop[NAME]_mm`` and ``point[NAME.k]_mm``, where a joint is on its link, a loop is closed, point k of a route is.
  ``joint_mm`` stands for all joints, and so on.
* ``mass_percent``, ``load_percent``, ``shoulder_stiffness_percent``, ``guides_percent``, ``springs_percent`` (harness,
  cuff and links): more or less of it.
"""

from __future__ import annotations

import re
from collections.abc import Callable, Iterator, Mapping
from dataclasses import replace
from functools import partial
from types import MappingProxyType
from typing import Any, NamedTuple

import numpy as np

from ..core.errors import InvalidInput, UnknownName
from ..core.validation import FloatArray, as_positive
from ..design import Mechanism, WristGeometry
from ..design.parameters.changes import value_of, with_values
from ..design.parameters.names import parameter
from ..device.protocol import Device
from ..device.wrist_device import as_device
from ..load_case import Case
from .device_quantities import DEVICE_UNCERTAINTY, of_all, of_device

#: Assumed uncertainties, to be replaced by what is known of a device and its wearer. The offset is the error of usual
#: estimates of the shoulder's centre; for the shoulder's stiffness no published value was found.
ASSUMED_UNCERTAINTY: Mapping[str, float] = MappingProxyType(
    {
        "offset_mm": 15.0,
        "pose_deg": 2.0,
        "A_mm": 2.0,
        "B_mm": 2.0,
        "mass_percent": 5.0,
        "centre_of_mass_mm": 10.0,
        "load_percent": 5.0,
        "shoulder_stiffness_percent": 50.0,
        "guides_percent": 20.0,
    }
)
_ASSUMED = {**ASSUMED_UNCERTAINTY, **DEVICE_UNCERTAINTY}
OFFSET = "offset_mm"
_JOINT = re.compile(r"([AB]|joint|loop|point)\[([^\]]+)\]_mm", re.ASCII)
#: A question with something changed by a vector, or by a number in an array of one entry, in the quantity's unit.
_Change = Callable[[FloatArray], tuple[Any, Case]]


class _Quantity(NamedTuple):
    """One uncertain quantity.

    Attributes
    ----------
    name : str
        With the unit.
    size : float
        Its uncertainty, in that unit.
    dimensions : int
        3 for a ball, 1 for a number.
    changed : callable
        Takes a change, shape (dimensions,), in the unit, and returns design and case with it.
    """

    name: str
    size: float
    dimensions: int
    changed: _Change


def quantities(
    mechanism: Device | Mechanism, case: Case, given: Mapping[str, float], elastic: bool
) -> Iterator[_Quantity]:
    """What is uncertain of a question: what is assumed where nothing is stated, and what is.

    Parameters
    ----------
    mechanism : Device or Mechanism
        The design.
    case : Case
        Of a single pose.
    given : mapping
        Uncertainties by name; zero leaves a quantity out.
    elastic : bool
        Whether stiffnesses count.

    Raises
    ------
    UnknownName
        If a name is no quantity of the question and no parameter of a design.
    InvalidInput
        If an uncertainty is no number of zero or more.
    """
    sizes = {name: as_positive(f"uncertainty {name}", size, zero=True) for name, size in given.items()}
    for name, size in sizes.items():
        if str(name).endswith("_percent") and size >= 100.0:
            raise InvalidInput(f"expected uncertainty {name} below 100, got {size:g}")
    limbs = as_device(mechanism).accelerate("uncertainty")
    if limbs is None:
        known: dict[str, tuple[int, _Change]] = dict(of_device(as_device(mechanism).as_chain(), case, elastic))
    else:
        known = dict(_known(limbs, case, elastic))
    own = []
    for name in sizes.keys() - known.keys() - {_JOINT.sub(r"\1_mm", name) for name in known}:
        if name in _ASSUMED:
            raise InvalidInput(f"expected no uncertainty {name}: the question has nothing of the kind")
        if limbs is None:
            raise UnknownName("uncertain quantity", name, known)
        own.append(_Quantity(name, sizes[name], 1, _of_design(limbs, case, name, [*known, "A_mm", "B_mm"])))
    for name, (dimensions, changed) in known.items():
        assumed = _ASSUMED[_JOINT.sub(r"\1_mm", name)]
        size = sizes.get(name, sizes.get(_JOINT.sub(r"\1_mm", name), assumed))
        if size > 0.0:
            yield _Quantity(name, size, dimensions, changed)
    yield from own


def _known(mechanism: Mechanism, case: Case, elastic: bool) -> Iterator[tuple[str, tuple[int, _Change]]]:
    """Quantities of the question that are no parameters of a design."""
    geometry = mechanism.geometry

    def moved_end(end: str, limb: int, step: FloatArray) -> tuple[Mechanism, Case]:
        points = {"A": np.array(geometry.base_points), "B": np.array(geometry.platform_points)}
        points[end][limb] += 1e-3 * step
        return mechanism.replace(geometry=WristGeometry(points["A"], points["B"])), case

    def guided(step: FloatArray) -> tuple[Mechanism, Case]:
        more = 1.0 + 1e-2 * float(step[0])
        limbs = [replace(limb, guide=limb.guide and limb.guide.times(more)) for limb in mechanism.limbs]
        return mechanism.replace(limbs=tuple(limbs)), case

    yield from of_all(mechanism, case, elastic)
    for end in "AB":
        for limb in range(geometry.limb_count):
            yield f"{end}[{limb + 1}]_mm", (3, partial(moved_end, end, limb))
    if elastic and any(limb.guide is not None for limb in mechanism.limbs):
        yield "guides_percent", (1, guided)


def _of_design(mechanism: Mechanism, case: Case, name: str, others: list[str]) -> _Change:
    """A parameter of the design, changed from its value."""
    try:
        named = parameter(name)
    except UnknownName:
        raise UnknownName("uncertain quantity", name, others, where="or a dimension of the design") from None
    value = value_of(mechanism, named)
    if value is None:
        raise InvalidInput(f"expected a known dimension, got {name!r}, of which the design has none")

    def changed(step: FloatArray) -> tuple[Mechanism, Case]:
        return with_values(mechanism, {named: value + named.size * float(step[0])}), case

    return changed
