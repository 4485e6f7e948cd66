"""What happens at an event of a motion: impacts, and the mode in which the motion continues."""

from __future__ import annotations

from dataclasses import dataclass
from typing import NamedTuple

import numpy as np

from ....core.records import Record
from ....core.validation import FloatArray
from ...structure.chain_state import ChainState
from ...structure.motion_axes import Limits
from ..equations.equations_of_motion import inertia_matrix, moving_loops
from ..integration import Instant, Rates
from .contact_forces import AT_STOP, ContactMode, Contacts, at_rest, contact_forces, contacts_of, impact, room_to_stops
from .joint_friction import REST, friction_of, joint_names
from .projected_motion import projected_motion, response_at

#: A stop is not bounced from below this speed, characteristic lengths and rad a second, or after a flight shorter than
#: this, s: bounces become ever shorter, and falling through the depth at which an impact is noticed would renew them.
SLOW, BRIEF = 1e-5, 1e-6


#: Joints that hit their stops this often in turn, slowly or after brief flights, come to rest there: else two that
#: throw each other off would go on without end.
_ROCKING = 3


class Impacts(NamedTuple):
    """The time of a joint's last impact, s, and how many slow ones, or ones after brief flights, came in turn."""

    time: float
    times: int


_NEVER = Impacts(-np.inf, 0)


class MotionEvent(NamedTuple):
    """Something that happened in a simulated motion.

    Attributes
    ----------
    time : float
        s.
    kind : str
        "slip", "stick", "reversed" (a joint with friction that does not stay at rest), "impact", "stop reached",
        "stop left", or "crossing" of a singular configuration.
    joints : tuple of str
        The joints concerned; of a crossing, those that move in the other motion that is possible there.
    order : int
        Of a crossing, the derivative of the motion that tells its branch from the other one: 1 if the tangents differ,
        2 if only the curvatures do; 0 of other events.
    branch : tuple of float
        Of a crossing, the tangent of the branch that the motion keeps to: v there over its largest number, shape (nv,).

    Examples
    --------
    >>> block = '<joint name="x" type="slide" axis="1 0 0" frictionloss="4"/><geom size="0.1" mass="2"/>'
    >>> chain = ep.ClosedChain.from_mjcf(f"<mujoco><worldbody><body>{block}</body></worldbody></mujoco>")
    >>> event = chain.simulate([0.0], [1.0], [0.0, 1.0]).events[0]  # 1 m/s against 4 N
    >>> event.kind, event.joints, round(event.time, 6)  # s: m v/F
    ('stick', ('x',), 0.5)
    """

    time: float
    kind: str
    joints: tuple[str, ...]
    order: int = 0
    branch: tuple[float, ...] = ()


@dataclass(frozen=True)
class StopRules(Record):
    """Limits that are stops, or None, and Newton's restitution."""

    limits: Limits | None
    restitution: float


def settled(
    rates: Rates, time: float, instant: Instant, stops: StopRules, impacts: dict[int, Impacts]
) -> tuple[Instant, ContactMode, list[MotionEvent]]:
    """The state and mode after impacts at a time, and what happened; ``rates`` has the mode before, or None.

    ``impacts`` has the last impact of every index in v; those of this time are added.

    Raises
    ------
    MotionBlocked
        If every motion of the loops moves a joint into its stop.
    SolverFailed
        If the complementarity problem has no accurate solution.
    """
    state, before, q, v = rates.state, rates.mode, instant.q, instant.v
    column = state.topology.column
    gaps, index, side = room_to_stops(state, stops.limits, q)
    # Joints that rested on their stops still do, however much the projection on the loops has moved them.
    held = set() if before is None else before.held.pairs
    rested = np.array([pair in held for pair in zip(index.tolist(), side.tolist(), strict=True)], dtype=np.bool_)
    touching = (gaps <= AT_STOP) | rested
    index, side = index[touching], side[touching]
    found: list[MotionEvent] = []
    speed = -side * v[index] / column[index]
    hit = speed > REST
    if hit.any():
        found.append(MotionEvent(time, "impact", tuple(joint_names(state, index[hit]))))
        brief = np.array([time - impacts.get(k, _NEVER).time <= BRIEF for k in index.tolist()])
        small = brief | (speed <= SLOW)
        v = impact(response_at(state, q), v, (index, side), 0.0 if small[hit].all() else stops.restitution)
        for k, again in zip(index[hit].tolist(), small[hit].tolist(), strict=True):
            impacts[k] = Impacts(time, impacts.get(k, _NEVER).times + 1 if again else 1)
        if small[hit].all():
            rocking = [k for k in index.tolist() if impacts.get(k, _NEVER).times >= _ROCKING]
            v = at_rest(state, q, v, np.array(rocking, dtype=np.int64))
    v = np.where(np.abs(v) <= REST * column * 1e-3, 0.0, v) if hit.any() else v
    rubbing = friction_of(state, v)
    rests = side * v[index] / column[index] <= REST
    contacts = contacts_of(rubbing, index[rests], side[rests])
    mode = _mode(rates, time, (q, v), rubbing.force, contacts)
    v = at_rest(state, q, v, mode.index)
    M = inertia_matrix(state, q)
    lost = 0.5 * float(instant.v @ M @ instant.v - v @ M @ v)
    found += _changes(state, time, before, mode)
    return Instant(q, v, instant.work, instant.dissipated + lost), mode, found


def _mode(
    rates: Rates, time: float, where: tuple[FloatArray, FloatArray], sliding: FloatArray, contacts: Contacts
) -> ContactMode:
    """The mode in which the motion continues."""
    state, (q, v) = rates.state, where
    low, high = state.passive.dry_friction
    # Friction in one direction may be zero.
    sign = np.where((low != 0.0) | (high != 0.0), np.sign(v), 0.0).astype(np.int64)
    sign[contacts.place[contacts.side == 0]] = 0
    if not len(contacts.place):
        return ContactMode(state, sliding, sign, contacts)
    moving_loops(state, q, v)
    motion = projected_motion(state, q, v, rates.applied(time, q, v).plus(sliding))
    found = contact_forces(state, motion, contacts, sliding)
    slips = (contacts.side == 0) & ~found.sticks
    sliding, own = sliding.copy(), contacts.place[slips]
    sliding[own] = found.force[slips]
    sign[own] = np.sign(found.a[own])
    return ContactMode(state, sliding, sign, contacts.only(found.sticks))


def _changes(state: ChainState, time: float, before: ContactMode | None, after: ContactMode) -> list[MotionEvent]:
    """Joints that stick, slip, reach or leave their stops."""
    if before is None:
        return []
    found, old, new = [], before.held.pairs, after.held.pairs
    for kind, pairs, friction in (
        ("stick", new - old, True),
        ("slip", old - new, True),
        ("stop reached", new - old, False),
        ("stop left", old - new, False),
    ):
        own = sorted(index for index, side in pairs if (side == 0) == friction)
        if own:
            found.append(MotionEvent(time, kind, tuple(joint_names(state, np.array(own)))))
    turned = np.flatnonzero(before.sign * after.sign < 0)
    if len(turned):
        found.append(MotionEvent(time, "reversed", tuple(joint_names(state, turned))))
    return found
