"""Where a device is attached to arm and torso, and what its loops' multipliers do there: constant data of its trees.

A device ready for statics: its tree with the arm on a ball joint, and with the arm free to move in every direction.

In the second tree the shoulder's force is one of the forces that hold the arm, so that it stands in the equations of
motion beside the drives and the loops. Where device and shoulder have different centres, the shoulder moves against the
device (the torso side of an offset) and what is on the arm moves with the cuff.
"""

from __future__ import annotations

import itertools
from collections.abc import Iterable, Iterator
from dataclasses import replace
from functools import cached_property, lru_cache
from typing import TYPE_CHECKING, Any, NamedTuple

import numpy as np
import pinocchio as pin
from numpy.typing import NDArray

from ..chain.structure.chain_state import ChainState
from ..chain.structure.closures import Closure
from ..chain.structure.frames import Placement
from ..chain.structure.motion_axes import carried_joints, has_ends, limits_of, q_slice, v_slice
from ..chain.variants import with_joint
from ..core.validation import FloatArray
from .balance.device_state import NONE
from .parts.drives import Drive, Spring
from .parts.lacking_data import LackingData
from .parts.laws import covered_force
from .parts.routes import PlacedRoute

if TYPE_CHECKING:
    from .chain_device import ChainDevice


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


#: Why a turn ends: at its pose, where the loops cannot close, at a singular configuration.
REACHED, UNREACHED, SINGULAR_BEFORE = 0, 1, 2

_NOWHERE = (0.0, 0.0, 0.0)


class DeviceModel:
    """The trees of a device, and where its parts stand in them.

    Parameters
    ----------
    device : ChainDevice
        The device.
    base, cuff : tuple of float
        Shifts of the device's torso side (m, base frame) and of what it has on the arm (m, arm frame) from where the
        chain has them, seen from the shoulder's centre.
    held_joints, soft_joints : tuple of str
        Joints that do not move, and joints that move only where no other motion closes the loops.

    Attributes
    ----------
    held, free : ChainState
        The tree with the arm on a ball joint, and on a free flight.
    arm : int
        Index of the arm's joint in both.
    q_of, v_of : ndarray of int
        Where the coordinates of ``held``, but the arm's, stand in ``free``.
    q_from, v_from : ndarray of int
        Where they stand in ``held``.
    passive, soft, moving, fixed : ndarray of int
        Coordinates in v of ``held``: those that follow the arm, those of soft joints, both, and all others.
    closed_at_rest : ndarray or None
        The configuration with the arm hanging, once it is known, shape (nq,).
    """

    def __init__(
        self,
        device: ChainDevice,
        base: tuple[float, float, float] = _NOWHERE,
        cuff: tuple[float, float, float] = _NOWHERE,
        held_joints: tuple[str, ...] = (),
        soft_joints: tuple[str, ...] = (),
    ) -> None:
        self.device, given = device, device.chain._state
        self._fixed, self._soft = held_joints, soft_joints
        self.arm = arm = device.arm_index
        model = given.model
        body = pin.Inertia.Zero()
        if device.arm is not None:
            tensor = np.zeros((3, 3)) if device.arm.inertia is None else np.array(device.arm.inertia)
            body = pin.Inertia(device.arm.mass, np.array(device.arm.centre_of_mass), tensor)
        shifts = {arm: -np.array(base)}
        shifts |= {k: np.array(cuff) for k, parent in enumerate(model.parents) if parent == arm}
        loops = tuple(_shifted(given, closure, arm, np.array(cuff)) for closure in given.closures)
        described = replace(given.description, closures=loops, shapes=())
        kinds = pin.JointModelSpherical(), pin.JointModelFreeFlyer()
        self.held, self.free = (ChainState(with_joint(given, arm, kind, body, shifts), described) for kind in kinds)
        self._base, self._cuff = base, np.array(cuff)
        self.closed_at_rest: FloatArray | None = None
        #: What follows from that configuration alone, once it is known.
        self.kept: dict[str, Any] = {}
        self._index()

    @property
    def is_shifted(self) -> bool:
        """Whether device and shoulder have different centres."""
        return bool(any(self._base) or self._cuff.any())

    def __reduce__(self) -> tuple[Any, ...]:
        own = self.device, self._base, tuple(self._cuff.tolist()), self._fixed, self._soft
        return type(self), own, {"closed_at_rest": self.closed_at_rest}

    def _index(self) -> None:
        held, free, arm = self.held.model, self.free.model, self.arm
        others = [k for k in range(1, held.njoints) if k != arm]
        self.q_of = _places(q_slice(free, k) for k in others)
        self.v_of = _places(v_slice(free, k) for k in others)
        self.q_from = _places(q_slice(held, k) for k in others)
        self.v_from = _places(v_slice(held, k) for k in others)
        self.arm_q, self.arm_v = q_slice(held, arm), v_slice(held, arm)
        first = v_slice(free, arm).start
        #: Coordinates of the free tree: forces on the arm, moments on it, and all but the forces.
        self.linear, self.angular = np.arange(first, first + 3), np.arange(first + 3, first + 6)
        self.rest = np.setdiff1d(np.arange(free.nv), [*self.linear, *self.free.velocity_indices(self._fixed)])
        self.rest_angular = np.searchsorted(self.rest, self.angular)
        self.soft = self.held.velocity_indices(self._soft)
        self.passive = np.setdiff1d(self.v_from, [*self.soft, *self.held.velocity_indices(self._fixed)])
        self.moving = np.union1d(self.passive, self.soft)
        self.fixed = np.array([*range(self.arm_v.start, self.arm_v.stop), *self.held.velocity_indices(self._fixed)])
        #: Where the forces g of limbs act that turn about their own lines.
        self.twists = self.free.velocity_indices(self.device.twists)
        self.carried = carried_joints(free)
        self.owners = np.concatenate([np.full(free.nvs[k], k) for k in range(1, free.njoints)])
        self._flight = q_slice(free, arm).start
        self._q_slices = [q_slice(free, int(owner)) for owner in self.owners]
        self.parents = np.array(list(free.parents))

    @cached_property
    def none(self) -> float:
        """Size up to which a motion, self-stress or effect is none: rounding, or what the file's digits may make.

        A digit moves the entries of the scaled Jacobian by the tolerance, and its singular values by as many of them.
        """
        return max(NONE, max(self.free.row_count, self.free.nv) * self.free.tolerance)

    @cached_property
    def drives(self) -> list[tuple[Drive, PlacedRoute | int]]:
        """Each drive and brake with its route, or with the index in v of the joint that it is in."""
        return [(drive, self._place(drive)) for drive in self.device.efforts]

    @cached_property
    def springs(self) -> list[tuple[Spring, PlacedRoute | int]]:
        """Each spring in the same way."""
        return [(spring, self._place(spring)) for spring in self.device.springs]

    def spring_forces(
        self, q: FloatArray, poses: FloatArray
    ) -> tuple[FloatArray, dict[int, tuple[LackingData, ...]], FloatArray]:
        """Forces of all springs as far as their laws cover the poses; nothing else of a device asks these laws.

        Parameters
        ----------
        q : ndarray
            Of the free tree, shape (N, nq).
        poses : ndarray
            Of its joints, shape (N, njoints, 4, 3).

        Returns
        -------
        forces : ndarray
            Of S springs in N poses, shape (N, S), N or N m, pulling; zero of a spring whose force is not known.
        lacking : dict of int to tuple of LackingData
            By the pose, springs whose force is not known there.
        margin : ndarray
            Shape (N,), distance of the springs' coordinates to the ends of their laws, over the length of each range
            (1 m or 1 rad of one with one end): the least; negative outside, infinite where no law has an end.
        """
        lacking, margin = dict[int, tuple[LackingData, ...]](), np.full(len(q), np.inf)
        forces = np.zeros((len(q), len(self.springs)))
        for i, (spring, place) in enumerate(self.springs):
            x = self.coordinate(place, q, poses)
            (low, high), force = spring.law.range, covered_force(spring.law, x)
            size = high - low if np.isfinite(high - low) else 1.0
            margin = np.minimum(margin, np.minimum(x - low, high - x) / size)
            for k in np.flatnonzero(np.isnan(force)):
                unit = "m" if isinstance(place, PlacedRoute) or self.free.topology.metres[place] else "rad"
                part = LackingData("spring", spring.name, float(x[k]), low, high, unit, spring.law.source)
                lacking[int(k)] = (*lacking.get(int(k), ()), part)
            if isinstance(place, PlacedRoute):
                for k in np.flatnonzero((np.nan_to_num(force) != 0.0) & ~place.has_direction(poses)):
                    lacking[int(k)] = (*lacking.get(int(k), ()), LackingData("spring", spring.name))
                    force[k] = 0.0
            forces[:, i] = np.nan_to_num(force)
        return forces, lacking, margin

    def _place(self, part: Drive | Spring) -> PlacedRoute | int:
        if part.route is not None:
            return PlacedRoute(self.free, part.route).shifted(self.arm, self._cuff)
        return int(self.free.velocity_slice(str(part.joint)).start)

    def coordinate(self, place: PlacedRoute | int, q: FloatArray, poses: FloatArray) -> FloatArray:
        """Lengths of a route, m, or coordinates of a joint, m or rad (in (-π, π] of an endless hinge), shape (...)."""
        if isinstance(place, PlacedRoute):
            return place.length(poses)
        own = q[..., self._q_slices[place]]
        return np.asarray(own[..., 0] if own.shape[-1] == 1 else np.arctan2(own[..., 1], own[..., 0]))

    def free_configuration(self, q: FloatArray) -> FloatArray:
        """The free tree's q, shape (..., nq), for those of the tree that is held at the shoulder."""
        out = np.empty((*q.shape[:-1], self.free.nq))
        out[..., self.q_of] = q[..., self.q_from]
        start = self._flight
        out[..., start : start + 3] = 0.0
        out[..., start + 3 : start + 7] = q[..., self.arm_q]
        return out

    def free_motion(self, v: FloatArray) -> FloatArray:
        """The free tree's v or a, shape (..., nv), in which the shoulder's centre rests."""
        out = np.zeros((*v.shape[:-1], self.free.nv))
        out[..., self.v_of] = v[..., self.v_from]
        out[..., self.angular] = v[..., self.arm_v]
        return out

    @cached_property
    def passive_limits(self) -> tuple[NDArray[np.int64], FloatArray, FloatArray]:
        """Places in q of the held tree of joints without drive that have ends, and these, m or rad."""
        limits, driven = limits_of(self.held.model), {drive.joint for drive in self.device.drives}
        ends = has_ends(limits)
        free = [k for k, joint in enumerate(limits.joints) if joint not in driven and ends[k]]
        return limits.q_index[free], limits.lower[free], limits.upper[free]

    @cached_property
    def cuff(self) -> FloatArray | None:
        """Middle of the cuff, shape (3,), m, arm frame; None where the chain's roles do not say."""
        name = self.device.chain.roles.cuff
        if name is None:
            return None
        frame = self.free.model.frames[self.free.frame_index(name)]
        return np.array(frame.placement.translation) + self._cuff

    @cached_property
    def centre(self) -> FloatArray:
        """The shoulder's centre in the chain's world, shape (3,), m."""
        return np.array(self.held.model.jointPlacements[self.arm].translation)

    @cached_property
    def hanging(self) -> NDArray[np.intp]:
        """Joints that carry links of the device on the arm."""
        return np.flatnonzero(self.parents == self.arm)

    @cached_property
    def standing(self) -> NDArray[np.intp]:
        """Joints that carry links of the device on the torso."""
        roots = np.flatnonzero(self.parents == 0)
        return roots[(roots != 0) & (roots != self.arm)]

    @cached_property
    def attachments(self) -> Attachments:
        """Where the device is attached to arm and torso."""
        top, arm = self.free.topology, self.arm
        closure_of_row = np.repeat(np.arange(len(top.kinds)), np.diff(top.rows))
        on, base = top.joints == arm, top.joints == 0
        # A coupling joins no bodies: both of its ends are the torso, and cancel.
        sign, standing_sign = (ends[:, 0].astype(float) - ends[:, 1] for ends in (on, base))
        touching = np.flatnonzero(on.any(axis=1))
        on_arm = np.concatenate([top.carried[self.hanging], np.diag(sign)[touching]])
        to_torso = top.carried[self.standing].sum(axis=0) + standing_sign
        ends = tuple((int(top.joints[c, 1]), np.array(top.frame(int(c), 1).translation)) for c in touching)
        numbers = itertools.count(len(on_arm))
        of_springs, of_drives = (
            {
                i: next(numbers)
                for i, (_, place) in enumerate(parts)
                if isinstance(place, PlacedRoute) and (place.joints == arm).any()
            }
            for parts in (self.springs, self.drives)
        )
        count = max(1, len(on_arm) + len(of_springs) + len(of_drives))
        return Attachments(
            count, len(on_arm), on_arm[:, closure_of_row], to_torso[closure_of_row], ends, of_springs, of_drives
        )

    def scaled_rows(self, q: FloatArray) -> FloatArray:
        """Rows of the loops of the held tree, which is linearised here, over its coordinates; both scaled."""
        state, top = self.held, self.held.topology
        state.buffers.linearise(q)
        return np.asarray(state.buffers.jacobian * top.row_scale[:, None] * top.column)


def _places(slices: Iterable[slice]) -> NDArray[np.intp]:
    """What slices hold, one after the other."""
    return np.concatenate([np.zeros(0, dtype=np.intp), *(np.arange(own.start, own.stop) for own in slices)])


def _shifted(state: ChainState, closure: Closure, arm: int, shift: FloatArray) -> Closure:
    """A closure whose end on the arm moves with the cuff."""
    if closure.polynomial is not None or not shift.any():
        return closure
    changes: dict[str, Any] = {}
    for end in ("a", "b"):
        frame = state.model.frames[state.frame_index(getattr(closure, f"frame_{end}"))]
        if frame.parentJoint == arm:
            place: Placement = getattr(closure, f"placement_{end}")
            moved = np.array(place.translation) + frame.placement.rotation.T @ shift
            changes[f"placement_{end}"] = replace(place, translation=tuple(moved.tolist()))
    return replace(closure, **changes)


@lru_cache(maxsize=64)
def device_model(
    device: ChainDevice, base: tuple[float, float, float] = _NOWHERE, cuff: tuple[float, float, float] = _NOWHERE
) -> DeviceModel:
    """Made once for devices that are asked again; they are compared by identity."""
    return DeviceModel(device, base, cuff)


def models_at(
    device: ChainDevice, offset: tuple[FloatArray, FloatArray] | None, count: int
) -> Iterator[tuple[NDArray[np.intp], DeviceModel]]:
    """Rows of N poses and the trees of a device there, whose centre has an offset: of base and cuff, (N, 3) or (1, 3).

    Rows of one offset go together.
    """
    if offset is None:
        yield np.arange(count), device_model(device)
        return
    both = np.concatenate([np.broadcast_to(part, (count, 3)) for part in offset], axis=1)
    kinds, which = np.unique(both, axis=0, return_inverse=True)
    for k, shift in enumerate(kinds.tolist()):
        yield np.flatnonzero(which.ravel() == k), device_model(device, tuple(shift[:3]), tuple(shift[3:]))
