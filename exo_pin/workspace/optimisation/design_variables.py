"""Dimensions of a design that an optimiser may choose.

Names of variables, limbs counted from 1, all in SI units and rad:

* ``r_A``, ``r_B``, ``h_A``, ``h_B``, ``alpha[i]`` (both circles), ``alpha_A[i]``, ``alpha_B[i]``: joints on circles.
* ``A[i].radius``, ``A[i].azimuth``, ``A[i].elevation``: joint on the torso by its distance from the shoulder centre,
  the direction of its projection (0 forward, π/2 outward) and its angle above the horizontal plane through O.
* ``B[i].radius``, ``B[i].azimuth``, ``B[i].drop``: joint on the arm by its distance from the arm's axis, the direction
  in which it lies from it (0 forward, π/2 outward in the hanging arm) and how far below the shoulder it is.
* ``nominal_length[i]``: of the actuator: a muscle at rest, a cable let out, a linear actuator extended. A limb without
  this variable gets the stroke of its family that fits best.
* ``end_fitting[i]``: what the joint-to-joint length has on top of the actuator's.

On a right shoulder outward is to the right, so that one set of values describes mirror images.
"""

from __future__ import annotations

import re
from collections.abc import Mapping, Sequence
from dataclasses import replace
from typing import Any

import numpy as np

from ...core.conventions import MIRROR, as_side
from ...core.errors import InvalidInput, MissingData, UnknownName
from ...core.records import Record
from ...core.validation import FloatArray, as_finite
from ...design import Actuator, Arm, CircleDimensions, Limb, Mechanism, WristGeometry
from ...design.actuator_families import stroke_of_length
from .stroke_fitting import FitOptions

__all__ = ["DesignVariables", "free_joints", "starting_design"]

_CIRCLES = ("r_A", "r_B", "h_A", "h_B")
_ANGLES = ("alpha", "alpha_A", "alpha_B")
_JOINTS = {"A": ("radius", "azimuth", "elevation"), "B": ("radius", "azimuth", "drop")}
_STROKES = ("nominal_length", "end_fitting")
_NAME = re.compile(r"(?:(alpha|alpha_A|alpha_B|nominal_length|end_fitting)\[(\d+)\]|([AB])\[(\d+)\]\.(\w+))")
#: Variables of full circle: their two ends are one and the same value.
_AZIMUTH = (-np.pi, np.pi)


def free_joints(
    limb_count: int,
    base_radius: tuple[float, float] = (0.12, 0.25),
    platform_radius: tuple[float, float] = (0.05, 0.14),
    drop: tuple[float, float] = (0.08, 0.28),
) -> dict[str, tuple[float, float]]:
    """Variables of joints that may lie anywhere around the shoulder and the upper arm.

    Parameters
    ----------
    limb_count : int
        n.
    base_radius, platform_radius, drop : (float, float)
        Bounds of the joints' distance from the shoulder, from the arm's axis, and below the shoulder, m.

    Returns
    -------
    dict
        Bounds by name, six a limb.
    """
    bounds: dict[str, tuple[float, float]] = {}
    for i in range(1, limb_count + 1):
        bounds[f"A[{i}].radius"], bounds[f"A[{i}].azimuth"] = base_radius, _AZIMUTH
        bounds[f"A[{i}].elevation"] = (-np.pi / 2, np.pi / 2)
        bounds[f"B[{i}].radius"], bounds[f"B[{i}].azimuth"], bounds[f"B[{i}].drop"] = platform_radius, _AZIMUTH, drop
    return bounds


def starting_design(
    actuators: Actuator | Sequence[Actuator], arm: Arm, limb_count: int = 4, side: str = "left", name: str = "search"
) -> Mechanism:
    """Limbs with spherical joints at both ends, spread evenly around the shoulder.

    Parameters
    ----------
    actuators : Actuator or sequence of Actuator
        Of all limbs, or one a limb.
    arm : Arm
        What moves about the shoulder, person and device.
    limb_count : int
        n, where one actuator is given.
    side : {"left", "right"}
        Side of the body.
    name : str
        Of the design.
    """
    each = (actuators,) * limb_count if isinstance(actuators, Actuator) else tuple(actuators)
    if len(each) < 3:
        raise InvalidInput(f"expected at least 3 limbs (fewer cannot hold an arm), got {len(each)}")
    angles = 2.0 * np.pi * np.arange(len(each)) / len(each) + 0.3
    base = np.stack([0.15 * np.cos(angles), 0.15 * np.sin(angles), np.full(len(each), 0.1)], axis=-1)
    platform = np.stack([0.1 * np.cos(angles), 0.1 * np.sin(angles), np.full(len(each), -0.2)], axis=-1)
    limbs = tuple(Limb("SPS", actuator=actuator) for actuator in each)
    return Mechanism(WristGeometry(base, platform), arm=arm, limbs=limbs, side=as_side(side), name=name)


class DesignVariables(Record):
    """Variables with their bounds, and the design that belongs to a point of the unit cube.

    Parameters
    ----------
    mechanism : Mechanism
        The design to start from.
    bounds : mapping of str to (float, float)
        By name; see the module's description.

    Raises
    ------
    UnknownName
        If a name is none of these.
    InvalidInput
        If a bound is not finite or the lower one is not below the upper, or a circle's dimension is varied in a design
        whose joints are not on circles.
    """

    def __init__(self, mechanism: Mechanism, bounds: Mapping[str, Any]) -> None:
        if not isinstance(bounds, Mapping) or not bounds:
            raise InvalidInput("expected variables as a mapping of names to (lowest, highest)")
        self.mechanism = mechanism
        self.names = tuple(bounds)
        rows = []
        for name in self.names:
            _check(name, mechanism)
            low, high = as_finite(name, bounds[name], (2,)).tolist()
            if not low < high:
                raise InvalidInput(f"expected bounds of {name} as (lowest, highest), got ({low:g}, {high:g})")
            rows.append((low, high))
        self.bounds = np.array(rows)
        self._whole = np.isclose(self.bounds[:, 1] - self.bounds[:, 0], 2.0 * np.pi)
        kinds = {name[0] in "AB" and "[" in name for name in self.names if not _is_stroke(name)}
        if len(kinds) > 1:
            raise InvalidInput("expected variables of circles or of single joints, got both")
        numbers = range(1, mechanism.limb_count + 1)
        #: By limb: whether the variables set its stroke, so that none is fitted, shape (n,).
        self.sets_stroke = np.array([f"nominal_length[{i}]" in bounds for i in numbers])

    def refuse_idle(self) -> None:
        """Raise InvalidInput if an end fitting changes nothing, for designs whose strokes are not fitted."""
        for i in np.flatnonzero(~self.sets_stroke):
            name = f"end_fitting[{i + 1}]"
            if name in self.names:
                raise InvalidInput(f"expected nominal_length[{i + 1}] beside {name}, or strokes that are fitted")

    @property
    def count(self) -> int:
        """Number of variables."""
        return len(self.names)

    def values(self, point: FloatArray) -> dict[str, float]:
        """Values by name of a point, shape (k,).

        Bounds are met by a cosine, low + (high - low) (1 - cos π x)/2, which is smooth where a search would otherwise
        bounce off a wall, and good designs lie at many walls. A full circle goes on where it ends.
        """
        inside = 0.5 - 0.5 * np.cos(np.pi * point)
        values = self.bounds[:, 0] + inside * (self.bounds[:, 1] - self.bounds[:, 0])
        turned = self.bounds[:, 0] + np.mod(point, 1.0) * 2.0 * np.pi
        return dict(zip(self.names, np.where(self._whole, turned, values).tolist(), strict=True))

    def point(self, values: Mapping[str, float]) -> FloatArray:
        """The point that belongs to values within the bounds, shape (k,)."""
        chosen = np.array([values[name] for name in self.names])
        share = (chosen - self.bounds[:, 0]) / (self.bounds[:, 1] - self.bounds[:, 0])
        return np.where(self._whole, share, np.arccos(np.clip(1.0 - 2.0 * share, -1.0, 1.0)) / np.pi)

    def of_design(self) -> dict[str, float]:
        """Values of the design to start from, by name, moved into the bounds."""
        mechanism = self.mechanism
        circles = mechanism.geometry.circles
        strokes = [limb.stroke for limb in mechanism.limbs]
        values = {}
        for name, (low, high) in zip(self.names, self.bounds, strict=True):
            match = _NAME.fullmatch(name)
            if match is not None and match[1] in _STROKES:
                stroke = strokes[int(match[2]) - 1]
                value = None if stroke is None else getattr(stroke, match[1])
                value = 0.5 * (low + high) if value is None else value
            elif match is None or match[3] is None:
                assert circles is not None
                value = getattr(circles, name) if match is None else _angle(circles, match)
            else:
                points = mechanism.geometry.base_points if match[3] == "A" else mechanism.geometry.platform_points
                value = _of_joint(points[int(match[4]) - 1] * _outward(mechanism.side), match[3])[match[5]]
            values[name] = float(np.clip(value, low, high))
        return values

    def design(self, values: Mapping[str, float]) -> Mechanism:
        """The mechanism with these values."""
        mechanism = self.mechanism
        geometry = mechanism.geometry
        if self.sets_stroke.any():
            mechanism = mechanism.replace(limbs=self._limbs(values))
        if all(_is_stroke(name) for name in self.names):
            return mechanism
        if geometry.circles is not None and not any(name[0] in "AB" for name in self.names):
            return mechanism.replace(geometry=_on_circles(geometry, values))
        return mechanism.replace(geometry=_with_joints(geometry, values, mechanism.side))

    def fit_options(self, values: Mapping[str, float]) -> FitOptions:
        """How the strokes of the limbs are fitted whose lengths are no variables."""
        return FitOptions(self.sets_stroke, self.end_fittings(values))

    def end_fittings(self, values: Mapping[str, float]) -> tuple[float | None, ...]:
        """End fittings among the values, m, one a limb; None where the family's own counts."""
        return tuple(values.get(f"end_fitting[{i + 1}]") for i in range(self.mechanism.limb_count))

    def _limbs(self, values: Mapping[str, float]) -> list[Limb]:
        """Limbs whose stroke the values set; the others as they are."""
        limbs, fittings = list(self.mechanism.limbs), self.end_fittings(values)
        for i in np.flatnonzero(self.sets_stroke):
            actuator, stroke = limbs[i].actuator, limbs[i].stroke
            if actuator is None:
                raise MissingData([f"actuator of limb {i + 1}"], "its stroke", self.mechanism.name)
            fitting = fittings[i]
            if fitting is None and stroke is not None:
                fitting = stroke.end_fitting
            length = values[f"nominal_length[{i + 1}]"]
            stroke = stroke_of_length(actuator.family, length, fitting, actuator.travel_limit)
            limbs[i] = replace(limbs[i], stroke=stroke)
        return limbs


def _check(name: Any, mechanism: Mechanism) -> None:
    listed = [
        *_CIRCLES,
        *(f"{name}[i]" for name in (*_ANGLES, *_STROKES)),
        *(f"{j}[i].{f}" for j in _JOINTS for f in _JOINTS[j]),
    ]
    if name in _CIRCLES:
        limb, on_circles = 1, True
    else:
        match = _NAME.fullmatch(name) if isinstance(name, str) else None
        if match is None or (match[3] and match[5] not in _JOINTS[match[3]]):
            raise UnknownName("variable", name, listed)
        limb, on_circles = int(match[2] or match[4]), match[1] in _ANGLES
    if not 1 <= limb <= mechanism.limb_count:
        raise InvalidInput(f"expected a limb from 1 to {mechanism.limb_count} in {name!r}")
    if on_circles and mechanism.geometry.circles is None:
        raise InvalidInput(f"{name} needs joints on circles; vary A[i] and B[i] of this design")


def _is_stroke(name: str) -> bool:
    return name.split("[")[0] in _STROKES


def _angle(circles: CircleDimensions, match: re.Match[str]) -> float:
    """The angle of a variable such as alpha_B[2]."""
    angles = circles.alpha_B if match[1] == "alpha_B" else circles.alpha_A
    return float(angles[int(match[2]) - 1])


def _of_joint(point: FloatArray, end: str) -> dict[str, float]:
    """Variables of a joint centre of the base or the platform, in the order of ``_JOINTS``."""
    level, azimuth = float(np.hypot(point[0], point[1])), float(np.arctan2(point[1], point[0]))
    if end == "A":
        elevation = float(np.arctan2(point[2], level))
        return {"radius": float(np.linalg.norm(point)), "azimuth": azimuth, "elevation": elevation}
    return {"radius": level, "azimuth": azimuth, "drop": -float(point[2])}


def _on_circles(geometry: WristGeometry, values: Mapping[str, float]) -> WristGeometry:
    circles = geometry.circles
    assert circles is not None
    changes: dict[str, Any] = {name: values[name] for name in _CIRCLES if name in values}
    angles = {"alpha_A": np.array(circles.alpha_A), "alpha_B": np.array(circles.alpha_B)}
    for name, value in values.items():
        match = _NAME.fullmatch(name)
        if match is not None and match[1] in _ANGLES:
            for half in angles if match[1] == "alpha" else (match[1],):
                angles[half][int(match[2]) - 1] = value
    return geometry.replace(**changes, **angles)


def _with_joints(geometry: WristGeometry, values: Mapping[str, float], side: str) -> WristGeometry:
    """The geometry with some joint centres moved, numbers counted outward on each side."""
    outward = _outward(side)
    base, platform = np.array(geometry.base_points) * outward, np.array(geometry.platform_points) * outward

    def moved(end: str, i: int, point: FloatArray) -> list[float]:
        return [values.get(f"{end}[{i + 1}].{part}", own) for part, own in _of_joint(point, end).items()]

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
