"""Where a file puts a chain, closing its loops with the least movement, and joints beyond their limits.

Closed-loop forward kinematics, along paths that stay on one assembly branch, and inverse kinematics.
"""

from __future__ import annotations

from collections.abc import Callable, Iterable, Iterator

import numpy as np
import pinocchio as pin
from numpy.typing import ArrayLike

from ...core.errors import BeyondLimits, BranchChanged, ExoPinError, LoopNotClosed, SamplesFailed
from ...core.errors.base import warn
from ...core.progress import track
from ...core.validation import FloatArray, as_choice, as_count, as_finite, as_positive
from ..structure.chain_state import ChainState
from ..structure.motion_axes import Limits, joint_names, limits_of
from .closing_steps import attempt, closed_stack
from .loops import scaled_jacobian
from .structural_rank import settled, structural_rank

#: Spread of the first restart, rad and characteristic lengths; it doubles up to the largest.
_FIRST_SPREAD, _LARGEST_SPREAD = 0.1, 1.6
#: Number of neighbouring poses that give the regular ranks, and their distance, rad and characteristic lengths.
#: Singular poses are a set of measure zero: random neighbours are regular.
_NEIGHBOURS, NEAR = 3, 0.05
#: The farthest of them where more than the second one of a singular value may be rounding.
_FARTHEST, _COARSE = 0.5, 1e-4
#: No coordinate is held.
NOTHING_HELD = np.array([], dtype=np.int64)
#: What may be left open of rows that a rounded geometry determines, in tolerances.
FEW = 5.0
#: MuJoCo's name of the configuration in which a file draws its bodies.
_AS_DRAWN = "qpos0"


#: Largest step along a path, rad and characteristic lengths. Branches farther apart than that are not confused.
_PATH_STEP = 0.1
#: Most halvings of a step along which the loops do not close.
_HALVINGS = 12
#: Largest correction of a predicted step, rad and characteristic lengths; a larger one may have changed the branch.
_JUMP = 0.5
CLOSED_TO = 1e-12
STEPS = 30
#: Loops open by less than this share of the characteristic length are near their branch.
_CLOSE = 1e-3
#: Most new starts for the values of held joints at which the others are closed.
_SEARCHES = 8


def reference_configuration(state: ChainState, name: str | None = None) -> FloatArray:
    """A configuration that the chain's file states, where :meth:`ClosedChain.close` may start.

    All joints are at zero where a URDF or SDF draws the bodies. In an MJCF they are not: a free joint counts from the
    world, and a hinge or slide from its ``ref``.

    Parameters
    ----------
    name : str, optional
        Of one of the model's ``referenceConfigurations``: "qpos0" or a keyframe of an MJCF. By default "qpos0" where
        there is one, else all joints at zero.

    Returns
    -------
    ndarray
        Shape (nq,). The loops may be open.

    Raises
    ------
    UnknownName
        If there is no such configuration; the message lists those there are.

    Examples
    --------
    >>> chain = ep.load("four-cables").chain
    >>> bool((chain.reference_configuration() == chain.neutral()).all())  # this file states no other
    True
    """
    known = {item.key(): item.data() for item in state.model.referenceConfigurations}
    if name is None and _AS_DRAWN not in known:
        return state.neutral()
    chosen = as_choice("reference configuration", _AS_DRAWN if name is None else name, known)
    return np.array(known[chosen], dtype=float)


def close(
    state: ChainState,
    q: ArrayLike,
    hold: Iterable[str] = (),
    tolerance: float = 1e-12,
    max_iterations: int = 60,
    respect_limits: bool = False,
    restarts: int = 8,
    progress: bool = False,
) -> FloatArray:
    """Close the loops, moving as little as possible.

    Damped Gauss-Newton on the configuration manifold. Every step is the least one, with metres divided by
    :attr:`ClosedChain.characteristic_length`. The result is near the nearest closed configuration, and is q itself if
    q is closed. If the steps make no progress, they start again from random configurations around q, nearer ones
    first, with a fixed seed.

    Parameters
    ----------
    q : array_like
        Shape (nq,), or (n, nq) for a stack of n samples: where to start. Every sample is closed by itself, as it is
        alone, and all of them in compiled code.
    hold : iterable of str
        Joints that must not move. If the loops close with the others as they are, as where a joint of a closed
        configuration was set to another value, the result is on the branch of that configuration: the joints move to
        where they are held as in :meth:`forward_kinematics`. Else, and where that branch ends or the joints cannot move
        by themselves, it is the nearest one.
    tolerance : float
        Largest residual of a closed loop, m and rad; more than 1e-8, up to which every method takes loops for closed,
        counts as that. Loops of a rounded geometry, which cannot close, are left
        open in rows that agree with others by the digits alone, by the least squares, and by at most five times its
        tolerance, over characteristic lengths below a metre, in rows that the geometry determines.
    max_iterations : int
        Most steps from every start.
    respect_limits : bool
        Whether every joint must be within its limits; otherwise :meth:`ClosedChain.beyond_limits` lists those that
        are not.
    restarts : int
        Most new starts; with 0 the result is on the branch of q.
    progress : bool
        Whether to show a bar over the samples of a stack.

    Returns
    -------
    ndarray
        As q, with the residual within ``tolerance``; see there for a rounded geometry.

    Raises
    ------
    InvalidInput
        If ``tolerance`` is not positive, or a number of steps or starts is no whole number of 0 or more.
    LoopNotClosed
        If the loops do not close; the error carries the best configuration, its residual and the number of
        steps. An open loop is never returned.
    BeyondLimits
        If they close only with joints beyond their limits, and ``respect_limits`` is true.
    SamplesFailed
        If some samples of a stack do not close: it has the error of each, and the other samples closed.

    Warns
    -----
    BranchChanged
        If the branch of q ends before the held joints are at their values.

    Examples
    --------
    >>> chain = ep.load("prototype").chain
    >>> q = chain.close(chain.neutral())
    >>> bool(np.abs(chain.residual(q)).max() < 1e-12)  # m, rad
    True
    """
    joints = list(joint_names(hold))
    held = state.velocity_indices(joints) if joints else NOTHING_HELD
    # Every other function takes what is closed here.
    tolerance = min(as_positive("tolerance", tolerance), state.closed)
    iterations, starts = as_count("max_iterations", max_iterations), as_count("restarts", restarts)

    def one(start: FloatArray) -> FloatArray:
        if not joints or state.buffers.residual(start) <= _CLOSE * state.topology.length:
            return nearest_closed(state, start, held, tolerance, iterations, respect_limits, starts)[0]
        base, found = _on_branch(state, start, joints)
        beyond = () if found is None or not respect_limits else beyond_limits(state, found)
        if found is not None and not beyond:
            return nearest_closed(state, found, held, tolerance, iterations)[0]
        nearest = nearest_closed(state, start, held, tolerance, iterations, respect_limits, starts)[0]
        if base is not None:
            text = f"the branch of the configuration ends before it has {', '.join(joints)} where they are held"
            if beyond:
                text = f"on the branch of the configuration the limits of {', '.join(beyond)} are passed"
            warn(f"{text}: another branch is returned", BranchChanged)
        return nearest

    if np.ndim(q) != 2:
        return one(state.configuration(q))
    rows = as_finite("q", q, (None, state.nq))
    closed, done = np.full(rows.shape, np.nan), np.zeros(len(rows), dtype=np.bool_)
    if not (respect_limits or state.tolerance or joints):
        closed, done = closed_stack(state, rows, mobilities(state, held), tolerance, iterations, progress)
    failures: dict[int, ExoPinError] = {}
    for k in track(np.flatnonzero(~done), "closing", progress and not done.any()):
        try:
            closed[k] = one(state.configuration(rows[k]))
        except ExoPinError as error:
            failures[int(k)], closed[k] = error, np.nan
    if failures:
        raise SamplesFailed(failures, len(rows), closed)
    return closed


def beyond_limits(state: ChainState, q: ArrayLike) -> tuple[str, ...]:
    """Names of the joints that are outside their limits at q.

    Limits are those of ``model.lowerPositionLimit`` and ``upperPositionLimit`` for joints whose coordinates are
    angles or lengths; quaternions and endless hinges have none.

    Parameters
    ----------
    q : array_like
        Shape (nq,).

    Returns
    -------
    tuple of str

    Examples
    --------
    >>> chain = ep.load("four-linear-actuators").chain_with_masses()
    >>> q = chain.close(chain.neutral())
    >>> q[chain.configuration_slice("limb_2_slide")] += 1.0  # m, more than the actuator's stroke
    >>> chain.beyond_limits(q)
    ('limb_2_slide',)
    """
    limits, value = limits_of(state.model), state.configuration(q)
    here = value[limits.q_index]
    outside = (here < limits.lower) | (here > limits.upper)
    return tuple(dict.fromkeys(limits.joints[k] for k in np.flatnonzero(outside)))


def mobilities(state: ChainState, held: np.ndarray) -> FloatArray:
    """Of each coordinate, as :func:`attempt` takes it, with some held."""
    weight = state.topology.weight
    if held.size:
        weight = weight.copy()
        weight[held] = 0.0
    return weight


def nearest_closed(
    state: ChainState,
    start: FloatArray,
    held: np.ndarray,
    tolerance: float,
    iterations: int,
    respect_limits: bool = False,
    restarts: int = 0,
) -> tuple[FloatArray, int]:
    """The closed configuration that :func:`close` returns, and the number of steps; the input is not checked."""
    loose = max(tolerance, state.closed) if state.tolerance else tolerance
    weight = mobilities(state, held)
    limits = limits_of(state.model) if respect_limits else None
    best = attempt(state, start, weight, loose, iterations, limits)
    if best.closed:
        best.q, best.closed = _least_open(state, best.q, weight, limits, tolerance)
        if best.closed:
            return best.q, best.steps
        best.stuck, best.steps = True, max(best.steps, 1)
    steps, spread = best.steps, _FIRST_SPREAD
    rng = np.random.default_rng(0)
    for _ in range(restarts if weight.any() else 0):
        if best.closed or not best.stuck:
            break
        away = np.sqrt(weight) * rng.uniform(-spread, spread, len(weight))
        spread = min(2 * spread, _LARGEST_SPREAD)
        other = attempt(state, pin.integrate(state.model, start, away), weight, loose, iterations, limits)
        steps += other.steps
        if other.closed:
            other.q, other.closed = _least_open(state, other.q, weight, limits, tolerance)
        if other.closed or other.residual < best.residual:
            best = other
        best.stuck = True
    if best.closed:
        return best.q, steps
    if respect_limits:
        free = attempt(state, start, weight, loose, iterations, None)
        if free.closed:
            raise BeyondLimits(free.q, beyond_limits(state, free.q))
    raise LoopNotClosed(best.q, best.residual, steps)


def neighbours(
    state: ChainState, q: FloatArray, motions: FloatArray, held: np.ndarray, known: float = 0.0
) -> Iterator[FloatArray]:
    """Some closed configurations beside q, where held coordinates are as in q.

    Parameters
    ----------
    state : ChainState
        The chain.
    q : ndarray
        Shape (nq,), closed.
    motions : ndarray
        Shape (nv, k), a basis of the motions there, scaled.
    held : ndarray of int
        Coordinates of v.
    known : float
        Singular values up to this may be zero; the others have to be larger beside q.
    """
    rng, column = np.random.default_rng(0), state.topology.column
    for k in range(_NEIGHBOURS if motions.shape[1] else 0):
        size = min(NEAR * 3.0**k, _FARTHEST) if known > _COARSE else NEAR
        away = motions @ rng.normal(size=motions.shape[1])
        start = pin.integrate(state.model, q, column * away * (size / np.abs(away).max()))
        try:
            yield nearest_closed(state, start, held, CLOSED_TO, STEPS)[0]
        except LoopNotClosed as error:
            if state.is_closed(state.buffers.residual(error.q), state.scaled_gap()):
                yield error.q


def _least_open(
    state: ChainState, start: FloatArray, weight: FloatArray, limits: Limits | None, tolerance: float
) -> tuple[FloatArray, bool]:
    """The configuration nearby that meets every row that a rounded geometry determines, and whether it is closed.

    Rows that agree within the digits away from singular poses count as one, so that they do not pull along motions
    that the exact loops allow. A start that is closed but for its digits stays where it is in directions that these do
    not determine, as in a singular pose. Steps that leave the limits are not made.
    """
    worst = state.buffers.residual(start)
    if not state.tolerance or worst <= tolerance:
        return start, True
    free = np.flatnonzero(weight > 0.0)
    ranks = structural_rank(state, start, free if len(free) < state.nv else None), None
    most = FEW * state.tolerance
    for rank in ranks if worst > most else ranks[::-1]:
        q, left = settled(state, start, rank, weight)
        if rank is None:
            left = state.scaled_gap()
        if left <= most and (limits is None or limits.holds(q)):
            return q, state.is_closed(float(np.abs(state.buffers.gap).max()), state.scaled_gap())
    return start, False


def followed(state: ChainState, start: FloatArray, goal: FloatArray, joints: list[str]) -> FloatArray:
    """The closed configuration with joints as in ``goal``, at the end of their path from a closed ``start``.

    They move along a straight line, in steps that the loops follow.
    """
    index = np.concatenate([np.arange(state.nq)[state.configuration_slice(name)] for name in joints])
    held = state.velocity_indices(joints)
    end = start.copy()
    end[index] = goal[index]
    whole = pin.difference(state.model, start, end)
    reach = float(np.abs(whole / state.topology.column)[held].max(initial=0.0))

    def correct(fraction: float, q: FloatArray) -> FloatArray:
        here = pin.integrate(state.model, start, fraction * whole)
        moved = q.copy()
        moved[index] = end[index] if fraction == 1.0 else here[index]
        return nearest_closed(state, moved, held, CLOSED_TO, STEPS)[0]

    return follow(state, start, reach, correct)


def _on_branch(state: ChainState, start: FloatArray, joints: list[str]) -> tuple[FloatArray | None, FloatArray | None]:
    """The closed configuration that others than some joints belong to, and that with these joints as in ``start``.

    The others belong to one if the loops close with them and other values of the joints, as after joints of a closed
    configuration were set. From there the joints move to their values. None for what there is not, and where the
    joints cannot move by themselves: then they leave no choice of a branch.
    """
    others = np.setdiff1d(np.arange(state.nv), state.velocity_indices(joints))
    known, drawn, base = start.copy(), reference_configuration(state), None
    for name in joints:
        own = state.configuration_slice(name)
        known[own] = drawn[own]
    try:
        found = nearest_closed(state, known, others, CLOSED_TO, STEPS, restarts=_SEARCHES)[0]
        scaled, least = scaled_jacobian(state, found)
        if np.linalg.matrix_rank(scaled[:, others], tol=least) < np.linalg.matrix_rank(scaled, tol=least):
            return None, None
        base = found
        return base, followed(state, base, start, joints)
    except LoopNotClosed:
        return base, None


def follow(
    state: ChainState, start: FloatArray, reach: float, correct: Callable[[float, FloatArray], FloatArray]
) -> FloatArray:
    """Go from start to the end of a path in steps, halving those that the loops do not follow.

    The first guess of each step has the rate of the last one. A step that ends far from its guess may have
    changed its branch and is halved, too.
    """
    step = 1.0 / max(1, int(np.ceil(reach / _PATH_STEP)))
    smallest = step / 2**_HALVINGS
    column = state.topology.column
    fraction, q = 0.0, start
    rate = np.zeros(state.model.nv)
    while fraction < 1.0:
        target = fraction + step if fraction + step < 1.0 - 1e-9 else 1.0
        guess = pin.integrate(state.model, q, (target - fraction) * rate)
        try:
            found = correct(target, guess)
            moved = pin.difference(state.model, q, found)
            if np.abs(pin.difference(state.model, guess, found) / column).max(initial=0.0) > _JUMP:
                raise LoopNotClosed(guess, state.buffers.residual(guess), STEPS)
        except LoopNotClosed as error:
            if step <= smallest:
                raise LoopNotClosed(q, state.buffers.residual(q), error.iterations, reached=fraction) from None
            step /= 2
            continue
        rate = moved / (target - fraction)
        q, fraction = found, target
    return q
