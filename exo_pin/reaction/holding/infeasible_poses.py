"""Poses that the limbs cannot hold: the closest forces, the limits that block, and a direction that proves it."""

from __future__ import annotations

import functools
import itertools
from typing import TYPE_CHECKING

import numpy as np
import scipy
from numpy.typing import NDArray

from ...core.errors import SolverFailed
from ...core.validation import FloatArray
from ...numerics import LeastSquares, Solution, solve
from ...numerics.vectors import SINGULAR
from ...wrist.forces.wrench_feasibility import margin_stack, moment_margin
from ..evidence import AnswerSource, Infeasibility, Shortfall, infeasibility_of
from ..splits.limb_and_side_forces import PoseProgram, force_scale

if TYPE_CHECKING:
    from ..splits.pose_stack import PoseStack

#: Missing force, relative to the scale of the forces, below which a pose counts as held, as tensions alone do.
HELD = 1e-10
#: Margin of the moments, relative to the same scale, beyond which rounding does not decide.
_CLEAR = 1e-9
#: Multiplier, relative to the missing force, above which its limit blocks.
_BLOCKS = 1e-7
#: Part of a unit normal in a row, and of a column along it, that is rounding.
_NONE = 1e-12
#: Part of a normal in the rows of the moments below which a face has the same distance from every moment.
_OF_IDLE = 1e-9


def infeasibility(source: AnswerSource) -> Infeasibility | None:
    """What is missing in the poses of an answer that cannot be held, strokes left out; None if nothing is.

    None also if the split takes no other forces than those of plain equilibrium, as of locked actuators.
    """
    if not source.split.chooses_tensions:
        return None
    found: dict[int, Shortfall] = {}
    sharing = source.poses.sharing
    for row in np.flatnonzero(~source.held).tolist():
        try:
            missing = shortfall(source.split.program(source.poses, row))
        except SolverFailed:
            continue
        if missing is not None and sharing is not None and sharing.wearer is not None:
            # That the wearer gives nothing is what is asked, and no limit of the device.
            missing = missing._replace(blocking=np.where(sharing.wearer, np.int8(0), missing.blocking))
        if missing is not None:
            found[row] = missing
    return infeasibility_of(source.shape, found, source.poses.mechanism.drive_units) if found else None


def disturbing_moment(poses: PoseStack) -> FloatArray:
    """Moment of any direction that is held besides within the limits, shape (N,), N m; negative in a pose not held."""
    return _margins(poses, np.arange(len(poses.status)))


def _margins(poses: PoseStack, rows: NDArray[np.intp]) -> FloatArray:
    """The same of some poses, shape (k,)."""
    state, limits = poses.state, poses.limits
    count, n = len(rows), limits.lower.shape[1]
    low, high, status = limits.lower[rows], limits.upper[rows], poses.status[rows]
    M, m = state.moment_of_f[rows], state.moment[rows]
    if m.shape[1] > 3:
        each = zip(M, m, low, high, strict=True)
        found = np.array([margin_of_rows(*pose)[0] for pose in each])
        return np.where(status < SINGULAR, found, np.nan)
    margin, unused = np.empty(count), np.empty((2, count, n))
    margin_stack(
        np.ascontiguousarray(np.swapaxes(M, 1, 2)), m, low, high, status, margin, np.empty((count, 3)), *unused
    )
    return margin


def clearly_infeasible(poses: PoseStack, rows: NDArray[np.intp]) -> NDArray[np.bool_]:
    """Which of some poses miss moments by so much that rounding does not decide, shape (k,).

    For splits whose programs bind neither F_s nor side forces with moments: then the moments alone decide.
    """
    low, high = poses.limits.lower[rows], poses.limits.upper[rows]
    nearest = np.maximum(low, -high).max(axis=1)
    sizes = (np.abs(part[rows]).max(axis=1) for part in (poses.state.shoulder, poses.tensions.f))
    return np.asarray(
        _margins(poses, rows) < -_CLEAR * poses.mechanism.radius * functools.reduce(np.maximum, sizes, nearest)
    )


def is_held(pose: PoseProgram) -> bool:
    """Whether forces within all limits balance a pose; see :func:`shortfall`.

    Raises
    ------
    SolverFailed
        If that could not be decided.
    """
    scale, bound = force_scale(pose), _is_bound(pose)
    if not bound and not pose.has_side_moments:
        margin = _margin(pose, np.empty(len(pose.f_low)), np.empty(len(pose.f_low)))
        if abs(margin) > _CLEAR * scale * pose.radius:
            return margin > 0.0
    return shortfall(pose) is None


def shortfall(pose: PoseProgram) -> Shortfall | None:
    """What is missing in a pose; None if nothing is.

    Where F_s is free, the exact set of moments is tested first, and only poses that fail need a program. The closest
    wrench is a least-squares problem with hard limits. Its optimality condition is the proof: the residual separates
    the required wrench from all wrenches that can be supplied.

    Raises
    ------
    SolverFailed
        If the closest wrench was not found to its accuracy.
    """
    scale = force_scale(pose)
    bound = _is_bound(pose)
    n = len(pose.f_low)
    low_relief, high_relief = np.zeros(n), np.zeros(n)
    quick = not bound and not pose.has_side_moments
    if quick and _margin(pose, low_relief, high_relief) >= 0.0:
        return None
    program, target = _closest(pose, scale, bound)
    solution = solve(program)
    if not solution.is_optimal:
        raise SolverFailed("ProxQP", solution.kkt, "closest wrench within limits")
    missing = -solution.residual * scale
    size = float(np.linalg.norm(missing))
    if size <= HELD * scale * max(1.0, float(np.abs(solution.z).max())):
        return None
    y = missing / size
    required, available, valid = _separation(program, solution, y, target, size / scale)
    if required - available < 0.5 * size / scale:
        # The residual proves nothing, so it is an error of the solver: at the exact answer both sides are equal.
        return None
    blocking = _blocking(program, solution, size / scale, n)
    if not quick:
        relief = np.array([_relief(program, target, i, blocking[i]) * scale for i in range(n)])
    else:
        relief = np.where(blocking < 0, low_relief, np.where(blocking > 0, high_relief, np.inf))
    z = np.clip(solution.z[: n + pose.upu.size] * scale, pose.low, pose.high)
    f, g = pose.forces(z)
    shoulder = pose.state.shoulder + pose.shoulder_effect @ z
    if bound:
        shoulder = np.zeros(3) if pose.alone else solution.z[n + pose.upu.size :] * scale
    # The rows of the program are (moment / radius, force); the result has (force, moment).
    force = missing[3:] if bound else np.zeros(3)
    moment = missing[:3] * pose.radius
    direction = np.concatenate([y[3:] if bound else np.zeros(3), y[:3] / pose.radius])
    return Shortfall(
        f,
        g,
        shoulder,
        np.concatenate([force, moment]),
        direction,
        required * scale,
        available * scale,
        valid * scale,
        blocking,
        relief,
    )


def _is_bound(pose: PoseProgram) -> bool:
    """Whether F_s is bound, so that forces count beside moments."""
    return pose.alone or (pose.socket is not None and pose.socket.is_hard)


def _margin(pose: PoseProgram, low_relief: FloatArray, high_relief: FloatArray) -> float:
    """Disturbing moment that is held besides, N m, negative where the pose is not held; fills the reliefs."""
    if len(pose.state.moment) > 3:
        own = pose.state.moment_of_f, pose.state.moment, pose.f_low, pose.f_high
        margin, low_relief[:], high_relief[:] = margin_of_rows(*own)
        return margin
    return float(
        moment_margin(
            np.ascontiguousarray(pose.state.moment_of_f.T),
            # Copies: the kernel is compiled anew for arrays that cannot be written.
            *(np.array(part) for part in (pose.state.moment, pose.f_low, pose.f_high)),
            np.empty(3),
            low_relief,
            high_relief,
        )
    )


def _closest(pose: PoseProgram, scale: float, bound: bool) -> tuple[LeastSquares, FloatArray]:
    """Least-squares balance under hard limits; rows (moment / radius), and force too where F_s is bound.

    Signs: the limbs must supply ``state.moment``; F_s - S z = ``state.shoulder`` is the balance of forces. A device's
    own motions must be in balance: nobody but its drives holds them.
    """
    T, target = pose.moment_effect, pose.state.moment / (pose.radius * scale)
    A, b = T[3:], target[3:]
    T, target = T[:3], target[:3]
    low, high = pose.low / scale, pose.high / scale
    C = pose.side_rows()
    c = np.zeros(len(C))
    if bound:
        T = np.vstack([T, -pose.shoulder_effect])
        target = np.concatenate([target, pose.state.shoulder / scale])
    if bound and not pose.alone:
        assert pose.socket is not None
        T, A = np.hstack([T, np.eye(6, 3, -3)]), np.pad(A, ((0, 0), (0, 3)))
        C, c = scipy.linalg.block_diag(C, pose.socket.N), np.concatenate([c, pose.socket.h / scale])
        low, high = np.pad(low, (0, 3), constant_values=-np.inf), np.pad(high, (0, 3), constant_values=np.inf)
    return LeastSquares(T, target, A, b, low, high, C, c), target


def _separation(
    program: LeastSquares, solution: Solution, y: FloatArray, target: FloatArray, size: float
) -> tuple[float, float, float]:
    """Required along y, the most that can be supplied along it, and the forces up to which that holds.

    For ν >= 0 and any μ: max of y·T z over the limits <= ν·c + μ·b + max over the bounds of (Tᵀy - Cᵀν - Aᵀμ)·z.
    """
    nu = np.maximum(solution.inequality, 0.0) / size
    gain = program.E.T @ y - program.C.T @ nu
    held = np.linalg.lstsq(program.A.T, gain - solution.bound / size, rcond=None)[0] if len(program.b) else program.b
    gain = gain - program.A.T @ held
    endless = np.where(gain > 0, np.isinf(program.high), np.isinf(program.low)) & (gain != 0.0)
    reach = np.where(endless, 0.0, np.where(gain > 0, program.high, program.low))
    reach[gain == 0.0] = 0.0
    required, available = float(y @ target), float(nu @ program.c + held @ program.b + gain @ reach)
    leak = float(np.abs(gain[endless]).sum())
    return required, available, np.inf if leak == 0.0 else max(0.0, required - available) / leak


def _blocking(program: LeastSquares, solution: Solution, size: float, n: int) -> NDArray[np.int8]:
    held = solution.bound[:n]
    limit = np.where(held < 0, program.low[:n], program.high[:n])
    return np.where((np.abs(held) > _BLOCKS * size) & np.isfinite(limit), np.sign(held), 0).astype(np.int8)


def _relief(program: LeastSquares, target: FloatArray, limb: int, blocking: int) -> float:
    """Relaxation of one blocking limit alone that makes the pose feasible: a linear program."""
    if blocking == 0:
        return np.inf
    m = program.size
    low, high, cost = program.low.copy(), program.high.copy(), np.eye(m + 1)[m]
    # The last variable is the relaxation: the limit may be passed by that much.
    row = float(blocking) * np.eye(m + 1)[limb] - cost
    relaxed, side = (low, -low[limb]) if blocking < 0 else (high, high[limb])
    relaxed[limb] = blocking * np.inf
    answer = scipy.optimize.linprog(
        cost,
        A_ub=np.vstack([np.pad(program.C, ((0, 0), (0, 1))), row]),
        b_ub=np.append(program.c, side),
        A_eq=np.pad(np.vstack([program.E, program.A]), ((0, 0), (0, 1))),
        b_eq=np.concatenate([target, program.b]),
        bounds=[*zip(low, high, strict=True), (0.0, None)],
        method="highs",
    )
    return float(answer.x[m]) if answer.status == 0 else np.inf


def margin_of_rows(
    rows: FloatArray, load: FloatArray, lower: FloatArray, upper: FloatArray
) -> tuple[float, FloatArray, FloatArray]:
    """Disturbing moment that is held besides, N m, negative where a pose is not held, and the reliefs of both limits.

    With d idle motions that must stay in balance, equilibrium has r = 3 + d rows. What efforts between their limits
    supply is a sum of segments in r dimensions, whose faces are spanned by r - 1 of them: every set of r - 1
    efforts gives a normal ν, and a load m is supplied if and only if ν · m <= the most that efforts supply along ν,
    for all of them and both signs. The moments that are supplied while the idle motions are in balance are a slice
    of that set. The distance of m from a face, within the slice, is the slack over the length of the moment part of
    ν.

    Parameters
    ----------
    rows : ndarray
        M_f, shape (r, n): three rows of moments, then those of idle motions.
    load : ndarray
        m, shape (r,).
    lower, upper : ndarray
        Limits of the efforts, shape (n,).

    Returns
    -------
    margin : float
        Infinite where every moment is held.
    low, high : ndarray
        Relaxation of this limit alone that makes the pose feasible, shape (n,); infinite where none does, zero where
        the pose is held.
    """
    r, n = rows.shape
    reliefs = np.zeros((2, n))
    chosen = np.array(list(itertools.combinations(range(n), r - 1)))
    if not len(chosen):
        return np.inf, *reliefs
    size = np.linalg.norm(rows, axis=0)
    unit = rows / np.where(size > 0.0, size, 1.0)
    _, values, Vt = np.linalg.svd(np.swapaxes(unit[:, chosen], 0, 1).swapaxes(1, 2))
    # Columns that depend on one another span no face; others do.
    firm = values[:, -1] > _NONE
    normals, chosen = Vt[firm, -1], chosen[firm]
    normals, spans = np.concatenate([normals, -normals]), np.concatenate([chosen, chosen])
    levers = normals @ rows
    levers[np.abs(levers) <= _NONE * size] = 0.0
    levers[np.arange(len(spans))[:, None], spans] = 0.0
    with np.errstate(invalid="ignore"):
        supplied = np.where(levers > 0.0, levers * upper, np.where(levers < 0.0, levers * lower, 0.0))
    slack = supplied.sum(axis=1) - normals @ load
    turning = np.linalg.norm(normals[:, :3], axis=1)
    of_idle = turning <= _OF_IDLE
    distance = np.where(of_idle, np.where(slack < 0.0, slack, np.inf), slack / np.where(of_idle, 1.0, turning))
    broken = slack < 0.0
    with np.errstate(divide="ignore", invalid="ignore"):
        need = -slack[broken, None] / levers[broken]
        for k, sign in enumerate((-1.0, 1.0)):
            reliefs[k] = np.where(sign * levers[broken] > 0.0, sign * need, np.inf).max(axis=0, initial=0.0)
    return float(distance.min(initial=np.inf)), *reliefs
