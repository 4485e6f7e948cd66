"""Derivatives of forces by pose, geometry, arm, load, stiffness and offset.

The equilibrium and, in the elastic split, the two conditions of stiffness are linear in x = (f, λ, g, F_s, δ):

    f_i - a_i · λ = 0                       Σ f_i a_i + Σ g_i m_i = M
    g_i - k_i (S_i · δ + misfit_i) = 0      F_s - Σ f_i s_i - Σ g_i S_i = -F          K_s δ + F_s = 0

with a_i the lever arms, λ the multipliers of tensions of least norm with more than three limbs, and g = δ = 0 instead
of the last two in the spherical split. With J their matrix and r_p their derivative by a parameter at fixed x, exact to
rounding (:mod:`exo_pin.uncertainty.parameter_derivatives`), dx/dp = -J⁻¹ r_p is exact as well.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from types import MappingProxyType

import numpy as np
from numpy.typing import ArrayLike, NDArray
from scipy.spatial.transform import Rotation

from ..core.records import Record
from ..core.results import Result
from ..core.validation import FloatArray, as_choice
from ..design import Mechanism
from ..load_case import CentreOffset, Load, Motion
from ..load_case.pose_stacks import as_query, require_massless
from ..reaction.splits.split import Split
from ..wrist.forces.displaced import Displaced, as_offset
from ..wrist.forces.side_forces import SideWrenches
from ..wrist.limbs import STATUS
from .linear_splits import linear_split
from .parameter_derivatives import SYMMETRIC, Seed, circle_seeds, geometry_seeds, load_seeds

__all__ = ["Parameter", "Sensitivity", "sensitivity"]


@dataclass(frozen=True, eq=False)
class Parameter(Record):
    """Derivatives by one parameter, in poses of shape (...).

    Attributes
    ----------
    name, unit : str
        The parameter.
    labels : tuple of str
        Of its components: axes, limbs, or limb and axis.
    value : ndarray
        Shape (..., size), in ``unit``.
    shoulder_force, actuator_forces, constraint_forces : ndarray
        dF_s, shape (..., 3, size), df and dg, shape (..., n, size), N per ``unit``; NaN without an answer.
    """

    name: str
    unit: str
    labels: tuple[str, ...]
    value: FloatArray
    shoulder_force: FloatArray
    actuator_forces: FloatArray
    constraint_forces: FloatArray


@dataclass(frozen=True, eq=False)
class Sensitivity(Result):
    """First derivatives of an answer, in poses of shape (...).

    Attributes
    ----------
    split : {"spherical", "elastic_linear"}
        Of the answer; the second is the elastic formula for small displacements.
    shoulder_force, actuator_forces, constraint_forces : ndarray
        The answer itself, shape (..., 3), (..., n), (..., n), N.
    status : ndarray of str
        As :attr:`Reaction.status`.
    parameters : mapping of str to Parameter
        "orientation" is a rotation vector in the base frame, exp([θ]×) R, with motion held and the load turning as
        its frame determines; "offset" moves base and cuff together; "mass" keeps the inertia about the centre of mass.
    """

    split: str
    shoulder_force: FloatArray
    actuator_forces: FloatArray
    constraint_forces: FloatArray
    status: NDArray[np.str_]
    parameters: Mapping[str, Parameter]

    def __getitem__(self, name: str) -> Parameter:
        return self.parameters[as_choice("parameter", name, self.parameters)]

    def magnitude(self, name: str) -> FloatArray:
        """d|F_s|, shape (..., size), N per unit of the parameter; NaN where F_s is zero and has no direction."""
        size = np.linalg.norm(self.shoulder_force, axis=-1, keepdims=True)
        direction = np.divide(
            self.shoulder_force, size, out=np.full_like(self.shoulder_force, np.nan), where=size > 0.0
        )
        return np.asarray(np.einsum("...i,...ip->...p", direction, self[name].shoulder_force))


def sensitivity(
    mechanism: Mechanism,
    orientation: Rotation,
    motion: Motion | None = None,
    load: Load | None = None,
    split: str | Split = "spherical",
    centre_offset: CentreOffset | ArrayLike = (0.0, 0.0, 0.0),
) -> Sensitivity:
    """Derivatives of F_s, f and g by all parameters of the query.

    Parameters
    ----------
    mechanism : Mechanism
        With massless limbs.
    orientation, motion, load, centre_offset
        As :meth:`exo_pin.ShoulderExo.reaction`.
    split : {"spherical", "elastic_linear", "elastic"}
        How the forces that equilibrium does not determine are chosen. The last two are the same here: the elastic
        formula for small displacements; :meth:`exo_pin.ShoulderExo.elastic_difference` gives its difference from the
        displaced geometry.

    Returns
    -------
    Sensitivity

    Raises
    ------
    MissingData
        As :meth:`exo_pin.ShoulderExo.reaction`.
    InvalidInput
        If an argument does not fit, or a limb has mass.
    """
    law = linear_split(split)
    require_massless(mechanism)
    if motion is not None:
        mechanism.require_arm("motion", inertia=True)
    stiffness = law.shoulder_stiffness(mechanism)
    query = as_query(orientation, motion, load)
    base, cuff = (np.ascontiguousarray(side) for side in as_offset(centre_offset, query.shape))
    side, seeds = geometry_seeds(mechanism, query, base, cuff)
    if mechanism.geometry.circles is not None:
        seeds.update(circle_seeds(mechanism.geometry.circles, seeds))
    force, moment, loads = load_seeds(mechanism, orientation, query, motion, load)
    for name, seed in loads.items():
        known = seeds.get(name)
        seeds[name] = seed if known is None else known._replace(force=seed.force, moment=seed.moment)
    if stiffness is not None:
        entries = np.array([[stiffness[i, j] for i, j in SYMMETRIC]])
        seeds["shoulder_stiffness"] = Seed("N/m", tuple(SYMMETRIC.values()), entries)
    state = Displaced(mechanism, query, base, cuff, force, moment)
    system = _System(side, force, moment, stiffness, state)
    shape = query.shape
    parameters = {}
    for name, seed in seeds.items():
        value = np.broadcast_to(seed.value, (len(force), len(seed.labels))).reshape(*shape, len(seed.labels))
        changes = system.forces_of(system.change(name, seed), shape)
        parameters[name] = Parameter(name, seed.unit, seed.labels, value, *changes)
    status = np.array(STATUS)[system.status].reshape(shape)
    return Sensitivity(law.name, *system.forces_of(system.x, shape), status, MappingProxyType(parameters))


class _System:
    """The linear equations of all poses, and their solution."""

    def __init__(
        self, side: SideWrenches, force: FloatArray, moment: FloatArray, stiffness: FloatArray | None, state: Displaced
    ) -> None:
        count, n = side.stiffness.shape
        self.side = side
        self.f, self.load, self.g = slice(0, n), slice(n, n + 3), slice(n + 3, 2 * n + 3)
        self.shoulder, self.delta = slice(2 * n + 3, 2 * n + 6), slice(2 * n + 6, 2 * n + 9)
        J, rhs = np.zeros((count, 2 * n + 9, 2 * n + 9)), np.zeros((count, 2 * n + 9))
        # Unit of δ that makes its column as large as the others.
        self.unit = 1.0 if stiffness is None else 1.0 / (np.trace(stiffness) + side.stiffness.max(initial=0.0))
        arms, directions, sides, moments = (
            np.swapaxes(v, 1, 2) for v in (side.moment_arms, side.directions, side.forces, side.moments)
        )
        eye, eye3 = np.eye(n), np.eye(3)
        J[:, self.f, self.f], J[:, self.f, self.load] = eye, -side.moment_arms
        J[:, self.load, self.f], J[:, self.load, self.g] = arms, moments
        rhs[:, self.load] = moment
        J[:, self.g, self.g] = eye
        J[:, self.shoulder, self.shoulder] = eye3
        J[:, self.shoulder, self.f], J[:, self.shoulder, self.g] = -directions, -sides
        rhs[:, self.shoulder] = -force
        J[:, self.delta, self.delta] = eye3
        self.elastic = stiffness is not None
        if stiffness is not None:
            J[:, self.g, self.delta] = -side.stiffness[..., None] * side.forces * self.unit
            rhs[:, self.g] = side.stiffness * side.misfit
            J[:, self.delta, self.delta] = stiffness * self.unit
            J[:, self.delta, self.shoulder] = eye3
        self.status = state.status.copy()
        good = self.status < STATUS.index("singular")
        if stiffness is not None:
            # The same test as for the answer, so that both have an answer in the same poses.
            lost = good & np.isnan(state.elastic_side_forces(stiffness)[0]).any(axis=1)
            self.status[lost] = STATUS.index("not_solved")
        self.good = np.flatnonzero(self.status < STATUS.index("singular"))
        self.J = J[self.good]
        self.x = np.full_like(rhs, np.nan)
        self.x[self.good] = np.linalg.solve(self.J, rhs[self.good][..., None])[..., 0]

    def forces_of(self, x: FloatArray, shape: tuple[int, ...]) -> tuple[FloatArray, FloatArray, FloatArray]:
        """F_s, f and g within x, or within its derivative, in poses of shape (...)."""
        parts = (x[:, part] for part in (self.shoulder, self.f, self.g))
        shoulder, f, g = (part.reshape(*shape, *part.shape[1:]) for part in parts)
        return shoulder, f, g

    def change(self, name: str, seed: Seed) -> FloatArray:
        """dx by each component of a parameter, shape (N, len(x), size)."""
        count, length = self.x.shape
        residual = np.zeros((count, length, len(seed.labels)))
        f, g = self.x[:, self.f], self.x[:, self.g]
        delta, side = self.x[:, self.delta] * self.unit, self.side
        if name == "shoulder_stiffness":
            for p, (i, j) in enumerate(SYMMETRIC):
                residual[:, self.delta.start + i, p] += delta[:, j]
                if i != j:
                    residual[:, self.delta.start + j, p] += delta[:, i]
        for p, d in enumerate(seed.sides or ()):
            residual[:, self.f, p] -= np.einsum("kni,ki->kn", d.moment_arms, self.x[:, self.load])
            residual[:, self.load, p] += _dot(f, d.moment_arms) + _dot(g, d.moments)
            residual[:, self.shoulder, p] -= _dot(f, d.directions) + _dot(g, d.forces)
            if self.elastic:
                strain = np.einsum("kni,ki->kn", side.forces, delta) + side.misfit
                change = np.einsum("kni,ki->kn", d.forces, delta) + d.misfit
                residual[:, self.g, p] -= d.stiffness * strain + side.stiffness * change
        if seed.force is not None and seed.moment is not None:
            residual[:, self.load] -= np.swapaxes(seed.moment, 1, 2)
            residual[:, self.shoulder] += np.swapaxes(seed.force, 1, 2)
        solved = np.full_like(residual, np.nan)
        solved[self.good] = -np.linalg.solve(self.J, residual[self.good])
        return solved


def _dot(weights: FloatArray, vectors: FloatArray) -> FloatArray:
    return np.asarray(np.einsum("kn,kni->ki", weights, vectors))
