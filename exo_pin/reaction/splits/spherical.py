"""Split "spherical": limbs that carry no side force, (D-30)."""

from __future__ import annotations

from typing import Any

import numpy as np
from numpy.typing import NDArray

from ...core.compiled import kernel
from ...core.validation import FloatArray
from ...design import Mechanism
from ...numerics.bounded.box_program import least_forces
from ...numerics.bounded.polytope_program import FEW, least_sum_force
from ...numerics.quadratic import LeastSquares, judged
from .limb_and_side_forces import Choice, Pose
from .pose_stack import PoseStack
from .split import Chosen, Split

#: Distance from a limit, relative to the largest tension, below which a tension is on it: rounding.
_ON_LIMIT = 1e-10
#: Imbalance, relative to the largest tension, above which the pose is left to a program, a tenth of the answer's own.
_EXACT = 1e-10


def shortest_tensions(
    f: FloatArray, self_stress: FloatArray, lower: FloatArray, upper: FloatArray, scales: FloatArray | None = None
) -> FloatArray:
    """The f + N y of least norm within limits, shape (M, n), N; NaN where there is none, or rounding decides.

    Parameters
    ----------
    f, lower, upper : ndarray
        Tensions that balance M poses, and limits, shape (M, n), N.
    self_stress : ndarray
        N, tensions that balance themselves, shape (M, n, m), columns orthonormal once divided by ``scales``.
    scales : ndarray, optional
        What each tension is divided by in the norm, shape (n,).
    """
    if scales is not None:
        parts = f / scales, self_stress / scales[:, None], lower / scales, upper / scales
        return np.clip(scales * shortest_tensions(*parts), lower, upper)
    out = np.full_like(f, np.nan)
    if self_stress.shape[2] <= FEW:
        shortest_within(f, np.ascontiguousarray(self_stress), lower, upper, out)
        return np.clip(out, lower, upper)
    # What self-stress cannot change has three components: the shortest of the tensions in a box that give them.
    carried = np.swapaxes(np.linalg.svd(self_stress)[0][..., self_stress.shape[2] :], 1, 2)
    wanted = (carried @ f[..., None])[..., 0]
    nearest = least_forces(-wanted, carried, lower, upper)
    held = np.abs(nearest.forces).max(axis=1) <= _EXACT * np.abs(wanted).max(axis=1)
    out[held] = nearest.variables[held]
    return out


@kernel(stack=True)
def shortest_within(f: Any, N: Any, low: Any, high: Any, out: Any) -> None:
    """Write the f + N z of least norm within the limits, row by row; rows without one are not written.

    |f + N z|² and |Nᵀ f + z|² differ by a constant, because the columns of N are orthonormal.

    Parameters
    ----------
    f, low, high : ndarray
        Shape (M, n), N.
    N : ndarray
        Shape (M, n, m), m = 1, 2 or 3, columns orthonormal.
    out : ndarray
        Shape (M, n), N.
    """
    n, m = N.shape[1:]
    c, G, z = np.zeros(3), np.zeros((3, m)), np.empty(m)
    for j in range(m):
        G[j, j] = 1.0
    for k in range(N.shape[0]):
        for j in range(m):
            c[j] = 0.0
            for i in range(n):
                c[j] += N[k, i, j] * f[k, i]
        if least_sum_force(c, G, f[k], N[k], low[k], high[k], z):
            for i in range(n):
                out[k, i] = f[k, i]
                for j in range(m):
                    out[k, i] += N[k, i, j] * z[j]


class Spherical(Split):
    """g = 0, as for bare pneumatic muscles; of tensions that balance themselves, those of least norm."""

    name = "spherical"
    assumption = "limbs that carry no side force (g = 0)"
    criterion = "least sum of squares of the tensions"
    options = frozenset({"cone"})

    def caption(self, mechanism: Mechanism) -> str:
        """The assumption in a few words."""
        if mechanism.drive_units:
            return "the cuff puts no more couple on the arm than equilibrium needs"
        return "limbs carry no side force"

    def assumed(self, mechanism: Mechanism) -> str:
        """The assumption in words: of limbs, or of the cuff of any other device."""
        if not mechanism.drive_units:
            return self.assumption
        return "a cuff that puts no couple on the arm beyond what equilibrium needs (g = 0)"

    def program(self, poses: PoseStack, row: int) -> Pose:
        """Tensions of least norm within their limits."""
        return poses.program(row)

    def choose_within(self, poses: PoseStack, rows: NDArray[np.intp], answer: Chosen) -> NDArray[np.intp]:
        """Tensions of least norm within their limits.

        Left are poses that cannot be held, or so nearly that rounding decides.
        """
        own = poses.tensions
        if not own.self_stress.shape[2]:
            return rows
        low, high = poses.limits.lower[rows], poses.limits.upper[rows]
        scales = None if poses.sharing is None else poses.sharing.scales
        f = shortest_tensions(own.f[rows], own.self_stress[rows], low, high, scales)
        scale = np.maximum(np.abs(f).max(axis=1), 1e-300)
        miss = (poses.state.moment_of_f[rows] @ f[..., None])[..., 0] - poses.state.moment[rows]
        # Also False where there are none.
        good = np.abs(miss).max(axis=1) <= _EXACT * poses.mechanism.radius * scale
        answer.put_determined(rows[good], f[good], np.zeros_like(f[good]))
        answer.unjudged[rows[good]] = True
        return rows[~good]

    def judged(self, poses: PoseStack, row: int, f: FloatArray, g: FloatArray) -> Choice:
        """Optimality of tensions within their limits."""
        scale = float(np.abs(f).max(initial=0.0)) or 1.0
        z, low, high = (part / scale for part in (f, poses.limits.lower[row], poses.limits.upper[row]))
        radius = poses.mechanism.radius
        A, b = poses.state.moment_of_f[row] / radius, poses.state.moment[row] / (radius * scale)
        if poses.scales is not None:
            z, low, high, A = z / poses.scales, low / poses.scales, high / poses.scales, A * poses.scales
        n, free = len(z), (low + _ON_LIMIT < z) & (z < high - _ON_LIMIT)
        program = LeastSquares(np.eye(n), np.zeros(n), A, b, low, high, np.empty((0, n)), np.empty(0))
        multipliers = -np.linalg.lstsq(A[:, free].T, z[free], rcond=None)[0]
        solution = judged(program, z, multipliers, np.empty(0))
        return Choice(f, g, solution.kkt, solution.residual_gap * scale, solution.unique)
