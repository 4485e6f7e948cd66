"""Exact first derivatives of the equilibrium equations by pose, geometry, arm, load, guides and offset.

The derivatives by geometry, guides, offset and pose are complex steps of
:func:`exo_pin.wrist.forces.side_forces.side_wrenches_of`, which lose no digits. The loads are polynomials of degree two
at most in the parameters of arm and load, for which a central difference of any step is exact.
"""

from __future__ import annotations

from collections.abc import Iterable, Iterator, Sequence
from dataclasses import dataclass, replace
from typing import Any, NamedTuple

import numpy as np
from numpy.typing import ArrayLike, NDArray
from scipy.spatial.transform import Rotation

from ..core.records import reduced_tuple
from ..core.validation import FloatArray
from ..design import Mechanism
from ..design.geometry import CircleDimensions
from ..load_case import Load, Motion
from ..load_case.pose_stacks import Query, arm_load, as_query
from ..numerics.analytic_vectors import cross_matrix
from ..wrist.forces.side_forces import SideWrenches, guide_flexibility, side_wrenches_of

__all__ = ["Seed", "circle_seeds", "geometry_seeds", "load_seeds"]

_STEP = 1e-30
_AXES = ("x", "y", "z")
#: Upper triangle of a symmetric matrix, in the order of its six entries, and their names.
SYMMETRIC = {(0, 0): "xx", (1, 1): "yy", (2, 2): "zz", (1, 2): "yz", (0, 2): "xz", (0, 1): "xy"}


class Seed(NamedTuple):
    """A parameter and the derivatives of the equations by it.

    Attributes
    ----------
    unit : str
        Of the parameter.
    labels : tuple of str
        Of its components.
    value : ndarray
        Shape (N or 1, size).
    sides : list of SideWrenches or None
        Derivatives, one per component.
    force, moment : ndarray or None
        Derivatives of the load on limbs and shoulder, shape (N, size, 3).
    """

    unit: str
    labels: tuple[str, ...]
    value: FloatArray
    sides: list[SideWrenches] | None = None
    force: FloatArray | None = None
    moment: FloatArray | None = None

    def __reduce__(self) -> tuple[Any, ...]:
        return reduced_tuple(self)


@dataclass
class _Numbers:
    """Arguments of :func:`side_wrenches_of`, each of which may be complex."""

    base_points: FloatArray
    platform_points: FloatArray
    matrices: FloatArray
    base_offset: FloatArray
    cuff_offset: FloatArray
    flexibility: FloatArray
    resists: NDArray[np.bool_]
    is_upu: NDArray[np.bool_]

    def derivative(self, **changes: FloatArray) -> SideWrenches:
        """Derivative along a change of some of the arguments."""
        shifted: dict[str, Any] = {name: getattr(self, name) + 1j * _STEP * change for name, change in changes.items()}
        moved = side_wrenches_of(**{**vars(self), **shifted})
        return SideWrenches._make([*(part.imag / _STEP for part in moved[:-1]), moved.folded])


def geometry_seeds(
    mechanism: Mechanism, query: Query, base: FloatArray, cuff: FloatArray
) -> tuple[SideWrenches, dict[str, Seed]]:
    """The side wrenches, and the parameters that they depend on."""
    geometry, n = mechanism.geometry, mechanism.limb_count
    flexibility, resists = guide_flexibility(mechanism)
    numbers = _Numbers(
        geometry.base_points,
        geometry.platform_points,
        query.matrices,
        base,
        cuff,
        flexibility,
        resists,
        mechanism.is_upu,
    )
    seeds = {
        "orientation": Seed(
            "rad", _AXES, np.zeros((1, 3)),
            [numbers.derivative(matrices=turn @ query.matrices) for turn in cross_matrix(np.eye(3))],
        ),
    }  # fmt: skip
    points = tuple(f"{i + 1}{axis}" for i in range(n) for axis in _AXES)
    units = np.eye(3 * n).reshape(3 * n, n, 3)
    for name in ("base_points", "platform_points"):
        value = getattr(geometry, name).reshape(1, -1)
        seeds[name] = Seed("m", points, value, [numbers.derivative(**{name: unit}) for unit in units])
    for name, offset in (("offset_base", base), ("offset_cuff", cuff)):
        key = name.split("_")[1] + "_offset"
        seeds[name] = Seed("m", _AXES, offset, [numbers.derivative(**{key: e}) for e in np.eye(3)])
    both = zip(seeds["offset_base"].sides or (), seeds["offset_cuff"].sides or (), strict=True)
    seeds["offset"] = Seed("m", _AXES, 0.5 * (base + cuff), [_sum((u, v), (1.0, 1.0)) for u, v in both])
    guided = np.flatnonzero(resists)
    names = ("bending_rigidity", "torsional_rigidity", "joint_stiffness", "joint_twist_stiffness")
    for column, (name, unit) in enumerate(zip(names, ("N m²", "N m²", "N/m", "N m/rad"), strict=True)):
        sides, values, labels = [], [], []
        for i in guided:
            if flexibility[i, column] == 0.0:
                continue  # infinitely stiff
            change = np.zeros((n, 4))
            change[i, column] = -(flexibility[i, column] ** 2)  # of 1/k by k
            sides.append(numbers.derivative(flexibility=change))
            values.append(1.0 / flexibility[i, column])
            labels.append(str(i + 1))
        if sides:
            seeds[name] = Seed(unit, tuple(labels), np.array([values]), sides)
    side = side_wrenches_of(**vars(numbers))
    return side, seeds


def _sum(parts: Sequence[SideWrenches], weights: ArrayLike) -> SideWrenches:
    columns = zip(*(part[:-1] for part in parts), strict=True)
    mixed = [np.tensordot(np.asarray(weights), np.stack(column), 1) for column in columns]
    return SideWrenches._make([*mixed, parts[0].folded])


def circle_seeds(circles: CircleDimensions, seeds: dict[str, Seed]) -> dict[str, Seed]:
    """The dimensions of (4-2), by the chain rule through the points.

    ``alpha_A`` and ``alpha_B`` count as two parameters, also where a design gives them together.
    """
    made: dict[str, Seed] = {}
    for side, name, r, h, alpha in (
        ("base_points", "A", "r_A", "h_A", "alpha_A"),
        ("platform_points", "B", "r_B", "h_B", "alpha_B"),
    ):
        of_points = seeds[side].sides or []
        # The points are affine in radius and height, and turn with their angle.
        flat: dict[str, Any] = {r: 1.0, h: 0.0}
        unit = getattr(replace(circles, **flat), side)
        height = getattr(replace(circles, **{**flat, h: 1.0}), side) - unit
        angles = getattr(circles, alpha)
        ahead = np.angle(np.exp(1j * (angles + 0.5 * np.pi)))
        ahead_of: dict[str, Any] = {alpha: ahead, h: 0.0}
        turn = getattr(replace(circles, **ahead_of), side)
        for label, change in ((r, unit), (h, height)):
            value = np.array([[getattr(circles, label)]])
            made[label] = Seed("m", ("",), value, [_sum(of_points, change.ravel())])
        each = []
        for i in range(len(angles)):
            change = np.zeros_like(turn)
            change[i] = turn[i]
            each.append(_sum(of_points, change.ravel()))
        labels = tuple(str(i + 1) for i in range(len(angles)))
        made[f"alpha_{name}"] = Seed("rad", labels, angles[None], each)
    return made


def load_seeds(
    mechanism: Mechanism, orientation: Rotation, query: Query, motion: Motion | None, load: Load | None
) -> tuple[FloatArray, FloatArray, dict[str, Seed]]:
    """Load on limbs and shoulder, shape (N, 3) each, and the parameters that it depends on."""
    arm = mechanism.require_arm("weight")
    still = np.zeros_like(query.force)
    m, c, R = arm.mass, np.array(arm.centre_of_mass), query.matrices
    about_centre = np.zeros((3, 3)) if arm.inertia is None or motion is None else np.asarray(arm.inertia)
    own: dict[str, Any] = {"mass": m, "centre": c, "inertia": about_centre, "R": R}

    def carried(mass: float, centre: FloatArray, inertia: FloatArray, R: FloatArray) -> tuple[FloatArray, FloatArray]:
        F, M = np.empty_like(still), np.empty_like(still)
        about_origin = inertia + mass * (centre @ centre * np.eye(3) - np.outer(centre, centre))
        arm_load(
            np.ascontiguousarray(R), mass, centre, about_origin, mechanism.gravity, query.velocity, query.acceleration,
            still, still, F, M,
        )  # fmt: skip
        return F, M

    def slopes(name: str, steps: Iterable[Any], size: float = 1.0) -> Iterator[FloatArray]:
        """Derivatives of force and moment along steps of one number, shape (N, steps, 3) each."""
        pairs = [[carried(**{**own, name: own[name] + sign * step}) for sign in (1.0, -1.0)] for step in steps]
        return (np.stack([(plus[k] - minus[k]) / (2.0 * size) for plus, minus in pairs], axis=1) for k in (0, 1))

    force, moment = carried(**own)
    seeds = {
        "mass": Seed("kg", ("",), np.array([[m]]), None, *slopes("mass", [m], m)),
        "centre_of_mass": Seed("m", _AXES, c[None], None, *slopes("centre", np.eye(3))),
    }
    if motion is not None:
        entries = np.array([[about_centre[i, j] for i, j in SYMMETRIC]])
        labels = tuple(SYMMETRIC.values())
        seeds["inertia"] = Seed("kg m²", labels, entries, None, *slopes("inertia", _symmetric_units()))
    # Turning the arm: linear and quadratic in R, so that a step of any size along [e]× R is exact.
    turns = (turn @ R for turn in cross_matrix(np.eye(3)))
    seeds["orientation"] = Seed("rad", _AXES, np.zeros((1, 3)), None, *slopes("R", turns))
    at = np.zeros(3) if load is None else np.asarray(load.at)
    frame = "base" if load is None else load.frame
    for name, unit, loads in (
        ("force", "N", [Load(e, 0.0, at, frame) for e in np.eye(3)]),
        ("moment", "N m", [Load(np.zeros(3), e, at, frame) for e in np.eye(3)]),
    ):
        given = np.zeros(3) if load is None else np.asarray(getattr(load, name))
        applied = [as_query(orientation, None, one) for one in loads]
        by_force, by_moment = (np.stack([getattr(one, k) for one in applied], axis=1) for k in ("force", "moment"))
        seeds[f"load_{name}"] = Seed(unit, _AXES, _rows(given, query.shape), None, by_force, by_moment)
    if load is not None:
        moved = [as_query(orientation, None, Load(load.force, 0.0, e, frame)).moment for e in np.eye(3)]
        nothing = np.zeros((len(still), 3, 3))
        seeds["load_point"] = Seed("m", _AXES, _rows(at, query.shape), None, nothing, np.stack(moved, axis=1))
        turned = seeds["orientation"]
        assert turned.force is not None
        assert turned.moment is not None
        if frame == "arm":
            dF, dM = (np.stack([np.cross(e, v) for e in np.eye(3)], axis=1) for v in (query.force, query.moment))
        else:
            arms = np.einsum("kij,kj->ki", query.matrices, np.broadcast_to(_rows(at, query.shape), still.shape))
            dF, dM = nothing, np.stack([np.cross(np.cross(e, arms), query.force) for e in np.eye(3)], axis=1)
        seeds["orientation"] = turned._replace(force=turned.force + dF, moment=turned.moment + dM)
    return force + query.force, moment + query.moment, seeds


def _rows(value: FloatArray, shape: tuple[int, ...]) -> FloatArray:
    """One row, or one a pose where the value is a stack."""
    return value[None] if value.ndim == 1 else np.broadcast_to(value, (*shape, 3)).reshape(-1, 3)


def _symmetric_units() -> Iterator[FloatArray]:
    for i, j in SYMMETRIC:
        unit = np.zeros((3, 3))
        unit[i, j] = unit[j, i] = 1.0
        yield unit
