"""Friction at rest and reactions of stops: the complementarity problem of the constrained motion, and impacts.

Gauss's principle: of all accelerations that keep the loops closed and move no joint into its stop, the motion has the
one with the least ½ (a - a_free)ᵀ M (a - a_free) + Σ friction's dissipation. The forces f that act in the coordinates
with contact are the multipliers of that convex program:

    w = A f + c with A = R_c R_cᵀ, c = a_free in those coordinates, w complementary to the bounds of f

(Moreau; Acary and Brogliato, Numerical Methods for Nonsmooth Dynamical Systems, 2008). Impacts are the same problem
between velocities before and after with Newton's restitution e, by Moreau's rule: v⁺ + e v⁻ in place of a. Friction
has no impulse, because its force is bounded.

Within a mode of motion, given by which joints stick, slide or rest on their stops, the motion is smooth: coordinates
that stick are constraints a_i = 0 beside the loops, and joints that slide have constant friction. A mode ends where the
complementarity problem of what sticks says that it does not, a sliding joint comes to rest, or a joint meets its stop.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from ....core.errors import InvalidInput, MotionBlocked, SolverFailed
from ....core.records import Record, keeps_read_only
from ....core.validation import FloatArray, frozen
from ....numerics.complementarity import bounded_complementarity
from ...structure.chain_state import ChainState
from ...structure.motion_axes import Limits, limits_of
from ..equations.equations_of_motion import moving_loops
from .joint_friction import REST, Rubbing, friction_of, joint_names
from .projected_motion import Applied, ProjectedMotion, acceleration, projected_motion, response_at

#: A joint is at its stop if it is within this of it, characteristic lengths and rad.
AT_STOP = 1e-9
#: Acceleration of a contact that counts as zero, as a share of the largest that contacts would have without forces.
_STILL = 1e-11
#: What sticks may exceed its range by this share of half of it, or of the largest force for stops.
_EXCEEDED = 1e-9
#: It moves above this share of the largest acceleration without its forces.
_MOVES = 1e-10
#: Singular values of the rows that stick below this share of the largest count as zero. Coordinates that stick depend
#: on each other in some poses, and next to these rounding over σ² would be taken for their friction: below the second
#: share, no force answers what rounding, a share of the largest acceleration, may ask for.
_RANK, _WEAK, _NOISE = 1e-8, 1e-3, 1e-11


class Contacts(NamedTuple):
    """Coordinates whose joint force is a set: friction at rest, then stops.

    Attributes
    ----------
    place : ndarray of int
        Shape (n,), indices in v; a coordinate that rests at its stop with friction occurs twice.
    low, high : ndarray
        Shape (n,), range of the force, N and N m.
    side : ndarray of int
        Shape (n,): 1 at a lower stop, which pushes with f >= 0, -1 at an upper one, 0 for friction.
    """

    place: NDArray[np.int64]
    low: FloatArray
    high: FloatArray
    side: NDArray[np.int64]

    @property
    def pairs(self) -> set[tuple[int, int]]:
        """Place and side of each."""
        return set(zip(self.place.tolist(), self.side.tolist(), strict=True))

    def only(self, chosen: NDArray[np.bool_]) -> Contacts:
        """Some of them."""
        return Contacts(self.place[chosen], self.low[chosen], self.high[chosen], self.side[chosen])


@keeps_read_only
class ContactForces(NamedTuple):
    """Motion with friction and stops.

    Attributes
    ----------
    a : ndarray
        Shape (nv,), m/s² and rad/s².
    force : ndarray
        Shape (n,), of every contact, N and N m.
    sticks : ndarray of bool
        Shape (n,), contacts that stay at rest: their force is between its bounds, or they do not accelerate.
    friction, stops : ndarray
        Shape (nv,), all friction, and the reactions of the stops.
    unique : ndarray of bool
        Shape (nv,), coordinates in which friction and reaction of the stop are the same in every solution.
    """

    a: FloatArray
    force: FloatArray
    sticks: NDArray[np.bool_]
    friction: FloatArray
    stops: FloatArray
    unique: NDArray[np.bool_]


def room_to_stops(
    state: ChainState, limits: Limits | None, q: FloatArray
) -> tuple[FloatArray, NDArray[np.int64], NDArray[np.int64]]:
    """Room to every stop, characteristic lengths and rad; index in v; 1 for lower stops and -1 for upper ones."""
    if limits is None:
        return np.array([]), np.array([], np.int64), np.array([], np.int64)
    here, count = q[limits.q_index], len(limits.lower)
    index = np.concatenate([limits.v_index, limits.v_index])
    room = np.concatenate([here - limits.lower, limits.upper - here])
    return room / state.topology.column[index], index, np.repeat([1, -1], [count, count])


def stops_at(state: ChainState, limits: Limits | None, q: FloatArray) -> tuple[NDArray[np.int64], NDArray[np.int64]]:
    """Coordinates at their stops: index in v, and 1 for a lower stop or -1 for an upper one.

    Raises
    ------
    InvalidInput
        If a joint is beyond its limits.
    """
    room, index, side = room_to_stops(state, limits, q)
    if limits is not None and (room < -AT_STOP).any():
        k = int((np.flatnonzero(room < -AT_STOP) % len(limits.joints)).min())
        raise InvalidInput(
            f"joint {limits.joints[k]!r} is at {q[limits.q_index[k]]:.6g}, beyond its limits {limits.lower[k]:.6g} and "
            f"{limits.upper[k]:.6g}: expected q within all limits where they are stops, use "
            "close(q, respect_limits=True), or stops=False"
        )
    return index[room <= AT_STOP], side[room <= AT_STOP]


def contacts_at(state: ChainState, q: FloatArray, v: FloatArray, stops: bool) -> tuple[Rubbing, Contacts]:
    """Friction and contacts of a state.

    Raises
    ------
    InvalidInput
        If a joint is beyond its stop, or moves into it.
    """
    rubbing = friction_of(state, v)
    index, side = stops_at(state, limits_of(state.model) if stops else None, q)
    speed = side * v[index] / state.topology.column[index]
    if (speed < -REST).any():
        k = int(speed.argmin())
        raise InvalidInput(
            f"coordinate {index[k]} of v moves into its stop with {v[index[k]]:.6g}: expected a velocity that leaves "
            "the stop or is zero there; simulate computes the impact"
        )
    return rubbing, contacts_of(rubbing, index[speed <= REST], side[speed <= REST])


def contacts_of(rubbing: Rubbing, index: NDArray[np.int64], side: NDArray[np.int64]) -> Contacts:
    """Contacts from the friction at rest, and the stops."""
    rest = rubbing.rest
    return Contacts(
        np.concatenate([rest, index]),
        np.concatenate([rubbing.low[rest], np.where(side > 0, 0.0, -np.inf)]),
        np.concatenate([rubbing.high[rest], np.where(side > 0, np.inf, 0.0)]),
        np.concatenate([np.zeros(len(rest), np.int64), side]),
    )


def contact_forces(
    state: ChainState, motion: ProjectedMotion, contacts: Contacts, sliding: FloatArray
) -> ContactForces:
    """Acceleration and forces of the contacts; ``motion`` includes the ``sliding`` friction, shape (nv,), already.

    Raises
    ------
    MotionBlocked
        If every motion of the loops moves a joint into its stop.
    SolverFailed
        If the optimality conditions hold to no better than 1e-9.
    """
    index, column = contacts.place, motion.column[contacts.place]
    rows, start = motion.of(index)
    found = bounded_complementarity(rows @ rows.T, start, contacts.low * column, contacts.high * column)
    if not found.bounded:
        pressed = (contacts.side != 0) & ((contacts.side * start < 0.0) | (found.force != 0.0))
        raise MotionBlocked(joint_names(state, index[pressed]))
    # Exactly on the bounds where it is active.
    at_low, at_high = found.force == contacts.low * column, found.force == contacts.high * column
    force = np.where(at_low, contacts.low, np.where(at_high, contacts.high, found.force / column))
    a = motion.a + motion.response @ (rows.T @ found.force)
    a[index] = found.rate * column
    friction, stops, unique = sliding.copy(), np.zeros_like(sliding), np.ones(len(sliding), dtype=np.bool_)
    rests = contacts.side == 0
    friction[index[rests]] = force[rests]
    np.add.at(stops, index[~rests], force[~rests])
    unique[index[~found.unique]] = False
    # Exactly zero, but for contacts on a bound of their force that would not move without it either.
    still = np.abs(found.rate) <= _STILL * float(np.abs(start).max(initial=0.0))
    return ContactForces(a, force, still, frozen(friction), frozen(stops), frozen(unique))


def impact(
    motion: ProjectedMotion, v: FloatArray, stops: tuple[NDArray[np.int64], NDArray[np.int64]], restitution: float
) -> FloatArray:
    """Velocity after impacts, shape (nv,), for the coordinates at their stops and their sides.

    All have the same restitution, for which Moreau's rule never gains energy.

    Raises
    ------
    SolverFailed
        As for :func:`contact_forces`.
    """
    index, side = stops
    rows, _ = motion.of(index)
    before = v[index] / motion.column[index]
    low, high = np.where(side > 0, 0.0, -np.inf), np.where(side > 0, np.inf, 0.0)
    found = bounded_complementarity(rows @ rows.T, before + restitution * before, low, high)
    if not found.bounded:
        raise SolverFailed("the impact", np.inf, "every velocity of the loops moves a joint into its stop")
    after = v + motion.response @ (rows.T @ found.force)
    return np.asarray(after)


def with_contacts(
    state: ChainState, q: FloatArray, v: FloatArray, applied: Applied, stops: bool
) -> tuple[FloatArray, ContactForces]:
    """Acceleration and forces with friction and stops; :func:`moving_loops` must have been called."""
    rubbing, contacts = contacts_at(state, q, v, stops)
    motion = projected_motion(state, q, v, applied.plus(rubbing.force))
    found = contact_forces(state, motion, contacts, rubbing.force)
    return found.a, found


@dataclass(frozen=True, eq=False)
class ContactMode(Record):
    """One mode.

    Attributes
    ----------
    state : ChainState
        The chain.
    sliding : ndarray
        Shape (nv,), friction of the joints that slide, N and N m.
    sign : ndarray of int
        Shape (nv,), direction in which a joint with friction slides; 0 for all others.
    held : Contacts
        Those that stick and the stops with joints that rest on them.
    """

    state: ChainState
    sliding: FloatArray
    sign: NDArray[np.int64]
    held: Contacts

    @property
    def index(self) -> NDArray[np.int64]:
        """Coordinates of v that are held, each once."""
        return np.unique(self.held.place)

    def acceleration(self, q: FloatArray, v: FloatArray, applied: Applied) -> tuple[FloatArray, FloatArray]:
        """Acceleration, shape (nv,), and forces in the coordinates of :attr:`index`, the least if redundant."""
        index, applied = self.index, applied.plus(self.sliding)
        if not len(index):
            return acceleration(self.state, q, v, applied), np.array([])
        moving_loops(self.state, q, v)
        motion = projected_motion(self.state, q, v, applied)
        (rows, start), column = motion.of(index), motion.column[index]
        scaled = _held_forces(motion, rows, start, float(np.abs(motion.a / motion.column).max()))
        return motion.a + motion.response @ (rows.T @ scaled), scaled / column

    def holds(self, q: FloatArray, v: FloatArray, applied: Applied) -> bool:
        """Whether all that sticks still does, with forces beyond their ranges by a share of 1e-9 at most."""
        held, sliding = self.held, self.sliding
        if not len(held.place):
            return True
        moving_loops(self.state, q, v)
        motion = projected_motion(self.state, q, v, applied.plus(sliding))
        column = motion.column
        moves = _MOVES * float(np.abs(motion.a / column).max())
        try:
            found = contact_forces(self.state, motion, held, sliding)
            if (np.abs((found.a / column)[held.place]) > moves).any():
                largest = float(np.abs(found.force).max())
                slack = _EXCEEDED * np.where(held.side == 0, 0.5 * (held.high - held.low), largest)
                wide = held._replace(low=held.low - slack, high=held.high + slack)
                found = contact_forces(self.state, motion, wide, sliding)
        except (MotionBlocked, SolverFailed):
            return False
        return not (np.abs((found.a / column)[held.place]) > moves).any()


def _held_forces(motion: ProjectedMotion, rows: FloatArray, start: FloatArray, size: float) -> FloatArray:
    """The least forces f with rows rowsᵀ f = -start, but for what rounding of ``size`` may ask, continuous in all."""
    if not rows.size:
        return np.zeros(len(rows))
    U, values, _ = np.linalg.svd(rows, full_matrices=False)
    # Compared with all coordinates: those that stick may all be next to poses in which the loops lock them.
    weak = (_WEAK * float(np.linalg.norm(motion.response / motion.column[:, None], 2))) ** 2
    asked = U.T @ start
    asked = np.sign(asked) * np.maximum(np.abs(asked) - _NOISE * size * weak / (values**2 + weak), 0.0)
    counts = values > _RANK * values[0]
    return np.asarray(-U[:, counts] @ (asked[counts] / values[counts] ** 2))


def at_rest(state: ChainState, q: FloatArray, v: FloatArray, index: NDArray[np.int64]) -> FloatArray:
    """The velocity after the least impulses that bring coordinates of v to rest, shape (nv,)."""
    if not len(index) or not v[index].any():
        return v
    motion = response_at(state, q)
    rows, _ = motion.of(index)
    speed = v[index] / motion.column[index]
    after = v + motion.response @ (rows.T @ _held_forces(motion, rows, speed, float(np.abs(v / motion.column).max())))
    after[index] = 0.0
    return np.asarray(after)
