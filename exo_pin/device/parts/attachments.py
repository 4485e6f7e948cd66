"""Where a device is attached to arm and torso, and what its loops' multipliers do there: constant data of its trees."""

from __future__ import annotations

from typing import Any, NamedTuple

import numpy as np
from numpy.typing import NDArray

from ...chain.structure.topology import Topology
from ...core.validation import FloatArray
from .routes import PlacedRoute


class Attachments(NamedTuple):
    """Attachments on the arm in the order of their wrenches: joints, loops, routes of springs, routes of drives.

    Attributes
    ----------
    entries, firm : int
        Of all, at least one; and of joints and loops, which may put couples on the arm, as a route does not.
    on_arm, on_torso : ndarray
        Shapes (joints and loops, rows) and (rows,): by what the wrench of each multiplier on the body of its frame a
        counts in those on the arm, and in the device's on the torso.
    ends : tuple of int and ndarray
        Of each loop on the arm the joint that carries its frame b, and that frame's place in its axes, shape (3,), m.
    springs, drives : dict of int to int
        Places of routes on the arm, by the number of the spring or drive.
    """

    entries: int
    firm: int
    on_arm: FloatArray
    on_torso: FloatArray
    ends: tuple[tuple[int, FloatArray], ...]
    springs: dict[int, int]
    drives: dict[int, int]


def attachments(
    top: Topology, arm: int, parents: NDArray[np.intp], drives: list[Any], springs: list[Any]
) -> Attachments:
    """Of a tree.

    Parameters
    ----------
    top : Topology
        Its loops.
    arm : int
        The arm's joint.
    parents : ndarray of int
        Of all joints.
    drives, springs : list
        Pairs of a part and its :class:`.PlacedRoute` or joint.
    """
    closure_of_row = np.repeat(np.arange(len(top.kinds)), np.diff(top.rows))
    on, bodies = top.joints == arm, (top.joints != 0).any(axis=1)  # a coupling joins no bodies
    sign = np.where(on.any(axis=1), on[:, 0].astype(float) - on[:, 1], 0.0)
    touching = np.flatnonzero(on.any(axis=1))
    hanging, standing = np.flatnonzero(parents == arm), standing_joints(parents, arm)
    on_arm = np.concatenate([top.carried[hanging], np.diag(sign)[touching]])
    base = top.joints == 0
    to_torso = top.carried[standing].sum(axis=0) + np.where(bodies, base[:, 0].astype(float) - base[:, 1], 0.0)
    ends = tuple((int(top.joints[c, 1]), np.array(top.frame(int(c), 1).translation)) for c in touching)
    routed = [
        [i for i, (_, place) in enumerate(parts) if isinstance(place, PlacedRoute) and (place.joints == arm).any()]
        for parts in (springs, drives)
    ]
    numbers = iter(range(len(on_arm), len(on_arm) + sum(map(len, routed))))
    of_springs, of_drives = ({i: next(numbers) for i in group} for group in routed)
    count = max(1, len(on_arm) + len(of_springs) + len(of_drives))
    return Attachments(
        count, len(on_arm), on_arm[:, closure_of_row], to_torso[closure_of_row], ends, of_springs, of_drives
    )


def standing_joints(parents: NDArray[np.intp], arm: int) -> NDArray[np.intp]:
    """Joints that carry links of the device on the torso."""
    roots = np.flatnonzero(parents == 0)
    return roots[(roots != 0) & (roots != arm)]
