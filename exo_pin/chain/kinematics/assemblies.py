"""All closed configurations of a chain with some joints held, by closing from random starts until none is unseen.

Of each start the loops are closed with the held joints free, and these are driven to where they are held by damped
least-squares steps on the closed loops. Then the loops are closed with them held, as those are whose start does not
close.

How often each is found tells how many were not. By Good and Turing the probability that the next start finds a new one
is about the share of the starts whose configuration was found once; by Chao at least f1 (f1 - 1) / (2 (f2 + 1)) are
unseen, where f1 were found once and f2 twice (A. Chao, Scandinavian Journal of Statistics 11 (1984) 265-270). The
search stops where every configuration was found three times, so that both are zero, and where none was new for so long
that one three times rarer than the rarest would have been seen with a probability of 95 %. That is an estimate: a
configuration that hardly any start leads to may be missing.
"""

from __future__ import annotations

from collections.abc import Iterable
from dataclasses import dataclass

import numpy as np
import pinocchio as pin
from numpy.typing import ArrayLike, NDArray

from ...core.errors import UndeterminedMotion
from ...core.progress import track
from ...core.records import Record
from ...core.validation import FloatArray, as_count, frozen
from ..structure.chain_state import ChainState
from ..structure.memory.chain_buffers import forest_of
from ..structure.motion_axes import joint_names, limits_of
from .closing import mobilities, reference_configuration
from .closing_steps import BLOCK, closed_stack
from .loops import scaled_jacobian
from .reduced_kinematics import still_moving

#: Configurations whose bodies are no farther apart, characteristic lengths and entries of rotations, are one: where two
#: of them meet the loops close to the root of their residual.
_ALIKE = 1e-4
#: Residual of a closed loop, m and rad, and most steps to it.
_CLOSED, _STEPS = 1e-12, 60
#: How often steps that are stuck start anew.
_ROUNDS = 4
#: How often each configuration has to be found, and how much rarer than the rarest one may be that is not seen: of
#: that a search would have had three hits since the last new one, and has none with a probability of exp(-3).
_OFTEN, _RARER = 3, 3.0
#: Steps that drive held joints to their values, the longest one, characteristic lengths and rad, the damping over the
#: square of what is left, what is left at the end, residual and steps of loops that are closed on the way, and singular
#: values that are zero there.
_DRIVES, _LONGEST, _DAMPING, _DRIVEN, _ROUGHLY, _FEW, _ZERO = 40, 0.7, 0.05, 1e-6, 1e-6, 20, 1e-7
#: Residual of loops that are nearly closed, m and rad, and singular values that are rounding.
_NEARLY, _EXACT = 1e-5, 1e-12
#: Singular values up to this share of the largest are zero where two configurations meet.
_MEETING = 1e-4


@dataclass(frozen=True, eq=False)
class Assemblies(Record):
    """The closed configurations that were found with some joints held; prints as a table.

    Attributes
    ----------
    configurations : ndarray
        Shape (k, nq), m or rad of slides and hinges, the one found most often first.
    hits : ndarray of int
        Shape (k,), how many starts led to each.
    margins : ndarray
        Shape (k,), the smallest singular value of the loops with the joints held, over the largest: zero where two
        configurations meet, such as at a double root.
    starts : int
        Random starts, those whose loops did not close among them.
    since : int
        Closed ones after the first hit of the last one that was new.

    Examples
    --------
    >>> chain = ep.load("three-linear-actuators").chain
    >>> found = chain.assemblies(chain.roles.actuated, chain.close(chain.neutral()), frame="arm")
    >>> len(found), found.is_complete  # orientations of the arm with these three lengths
    (2, True)
    """

    configurations: FloatArray
    hits: NDArray[np.int64]
    margins: FloatArray
    starts: int
    since: int

    def __len__(self) -> int:
        return len(self.hits)

    @property
    def is_complete(self) -> bool:
        """Whether each was found three times, and one three times rarer than the rarest would be with 95 %."""
        return _is_enough(self.hits, self.since)

    @property
    def unseen(self) -> float:
        """About how many more there are, at least, by Chao's estimate; 0 where each was found twice."""
        once, twice = (int((self.hits == count).sum()) for count in (1, 2))
        return once * (once - 1) / (2 * (twice + 1))

    @property
    def meeting(self) -> NDArray[np.bool_]:
        """Shape (k,), where two or more configurations meet."""
        return np.asarray(self.margins < _MEETING)

    def __str__(self) -> str:
        met = f", {int(self.meeting.sum())} of them where two meet" if self.meeting.any() else ""
        rest = (
            f"each found {_OFTEN} times or more, and none new in the last {self.since} that closed"
            if self.is_complete
            else f"about {self.unseen:.1f} or more unseen, none new in the last {self.since}: give more starts"
        )
        head = (
            f"{len(self)} closed configurations{met} from {self.starts} starts, {int(self.hits.sum())} closed; {rest}"
        )
        return "\n".join([head, f"hits     {', '.join(map(str, self.hits))}"])


def _is_enough(hits: NDArray[np.int64], since: int) -> bool:
    """Whether a search may stop: see :attr:`Assemblies.is_complete`."""
    return bool(len(hits) and hits.min() >= _OFTEN and since * hits.min() >= 3.0 * _RARER * hits.sum())


def assemblies(
    state: ChainState,
    held: Iterable[str] = (),
    q: ArrayLike | None = None,
    frame: str | None = None,
    starts: int = 100_000,
    seed: int = 0,
    progress: bool = False,
) -> Assemblies:
    """All closed configurations with some joints held that random starts lead to.

    Starts are spread over whole turns of the hinges and balls, over the limits of slides, and over two characteristic
    lengths about q where these have none. The search stops where every configuration was found three times and none was
    new for so long that one three times rarer than the rarest would have been seen with a probability of 95 %. Joint
    limits do not count: :meth:`beyond_limits` says which a configuration breaks.

    Parameters
    ----------
    held : iterable of str
        Joints that do not move, such as the actuated ones; with them the loops have to determine all others.
    q : array_like, optional
        Shape (nq,), where they are held; :meth:`reference_configuration` if left out.
    frame : str, optional
        Configurations that put this frame at one pose count as one, such as those whose universal joints are turned
        over. If left out, all links have to be at theirs.
    starts : int
        At most so many.
    seed : int
        Of the random numbers.
    progress : bool
        Whether to show a bar.

    Returns
    -------
    Assemblies

    Raises
    ------
    UndeterminedMotion
        If joints can still move: hold more of them.

    Examples
    --------
    >>> exo = ep.load("scenario-one")
    >>> found = exo.chain.assemblies(exo.chain.roles.actuated, exo.chain.close(exo.chain.neutral()), frame="arm")
    >>> len(found), int(found.meeting.sum())  # in one of them two meet
    (3, 1)
    """
    names, most, top, count = joint_names(held), as_count("starts", starts, 1), state.topology, 0
    start = reference_configuration(state) if q is None else state.configuration(q)
    weight = mobilities(state, state.velocity_indices(names))
    forest, rng = forest_of(state), np.random.default_rng(seed)
    placed = state.topology.weight.copy()
    joint = 0 if frame is None else state.body_index(frame)
    while joint:
        placed[state.velocity_slice(str(state.model.names[joint]))] = 0.0
        joint = int(state.model.parents[joint])
    scale = np.ones((state.model.njoints - 1, 4, 3))
    scale[:, 3] = 1.0 / top.length
    bodies = slice(1, None) if frame is None else slice(state.body_index(frame), state.body_index(frame) + 1)
    scale = scale[: len(range(state.model.njoints)[bodies])]
    is_fixed, since, free = False, 0, np.flatnonzero(weight)
    found, hits, places = np.empty((0, state.nq)), np.empty(0, dtype=np.int64), np.empty((0, scale.size))
    for done in track(range(0, most, BLOCK), "closing", progress):
        count = min(BLOCK, most - done)
        rows, closed = _starts(state, start, weight, rng, count), np.zeros(count, dtype=np.bool_)
        if names:
            rows = _driven(state, rows, start, names, placed)
        # Along narrow valleys steps get stuck; some go on when they start anew from there.
        for _ in range(_ROUNDS):
            rows[~closed], closed[~closed] = closed_stack(state, rows[~closed], weight, _CLOSED, _STEPS, False)
        for k in np.flatnonzero(~closed):
            rows[k], closed[k] = _met(state, rows[k], weight)
        for row in rows[closed]:
            poses = (forest.kinematics(row[None])[0][0, bodies] * scale).ravel()
            near = np.flatnonzero(np.abs(places - poses).max(axis=1, initial=0.0) <= _ALIKE)
            since = since + 1 if near.size else 0
            if near.size:
                hits[near[0]] += 1
                continue
            found, hits, places = np.vstack([found, row]), np.append(hits, 1), np.vstack([places, poses])
        if len(found) and not is_fixed:
            is_fixed, moving = True, still_moving(state, found[0], free)
            if moving:
                scaled, least = scaled_jacobian(state, found[0])
                rank = np.linalg.matrix_rank(scaled[:, free], tol=least)
                raise UndeterminedMotion(found[0].copy(), len(free) - int(rank), moving)
        if _is_enough(hits, since):
            break
    order = np.argsort(-hits, kind="stable")
    margins = [_margin(scaled_jacobian(state, row)[0][:, free]) for row in found[order]]
    return Assemblies(frozen(found[order]), frozen(hits[order]), frozen(np.array(margins)), done + count, since)


def _starts(state: ChainState, q: FloatArray, weight: FloatArray, rng: np.random.Generator, count: int) -> FloatArray:
    """Random configurations, shape (count, nq), with coordinates without weight as in q."""
    reach = np.where(state.topology.metres, 2.0 * state.topology.length, np.pi) * (weight > 0.0)
    rows = np.array([pin.integrate(state.model, q, rng.uniform(-reach, reach)) for _ in range(count)])
    limits = limits_of(state.model)
    sliding = state.topology.metres[limits.v_index] & (weight[limits.v_index] > 0.0)
    sliding &= np.isfinite(limits.lower) & np.isfinite(limits.upper)
    lower, upper = limits.lower[sliding], limits.upper[sliding]
    rows[:, limits.q_index[sliding]] = rng.uniform(lower, upper, (count, len(lower)))
    return rows


def _driven(
    state: ChainState, rows: FloatArray, goal: FloatArray, joints: tuple[str, ...], placed: FloatArray
) -> FloatArray:
    """The starts, shape (n, nq), on closed loops as near to the values of joints in ``goal`` as steps bring them.

    The loops close first with the coordinates of some weight, those that do not carry the frame; what does not close
    stays as it is.
    """
    top, forest, held = state.topology, forest_of(state), state.velocity_indices(joints)
    own = np.concatenate([np.arange(state.nq)[state.configuration_slice(name)] for name in joints])
    found, closed = closed_stack(state, rows, placed, _ROUGHLY, _STEPS, False)
    going, q, work = np.flatnonzero(closed), found, state.buffers
    for _ in range(_DRIVES):
        left = np.array([pin.difference(state.model, row, goal)[held] for row in q[going]]).reshape(-1, len(held))
        left /= top.column[held]
        size = np.linalg.norm(left, axis=1)
        going, left, size = going[size > _DRIVEN], left[size > _DRIVEN], size[size > _DRIVEN]
        if not going.size:
            break
        J = np.empty((len(going), state.row_count, state.nv))
        for k, row in enumerate(q[going]):
            work.linearise(row)
            J[k] = work.jacobian * top.row_scale[:, None] * top.column
        _, values, Vt = np.linalg.svd(J, full_matrices=False)
        Vt = Vt * (values > _ZERO * values[:, :1])[..., None]
        # Motions that the loops allow, by the coordinates that have to move.
        along = (np.eye(state.nv) - np.swapaxes(Vt, 1, 2) @ Vt)[:, :, held]
        damping = (_DAMPING * size * size + _ZERO**2)[:, None, None] * np.eye(len(held))
        move = (along @ np.linalg.solve(along[:, held] + damping, left[..., None]))[..., 0]
        move *= _LONGEST / np.maximum(np.abs(move).max(axis=1), _LONGEST)[:, None]
        q[going] = closed_stack(
            state, forest.integrate(q[going], top.column * move), top.weight, _ROUGHLY, _FEW, False
        )[0]
    rows = np.where(closed[:, None], q, rows)
    rows[:, own] = goal[own]
    return rows


def _met(state: ChainState, row: FloatArray, weight: FloatArray) -> tuple[FloatArray, bool]:
    """Where nearly closed loops close, and whether they do: without damping, which is too strong where several meet."""
    top, work, column = state.topology, state.buffers, np.sqrt(weight)
    for _ in range(_STEPS):
        # The first step leaves the other directions open by its square.
        if not _CLOSED < work.linearise(row) <= _NEARLY:
            break
        J = work.jacobian * top.row_scale[:, None] * column
        step = np.linalg.lstsq(J, -work.gap * top.row_scale, rcond=_EXACT)[0]
        row = np.asarray(pin.integrate(state.model, row, column * step))
    return row, work.residual(row) <= _CLOSED


def _margin(J: FloatArray) -> float:
    """The smallest singular value over the largest, of a matrix that has no more columns than rows."""
    values = np.linalg.svd(J, compute_uv=False)
    return float(values[-1] / values[0]) if len(values) else 0.0
