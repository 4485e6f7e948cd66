"""Where a search begins: joints anywhere, actuators of a family, and the bounds of free joints.

Strokes fit the lengths that a design needs, by family. Which longest length serves best is chosen for each limb by
itself, from a few quantiles of its lengths: the family sets the shortest length that goes with it
(:mod:`exo_pin.design.actuator_families`), and the choice is the one that leaves the least weighted shortfall over the
poses.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import replace
from typing import Any

import numpy as np
from numpy.typing import ArrayLike

from ...core.conventions import as_side
from ...core.errors import InvalidInput, MissingData
from ...core.errors.checked import checked
from ...core.validation import FloatArray, as_count
from ...design import Actuator, Arm, Limb, Mechanism, Stroke, WristGeometry
from ...design.actuator_families import family_limits, fitting_stroke
from ...design.parameters.changes import value_of, worn_by
from ...design.parameters.names import parameter
from ...device.protocol import Device
from ...device.wrist_device import as_device
from ...load_case.pose_stacks import pose_matrices
from ...reaction.constraints.actuator_limits import length_limits
from ...reaction.splits.pose_stack import limb_lengths
from ..evaluation import PoseOffsets
from .search_poses import Centre

#: Greatest pull of a limb, N, and gauge pressure of a muscle's supply, Pa, of a new design that states none.
PULL, SUPPLY = 400.0, 4e5
#: More limbs than any device has.
_MOST_LIMBS = 1000
#: Variables of full circle: their two ends are one and the same value.
_AZIMUTH = (-np.pi, np.pi)
#: In place of bounds, of which only it matters that they were given.
_AS_GIVEN = (-np.inf, np.inf)


def starting_actuator(
    family: str = "cable",
    pull: float | None = None,
    push: float | None = None,
    force_law: str | None = None,
    supply: float | None = None,
    travel: float | None = None,
) -> Actuator:
    """The actuator of a new design.

    Parameters
    ----------
    family : {"pneumatic muscle", "cable", "linear"}
        The family.
    pull, push : float, optional
        Greatest tension, :data:`PULL` if left out, and greatest compression of a linear actuator, the same if left out,
        N.
    force_law : str, optional
        Of pneumatic muscles, in place of ``pull``.
    supply : float, optional
        Gauge pressure with a force law, Pa; :data:`SUPPLY` if left out.
    travel : float, optional
        Greatest travel, m.
    """
    greatest = PULL if pull is None else pull
    pressure = None if force_law is None else SUPPLY if supply is None else supply
    own, other = None if force_law else greatest, greatest if push is None else push
    both = own, other if family == "linear" else None
    return Actuator(family, *both, force_law, pressure, travel_limit=travel)  # type: ignore[arg-type]


def joints_and_variables(
    design: Device | Mechanism, variables: Mapping[str, Any], refine: bool = False, **bounds: tuple[float, float] | None
) -> dict[str, Any]:
    """Variables of a search: the named ones alone, or with free joints where none are named or their bounds are given.

    Parameters
    ----------
    design : Device or Mechanism
        The design to start from.
    variables : mapping
        Bounds by name, see :mod:`exo_pin.design.parameters.names`; they come before those of free joints.
    refine : bool
        Whether the search starts from the design itself: bounds that are not given then reach as far as its joints.
    **bounds
        Of :func:`free_joints`; None for its own.

    Raises
    ------
    InvalidInput
        If none is named of a device that is no wrist, or bounds of free joints are given for one.
    """
    given = {name: pair for name, pair in bounds.items() if pair is not None}
    if variables and not given:
        return dict(variables)
    device = as_device(design)
    mechanism = device.accelerate("workspace")
    if mechanism is None:
        known = ", ".join(device.dimensions())
        raise InvalidInput(
            f"free joints are of wrists; expected variables among the dimensions of {device.name}: {known}"
        )
    named = {parameter(name).si_name for name in variables}
    free = free_joints(mechanism.limb_count, **given)
    if refine:
        asked = free_joints(mechanism.limb_count, **dict.fromkeys(given, _AS_GIVEN))
        for name, (low, high) in free.items():
            own = value_of(mechanism, parameter(name))
            if own is not None and asked[name] != _AS_GIVEN:
                free[name] = min(low, own), max(high, own)
    return {**{name: pair for name, pair in free.items() if name not in named}, **variables}


@checked
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

    Examples
    --------
    >>> from exo_pin.workspace import free_joints
    >>> len(free_joints(4))  # variables: three coordinates for each of eight joints
    24
    """
    bounds: dict[str, tuple[float, float]] = {}
    for i in range(1, as_count("limb_count", limb_count, 1, _MOST_LIMBS) + 1):
        bounds[f"A[{i}].radius"], bounds[f"A[{i}].azimuth"] = base_radius, _AZIMUTH
        bounds[f"A[{i}].elevation"] = (-np.pi / 2, np.pi / 2)
        bounds[f"B[{i}].radius"], bounds[f"B[{i}].azimuth"], bounds[f"B[{i}].drop"] = platform_radius, _AZIMUTH, drop
    return bounds


@checked
def starting_design(
    actuators: Actuator | Sequence[Actuator],
    arm: Arm,
    limb_count: int = 4,
    side: str = "left",
    name: str = "search",
    device: Mechanism | None = None,
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
    device : Mechanism, optional
        A design whose moving part rides on the arm of a person: ``arm`` is then a left one, as
        :meth:`exo_pin.Arm.from_anthropometry` makes it.

    Returns
    -------
    Mechanism

    Raises
    ------
    InvalidInput
        If there are fewer than three limbs, or the device has no moving part.

    Examples
    --------
    >>> from exo_pin.workspace import starting_design
    >>> motor = ep.Actuator("linear", pull_limit=600.0, push_limit=600.0)
    >>> sketch = starting_design(motor, ep.Arm.from_anthropometry(1.75, 75, sex="male"))
    >>> np.linalg.norm(sketch.geometry.base_points, axis=1).round(2)  # m from the shoulder
    array([0.18, 0.18, 0.18, 0.18])
    """
    each = (actuators,) * limb_count if isinstance(actuators, Actuator) else tuple(actuators)
    if len(each) < 3:
        raise InvalidInput(f"expected at least 3 limbs (fewer cannot hold an arm), got {len(each)}")
    if device is not None:
        if device.arm is None or not any(part.device for part in device.arm.parts):
            raise InvalidInput(f"{device.name!r} has no moving part; choose another device")
        arm = worn_by(device.on_side(side), arm).require_arm("a start")
    angles = 2.0 * np.pi * np.arange(len(each)) / len(each) + 0.3
    base = np.stack([0.15 * np.cos(angles), 0.15 * np.sin(angles), np.full(len(each), 0.1)], axis=1)
    platform = np.stack([0.1 * np.cos(angles), 0.1 * np.sin(angles), np.full(len(each), -0.2)], axis=1)
    limbs = tuple(Limb("SPS", actuator=actuator) for actuator in each)
    return Mechanism(WristGeometry(base, platform), arm=arm, limbs=limbs, side=as_side(side), name=name)


#: Beyond the window of the lengths on the grid, an actuator takes this much, m, where its family allows it.
_SPARE = 0.002
#: Quantiles of a limb's lengths that are tried as its longest length.
_QUANTILES = np.array([1.0, 0.98, 0.95, 0.9, 0.85, 0.8, 0.7, 0.6, 0.5])
#: A pose outside the stroke by more than this, m, counts no more than one outside by as much.
_WORST = 0.1


def stroke_windows(
    mechanism: Mechanism, lengths: FloatArray, weights: FloatArray, is_given: ArrayLike = False
) -> FloatArray:
    """Shortest and longest length that each limb's actuator should take, shape (n, 2), m.

    Parameters
    ----------
    mechanism : Mechanism
        Whose limbs name the families of their actuators.
    lengths : ndarray
        l_i over the poses, shape (N, n), m.
    weights : ndarray
        Of the poses, shape (N,).
    is_given : array_like of bool
        Limbs that keep the stroke that they have, broadcasting to (n,).

    Raises
    ------
    MissingData
        If a limb has no actuator.
    """
    given = np.broadcast_to(is_given, mechanism.limb_count)
    windows = np.array(length_limits(mechanism)).T
    for i, limb in enumerate(mechanism.limbs):
        if limb.actuator is None:
            raise MissingData([f"actuator of limb {i + 1}"], "the fit of its stroke", mechanism.name)
        if given[i]:
            continue
        family = limb.actuator.family
        share, constant = family_limits(family)
        column = lengths[:, i]
        ends = np.sort(column)[np.rint(_QUANTILES * (len(column) - 1)).astype(int)]
        starts = np.maximum(share * ends + constant, column.min())
        if limb.actuator.travel_limit is not None:
            starts = np.maximum(starts, ends - limb.actuator.travel_limit)
        outside = np.maximum(np.maximum(starts[:, None] - column, column - ends[:, None]), 0.0)
        cost = (weights * (np.minimum(outside, _WORST) / _WORST + (outside > 0.0))).sum(axis=1)
        best = int(cost.argmin())
        windows[i] = starts[best], max(ends[best], starts[best])
    return windows


def window_margin(windows: FloatArray, lengths: FloatArray) -> FloatArray:
    """Distance of the lengths, shape (N, n), to the ends of the windows, shape (N,), m; negative outside."""
    return np.minimum(lengths - windows[:, 0], windows[:, 1] - lengths).min(axis=1)


def fitted_strokes(
    mechanism: Mechanism, lengths: FloatArray, weights: FloatArray, spare: float = 0.0, is_given: ArrayLike = False
) -> Mechanism:
    """The design with strokes by :func:`stroke_windows`.

    Parameters
    ----------
    mechanism, lengths, weights, is_given
        As there.
    spare : float
        What an actuator whose family allows it takes beyond each end of the window, m.
    """
    given, limbs = np.broadcast_to(is_given, mechanism.limb_count), []
    for i, (short, long) in enumerate(stroke_windows(mechanism, lengths, weights, given)):
        limb = mechanism.limbs[i]
        assert limb.actuator is not None
        if not given[i]:
            limb = replace(limb, stroke=_fitted(limb.actuator, short, long, spare))
        limbs.append(limb)
    return mechanism.replace(limbs=limbs)


def _fitted(actuator: Actuator, short: float, long: float, spare: float) -> Stroke:
    family, travel = actuator.family, actuator.travel_limit
    share, constant = family_limits(family)
    travel_room = np.inf if travel is None else travel
    # What is spared beyond the long end must not cost poses at the short one.
    most = min((short - constant) / share if share > 0.0 else np.inf, short + travel_room)
    longest = max(long, min(long + spare, most))
    shortest = min(max(short - spare, share * longest + constant, longest - travel_room), longest)
    return fitting_stroke(family, shortest, longest, travel)


def with_strokes(
    mechanism: Mechanism,
    weights: FloatArray,
    lengths: FloatArray,
    centres: tuple[Centre, ...],
    is_given: ArrayLike,
) -> Mechanism:
    """The design with strokes that fit the full grid of daily activities and the poses of a search.

    ``weights``, shape (N,), and ``lengths``, shape (N, n), m, are of the poses of the search; the rest is that of
    :func:`fitted_strokes`.
    """
    from ...study import adl_box

    full = adl_box(4.0, mechanism.side)
    matrices = pose_matrices(full)[1]
    each = [limb_lengths(mechanism, matrices, PoseOffsets.of(centre, full).spread(len(matrices))) for centre in centres]
    # The grid has many poses and the search few: both count alike.
    grid = len(matrices) * len(centres)
    both = np.concatenate([np.full(grid, 0.5 / grid), 0.5 * weights])
    return fitted_strokes(mechanism, np.concatenate([*each, lengths]), both, _SPARE, is_given)
