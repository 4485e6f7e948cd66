"""Equilibrium of the elastic device at the displaced geometry, exact in displacements and turns.

The centre of the arm's joint moves by δ, a harness lets the base ring move by (t_h, v_h), a cuff the platform by (t_c,
v_c) against the arm; with locked actuators the arm turns by exp [v], too. All of this moves the joints A_i and B_i and
the axes of the universal joints. At that geometry

    F_s = -K_s δ                                 force and moment balance of the arm about its displaced centre
    g_i = k_i t_i φ_i                            φ_i the twist of the guide by the crosses of its joints
    (t, v) = K⁻¹ (F, J_lᵀ M)                     of harness and cuff under their wrench

of straight guides, with t_i the torque of the unit side wrench. Guides bend, and the rotation of their ends rotates the
crosses: g_i, side wrenches and directions are those of :mod:`exo_pin.wrist.forces.bent_guides`. In the limit of small
displacements t_i φ_i is S_i · δ + misfit_i.

- "held": the pose is given, actuators adapt. f follows from the moment balance; of more than three, f of least norm.
- "locked": the lengths are those of the aligned device in the given pose, and the pose of the arm follows: δ and v,
  with f the forces that hold the lengths.

Assumed: guides as there; f acts along A_i B_i; harness and cuff are linear in rotation vectors; the weight of the
device's own moving part acts where it would with a rigid cuff. Solved by :func:`exo_pin.numerics.continuation.follow`
from the unloaded, aligned device, load and offset growing together, with J by complex steps.

Placement of base ring and platform on an elastic harness and cuff, and displacement of these under a wrench.

Harness and cuff are springs with six degrees of freedom, linear in displacement t and rotation vector v:
(t, v) = K⁻¹ (F, J_lᵀ M), with the moment M about the displaced point. All operations are analytic, for complex steps.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from ...core.records import Record
from ...core.validation import FloatArray
from ...design import Interface, Interfaces, Mechanism
from ...load_case.pose_stacks import Query
from ...numerics.analytic_vectors import left_jacobian, solved, turn_matrix
from ...numerics.continuation import follow
from .bent_guides import bent_wrenches
from .side_forces import SideWrenches, guide_flexibility, limb_loads, straight_guides

#: Imaginary step: its square is below the smallest number, so that derivatives are exact to rounding.
_STEP = 1e-30
#: Step of the differences for loads that rotate with the arm, rad.
_TURN = 1e-5
#: Shares of the offset at which guides are asked that are all that gives way.
_SHARES = (0.25, 0.5, 0.75, 1.0)
#: Takes rows of a stack and matrices, shape (k, 3, 3), and returns force, moment about the arm's joint and wrench of
#: the device's own moving part, shapes (k, 3), (k, 3) and (k, 6), base frame.
ArmLoads = Callable[[NDArray[np.intp], FloatArray], tuple[FloatArray, FloatArray, FloatArray]]


class DevicePlacement(NamedTuple):
    """Placement of the parts of the device, N poses, seen from the displaced centre of the arm's joint.

    Attributes
    ----------
    base_points : ndarray
        A_i about the centre of the base ring, turned with it, shape (N, n, 3), m, base frame.
    matrices : ndarray
        Orientation of the platform, shape (N, 3, 3).
    base, cuff : ndarray
        Centre of the base ring, base frame, and of the platform, axes of the platform, shape (N, 3), m.
    """

    base_points: FloatArray
    matrices: FloatArray
    base: FloatArray
    cuff: FloatArray


def placed(
    points: FloatArray,
    arm: FloatArray,
    delta: FloatArray,
    base: FloatArray,
    cuff: FloatArray,
    interfaces: Interfaces,
    harness_displacement: FloatArray,
    cuff_displacement: FloatArray,
) -> DevicePlacement:
    """Placement of the parts, k poses.

    Parameters
    ----------
    points : ndarray
        A_i about the centre of the base ring, shape (n, 3), m.
    arm : ndarray
        Orientation of the arm, shape (k, 3, 3).
    delta, base, cuff : ndarray
        δ and the centre offsets, shape (k, 3), m.
    interfaces : Interfaces
        Harness and cuff.
    harness_displacement, cuff_displacement : ndarray
        (t, v) of those that are not rigid, shape (k, 6), else (k, 0).
    """
    base_points = np.repeat(points[None], len(arm), axis=0)
    platform = arm
    if interfaces.harness is not None:
        turn = turn_matrix(harness_displacement[:, 3:])
        base_points = base_points @ np.swapaxes(turn, 1, 2)
        base = _moved(interfaces.harness, harness_displacement, turn, base)
    if interfaces.cuff is not None:
        turn = turn_matrix(cuff_displacement[:, 3:])
        platform = arm @ turn
        cuff = turned(np.swapaxes(turn, 1, 2), _moved(interfaces.cuff, cuff_displacement, turn, cuff))
    return DevicePlacement(base_points, platform, base - delta, cuff)


def turned(matrices: FloatArray, vectors: FloatArray) -> FloatArray:
    """Vectors of shape (k, 3), each turned by its own matrix."""
    return np.asarray((matrices @ vectors[..., None])[..., 0])


def displacement_under(
    interface: Interface, displacement: FloatArray, wrench: FloatArray, centre: FloatArray
) -> FloatArray:
    """(t, v), shape (k, 6), under a wrench on the displaced part of the device, moment about ``centre``."""
    force = wrench[:, :3]
    moment = wrench[:, 3:] - np.cross(np.asarray(interface.at) + displacement[:, :3] - centre, force)
    generalised = turned(np.swapaxes(left_jacobian(displacement[:, 3:]), 1, 2), moment)
    return np.concatenate([force, generalised], axis=1) @ interface.compliance


def _moved(interface: Interface, displacement: FloatArray, turn: FloatArray, point: FloatArray) -> FloatArray:
    """Displaced position of a point of the device's part, shape (k, 3)."""
    at = np.asarray(interface.at)
    return np.asarray(at + displacement[:, :3] + turned(turn, point - at))


@dataclass(eq=False)
class ElasticEquations(Record):
    """r(x, λ) of a stack of poses, load and offset in the share λ.

    x is δ, where the shoulder is not rigid, with locked actuators v, then (t_h, v_h) and (t_c, v_c) where harness and
    cuff are not rigid, and with locked actuators f.

    Parameters
    ----------
    mechanism : Mechanism
        The design.
    query : Query
        N poses.
    base, cuff : ndarray
        Centre offsets, shape (N, 3), m.
    loads_at : callable
        Of the arm; see :data:`ArmLoads`.
    stiffness : ndarray or None
        K_s, shape (3, 3), N/m; None of a rigid shoulder, whose δ is zero and whose force follows from the others.
    locked : bool
        Whether the actuators are locked.
    """

    mechanism: Mechanism
    query: Query
    base: FloatArray
    cuff: FloatArray
    loads_at: ArmLoads
    stiffness: FloatArray | None
    locked: bool

    def __post_init__(self) -> None:
        mechanism, query = self.mechanism, self.query
        own, geometry = mechanism.interfaces, mechanism.geometry
        self.harness, self.soft_cuff = own.harness, own.cuff
        self.flexibility, self.resists = guide_flexibility(mechanism)
        #: Turns of the guides' ends at the last evaluation of each pose.
        self.ends = np.zeros((len(self.base), mechanism.limb_count, 4))
        self._fixed = None if self.locked else self.loads_at(np.arange(len(self.base)), query.matrices)
        aligned = geometry.platform_points @ np.swapaxes(query.matrices, 1, 2) - geometry.base_points
        self.lengths = np.linalg.norm(aligned, axis=-1)
        ends = np.cumsum(
            [
                3 * (self.stiffness is not None),
                3 * self.locked,
                6 * (self.harness is not None),
                6 * (self.soft_cuff is not None),
            ]
        )
        self.parts = [slice(a, b) for a, b in zip([0, *ends[:-1]], ends, strict=True)]
        self.size = int(ends[-1]) + mechanism.limb_count * self.locked

    @property
    def scale(self) -> FloatArray:
        """Size of a large change of x, shape (m,): a tenth of a limb, half a radian."""
        scale = np.full(self.size, np.inf)
        length = 0.2 * self.mechanism.geometry.platform_radius
        joint, turn, *springs = self.parts
        scale[joint], scale[turn] = length, 0.5
        for part in springs:
            scale[part] = np.repeat([length, 0.5], (part.stop - part.start) // 2)
        return scale

    def __call__(
        self, rows: NDArray[np.intp], x: FloatArray, parameter: FloatArray
    ) -> tuple[FloatArray, FloatArray, FloatArray]:
        """r, ∂r/∂x and ∂r/∂λ; see :func:`exo_pin.numerics.continuation.follow`."""
        k, m = x.shape
        steps = 1j * _STEP * np.eye(m + 1)
        points = np.concatenate([x, parameter[:, None]], axis=1)[:, None] + steps
        loads = self._varied_loads(rows, x)
        with np.errstate(all="ignore"):
            out = self._residual(np.repeat(rows, m + 1), points.reshape(-1, m + 1), m + 1, loads).reshape(k, m + 1, m)
        slopes = np.swapaxes(out.imag, 1, 2) / _STEP
        return out[:, 0].real, slopes[:, :, :m], slopes[:, :, m]

    def centre(self, x: FloatArray) -> FloatArray:
        """δ of unknowns of shape (k, m), shape (k, 3), m."""
        return x[:, self.parts[0]] if self.stiffness is not None else np.zeros((len(x), 3), dtype=x.dtype)

    def place(self, rows: NDArray[np.intp], x: FloatArray, share: FloatArray) -> tuple[DevicePlacement, FloatArray]:
        """Placement of the parts, and orientation of the arm, for x of shape (k, m) and λ of shape (k,)."""
        delta, (turn, *gives) = self.centre(x), (x[:, part] for part in self.parts[1:])
        arm = self.query.matrices[rows].astype(x.dtype)
        if self.locked:
            arm = turn_matrix(turn) @ arm
        offsets = share[:, None] * self.base[rows], share[:, None] * self.cuff[rows]
        points = self.mechanism.geometry.base_points
        return placed(points, arm, delta, *offsets, self.mechanism.interfaces, *gives), arm

    def sides(self, placement: DevicePlacement, start: FloatArray, copies: int = 1) -> tuple[SideWrenches, FloatArray]:
        """Side wrenches at a placement, which may be complex, and turns of the guides' ends; see bent_wrenches."""
        guides = straight_guides(placement.base_points, self.mechanism.geometry.platform_points, *placement[1:])
        return bent_wrenches(guides, self.flexibility, self.resists, self.mechanism.is_upu, start, copies)

    def _residual(
        self, rows: NDArray[np.intp], z: FloatArray, copies: int, loads: tuple[FloatArray, ...]
    ) -> FloatArray:
        """r, shape (k, m), of x and λ side by side; loads in full; ``copies`` rows each have the same real parts."""
        force, moment, device = loads
        x, share = z[:, :-1], z[:, -1]
        placement, arm = self.place(rows, x, share)
        # The turns of the guides' ends differ little from those of the evaluation before.
        side, ends = self.sides(placement, self.ends[rows], copies)
        self.ends[rows[::copies]] = np.nan_to_num(ends[::copies].real)
        g = side.stiffness * side.deflection
        closure, limb_share = self._limbs(rows, placement, side)
        own = share[:, None, None] * closure
        limbs = own - share[:, None, None] * limb_share
        sides = np.concatenate([side.forces, side.moments], axis=-1)
        lines = np.concatenate([side.directions, side.moment_arms], axis=-1)
        rest = share[:, None] * np.concatenate([force, moment], axis=1) + (limbs - g[..., None] * sides).sum(axis=1)
        f = x[:, self.parts[3].stop :] if self.locked else _tensions(side.moment_arms, rest[:, 3:])
        pull = f[..., None] * lines
        carried = rest - pull.sum(axis=1)
        delta, out = self.centre(x), []
        if self.stiffness is not None:
            # The shoulder puts -K_s δ on the arm.
            out.append(carried[:, :3] - delta @ self.stiffness)
        if self.locked:
            out.append(carried[:, 3:])
        if self.harness is not None:
            wrench = (pull + g[..., None] * sides - own).sum(axis=1)
            own_x = x[:, self.parts[2]]
            out.append(own_x - displacement_under(self.harness, own_x, wrench, delta))
        if self.soft_cuff is not None:
            wrench = share[:, None] * device + (limbs - g[..., None] * sides - pull).sum(axis=1)
            back = np.swapaxes(arm, 1, 2)
            wrench = np.concatenate([turned(back, wrench[:, :3]), turned(back, wrench[:, 3:])], axis=1)
            own_x = x[:, self.parts[3]]
            out.append(own_x - displacement_under(self.soft_cuff, own_x, wrench, np.zeros_like(delta)))
        if self.locked:
            lines = self.mechanism.geometry.platform_points @ np.swapaxes(placement.matrices, 1, 2)
            lines = lines + turned(placement.matrices, placement.cuff)[:, None]
            lines = lines - placement.base_points - placement.base[:, None]
            out.append(np.sqrt((lines * lines).sum(axis=-1)) - self.lengths[rows])
        return np.asarray(np.where(side.folded[:, None], np.nan, np.concatenate(out, axis=1)))

    def query_at(self, rows: NDArray[np.intp], at: DevicePlacement) -> Query:
        """Rows of the query at the platform's orientations."""
        return Query((len(rows),), at.matrices, *(part[rows] for part in self.query[2:]))

    def _limbs(self, rows: NDArray[np.intp], at: DevicePlacement, side: SideWrenches) -> tuple[FloatArray, FloatArray]:
        """Wrenches of limbs with mass at f = g = 0, as :func:`limb_loads` gives them."""
        return limb_loads(self.mechanism, self.query_at(rows, at), at.base, at.cuff, side.folded, at.base_points)

    def loads(self, rows: NDArray[np.intp], arm: FloatArray) -> tuple[FloatArray, FloatArray, FloatArray]:
        """Loads at orientations of the arm; see :data:`ArmLoads`."""
        if self._fixed is None:
            return self.loads_at(rows, arm)
        force, moment, device = (part[rows] for part in self._fixed)
        return force, moment, device

    def led_to(
        self, x: FloatArray, row: int, delta: FloatArray, on_torso: FloatArray, by_cuff: FloatArray
    ) -> FloatArray:
        """x of one held pose that follows from the wrenches on harness and cuff at x.

        Parameters
        ----------
        x : ndarray
            Shape (m,), at which the wrenches act.
        row : int
            The pose.
        delta : ndarray
            The new δ, shape (3,), m.
        on_torso, by_cuff : ndarray
            Wrench of the limbs on the torso, and of the cuff on the arm, shape (6,), base frame, moments about the
            centre of the arm's joint.
        """
        centre = self.centre(x[None])
        parts = [] if self.stiffness is None else [delta]
        if self.harness is not None:
            parts.append(displacement_under(self.harness, x[None, self.parts[2]], on_torso[None], centre)[0])
        if self.soft_cuff is not None:
            wrench = np.concatenate(np.split(by_cuff, 2) @ self.query.matrices[row])[None]
            parts.append(displacement_under(self.soft_cuff, x[None, self.parts[3]], wrench, 0.0 * centre)[0])
        return np.concatenate(parts)

    def _varied_loads(self, rows: NDArray[np.intp], x: FloatArray) -> tuple[FloatArray, ...]:
        """Loads of the arm at the turns of x, m + 1 times a row, with their changes by the complex steps of x."""
        count = x.shape[1] + 1
        if self._fixed is not None:
            return tuple(np.repeat(part[rows], count, axis=0) for part in self._fixed)
        # Each row at its rotation and at small rotations to both sides about each axis, in one stack.
        steps = _TURN * np.concatenate([np.zeros((1, 3)), np.eye(3), -np.eye(3)])
        turned_arm = turn_matrix(x[:, None, self.parts[1]] + steps) @ self.query.matrices[rows][:, None]
        found = self.loads(np.repeat(rows, len(steps)), turned_arm.reshape(-1, 3, 3))
        parts = []
        for part in (part.reshape(len(x), len(steps), -1) for part in found):
            repeated = np.repeat(part[:, :1], count, axis=1).astype(complex)
            slopes = (part[:, 1:4] - part[:, 4:]) / (2.0 * _TURN)
            repeated[:, self.parts[1]] += 1j * _STEP * slopes
            parts.append(repeated.reshape(len(x) * count, -1))
        return tuple(parts)


def settle(equations: ElasticEquations, rows: NDArray[np.intp]) -> tuple[FloatArray, FloatArray]:
    """Follow the equilibrium from the unloaded, aligned device to full load and offset.

    Parameters
    ----------
    equations : ElasticEquations
        Of N poses.
    rows : ndarray of int
        The poses to solve.

    Returns
    -------
    x : ndarray
        Shape (N, m); zero in rows that were not reached.
    reached : ndarray
        Shape (N,): the share of load and offset at which the path ended, 1 for an answer, 0 in other rows.
    """
    count = len(equations.base)
    x, reached = np.zeros((count, equations.size)), np.zeros(count)
    if not equations.size:
        # Nothing but the guides gives way, in the given place of their ends, to which they are led in some steps.
        for share in _SHARES:
            at, _ = equations.place(rows, x[rows], np.full(len(rows), share))
            equations.ends[rows] = np.nan_to_num(equations.sides(at, equations.ends[rows])[1])
        reached[rows] = 1.0
        return x, reached
    path = follow(equations, rows, equations.scale)
    good = path.reached >= 1.0
    x[rows[good]], reached[rows] = path.x[good], path.reached
    return x, reached


def _tensions(arms: FloatArray, moment: FloatArray) -> FloatArray:
    """f of least norm with Σ f_i arm_i = moment, shape (k, n), by formulas that are analytic."""
    matrix = np.swapaxes(arms, 1, 2)
    if arms.shape[1] == 3:
        return solved(matrix, moment)
    return turned(arms, solved(matrix @ arms, moment))
