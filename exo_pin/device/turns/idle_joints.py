"""Freedoms of a device that leave the arm and all drives at rest: they settle where gravity and springs hold them.

Where the arm is held and each drive keeps its coordinate, such a freedom is in equilibrium where the potential energy
of the links and springs has no slope along it, and stable where that is a minimum. From the least motion the joints
swing downhill to the nearest such place. Freedoms along which the energy is constant, as the spin of a bar about its
own axis, stay where the least motion has them; so do all of a pose in which no minimum is found.

All configurations of a device in one pose of the arm, as far as its idle freedoms lead within the joints' limits.

A net of configurations is laid from a given one: each is a step along the idle motions from one before, its loops
closed with the arm held near where the step leads, and away from all others.
"""

from __future__ import annotations

from typing import Any

import numpy as np
import pinocchio as pin

from ...chain.kinematics.closing import nearest_closed
from ...chain.structure.motion_axes import carried_joints, has_ends, limits_of
from ...core.errors import LoopNotClosed, MissingData
from ...core.validation import FloatArray
from ..balance.device_state import NONE
from ..device_model import DeviceModel
from ..parts.drives import Drive, Spring
from ..parts.routes import PlacedRoute

__all__ = ["beside", "idle_motions", "idle_net", "settled", "undriven_joints", "undriven_motions"]

#: Rates of joints and drives, rad and characteristic lengths per unit of a motion, that are zero.
STILL = 1e-7
#: Residual of closed loops, most corrections, and the part of a step by which closing may correct it.
CLOSED, CORRECTIONS, JUMP = 1e-12, 20, 0.35
#: Most steps, the largest, the one of differences, and the last, rad and characteristic lengths.
_STEPS, _LARGEST, _PROBE, _LAST = 80, 0.2, 1e-4, 1e-10
#: Slope and curvature of the energy, over the largest generalised force, that are zero.
_LEVEL, _FLAT = 1e-12, 1e-5


def idle_motions(model: DeviceModel, q: FloatArray, none: float = NONE) -> FloatArray:
    """Motions of all joints that leave the arm at rest, shape (nv, k), orthonormal, characteristic lengths and rad."""
    _, s, Vt = np.linalg.svd(model.scaled_rows(q)[:, model.moving])
    free = Vt[int((s > none * s[:1]).sum()) :]
    out = np.zeros((model.held.nv, len(free)))
    out[model.moving] = free.T
    return out


def undriven_motions(model: DeviceModel, q: FloatArray) -> FloatArray:
    """Those of :func:`idle_motions` that leave all drives at rest, too."""
    idle = idle_motions(model, q)
    if not idle.shape[1] or not model.drives:
        return idle
    column = model.held.topology.column
    rates = np.array([_rate(model, part, place) * column for part, place in model.drives]) @ idle
    scale = np.where([isinstance(place, PlacedRoute) for _, place in model.drives], model.held.topology.length, 1.0)
    _, s, Vt = np.linalg.svd(rates / scale[:, None])
    return np.asarray(idle @ Vt[int((s > STILL).sum()) :].T)


def _rate(model: DeviceModel, part: Drive | Spring, place: PlacedRoute | int) -> FloatArray:
    """Change of the coordinate of a drive or spring with those of the held tree as last linearised, shape (nv,)."""
    state = model.held
    if not isinstance(place, PlacedRoute):
        out = np.zeros(state.nv)
        out[state.velocity_slice(str(part.joint))] = 1.0
        return out
    wrenches = carried_joints(state.model) @ place.wrenches(state.buffers.poses)
    return -np.einsum("ci,ci->c", state.buffers.J, wrenches[state.topology.owners])


def _slope(model: DeviceModel, q: FloatArray) -> FloatArray:
    """Slope of the potential energy of links and springs along all coordinates, scaled, shape (nv,)."""
    state = model.held
    state.buffers.linearise(q)
    out = np.array(pin.computeGeneralizedGravity(state.model, pin.Data(state.model), q))
    if state.passive.act:
        out -= state.passive.force(q, None)
    forces, lacking, _ = model.spring_forces(model.free_configuration(q)[None], state.buffers.poses[None])
    if lacking:
        raise MissingData([f"data ({lacking[0][0]})"], "where undriven joints settle", model.device.name)
    for force, (spring, place) in zip(forces[0].tolist(), model.springs, strict=True):
        if force:
            out += force * _rate(model, spring, place)
    return out * state.topology.column


def settled(model: DeviceModel, q: FloatArray) -> FloatArray:
    """Where undriven freedoms settle from a closed configuration, shape (nq,); see the module.

    Parameters
    ----------
    model : DeviceModel
        The device.
    q : ndarray
        Closed configuration of the held tree, shape (nq,).

    Returns
    -------
    ndarray
        Shape (nq,): q itself where no stable place is found.
    """
    at, falls = q, False
    try:
        for _ in range(_STEPS):
            motions, slope = undriven_motions(model, at), _slope(model, at)
            if not motions.shape[1]:
                return q
            step, straight = _downhill(model, at, motions, slope)
            if np.abs(step).max() <= _LAST:
                return at
            # A slide that stands upright falls without end; a swinging link is straight only in passing.
            if straight and falls:
                return q
            falls = straight
            at = _moved(model, at, motions @ step)
    except (LoopNotClosed, MissingData):
        return q
    return q


def _downhill(model: DeviceModel, q: FloatArray, motions: FloatArray, slope: FloatArray) -> tuple[FloatArray, bool]:
    """Step along the motions, shape (k,), and whether one goes down a straight slope.

    The step is Newton's, with each curvature taken as positive, and bounded.
    """
    own, size = motions.T @ slope, float(np.abs(slope).max())
    curvature = np.zeros((len(own), len(own)))
    for k, motion in enumerate(motions.T):
        for sign in (1.0, -1.0):
            there = _moved(model, q, sign * _PROBE * motion)
            turned = undriven_motions(model, there)
            turned = turned @ (turned.T @ motions)
            curvature[k] += sign * (turned.T @ _slope(model, there)) / (2.0 * _PROBE)
    values, axes = np.linalg.eigh(0.5 * (curvature + curvature.T))
    along = axes.T @ own
    level = np.abs(along) <= _LEVEL * size
    with np.errstate(divide="ignore", invalid="ignore"):
        step = np.where(level, 0.0, np.clip(-along / np.abs(values), -_LARGEST, _LARGEST))
    # On a ridge either way is down: that of the larger joint's coordinate.
    ridge = level & (values < -_FLAT * size)
    largest = (motions @ axes)[np.abs(motions @ axes).argmax(axis=0), np.arange(len(own))]
    straight = bool((~level & (np.abs(values) <= _FLAT * size)).any())
    return axes @ np.where(ridge, np.copysign(_LARGEST, largest), step), straight


def _moved(model: DeviceModel, q: FloatArray, motion: FloatArray) -> FloatArray:
    """The closed configuration along a motion, with the arm and the joints that have drives held."""
    state = model.held
    driven = [part.joint for part, place in model.drives if not isinstance(place, PlacedRoute)]
    held = np.concatenate([model.fixed, state.velocity_indices([str(joint) for joint in driven])]).astype(np.int64)
    there = pin.integrate(state.model, q, motion * state.topology.column)
    return nearest_closed(state, there, held, CLOSED, CORRECTIONS)[0]


#: Width of the net by the number of idle freedoms, rad and characteristic lengths; of more than these the last one.
_WIDTH = (0.1, 0.3, 0.6)
#: Most configurations of a net.
MOST = 1500
#: Longest step, and part of the width within which two are one.
_STEP, _SAME = 0.1, 0.6


def idle_net(model: DeviceModel, q: FloatArray) -> tuple[FloatArray, bool, float]:
    """Configurations from a given one on, shape (k, nq), whether these are all, and the width of the net."""
    free = idle_motions(model, q).shape[1]
    found, places = [q], [_place(model, q)]
    if not free:
        return np.array(found), True, 0.0
    width, at = _WIDTH[min(free, len(_WIDTH)) - 1], 0
    while at < len(found):
        for there in beside(model, found[at], width):
            place = _place(model, there)
            if np.linalg.norm(np.array(places) - place, axis=1).min() < _SAME * width:
                continue
            if len(found) == MOST:
                return np.array(found), False, width
            found.append(there)
            places.append(place)
        at += 1
    return np.array(found), True, width


def beside(model: DeviceModel, q: FloatArray, width: float) -> list[FloatArray]:
    """The configurations a step along and against each idle motion away, those that are within the limits."""
    motions, out = idle_motions(model, q), []
    steps = max(1, int(np.ceil(width / _STEP)))
    for motion in (*motions.T, *-motions.T):
        there, along = q, motion
        for _ in range(steps):
            there, along = _stepped(model, there, along, width / steps, motions.shape[1])
            if there is None:
                break
        else:
            out.append(there)
    return out


def _stepped(model: DeviceModel, q: FloatArray, along: FloatArray, size: float, free: int) -> tuple[Any, FloatArray]:
    """One step in a direction, and the direction there; None where it leads nowhere."""
    state = model.held
    motions = idle_motions(model, q)
    own = motions @ (motions.T @ along)
    length = float(np.linalg.norm(own))
    if motions.shape[1] != free or length < 0.5:
        return None, along
    own /= length
    ahead = pin.integrate(state.model, q, size * own * state.topology.column)
    try:
        closed = nearest_closed(state, ahead, model.fixed, CLOSED, CORRECTIONS)[0]
    except LoopNotClosed:
        return None, along
    moved = pin.difference(state.model, ahead, closed) / state.topology.column
    if np.abs(moved).max() > JUMP * size or not _within(model, closed):
        return None, along
    return closed, own


def _within(model: DeviceModel, q: FloatArray) -> bool:
    limits = limits_of(model.held.model)
    own, ends = q[limits.q_index], has_ends(limits)
    return bool(((own >= limits.lower) & (own <= limits.upper) | ~ends).all())


def _place(model: DeviceModel, q: FloatArray) -> FloatArray:
    """Coordinates of all joints, in which small distances are those of motions, and whole turns are none."""
    own, parts = model.held.model, list[FloatArray]()
    for k in range(1, own.njoints):
        x, nv = q[own.idx_qs[k] : own.idx_qs[k] + own.nqs[k]], own.nvs[k]
        if own.nqs[k] == 4 and nv == 3:
            parts.append(2.0 * x * np.sign(x[np.abs(x).argmax()]))
        elif nv == 1 and own.nqs[k] == 1 and not model.held.topology.metres[own.idx_vs[k]]:
            parts.append(np.array([np.cos(x[0]), np.sin(x[0])]))
        else:
            parts.append(x / (model.held.topology.length if nv == own.nqs[k] else 1.0))
    return np.concatenate(parts)


def undriven_joints(model: DeviceModel, q: FloatArray) -> list[str]:
    """Joints of one coordinate that, held, leave as few undriven freedoms as they can."""
    left, held, own = undriven_motions(model, q), list[str](), model.held.model
    single = [k for k in range(1, own.njoints) if own.nvs[k] == 1 and k != model.arm]
    while left.shape[1]:
        sizes = [float(np.linalg.norm(left[own.idx_vs[k]])) for k in single]
        best = int(np.argmax(sizes)) if sizes else -1
        if best < 0 or sizes[best] <= STILL:
            break
        held.append(str(own.names[single[best]]))
        left = left @ np.linalg.svd(left[own.idx_vs[single[best]]][None])[2][1:].T
    return held
