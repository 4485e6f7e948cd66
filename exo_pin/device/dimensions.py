"""Dimensions of a chain by name: places of joints, directions of axes, ends of loops, anchors, laws of springs.

A name ends in its unit: m or mm, rad or deg, else SI. NAME is that of the joint, closure, spring or cable.

* ``joint[NAME].x``, ``.y``, ``.z``: place of a joint in the frame of the joint before it; all that hangs on it moves
  along.
* ``axis[NAME].azimuth``, ``axis[NAME].elevation``: direction of the axis of a hinge or slide in that frame, about z
  from x (0 of an axis along z) and above the xy-plane. The links stay where they are at zero.
* ``end_a[NAME].x``, ..., ``end_b[NAME].x``, ...: ends of a closure in the frames that it joins, such as a joint on the
  torso.
* ``spring[NAME,k].x``, ..., ``cable[NAME,k].x``, ...: the k-th point of a route, from 1, in its link.
* ``law[NAME].stiffness``, ``.slack``, ...: constants of a spring's law.
"""

from __future__ import annotations

import re
from collections.abc import Iterable, Iterator, Mapping
from dataclasses import fields, replace
from typing import TYPE_CHECKING, Any

import numpy as np
import pinocchio as pin
from numpy.typing import ArrayLike

from ..core.errors import InvalidInput, UnknownName
from ..core.validation import FloatArray, as_finite
from ..design.parameters.changes import on_wearer
from ..design.parameters.names import OF_WEARER, DesignParameter, parameter
from .parts.routes import Route

if TYPE_CHECKING:
    from ..chain import ClosedChain
    from .chain_device import ChainDevice


_XYZ = ("x", "y", "z")
#: Units of a dimension by the unit that its own name ends in, and their SI values.
_UNITS = {"m": {"m": 1.0, "mm": 1e-3}, "rad": {"rad": 1.0, "deg": np.pi / 180.0}}
#: Units of the constants of spring laws along a route, and in a hinge.
_LAW_UNITS = {
    "stiffness": ("N_m", "N_m_rad"),
    "slack": ("m", "rad"),
    "value": ("N", "N_m"),
    "extended_force": ("N", "N_m"),
    "extended_length": ("m", "rad"),
    "gas_height": ("m", "rad"),
    "exponent": ("", ""),
}
#: Hinges and slides, by Pinocchio's names of their kinds; a screw is neither.
_AXIAL = re.compile(r"JointModel(R|RUB|P)[XYZ]|JointModel(Revolute|RevoluteUnbounded|Prismatic)Unaligned")
#: Joints about any axis by the number of their coordinates, and along one.
_HINGE = {1: pin.JointModelRevoluteUnaligned, 2: pin.JointModelRevoluteUnboundedUnaligned}
_SLIDE = pin.JointModelPrismaticUnaligned
_NAME = re.compile(r"(joint|axis|end_a|end_b|spring|cable|law)\[([^\]]+)\]\.([a-z_]+)")


def parameters(device: ChainDevice, names: Iterable[Any]) -> tuple[DesignParameter, ...]:
    """Dimensions in any of their units, and whom and what the device carries.

    Parameters
    ----------
    names : iterable of str
        Of :meth:`dimensions`, and ``arm``, ``person``, ``payload``, ``gravity``, ``lean_forward``, ``lean_left``.

    Returns
    -------
    tuple of DesignParameter

    Examples
    --------
    >>> device = ep.load("four-cables").device.as_chain()
    >>> [own.kind for own in device.parameters(["joint[limb_1_slide].z_mm", "payload"])]
    ['length', 'mass']
    """
    known, found = dimensions(device), list[DesignParameter]()
    by_name: dict[Any, DesignParameter] = {}
    for key in known:
        own = key.rsplit("_", 1)[-1]
        stem = key.removesuffix(f"_{own}")
        for unit, size in _UNITS.get(own, {}).items():
            kind = "length" if own == "m" else "angle"
            by_name[f"{stem}_{unit}"] = DesignParameter(f"{stem}_{unit}", key, None, unit, kind)
            if size == 1.0:
                by_name[stem] = DesignParameter(stem, key, None, "", kind)
        # Of the constants of a law the unit belongs to the name.
        by_name.setdefault(key, DesignParameter(key, key, None, "", "number"))
    for name in names:
        if name in by_name:
            found.append(by_name[name])
            continue
        try:
            own_name = parameter(name)
        except UnknownName:
            own_name = None
        if own_name is None or own_name.key not in OF_WEARER:
            raise UnknownName("parameter", name, (*known, *OF_WEARER))
        found.append(own_name)
    return tuple(found)


def value_of(device: ChainDevice, named: DesignParameter) -> float | None:
    """Value of a dimension.

    Parameters
    ----------
    named : DesignParameter
        Of :meth:`parameters`.

    Returns
    -------
    float
        SI.

    Examples
    --------
    >>> device = ep.load("four-cables").device.as_chain()
    >>> round(device.value_of(device.parameters(["joint[limb_1_slide].x_mm"])[0]), 3)  # m
    -0.107
    """
    if named.key in OF_WEARER:
        raise InvalidInput(f"expected a dimension, got {named.name!r}; ep.sweep varies others")
    return dimensions(device)[named.key]


def with_values(
    device: ChainDevice, values: Mapping[DesignParameter, Any], payload_at: ArrayLike | None = None
) -> ChainDevice:
    """The device with other values of its parameters.

    Parameters
    ----------
    values : mapping of DesignParameter to value
        SI.
    payload_at : array_like, optional
        Shape (3,), m, in the arm frame: where a ``payload`` is held.

    Returns
    -------
    ChainDevice

    Examples
    --------
    >>> device = ep.load("four-cables").device.as_chain()
    >>> (payload,) = device.parameters(["payload_kg"])
    >>> round(float(device.with_values({payload: 2.0}, [0.0, 0.0, -0.6]).arm.mass - device.arm.mass), 9)
    2.0
    """
    own = {named: value for named, value in values.items() if named.key not in OF_WEARER}
    changed = _with_dimensions(device, own) if own else device
    return on_wearer(changed, {named.key: value for named, value in values.items()}, payload_at)


def dimensions(device: ChainDevice) -> dict[str, float]:
    """Places and axes of joints, ends of closures, anchors and laws by name.

    Parameters
    ----------
    device : ChainDevice
        The device.

    Returns
    -------
    dict of str to float
        SI; each name ends in its unit. See :mod:`exo_pin.device.dimensions`.

    Examples
    --------
    >>> round(ep.load("four-cables").device.as_chain().dimensions()["joint[limb_1_slide].x_m"], 3)
    -0.107
    """
    return dict(_all(device))


def with_dimensions(device: ChainDevice, **values: float) -> ChainDevice:
    """The device with other values of some dimensions.

    Parameters
    ----------
    **values
        By the names of :meth:`dimensions`, or with mm and deg in the place of m and rad.

    Returns
    -------
    ChainDevice

    Examples
    --------
    >>> device = ep.load("four-cables").device.as_chain()
    >>> device.with_dimensions(**{"end_b[limb_1_base].z_mm": 250.0}).dimensions()["end_b[limb_1_base].z_m"]
    0.25
    """
    named = parameters(device, values)
    return with_values(device, {own: own.in_si(value) for own, value in zip(named, values.values(), strict=True)})


def _all(device: ChainDevice) -> Iterator[tuple[str, float]]:
    model = device.chain.model
    for index in range(1, model.njoints):
        if index == device.arm_index:
            continue
        name, placement = model.names[index], model.jointPlacements[index]
        yield from _point(f"joint[{name}]", placement.translation)
        if _AXIAL.fullmatch(model.joints[index].shortname()):
            x, y, z = (placement.rotation @ _axis(model, index)).tolist()
            yield f"axis[{name}].azimuth_rad", float(np.arctan2(y, x))
            yield f"axis[{name}].elevation_rad", float(np.arctan2(z, np.hypot(x, y)))
    for closure in device.chain.closures:
        for end in ("a", "b"):
            if closure.polynomial is None:
                yield from _point(f"end_{end}[{closure.name}]", getattr(closure, f"placement_{end}").translation)
    for what, parts in (("spring", device.springs), ("cable", device.drives)):
        for part in parts:
            for number, at in enumerate(() if part.route is None else part.route.points, 1):
                yield from _point(f"{what}[{part.name},{number}]", at.point)
    for spring in device.springs:
        for each in fields(spring.law):  # type: ignore[arg-type]
            if each.name in _LAW_UNITS:
                unit = _LAW_UNITS[each.name][device.unit_of(spring) == "N m"]
                name = f"law[{spring.name}].{each.name}"
                yield f"{name}_{unit}" if unit else name, float(getattr(spring.law, each.name))


def _point(name: str, values: Any) -> Iterator[tuple[str, float]]:
    for axis, value in zip(_XYZ, values, strict=True):
        yield f"{name}.{axis}_m", float(value)


def places(device: ChainDevice) -> dict[str, FloatArray]:
    """Places of joints, ends of closures and points of routes, by the names of their dimensions.

    Joints and closures count where the rows of the loops are independent: links of a device with redundant ones fit
    together as they are drawn, and not otherwise. Of a closure the second end counts, and of a limb among the roles
    its ends, ``"A[1]"``, ... on the torso and ``"B[1]"``, ... on the arm.

    Parameters
    ----------
    device : ChainDevice
        The device.

    Returns
    -------
    dict of str to ndarray
        Shape (3,) each, m.

    Examples
    --------
    >>> device = ep.load("four-cables").device.as_chain()
    >>> list(device.places())[:2]
    ['B[1]', 'B[2]']
    """
    heads = ("joint", "end_b", "spring", "cable") if device.structure.self_stresses == 0 else ("spring", "cable")
    known, found, ends = dimensions(device), dict[str, FloatArray](), _limb_ends(device.chain)
    for key in known:
        name, dot, axis = key.rpartition(".")
        own = ends.get(name, name)
        if dot and axis == "x_m" and name.startswith(heads) and own:
            found[own] = np.array([known[f"{name}.{each}_m"] for each in _XYZ])
    return found


def _limb_ends(chain: ClosedChain) -> dict[str, str]:
    """What a limb among the roles is called: its ends A[i] and B[i]; joints between these are empty, no places."""
    model, found = chain.model, dict[str, str]()
    for i, limb in enumerate(chain.roles.limbs, 1):
        start = model.getJointId(limb.platform_joint)
        for joint in range(start + 1, model.njoints):
            if start in list(model.supports[joint]):
                found[f"joint[{model.names[joint]}]"] = ""
        found |= {f"joint[{limb.platform_joint}]": f"B[{i}]", f"end_b[{limb.closure}]": f"A[{i}]"}
    return found


def with_place(device: ChainDevice, name: str, point: FloatArray) -> ChainDevice:
    """The device with one of these points elsewhere.

    Parameters
    ----------
    name : str
        Of :meth:`places`.
    point : ndarray
        Shape (3,), m.

    Returns
    -------
    ChainDevice

    Examples
    --------
    >>> device = ep.load("four-cables").device.as_chain()
    >>> device.with_place("A[1]", np.array([0.1, 0.0, -0.2])).places()["A[1]"]
    array([ 0.1,  0. , -0.2])
    """
    own = {end: part for part, end in _limb_ends(device.chain).items() if end}.get(name, name)
    named = parameters(device, [f"{own}.{axis}_m" for axis in _XYZ])
    return _with_dimensions(device, dict(zip(named, point.tolist(), strict=True)))


def _with_dimensions(device: ChainDevice, values: Mapping[DesignParameter, float]) -> ChainDevice:
    asked: dict[str, float] = {}
    for named, value in values.items():
        if named.key in asked:
            raise InvalidInput(f"expected each dimension once, got {named.key} twice")
        asked[named.key] = float(as_finite(named.name, value, ()))
    known = dimensions(device)
    groups: dict[tuple[str, str], dict[str, float]] = {}
    for key in asked:
        match = _NAME.match(key)
        assert match is not None
        groups.setdefault((match[1], match[2]), {})
    for head, part in groups:
        prefix = f"{head}[{part}]."
        for key, value in known.items():
            if key.startswith(prefix):
                field = key.removeprefix(prefix)
                groups[head, part][field] = asked.get(key, value)
    changed = _moved_chain(device, groups)
    springs, drives = list(device.springs), list(device.drives)
    for (head, part), own in groups.items():
        name, _, number = part.rpartition(",")
        if head == "spring":
            _route_point(springs, name, int(number), own)
        elif head == "cable":
            _route_point(drives, name, int(number), own)
        elif head == "law":
            k = next(k for k, each in enumerate(springs) if each.name == part)
            law = springs[k].law
            given = {
                each.name: own[key]
                for each in fields(law)  # type: ignore[arg-type]
                for key in own
                if key == each.name or key.removeprefix(f"{each.name}_") in _LAW_UNITS.get(each.name, ())
            }
            springs[k] = replace(springs[k], law=replace(law, **given))  # type: ignore[type-var]
    return device.replace(springs=tuple(springs), drives=tuple(drives), **changed)


def _route_point(parts: list[Any], name: str, number: int, own: Mapping[str, float]) -> None:
    k = next(k for k, each in enumerate(parts) if each.name == name and each.route is not None)
    points = list(parts[k].route.points)
    points[number - 1] = replace(points[number - 1], point=tuple(own[f"{axis}_m"] for axis in _XYZ))
    parts[k] = replace(parts[k], route=Route(tuple(points)))


def _moved_chain(device: ChainDevice, groups: Mapping[tuple[str, str], Mapping[str, float]]) -> dict[str, Any]:
    """The chain with other places and axes of joints and other ends of closures; nothing where none changes."""
    if not any(head in ("joint", "axis", "end_a", "end_b") for head, _ in groups):
        return {}
    chain = device.chain
    model, closures = chain.model.copy(), {each.name: each for each in chain.closures}
    for (head, part), own in groups.items():
        if head == "joint":
            model.jointPlacements[model.getJointId(part)].translation = np.array([own[f"{axis}_m"] for axis in _XYZ])
        elif head == "axis":
            azimuth, elevation = own["azimuth_rad"], own["elevation_rad"]
            level = np.cos(elevation)
            to = np.array([level * np.cos(azimuth), level * np.sin(azimuth), np.sin(elevation)])
            _turn_axis(model, model.getJointId(part), to)
        elif head in ("end_a", "end_b"):
            place = f"placement_{head[-1]}"
            at = replace(getattr(closures[part], place), translation=tuple(own[f"{axis}_m"] for axis in _XYZ))
            closures[part] = replace(closures[part], **{place: at})
    return {"chain": type(chain)(model, replace(chain.description, closures=tuple(closures.values())))}


def _axis(model: pin.Model, index: int) -> FloatArray:
    """Unit vector along the axis of a joint of one coordinate, in its own frame."""
    data = model.joints[index].createData()
    model.joints[index].calc(data, pin.neutral(model)[model.idx_qs[index] :][: model.nqs[index]])
    screw = np.asarray(data.S).reshape(6)
    return np.asarray(screw[:3] + screw[3:])  # one of them is zero


def _turn_axis(model: pin.Model, index: int, to: FloatArray) -> None:
    """Give the axis of a joint another direction in the frame before it; at zero the links stay where they are."""
    joint = model.joints[index]
    kind = _SLIDE if joint.shortname().startswith("JointModelP") else _HINGE[joint.nq]
    turned = pin.JointModel(kind(model.jointPlacements[index].rotation.T @ to))
    turned.setIndexes(index, joint.idx_q, joint.idx_v)
    model.joints[index] = turned
