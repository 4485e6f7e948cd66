"""Least and greatest shoulder force over the postures of a device in poses of the arm.

Every configuration that idle freedoms lead to, driven or not, from that of the answer within the limits of the joints,
is asked the same question. Freedoms that no drive holds are taken as held where they are, as by friction. The set is
laid out as a net (:mod:`exo_pin.device.turns.idle_sets`), and both ends are searched from its best configurations.
"""

from __future__ import annotations

import math
from dataclasses import dataclass, replace
from typing import Any, cast

import numpy as np
from numpy.typing import NDArray
from scipy.spatial.transform import Rotation

from ...core.errors import InvalidInput
from ...core.errors.checked import checked
from ...core.results import Result
from ...core.tables import enumerated
from ...core.validation import FloatArray, ReadOnly
from ...device.chain_device import ChainDevice
from ...device.device_model import device_model
from ...device.parts.brakes import Brake
from ...device.turns.idle_sets import beside, idle_net, undriven_joints
from ...load_case.case import Case
from ..assumptions import Assumptions
from ..solve_case import solve

#: Halvings of the net's width in the search for an end.
_HALVINGS = 8


@dataclass(frozen=True, eq=False)
class PostureRange(Result, ReadOnly):
    """|F_s| over the postures of a device, in a pose or a stack of shape (...).

    Attributes
    ----------
    least, greatest : ndarray
        Shape (...), N, over the postures that are held, of all that have an answer if none is. Ends of a search.
    at_least, at_greatest : ndarray
        The configurations, shape (..., nq), for ``posture=``.
    postures, held : ndarray of int
        Shape (...): configurations that were asked, and of these those that are held.
    rule : str
        Over what; of a stack that of its first pose.

    Examples
    --------
    >>> exo = ep.load("four-cables")
    >>> found = ep.reaction.posture_range(exo, ep.Case(exo.pose(30)))
    >>> int(found.postures), int(found.held)
    (1, 1)
    """

    least: FloatArray
    greatest: FloatArray
    at_least: FloatArray
    at_greatest: FloatArray
    postures: NDArray[np.intp]
    held: NDArray[np.intp]
    rule: str

    def __str__(self) -> str:
        several = f" in {self.least.size} poses" if self.least.ndim else ""
        return f"{self.least.min():.1f} to {self.greatest.max():.1f} N{several} over {self.rule}"


@checked
def posture_range(exo: Any, case: Case, assumptions: Assumptions | None = None) -> PostureRange:
    """The range of |F_s| over all postures of a device in each pose of the arm.

    Parameters
    ----------
    exo : ShoulderExo, Device or Mechanism
        The device.
    case : Case
        ``posture`` is where the search begins.
    assumptions : Assumptions, optional
        As of :func:`exo_pin.solve`.

    Returns
    -------
    PostureRange
        Prints as a sentence.

    Raises
    ------
    InvalidInput
        If the device does not reach a pose.

    Examples
    --------
    >>> exo = ep.load("four-cables")
    >>> print(ep.reaction.posture_range(exo, ep.Case(exo.pose(60))))  # nothing moves by itself
    46.1 to 46.1 N over one posture: no joint moves by itself
    """
    shape = case.poses.shape
    found = [_single_range(exo, case.row(k), assumptions) for k in range(math.prod(shape))]
    if not found:
        raise InvalidInput("expected poses for the range over postures, got an empty stack")
    *parts, rules = zip(*found, strict=True)
    ends = (np.array(part).reshape((*shape, *np.shape(part[0]))) for part in parts)
    return PostureRange(*ends, rules[0])


def _single_range(exo: Any, case: Case, assumptions: Assumptions | None) -> tuple[Any, ...]:
    """The fields of :class:`PostureRange` of a single pose."""
    answer = solve(exo, case, assumptions)
    if answer.source.poses.placed is None:
        # Closed forms: spins of limbs about themselves change no force.
        size, none = answer.magnitude, np.zeros(0)
        return size, size, none, none, 1, int(answer.held), "one posture: no joint moves by itself"
    # A device that gives way has the postures of the rigid one.
    rigid = answer
    if answer.source.split.moves:
        rigid = solve(exo, replace(case, centre_offset=None), Assumptions(limits="none"))
    placed, device = rigid.source.poses.placed, cast(ChainDevice, rigid.source.poses.mechanism)
    assert placed is not None
    if not placed.reached[0]:
        raise InvalidInput(f"expected a pose that the device reaches, got {answer.status}")
    model = device_model(device)
    loose = undriven_joints(model, placed.q[0])
    if loose:
        names = {drive.name for drive in device.efforts}
        own = [Brake(f"{joint} held" if joint in names else joint, joint) for joint in loose]
        device = device.replace(brakes=(*device.brakes, *own))
    net, whole, width = idle_net(model, placed.q[0])
    count = [0, 0]

    def sizes(places: FloatArray) -> tuple[FloatArray, NDArray[np.bool_]]:
        asked = replace(
            answer.case, wearer=None, poses=Rotation.concatenate([case.poses] * len(places)), posture=places
        )
        found = solve(device, asked, assumptions)
        count[0] += len(places)
        count[1] += int(found.held.sum())
        return np.where(found.has_answer, found.magnitude, np.nan), found.held

    force, held = sizes(net)
    rows = held if held.any() else np.isfinite(force)
    if not rows.any():
        raise InvalidInput("expected a pose with an answer in some posture")
    ends = []
    for sign in (-1.0, 1.0):
        best = int(np.where(rows, sign * force, -np.inf).argmax())
        q, size, step = net[best], float(force[best]), width
        for _ in range(_HALVINGS if width else 0):
            step *= 0.5
            there = np.array(beside(model, q, step)).reshape(-1, len(q))
            if not len(there):
                continue
            near, good = sizes(there)
            near = np.where(good if held.any() else np.isfinite(near), sign * near, -np.inf)
            if near.max() > sign * size:
                q, size = there[near.argmax()], float(sign * near.max())
        ends.append((size, q))
    idle = "joints that move while the arm rests" if width else "one posture: no joint moves by itself"
    rule = f"all postures of {idle}, within their limits" if width else idle
    rule += f"; {enumerated(loose)} held where no drive holds {'it' if len(loose) == 1 else 'them'}" if loose else ""
    rule += "" if whole else f"; the first {len(net)} of them that were found"
    return ends[0][0], ends[1][0], ends[0][1], ends[1][1], *count, rule
