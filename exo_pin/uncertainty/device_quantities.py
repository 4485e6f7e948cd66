"""What may be uncertain of a device, by its chain; see :mod:`exo_pin.uncertainty.quantities`.

Places of joints and loops count where the rows of the loops are independent: links of a device with redundant ones fit
together as they are drawn, and not otherwise. Of a limb among the roles these are its ends A_i and B_i.
"""

from __future__ import annotations

from collections.abc import Callable, Iterator, Mapping
from dataclasses import replace
from functools import partial
from types import MappingProxyType
from typing import Any

import numpy as np
from scipy.spatial.transform import Rotation

from ..chain.structure.closures import Closure
from ..chain.variants import with_joint
from ..core.validation import FloatArray
from ..design import Interface, Interfaces
from ..device import ChainDevice, Drive, SoftLink, Spring
from ..load_case import Case, CentreOffset
from .arm_changes import heavier, moved

#: Assumed uncertainties of places and springs, beside those of :mod:`exo_pin.uncertainty.quantities`.
DEVICE_UNCERTAINTY: Mapping[str, float] = MappingProxyType(
    {"joint_mm": 2.0, "loop_mm": 2.0, "point_mm": 2.0, "springs_percent": 50.0}
)
#: A device and a case with something changed by a vector.
_Changed = tuple[ChainDevice, Case]
_Known = tuple[str, tuple[int, Callable[[FloatArray], _Changed]]]


def of_device(device: ChainDevice, case: Case, elastic: bool) -> Iterator[_Known]:
    """Name, dimensions and change of all that is uncertain of a device in a case of one pose."""
    yield from of_all(device, case, elastic, device.soft_links)
    if places_count(device):
        yield from _of_loops(device, case)
    for key in ("drives", "springs"):
        for part in getattr(device, key):
            for point in range(0 if part.route is None else len(part.route.points)):
                yield f"point[{part.name}.{point + 1}]_mm", (3, partial(_moved_point, device, case, key, part, point))
    if elastic and any(limb.guide is not None for limb in device.guided_slides):
        yield "guides_percent", (1, partial(_stiffer_guides, device, case))


def of_all(device: Any, case: Case, elastic: bool, soft_links: tuple[SoftLink, ...] = ()) -> Iterator[_Known]:
    """What is uncertain of a device of any kind: case, arm, and stiffness of shoulder, harness, cuff and links."""
    yield from _of_case(device, case)
    yield from _of_arm(device, case)
    if elastic and device.shoulder.stiffness is not None:
        yield "shoulder_stiffness_percent", (1, partial(_stiffer_shoulder, device, case))
    if elastic and (soft_links or not device.interfaces.are_rigid):
        yield "springs_percent", (1, partial(_stiffer, device, case, soft_links))


def places_count(device: ChainDevice) -> bool:
    """Whether places of joints and loops count: the rows of the loops are independent."""
    return device.structure.self_stresses == 0


def _of_loops(device: ChainDevice, case: Case) -> Iterator[_Known]:
    state, limbs = device.chain._state, device.chain.roles.limbs
    ends = {limb.platform_joint: f"B[{i}]_mm" for i, limb in enumerate(limbs, 1)}
    ends |= {limb.closure: f"A[{i}]_mm" for i, limb in enumerate(limbs, 1)}
    starts = {state.model.getJointId(limb.platform_joint) for limb in limbs}
    for index, name in enumerate(state.model.names):
        between = starts & set(list(state.model.supports[index])[:-1])
        if index not in (0, device.arm_index) and not between:
            yield ends.get(name, f"joint[{name}]_mm"), (3, partial(_moved_joint, device, case, index))
    for closure in device.chain.description.closures:
        if closure.polynomial is None:
            yield ends.get(closure.name, f"loop[{closure.name}]_mm"), (3, partial(_moved_loop, device, case, closure))


def _of_case(device: Any, case: Case) -> Iterator[_Known]:
    offset, load = case.offset or CentreOffset.together(np.zeros(3)), case.load

    def shifted(step: FloatArray) -> _Changed:
        return device, replace(case, centre_offset=CentreOffset(offset.base + 1e-3 * step, offset.cuff + 1e-3 * step))

    def turned(step: FloatArray) -> _Changed:
        return device, replace(case, poses=Rotation.from_rotvec(step, degrees=True) * case.poses)

    yield "offset_mm", (3, shifted)
    yield "pose_deg", (3, turned)
    if load is not None:

        def loaded(step: FloatArray) -> _Changed:
            more = _factor(step)
            own = replace(load, force=more * load.force, moment=more * np.asarray(load.moment))
            return device, replace(case, load=own)

        yield "load_percent", (1, loaded)


def _of_arm(device: Any, case: Case) -> Iterator[_Known]:
    arm = device.require_arm("its uncertainty")

    def more(step: FloatArray) -> _Changed:
        return device.replace(arm=heavier(arm, _factor(step))), case

    def balanced(step: FloatArray) -> _Changed:
        return device.replace(arm=moved(arm, 1e-3 * step)), case

    yield "mass_percent", (1, more)
    yield "centre_of_mass_mm", (3, balanced)


def _factor(step: FloatArray) -> float:
    return 1.0 + 1e-2 * float(step[0])


def _moved_joint(device: ChainDevice, case: Case, index: int, step: FloatArray) -> _Changed:
    state, arm = device.chain._state, device.arm_index
    model = with_joint(state, arm, state.model.joints[arm], moved={index: 1e-3 * step})
    return device.replace(chain=type(device.chain)(model, device.chain.description)), case


def _moved_loop(device: ChainDevice, case: Case, closure: Closure, step: FloatArray) -> _Changed:
    chain = device.chain
    end = closure.placement_b
    moved = replace(end, translation=tuple((np.array(end.translation) + 1e-3 * step).tolist()))
    closures = tuple(replace(own, placement_b=moved) if own is closure else own for own in chain.description.closures)
    own = type(chain)(chain.model, replace(chain.description, closures=closures))
    return device.replace(chain=own), case


def _moved_point(
    device: ChainDevice, case: Case, key: str, part: Drive | Spring, point: int, step: FloatArray
) -> _Changed:
    assert part.route is not None
    points = list(part.route.points)
    points[point] = replace(points[point], point=tuple((np.array(points[point].point) + 1e-3 * step).tolist()))
    own = replace(part, route=replace(part.route, points=tuple(points)))
    changed: Any = {key: tuple(own if each is part else each for each in getattr(device, key))}
    return device.replace(**changed), case


def _stiffer_shoulder(device: Any, case: Case, step: FloatArray) -> _Changed:
    more = _factor(step) * np.asarray(device.shoulder.stiffness)
    return device.replace(shoulder=replace(device.shoulder, stiffness=more)), case


def _stiffer_guides(device: ChainDevice, case: Case, step: FloatArray) -> _Changed:
    limbs = [replace(own, guide=own.guide and own.guide.times(_factor(step))) for own in device.guided_slides]
    return device.replace(guided_slides=tuple(limbs)), case


def _stiffer(device: Any, case: Case, soft_links: tuple[SoftLink, ...], step: FloatArray) -> _Changed:
    """Harness, cuff and links, all of them alike."""

    def own(spring: Interface) -> Interface:
        return replace(spring, stiffness=_factor(step) * spring.stiffness)

    harness, cuff = (part and own(part) for part in (device.interfaces.harness, device.interfaces.cuff))
    links = tuple(SoftLink(link.link, own(link.spring)) for link in soft_links)
    more = {"soft_links": links} if links else {}
    return device.replace(interfaces=Interfaces(harness, cuff, device.interfaces.cuff_area), **more), case
