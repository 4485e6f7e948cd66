"""The equations of motion of a device in a stack of poses, solved: forces of :mod:`exo_pin.device.equilibrium`.

Equilibrium is a sum of zero over every motion that the loops allow: those that turn the arm, and idle ones, which leave
it where it is. An idle motion on which a drive or brake acts has a row of equilibrium beside the three of the arm's
turns. One on which nothing acts must not be loaded, because nobody holds it: the spin of a limb between two ball joints
is not, a slide that stands upright is.
"""

from __future__ import annotations

from typing import NamedTuple

import numpy as np
import scipy
from numpy.typing import NDArray

from ...core.validation import FloatArray
from ...numerics.rank_factors import fill_least_in_order, solve_and_span
from ..device_model import DeviceModel
from .device_loads import DeviceLoads
from .device_state import NONE, DeviceState

__all__ = ["fill_forces"]

#: Load of a motion that nothing holds, relative to the largest load in any coordinate (moments, and forces times the
#: characteristic length), up to which it is rounding: loops are closed to 1e-12 of that length.
UNBALANCED = 1e-9


class LoopMotions(NamedTuple):
    """What the loops of a device allow in N poses, over all coordinates but the arm's translation and fixed joints.

    Coordinates and rows are scaled by the characteristic length.

    Attributes
    ----------
    multipliers : ndarray
        The least ones that carry each of some loads as far as loops can, shape (N, rows, k).
    stresses : ndarray
        Orthonormal multipliers that load no coordinate, shape (N, rows, s); zero columns where a pose has fewer.
    self_stresses : ndarray of int
        Their number, shape (N,).
    turning : ndarray
        Shape (N, rest, 3): the least motion of all joints for a turn of 1 rad of the arm about each axis of the base
        frame, as far as the loops allow it.
    freedom : ndarray
        Shape (N,): turn about the worst axis over the motion that it needs, from 0 to 1.
    motions : ndarray
        All that the loops allow, orthonormal, shape (N, rest, k); zero columns where a pose has fewer.
    idle : ndarray or None
        Projector of their multiples on those that leave the arm where it is, shape (N, k, k); None where no pose has
        any.
    idle_count : ndarray of int
        Their number, shape (N,).
    """

    multipliers: FloatArray
    stresses: FloatArray
    self_stresses: NDArray[np.intp]
    turning: FloatArray
    freedom: FloatArray
    motions: FloatArray
    idle: FloatArray | None
    idle_count: NDArray[np.intp]


def loop_motions(model: DeviceModel, jacobian: FloatArray, R: FloatArray, loads: FloatArray) -> LoopMotions:
    """Motions and self-stresses of N poses.

    Parameters
    ----------
    model : DeviceModel
        The device.
    jacobian : ndarray
        Of the loops of the free tree, shape (N, rows, nv).
    R : ndarray
        Orientations of the arm, shape (N, 3, 3).
    loads : ndarray
        Generalised forces, scaled, shape (N, rest, k).
    """
    rest, top = model.rest, model.free.topology
    J = jacobian[:, :, rest] * (top.row_scale[:, None] * top.column[rest])
    count, rows, size = J.shape
    multipliers, rank = np.empty((count, loads.shape[2], rows)), np.empty(count, dtype=np.intp)
    null, left = np.empty((count, size, size)), np.empty((count, rows, rows))
    solve_and_span(J, np.ascontiguousarray(loads.mT), model.none, multipliers, null, left, rank)
    least = int(rank.min())
    motions = null[:, least:].mT
    u, w, vt = np.linalg.svd(R @ motions[:, model.rest_angular], full_matrices=False)
    turns = w > model.none
    turned = vt.mT * turns[:, None]
    inverse = np.divide(1.0, w, out=np.zeros_like(w), where=turns)
    idle_count = size - rank - turns.sum(axis=1)
    return LoopMotions(
        multipliers.mT,
        left[:, least:].mT,
        rows - rank,
        motions @ (turned * inverse[:, None] @ u.mT),
        w[:, -1] if w.shape[1] == 3 else np.zeros(count),
        motions,
        np.eye(size - least) * (np.arange(least, size) >= rank[:, None])[:, None] - turned @ turned.mT
        if idle_count.any()
        else None,
        idle_count,
    )


def held_motions(
    found: LoopMotions, efforts: FloatArray, moments: FloatArray, none: float = NONE
) -> tuple[FloatArray, FloatArray, NDArray[np.intp]]:
    """Idle motions on which efforts act, and the number of these.

    Parameters
    ----------
    found : LoopMotions
        Of which some are idle.
    efforts : ndarray
        Generalised force of a unit of each effort, scaled, shape (N, rest, p).
    moments : ndarray
        Moments of the efforts on the arm, shape (N, 3, p), beside which an effect may be rounding.
    none : float
        Part of these up to which an effect is none.

    Returns
    -------
    held : ndarray
        Shape (N, rest, d), orthonormal; zero columns where a pose has fewer.
    free : ndarray
        Projector of multiples of all motions on those on which no effort acts, shape (N, k, k).
    count : ndarray of int
        Shape (N,).
    """
    assert found.idle is not None
    U, s, _ = np.linalg.svd(found.idle @ (found.motions.mT @ efforts), full_matrices=False)
    scale = np.hypot(np.linalg.norm(moments, axis=(1, 2)), np.linalg.norm(s, axis=1))
    counts = s > none * scale[:, None]
    count = counts.sum(axis=1)
    held = (U * counts[:, None])[:, :, : int(count.max())]
    return found.motions @ held, found.idle - held @ held.mT, count


class Freedoms(NamedTuple):
    """What equilibrium needs of N poses beside their three moments.

    Attributes
    ----------
    freedom : ndarray
        Turn of the arm about its worst axis over the motion of all joints that it needs, shape (N,), from 0 to 1.
    self_stresses : ndarray of int
        Reactions that equilibrium does not determine, shape (N,).
    held, free : ndarray of int
        Idle motions on which drives or brakes act, and on which none does, shape (N,).
    unheld : ndarray
        Effort that is missing at each joint, N or N m, shape (N, njoints): zero where the free ones are in balance.
    """

    freedom: FloatArray
    self_stresses: NDArray[np.intp]
    held: NDArray[np.intp]
    free: NDArray[np.intp]
    unheld: FloatArray


def fill_forces(
    model: DeviceModel, loads: DeviceLoads, R: FloatArray, on_cuff: FloatArray, state: DeviceState
) -> Freedoms:
    """Write the forces of N poses, and say what else equilibrium needs.

    Parameters
    ----------
    model : DeviceModel
        The device.
    loads : DeviceLoads
        Its equations.
    R : ndarray
        Orientations of the arm, shape (N, 3, 3).
    on_cuff : ndarray
        Weight and inertia of the device's links that are welded to the arm, shape (N, 6), about O, base frame. The
        arm's body has their mass, but they load the cuff, as all of the device does.
    state : DeviceState
        Of N poses, filled.
    """
    rest, top, J, B = model.rest, model.free.topology, loads.equations.jacobian, loads.driven.B
    column, own, p, count = top.column[rest][:, None], B.shape[2], state.moment_of_f.shape[2], len(R)
    # Loads as columns: constant, of the drives' efforts, of limbs that resist their twist, and of moments on the arm
    # about the base frame's axes.
    twists, first = len(model.twists), 1 + own + len(model.twists)
    sides = slice(1 + own, first)
    columns = np.zeros((count, model.free.nv, first + 3))
    columns[:, :, 0], columns[:, :, 1 : 1 + own], columns[:, model.angular, first:] = loads.tau, -B, R.mT
    columns[:, model.twists, np.arange(sides.start, first)] = -1.0
    scaled = column * columns[:, rest]
    motions = loop_motions(model, J, R, scaled)
    turned = motions.turning.mT @ scaled
    load, efforts, moments = scaled[..., :1], -scaled[..., 1 : 1 + own], -turned[..., 1 : 1 + own]
    state.moment[:, :3], state.moment_of_f[:, :3, :own] = turned[..., 0], moments
    state.moment_of_f[:, :3, own:], state.moment_of_g[:, :3, :twists] = np.eye(3)[:, : p - own], -turned[..., sides]
    held_count, unheld = np.zeros(count, dtype=np.intp), np.zeros((count, model.free.model.njoints))
    if motions.idle is not None:
        held, free, held_count = held_motions(motions, efforts, moments, model.none)
        rows = min(held.shape[2], state.moment.shape[1] - 3)
        idle, along = slice(3, 3 + rows), held[:, :, :rows].mT
        state.moment_of_f[:, idle, :own] = along @ efforts
        state.moment_of_g[:, idle, :twists] = -along @ scaled[..., sides]
        state.moment[:, idle] = (along @ load)[..., 0]
        _find_unheld(model, loads, motions.motions, free, load, unheld)
    # What a column lacks to balance the turns of the arm acts on the arm itself, whoever makes it. What it lacks to
    # balance idle motions is left out: nothing of that is left of the sum in equilibrium.
    turned[..., first:] -= np.eye(3)
    multipliers = -motions.multipliers[..., first:] @ turned
    multipliers[..., :first] += motions.multipliers[..., :first]
    multipliers[..., first:] *= -1.0
    # Constant, of all efforts with the wearer's moments, of limbs that resist their twist.
    order = [*range(1 + own), *range(first, first + p - own), *range(1 + own, first)]
    row = top.row_scale[:, None]
    across = R @ J[:, :, model.linear].mT
    shoulder = np.zeros((count, 3, 1 + p + twists))
    shoulder[..., : 1 + own] = R @ columns[:, model.linear, : 1 + own]
    multipliers = row * multipliers[..., order]
    _Attachments(model, loads, R, on_cuff).fill(state, shoulder, across, multipliers, row * motions.stresses)
    if twists:
        state.count_sides_in_newton(twists)
    free_count = motions.idle_count - held_count
    return Freedoms(motions.freedom, motions.self_stresses, held_count, free_count, unheld)


def _find_unheld(
    model: DeviceModel, loads: DeviceLoads, motions: FloatArray, free: FloatArray, load: FloatArray, out: FloatArray
) -> None:
    """Fill the effort that is missing at each joint, shape (N, njoints), where motions without drive are loaded.

    Parameters
    ----------
    motions : ndarray
        All motions, scaled, orthonormal, shape (N, rest, k).
    free : ndarray
        Projector of their multiples on those on which no drive acts, shape (N, k, k).
    load : ndarray
        Load, scaled, shape (N, rest, 1).
    """
    column = model.free.topology.column
    # Loads are sums of weights: rounding is relative to the largest of them, wherever it acts.
    scale = np.hypot(*(np.linalg.norm(column * part, axis=1) for part in (loads.tau, loads.equations.tau)))
    missing = (free @ (motions.mT @ load))[..., 0]
    least = max(UNBALANCED, model.free.contradiction) * scale
    for k in np.flatnonzero(np.linalg.norm(missing, axis=1) > least):
        values, vectors = np.linalg.eigh(free[k])
        own = vectors[:, values.round() > 0]
        moving = motions[k] @ own
        # Of several motions, as many joints as move most, each with the effort that would hold them all.
        chosen = scipy.linalg.qr(moving.T, mode="r", pivoting=True)[1][: own.shape[1]]
        efforts = np.linalg.solve(moving[chosen].T, own.T @ missing[k])
        for at, effort in zip(model.rest[chosen], efforts, strict=True):
            if abs(effort) > least[k]:
                out[k, model.owners[at]] += abs(effort) / column[at]


class _Attachments:
    """Wrenches at the attachments of the device on the arm and of the device on the torso, in N poses.

    Wrenches have columns: constant, then one for each effort; moments are about O. The forces that equilibrium leaves
    open are chosen as :mod:`exo_pin.device.balance.device_state` says.
    """

    def __init__(self, model: DeviceModel, loads: DeviceLoads, R: FloatArray, on_cuff: FloatArray) -> None:
        self.model, self.loads, self.R, self.on_cuff = model, loads, R, on_cuff

    def fill(
        self, state: DeviceState, shoulder: FloatArray, across: FloatArray, multipliers: FloatArray, free: FloatArray
    ) -> None:
        """Write shoulder force and attachments.

        Parameters
        ----------
        state : DeviceState
            Of N poses.
        shoulder : ndarray
            Force on the shoulder but for that of multipliers, shape (N, 3, 1 + p + t), of t limbs that resist their
            twist.
        across : ndarray
            Force that each multiplier takes from it, shape (N, 3, rows).
        multipliers, free : ndarray
            Of the columns, shape (N, rows, 1 + p + t), and those that load no coordinate, shape (N, rows, s).
        """
        efforts, twists, count = state.forces_of_f.shape[2], len(self.model.twists), len(self.R)
        none, places, unit = self.model.none, self.model.attachments, self._about(self.loads.equations.unit).mT
        of_rows = np.zeros((count, places.entries + 1, *unit.shape[1:]))
        of_rows[:, : places.firm], of_rows[:, -1] = places.on_arm[:, None] * unit[:, None], places.on_torso * unit
        # Loads of the columns are the left side: tau, and what of B f stands on the right with the other sign.
        of_multipliers = np.concatenate([-across, of_rows.reshape(count, 6 * of_rows.shape[1], unit.shape[2])], axis=1)
        own, points = self._own(multipliers.shape[2])
        found = np.concatenate([shoulder, own.reshape(count, -1, own.shape[3])], axis=1) + of_multipliers @ multipliers
        if free.shape[2]:
            of_free = of_multipliers @ free
            effects, present = self._wanted(of_free, points), self._wanted(found, points, self.on_cuff)
            found += of_free @ least_in_order(effects, present, none)
            # Unit forces along the base frame's axes where all three are open, with the least couples that make them.
            open_ = of_free[:, :3]
            U, s, _ = np.linalg.svd(open_, full_matrices=False)
            counts = s > none
            target = U * counts[:, None]
            target[counts.sum(axis=1) == 3] = np.eye(3)[:, : target.shape[2]]
            nothing = [np.zeros((*part.shape[:2], target.shape[2])) for part in effects]
            side = least_in_order([open_, *effects], [-target, *nothing], none)
            k = min(target.shape[2], efforts - twists)
            state.forces_of_g[..., twists : twists + k] = (of_free @ side)[..., :k]
        state.forces[:], state.forces_of_f[:] = found[..., 0], found[..., 1 : 1 + efforts]
        state.forces_of_g[..., :twists] = found[..., 1 + efforts :]

    def _own(self, width: int) -> tuple[FloatArray, FloatArray]:
        """Wrenches but for the multipliers: at c places on the arm, then on the torso, (N, c + 1, 6, width).

        The second are the points of the attachments that may put couples on the arm, from O, shape (N, firm, 3).
        """
        model, loads, places = self.model, self.loads, self.model.attachments
        equations, count, hanging = loads.equations, len(self.R), model.hanging
        found = np.zeros((count, places.entries + 1, 6, width))
        at_arm, standing = found[:, :-1], found[:, -1]
        # What the arm's child transmits to the arm: minus the weight and inertia of all that it carries.
        at_arm[:, : len(hanging), :, 0] = -self._about(equations.tree[:, hanging])
        standing[:, :, 0] = -self._about(equations.tree[:, model.standing].sum(axis=1))
        routed = [
            *((0, pull, places.springs.get(i)) for i, pull in enumerate(loads.spring_pulls)),
            *((1 + i, pull, places.drives.get(i)) for i, pull in enumerate(loads.driven.pulls)),
        ]
        for column, pull, place in routed:
            if pull is None:
                continue
            own = self._about(pull)
            at_arm[:, : len(hanging), :, column] += model.carried[hanging] @ own
            standing[:, :, column] += model.carried[model.standing].sum(axis=0) @ own + own[:, 0]
            if place is not None:
                at_arm[:, place, :, column] = own[:, model.arm]
        poses = equations.poses
        ends = [poses[:, carrier, 3] + at @ poses[:, carrier, :3] for carrier, at in places.ends]
        points = np.concatenate([poses[:, hanging, 3], *(end[:, None] for end in ends)], axis=1)
        return found, points - model.centre

    def _wanted(self, forces: FloatArray, points: FloatArray, welded: FloatArray | None = None) -> list[FloatArray]:
        """What is made least, in this order: couple and force at the cuff, then couples and forces of the attachments.

        Parameters
        ----------
        forces : ndarray
            As :attr:`.DeviceState.forces`, shape (N, 9 + 6 c, k).
        points : ndarray
            Of the attachments from O, shape (N, firm, 3).
        welded : ndarray, optional
            Of the links that are welded to the arm, shape (N, 6), about O, in the first column: they and the
            attachments are what the cuff bears.
        """
        count, _, width = forces.shape
        wrenches = forces[:, 3:-6].reshape(count, -1, 6, width)
        firm = wrenches[:, : points.shape[1]]
        couples = firm[:, :, 3:] - _cross_matrix(points) @ firm[:, :, :3]
        each = [part.reshape(count, -1, width) for part in (couples, wrenches[:, :, :3])]
        if self.model.cuff is None:
            return each
        total = wrenches.sum(axis=1)
        if welded is not None:
            total[:, :, 0] += welded
        return [total[:, 3:] - _cross_matrix(self.R @ self.model.cuff) @ total[:, :3], total[:, :3], *each]

    def _about(self, wrenches: FloatArray) -> FloatArray:
        """Wrenches about the world's origin, shape (..., 6), about O."""
        out = np.array(wrenches)
        out[..., 3:] += wrenches[..., :3] @ _cross_matrix(self.model.centre)
        return out


def _cross_matrix(a: FloatArray) -> FloatArray:
    """Matrix of a × of vectors, shape (..., 3)."""
    out = np.zeros((*a.shape, 3))
    for i, j, k in ((0, 1, 2), (1, 2, 0), (2, 0, 1)):
        out[..., j, k], out[..., k, j] = -a[..., i], a[..., i]
    return out


def least_in_order(effects: list[FloatArray], present: list[FloatArray], none: float) -> FloatArray:
    """Multiples of self-stresses that make each of several quantities least, the first ones first, (N, stresses, k).

    Parameters
    ----------
    effects : list of ndarray
        Of a unit of each self-stress on the quantities, shape (N, rows, stresses).
    present : list of ndarray
        The quantities without, shape (N, rows, k).
    none : float
        Effect that is rounding.
    """
    ends = np.cumsum([effect.shape[1] for effect in effects])
    found = np.empty((len(effects[0]), present[0].shape[2], effects[0].shape[2]))
    # Self-stresses are of size one. Where none reaches the arm, as behind a soft cuff, all effects are rounding.
    fill_least_in_order(np.concatenate(effects, axis=1), np.concatenate(present, axis=1), ends, none, found)
    return found.mT
