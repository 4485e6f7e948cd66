"""What may be uncertain of a device, its wearer and a pose, and the question with it changed.

Names end in the unit of the uncertainty. Beside the dimensions of the device, as sweeps name them
(:mod:`exo_pin.design.parameters.names`, :mod:`exo_pin.device.dimensions`):

* ``pose_deg``: the arm is turned about any axis. ``lean_deg``: the trunk leans against gravity, about any axis.
  ``offset_mm``: the device's centre lies elsewhere, base and cuff together. ``centre_of_mass_mm``: of all that moves.
  ``A[i]_mm``, ``B[i]_mm``: the joint of limb i, of a wrist or of the roles of a chain, lies elsewhere;
  ``joint[NAME]_mm``, ``end_b[NAME]_mm``, ``spring[NAME,k]_mm``, ``cable[NAME,k]_mm``: of any other device, where a
  joint is on its link, a loop is closed, a point of a route is. ``A_mm``, ``joint_mm``, ... stand for all of them.
  These are balls: a change of that size in any direction.
* ``mass_percent``, ``load_percent``, ``shoulder_stiffness_percent``, ``guides_percent``, ``springs_percent`` (harness,
  cuff and links, all of them alike): more or less of it.
"""

from __future__ import annotations

import re
from collections.abc import Callable, Iterator, Mapping
from dataclasses import replace
from functools import partial, reduce
from operator import add
from types import MappingProxyType
from typing import Any, NamedTuple

import numpy as np
from scipy.spatial.transform import Rotation

from ..core.errors import InvalidInput, UnknownName
from ..core.validation import FloatArray, as_positive
from ..design import Arm, Interface, Interfaces, Mechanism
from ..device.postures import nearest_reached
from ..device.protocol import Device
from ..device.wrist_device import as_device
from ..load_case import Case, CentreOffset

#: Assumed uncertainties, to be replaced by what is known of a device and its wearer. The offset is the error of usual
#: estimates of the shoulder's centre; for the shoulder's stiffness no published value was found.
ASSUMED_UNCERTAINTY: Mapping[str, float] = MappingProxyType(
    {
        "offset_mm": 15.0,
        "pose_deg": 2.0,
        "lean_deg": 0.0,
        **dict.fromkeys(("A_mm", "B_mm", "joint_mm", "end_b_mm", "spring_mm", "cable_mm"), 2.0),
        "mass_percent": 5.0,
        "centre_of_mass_mm": 10.0,
        "load_percent": 5.0,
        "shoulder_stiffness_percent": 50.0,
        "springs_percent": 50.0,
        "guides_percent": 20.0,
    }
)
OFFSET = "offset_mm"
_PLACE = re.compile(r"(A|B|joint|end_b|spring|cable)\[([^\]]+)\]_mm", re.ASCII)
#: A question with something changed by a vector, or by a number in an array of one entry, in the quantity's unit.
_Change = Callable[[FloatArray], tuple[Any, Case]]
_Known = Iterator[tuple[str, tuple[int, _Change]]]


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
    """What is uncertain of a question: what is assumed where nothing is stated, and what is; with size 0 what is not.

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
    device = as_device(mechanism)
    known = dict(_known(device, case, elastic))
    own = []
    for name in sizes.keys() - known.keys() - {_PLACE.sub(r"\1_mm", name) for name in known}:
        if name in ASSUMED_UNCERTAINTY:
            if not sizes[name]:
                continue  # what is not there is certain
            raise InvalidInput(f"expected no uncertainty {name}: the question has nothing of the kind")
        own.append(_Quantity(name, sizes[name], 1, _of_dimension(device, case, name, known)))
    for name, (dimensions, changed) in known.items():
        each = _PLACE.sub(r"\1_mm", name)
        size = sizes.get(name, sizes.get(each, ASSUMED_UNCERTAINTY[each]))
        yield _Quantity(name, size, dimensions, changed)
    yield from own


def _known(device: Device, case: Case, elastic: bool) -> _Known:
    """Quantities of a question that are no dimensions of the device."""
    arm, load = device.require_arm("its uncertainty"), case.load
    offset = case.offset or CentreOffset.together(np.zeros(3))

    def shifted(step: FloatArray) -> tuple[Device, Case]:
        there = CentreOffset(offset.base + 1e-3 * step, offset.cuff + 1e-3 * step)
        return device, replace(case, centre_offset=there)

    def turned(step: FloatArray) -> tuple[Device, Case]:
        pose = Rotation.from_rotvec(step, degrees=True) * case.poses
        # An arm that its device turns about fewer than three axes is where the device can bring it.
        own = nearest_reached(device.as_chain(), pose) if device.accelerate("uncertainty") is None else None
        return device, replace(case, poses=pose if own is None else own)

    def leant(step: FloatArray) -> tuple[Device, Case]:
        return device.replace(gravity=Rotation.from_rotvec(step, degrees=True).as_matrix() @ device.gravity), case

    def heavier(step: FloatArray) -> tuple[Device, Case]:
        def own(part: Arm) -> Arm:
            inertia = None if part.inertia is None else _factor(step) * part.inertia
            return replace(part, mass=_factor(step) * part.mass, inertia=inertia)

        return device.replace(arm=_of_parts(arm, own)), case

    def moved(step: FloatArray) -> tuple[Device, Case]:
        def own(part: Arm) -> Arm:
            return replace(part, centre_of_mass=part.centre_of_mass + 1e-3 * step)

        return device.replace(arm=_of_parts(arm, own)), case

    def placed(name: str, point: FloatArray, step: FloatArray) -> tuple[Device, Case]:
        return device.with_place(name, point + 1e-3 * step), case

    yield OFFSET, (3, shifted)
    yield "pose_deg", (3, turned)
    yield "lean_deg", (3, leant)
    for name, point in device.places().items():
        yield f"{name}_mm", (3, partial(placed, name, point))
    yield "mass_percent", (1, heavier)
    yield "centre_of_mass_mm", (3, moved)
    if load is not None:

        def loaded(step: FloatArray) -> tuple[Device, Case]:
            more = _factor(step)
            return device, replace(
                case, load=replace(load, force=more * load.force, moment=more * np.asarray(load.moment))
            )

        yield "load_percent", (1, loaded)
    if elastic:
        yield from _stiffnesses(device, case)


def _factor(step: FloatArray) -> float:
    return 1.0 + 1e-2 * float(step[0])


def _stiffnesses(device: Device, case: Case) -> _Known:
    shoulder, soft = device.shoulder, device.interfaces

    def shoulder_times(step: FloatArray) -> tuple[Device, Case]:
        more = _factor(step) * np.asarray(shoulder.stiffness)
        return device.replace(shoulder=replace(shoulder, stiffness=more)), case

    def springs_times(step: FloatArray) -> tuple[Device, Case]:
        more = _factor(step)

        def own(spring: Interface | None) -> Interface | None:
            return spring and replace(spring, stiffness=more * spring.stiffness)

        softer = device.stiffened("links", more) or device
        return softer.replace(interfaces=Interfaces(own(soft.harness), own(soft.cuff), soft.cuff_area)), case

    if shoulder.stiffness is not None:
        yield "shoulder_stiffness_percent", (1, shoulder_times)
    if not soft.are_rigid or device.stiffened("links", 1.0) is not None:
        yield "springs_percent", (1, springs_times)
    if device.stiffened("guides", 1.0) is not None:
        yield "guides_percent", (1, lambda step: (device.stiffened("guides", _factor(step)), case))


def _of_dimension(device: Device, case: Case, name: str, known: Mapping[str, Any]) -> _Change:
    """A dimension of the device, changed from its value."""
    try:
        (named,) = device.parameters([name])
    except UnknownName:
        others = [*known, *{_PLACE.sub(r"\1_mm", each) for each in known}]
        raise UnknownName("uncertain quantity or dimension", name, set(others)) from None
    value = device.value_of(named)
    if value is None:
        raise InvalidInput(f"expected a known dimension, got {name!r}, of which the design has none")

    def changed(step: FloatArray) -> tuple[Device, Case]:
        return device.with_values({named: value + named.size * float(step[0])}), case

    return changed


def _of_parts(arm: Arm, changed: Callable[[Arm], Arm]) -> Arm:
    return reduce(add, [changed(part) for part in arm.parts])
