"""Designs with other values of their parameters; see :mod:`.names`."""

from __future__ import annotations

from collections.abc import Iterable, Iterator, Mapping
from dataclasses import replace
from typing import Any

import numpy as np
from numpy.typing import ArrayLike
from scipy.spatial.transform import Rotation

from ...core.conventions import MIRROR
from ...core.errors import InvalidInput, MissingData
from ...core.validation import FloatArray, as_finite, as_positive
from ..actuator import Actuator
from ..actuator_families import stroke_of_length
from ..arm import Arm
from ..geometry import WristGeometry
from ..limb import Limb
from ..mechanism import Mechanism
from ..wearer import Wearer
from .names import ANGLES, JOINTS, DesignParameter, parameter

_CIRCLES = ("r_A", "r_B", "h_A", "h_B")
_ON_CIRCLES = {*_CIRCLES, *ANGLES}
_ACTUATOR = ("pull_limit", "push_limit", "least_tension", "travel_limit")
#: A value of one limb (an index from 0) or, with None, of the whole device.
_Values = dict[tuple[str, int | None], Any]


def worn_by(mechanism: Any, person: Any) -> Any:
    """The device on a person's arm: what the device itself moves is kept, another person's arm is not.

    Parameters
    ----------
    mechanism : Mechanism
        The device.
    person : Arm or Wearer
        A left arm, as :meth:`Arm.from_anthropometry` makes it, or whose it is (a Person, too); it is mirrored for a
        right-sided design.
    """
    if not isinstance(person, Arm | Wearer):
        raise InvalidInput(f"expected person to be an Arm, a Wearer or a Person, got {type(person).__name__}")
    own = person if isinstance(person, Arm) else Arm.of_wearer(person)
    return mechanism.replace(arm=(own if mechanism.side == "left" else own.mirrored()).with_device_of(mechanism.arm))


def check_parameters(mechanism: Mechanism, parameters: Iterable[DesignParameter]) -> None:
    """Check that a design has these parameters, and that all of them can be changed together.

    Raises
    ------
    InvalidInput
        If it has no such limb, its joints are not on circles, or circles and single joints are meant both.
    """
    keys = set()
    for named in parameters:
        keys.add(named.key)
        if named.limb is not None and not 1 <= named.limb <= mechanism.limb_count:
            raise InvalidInput(f"expected a limb from 1 to {mechanism.limb_count} in {named.name!r}")
        if named.key in _ON_CIRCLES and mechanism.geometry.circles is None:
            raise InvalidInput(f"{named.name} needs joints on circles; vary A[i] and B[i] of this design")
    if keys & _ON_CIRCLES and any("." in key for key in keys):
        raise InvalidInput("expected variables of circles or of single joints, got both")


def value_of(mechanism: Mechanism, named: DesignParameter) -> float | None:
    """Value of a dimension of a design, SI; of several limbs the mean; None where it is not known."""
    check_parameters(mechanism, (named,))
    limbs = range(mechanism.limb_count) if named.limb is None else (named.limb - 1,)
    key, geometry = named.key, mechanism.geometry
    if key == "scale":
        return 1.0
    if key == "cuff_height":
        return -float(geometry.platform_points[:, 2].mean())
    if key in _CIRCLES:
        return float(getattr(geometry.circles, key))
    if key in ANGLES and named.limb is not None:
        angles = getattr(geometry.circles, "alpha_A" if key == "alpha" else key)
        return float(np.mean(angles[list(limbs)]))
    end, _, part = key.partition(".")
    if part:
        points = (geometry.base_points if end == "A" else geometry.platform_points) * _outward(mechanism.side)
        return float(np.mean([_of_joint(points[i], end)[part] for i in limbs]))
    if key not in ("nominal_length", "end_fitting"):
        raise InvalidInput(f"expected a dimension of joints or strokes, got {named.name!r}; ep.sweep varies others")
    values = [getattr(mechanism.limbs[i].stroke, key, None) for i in limbs]
    return None if None in values else float(np.mean(values))  # type: ignore[arg-type]


def dimensions_of(mechanism: Mechanism) -> dict[str, float]:
    """Values of the dimensions that may be changed together, SI, by names that end in their units."""
    names: list[str] = []
    for i in range(1, mechanism.limb_count + 1):
        if mechanism.geometry.circles is None:
            names += [f"{end}[{i}].{part}" for end in JOINTS for part in JOINTS[end]]
        else:
            names += [*(_CIRCLES if i == 1 else ()), f"alpha_A[{i}]", f"alpha_B[{i}]"]
        names += [f"nominal_length[{i}]", f"end_fitting[{i}]"]
    values = {named.full_name: value_of(mechanism, named) for named in map(parameter, names)}
    return {name: value for name, value in values.items() if value is not None}


def with_values(
    mechanism: Mechanism, values: Mapping[DesignParameter, Any], payload_at: ArrayLike | None = None
) -> Mechanism:
    """A design with other values of its parameters, in whatever order they are named.

    Parameters
    ----------
    mechanism : Mechanism
        The design to start from.
    values : mapping of DesignParameter to value
        In SI units.
    payload_at : array_like, optional
        Shape (3,), m, in the arm frame: where ``payload`` is held.

    Raises
    ------
    InvalidInput
        If the design has no such parameter, a value does not fit, circles and single joints are changed both, or a
        payload has no place.
    MissingData
        If a limb has no actuator or stroke that could be changed.
    """
    check_parameters(mechanism, values)
    given = dict(_by_limb(values, mechanism.limb_count))
    keys = {key for key, _ in given}
    geometry, limbs = mechanism.geometry, given.get(("limbs", None), mechanism.limbs)
    if "limb_kind" in keys:
        limbs = [replace(limb, kind=given["limb_kind", None]) for limb in limbs]
    if "scale" in keys:
        scale = as_positive("scale", given["scale", None])
        geometry, limbs = _scaled(geometry, scale), [_scaled_limb(limb, scale) for limb in limbs]
    if keys & _ON_CIRCLES:
        geometry = _on_circles(geometry, given)
    if any("." in key for key in keys):
        geometry = _with_joints(geometry, given, mechanism.side)
    if "cuff_height" in keys:
        geometry = _at_height(geometry, float(as_finite("cuff_height", given["cuff_height", None], ())))
    if keys & {"nominal_length", "end_fitting", *_ACTUATOR}:
        limbs = [_with_actuator(limb, i, given, mechanism.name) for i, limb in enumerate(limbs)]
    # What none of the values changes is the same object still, whose sources stay.
    mechanism = mechanism.replace(geometry=geometry, limbs=tuple(limbs))
    return on_wearer(mechanism, {key: value for (key, _), value in given.items()}, payload_at)


def on_wearer(device: Any, values: Mapping[str, Any], payload_at: ArrayLike | None = None) -> Any:
    """A device of any kind on another arm, with another payload, or of a wearer who leans.

    Parameters
    ----------
    device : Device or Mechanism
        The device to start from.
    values : mapping
        By the names of :data:`~exo_pin.design.parameters.names.OF_WEARER`, SI; others are left out.
    payload_at : array_like, optional
        As of :func:`with_values`.
    """
    changed = {name: values[name] for name in ("arm", "gravity") if name in values}
    device = device.replace(**changed) if changed else device
    if "person" in values:
        device = worn_by(device, values["person"])
    if "payload" in values:
        device = _loaded(device, values["payload"], payload_at)
    for name, axis, sign in (("lean_forward", "y", 1.0), ("lean_left", "x", -1.0)):
        if name in values:
            turn = Rotation.from_euler(axis, sign * float(as_finite(name, values[name], ())))
            device = device.replace(gravity=turn.inv().apply(np.array(device.gravity)))
    return device


def _by_limb(values: Mapping[DesignParameter, Any], limb_count: int) -> Iterator[tuple[tuple[str, int | None], Any]]:
    """Values by key and limb; one of every limb stands for each of them, and comes before one of a single limb."""
    for named, value in sorted(values.items(), key=lambda item: item[0].limb is not None):
        if named.limb is not None:
            yield (named.key, named.limb - 1), value
        elif "." in named.key or named.key in ("nominal_length", "end_fitting", *_ACTUATOR):
            for i in range(limb_count):
                yield (named.key, i), value
        else:
            yield (named.key, None), value


def _loaded(device: Any, mass: Any, place: ArrayLike | None) -> Any:
    if place is None:
        raise InvalidInput("a payload needs payload_at, the place in the arm frame where it is held, m")
    kilograms, hand = as_positive("payload", mass, zero=True), as_finite("payload_at", place, (3,))
    if kilograms == 0.0:
        return device
    return device.replace(arm=device.require_arm("a payload") + Arm(kilograms, hand, np.zeros((3, 3))))


def _scaled(geometry: WristGeometry, scale: float) -> WristGeometry:
    circles = geometry.circles
    if circles is not None:
        return geometry.replace(**{name: scale * getattr(circles, name) for name in _CIRCLES})
    return geometry.replace(base_points=scale * geometry.base_points, platform_points=scale * geometry.platform_points)


def _scaled_limb(limb: Limb, scale: float) -> Limb:
    """The limb with an actuator that is so many times as long and gives the same forces."""
    stroke, actuator = limb.stroke, limb.actuator
    if stroke is not None:
        fitting = None if stroke.end_fitting is None else scale * stroke.end_fitting
        stroke = replace(stroke, nominal_length=scale * stroke.nominal_length, end_fitting=fitting)
    if actuator is not None:
        travel, tackle = actuator.travel_limit, actuator.tackle
        actuator = replace(
            actuator,
            travel_limit=None if travel is None else scale * travel,
            tackle=None if tackle is None else replace(tackle, muscle_length=scale * tackle.muscle_length),
        )
    return replace(limb, stroke=stroke, actuator=actuator)


def _at_height(geometry: WristGeometry, height: float) -> WristGeometry:
    """The joints on the arm moved along it alike, to this mean distance below the shoulder."""
    circles = geometry.circles
    if circles is not None:
        return geometry.replace(h_B=height)
    points = np.array(geometry.platform_points)
    points[:, 2] -= height + points[:, 2].mean()
    return geometry.replace(platform_points=points)


def _with_actuator(limb: Limb, i: int, given: _Values, name: str) -> Limb:
    """The limb with the stroke and the limits of its actuator that are given."""
    limits = {key: given[key, i] for key in _ACTUATOR if (key, i) in given}
    length, fitting = given.get(("nominal_length", i)), given.get(("end_fitting", i))
    actuator, stroke = limb.actuator, limb.stroke
    if (limits or length is not None) and not isinstance(actuator, Actuator):
        raise MissingData([f"actuator of limb {i + 1}"], "its stroke" if not limits else "its limits", name)
    if limits:
        assert actuator is not None
        actuator = replace(actuator, **limits)
    if length is not None:
        assert actuator is not None
        own = None if stroke is None else stroke.end_fitting
        fitting = own if fitting is None else fitting
        stroke = stroke_of_length(actuator.family, length, fitting, actuator.travel_limit)
    elif fitting is not None:
        if stroke is None:
            raise MissingData([f"stroke of limb {i + 1}"], "its end fitting", name)
        stroke = replace(stroke, end_fitting=fitting)
    return replace(limb, actuator=actuator, stroke=stroke)


def _on_circles(geometry: WristGeometry, given: _Values) -> WristGeometry:
    circles = geometry.circles
    assert circles is not None
    # Both angles are given, because the geometry would change alpha_B with alpha_A where they are equal.
    angles = {half: np.array(getattr(circles, half)) for half in ("alpha_A", "alpha_B")}
    for (key, limb), value in given.items():
        for half in () if key not in ANGLES else angles if key == "alpha" else (key,):
            if limb is None:
                angles[half] = np.array(value)
            else:
                angles[half][limb] = as_finite(f"{key}[{limb + 1}]", value, ())
    return geometry.replace(**{name: given[name, None] for name in _CIRCLES if (name, None) in given}, **angles)


def _of_joint(point: FloatArray, end: str) -> dict[str, float]:
    """Coordinates of a joint centre of the base or the platform, in the order of ``JOINTS``."""
    level, azimuth = float(np.hypot(point[0], point[1])), float(np.arctan2(point[1], point[0]))
    if end == "A":
        elevation = float(np.arctan2(point[2], level))
        return {"radius": float(np.linalg.norm(point)), "azimuth": azimuth, "elevation": elevation}
    return {"radius": level, "azimuth": azimuth, "drop": -float(point[2])}


def _with_joints(geometry: WristGeometry, given: _Values, side: str) -> WristGeometry:
    """The geometry with some joint centres moved, numbers counted outward on each side."""
    outward = _outward(side)
    base, platform = np.array(geometry.base_points) * outward, np.array(geometry.platform_points) * outward

    def moved(end: str, i: int, point: FloatArray) -> list[float]:
        own = _of_joint(point, end)
        return [given.get((f"{end}.{part}", i), own[part]) for part in JOINTS[end]]

    for i in range(geometry.limb_count):
        radius, azimuth, elevation = moved("A", i, base[i])
        level = radius * np.cos(elevation)
        base[i] = level * np.cos(azimuth), level * np.sin(azimuth), radius * np.sin(elevation)
        around, azimuth, drop = moved("B", i, platform[i])
        platform[i] = around * np.cos(azimuth), around * np.sin(azimuth), -drop
    return WristGeometry(base * outward, platform * outward)


def _outward(side: str) -> FloatArray:
    """Factors by which a point of a body's side is one of the left side."""
    return np.ones(3) if side == "left" else np.diag(MIRROR)
