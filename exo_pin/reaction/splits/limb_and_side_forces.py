"""Limb and side forces chosen together within the limits of limbs and socket: one quadratic program a pose."""

from __future__ import annotations

from typing import NamedTuple

import numpy as np
import scipy
from numpy.typing import NDArray
from scipy.spatial.transform import Rotation

from ...core.errors import SolverFailed
from ...core.validation import FloatArray
from ...numerics import LeastSquares, solve
from ...wrist.forces.affine_state import AffineState, Follower
from ..constraints.glenoid_cone import GlenoidCone

_NONE = np.empty(0)
#: Imbalance of moments, over the scale of the forces, of an answer.
_BALANCED = 1e-6


class Socket(NamedTuple):
    """The half-spaces N F_s <= h of a glenoid cone, and the penalty outside it (None: not allowed).

    N has the shape (faces, 3), or (count, faces, 3) for a stack of poses.
    """

    N: FloatArray
    h: FloatArray
    penalty: float | None

    @classmethod
    def of(cls, cone: GlenoidCone, side: str, pose: Rotation) -> Socket:
        """Of a stack of poses, flattened."""
        N, h = cone.half_spaces(side, pose)
        return cls(N.reshape(-1, *N.shape[-2:]), h, cone.penalty)

    def row(self, k: int) -> Socket:
        """Of pose k of a stack."""
        return self._replace(N=self.N[k])

    @property
    def is_hard(self) -> bool:
        """Whether F_s must stay inside."""
        return self.penalty is None


class PoseProgram(NamedTuple):
    """The program of one pose.

    Attributes
    ----------
    state : AffineState
        Forces of the pose as affine functions of f and g.
    radius : float
        Largest |B_i|, m, by which moments are divided.
    f_low, f_high : ndarray
        Limits of f, shape (n,), N.
    socket : Socket or None
        The glenoid cone.
    g_low, g_high : ndarray
        Limits of the side forces that are chosen with f, shape (u,), N.
    upu : ndarray of int
        Indices of their limbs, shape (u,).
    by_actuator : bool
        Whether |g_i| <= |f_i| besides, for f of one sign.
    goal : ndarray or None
        Square root of the cost of F_s, shape (3, 3); None for the forces of least norm.
    tension : float
        Weight of f beside it.
    alone : bool
        Whether F_s must be zero.
    metric : ndarray or None
        Without a ``goal``: its product with f, shape (k,), is minimised; None for f itself.
    follower : Follower or None
        Side forces that follow f by stiffness; ``state`` is then its state.
    scales : ndarray or None
        What each component of f is divided by where their squares are added, shape (n,).
    """

    state: AffineState
    radius: float
    f_low: FloatArray
    f_high: FloatArray
    socket: Socket | None
    g_low: FloatArray = _NONE
    g_high: FloatArray = _NONE
    upu: NDArray[np.int64] = _NONE.astype(np.intp)
    by_actuator: bool = False
    goal: FloatArray | None = None
    tension: float = 0.0
    alone: bool = False
    metric: FloatArray | None = None
    follower: Follower | None = None
    scales: FloatArray | None = None

    @property
    def shoulder_effect(self) -> FloatArray:
        """Shape (3, n + u): F_s per N of f and g."""
        return np.hstack([self.state.shoulder_of_f, self.state.shoulder_of_g[:, self.upu]])

    @property
    def moment_effect(self) -> FloatArray:
        """Shape (3, n + u), dimensionless: moment over ``radius`` per N of f and g."""
        return np.hstack([self.state.moment_of_f, self.state.moment_of_g[:, self.upu]]) / self.radius

    @property
    def has_side_moments(self) -> bool:
        """Whether side forces that are chosen with f have a moment about O."""
        return bool(self.state.moment_of_g[:, self.upu].any())

    def forces(self, z: FloatArray) -> tuple[FloatArray, FloatArray]:
        """f and g, shape (n,), of the variables z, shape (n + u,), N; within their limits to the last bit."""
        n = len(self.f_low)
        z = np.clip(z, self.low, self.high)
        if self.follower is not None:
            return z[:n], self.follower.g + self.follower.g_of_f @ z[:n]
        g = np.zeros(n)
        g[self.upu] = z[n:]
        return z[:n], g

    @property
    def low(self) -> FloatArray:
        """Shape (n + u,), N."""
        return np.concatenate([self.f_low, self.g_low])

    @property
    def high(self) -> FloatArray:
        """Shape (n + u,), N."""
        return np.concatenate([self.f_high, self.g_high])

    def side_rows(self) -> FloatArray:
        """Rows of |g_i| <= |f_i|, shape (2 u, n + u), each <= 0."""
        n, u = len(self.f_low), self.upu.size
        if not self.by_actuator:
            return np.empty((0, n + u))
        sign = 1.0 if (self.f_low >= 0.0).all() else -1.0
        rows = np.zeros((2 * u, n + u))
        for k, limb in enumerate(self.upu):
            rows[2 * k : 2 * k + 2, limb] = -sign
            rows[2 * k : 2 * k + 2, n + k] = 1.0, -1.0
        return rows


class Choice(NamedTuple):
    """f and g of one pose, with their optimality.

    Attributes
    ----------
    f, g : ndarray
        Shape (n,), N.
    kkt : float
        Largest violation of the optimality conditions over the largest force of the problem.
    gap : float
        The most, N, by which the square root of the cost (|F_s| where nothing else is weighted) can exceed its minimum.
    unique : bool
        Whether f and g are the only best ones; the cost's minimum always is.
    """

    f: FloatArray
    g: FloatArray
    kkt: float
    gap: float
    unique: bool


def force_scale(pose: PoseProgram) -> float:
    """Scale of the forces in a pose, N: load, tensions that balance it, and limits that are away from zero."""
    f = np.linalg.lstsq(pose.moment_effect, pose.state.moment / pose.radius, rcond=None)[0]
    # Distance of an interval from zero: the far ends of wide limits are no measure of the forces.
    nearest = np.maximum(pose.low, -pose.high)
    socket = () if pose.socket is None else pose.socket.h
    return float(np.concatenate([np.abs(pose.state.shoulder), np.abs(f), nearest, socket]).max()) or 1.0


def choose(pose: PoseProgram) -> Choice:
    """Solve one pose that is known to be feasible.

    Raises
    ------
    SolverFailed
        If the optimality conditions hold to no better than 1e-8.
    """
    scale = force_scale(pose)
    program, variables, root, sizes = _program(pose, scale)
    solution = solve(program)
    if not solution.is_optimal:
        raise SolverFailed("ProxQP", solution.kkt, "limb forces within limits")
    z = (sizes * solution.z)[:variables] * scale
    # The optimality conditions count relative to z: enormous side forces on rounding-size lever arms meet them.
    miss = float(np.abs(pose.moment_effect @ z - pose.state.moment / pose.radius).max())
    if not miss <= _BALANCED * scale:
        raise SolverFailed("ProxQP", miss / scale, "limb forces within limits")
    # Scaling back may round a variable on its limit to just beyond it.
    f, g = pose.forces(z)
    return Choice(f, g, solution.kkt, solution.residual_gap * scale / root, solution.unique)


def _program(pose: PoseProgram, scale: float) -> tuple[LeastSquares, int, float, FloatArray | float]:
    """The program in units of ``scale``.

    Also how many of its variables are forces f and g (the rest are slack), the factor on the square root of the cost
    that brings its largest weight to 1, and the unit of each variable.
    """
    state, S, n = pose.state, pose.shoulder_effect, len(pose.f_low)
    count = S.shape[1]
    constant = state.shoulder / scale
    # Minimised are weighted F_s and tension, or all forces; and the distance from a soft cone.
    if pose.goal is None:
        E = np.eye(count)
        if pose.metric is not None:
            E = np.vstack([np.pad(pose.metric, ((0, 0), (0, count - n))), E[n:]])
        d = np.zeros(len(E))
    else:
        tension = np.sqrt(pose.tension) * np.eye(n, count)[: n if pose.tension else 0]
        E = np.vstack([pose.goal @ S, tension])
        d = np.concatenate([-pose.goal @ constant, np.zeros(len(tension))])
    A, b = pose.moment_effect, state.moment / (pose.radius * scale)
    if pose.alone:
        A, b = np.vstack([A, S]), np.concatenate([b, -constant])
    C, low, high = pose.side_rows(), pose.low / scale, pose.high / scale
    c = np.zeros(len(C))
    if pose.socket is not None:
        N, h = pose.socket.N, pose.socket.h / scale
        C, c = np.vstack([C, N @ S]), np.concatenate([c, h - N @ constant])
        if pose.socket.penalty is not None:
            E = scipy.linalg.block_diag(E, np.sqrt(pose.socket.penalty) * np.eye(3))
            A, C = (np.pad(rows, ((0, 0), (0, 3))) for rows in (A, C))
            C[-len(N) :, count:] = -N
            d = np.pad(d, (0, 3))
            low, high = np.pad(low, (0, 3), constant_values=-np.inf), np.pad(high, (0, 3), constant_values=np.inf)
    sizes: FloatArray | float = 1.0
    if pose.scales is not None:
        sizes = np.concatenate([pose.scales, np.ones(len(low) - n)])
        # All forces count over their scales; F_s counts as it is.
        E = E if pose.goal is None and pose.metric is None else E * sizes
        A, C, low, high = A * sizes, C * sizes, low / sizes, high / sizes
    root = 1.0 / float(np.linalg.norm(E, axis=0).max())
    return LeastSquares(root * E, root * d, A, b, low, high, C, c), count, root, sizes
