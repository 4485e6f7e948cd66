"""Closed configurations of a device for poses of the arm.

From rest to a pose the arm turns about one axis, and the device follows on its assembly mode in verified steps
(:mod:`exo_pin.device.turns`). Freedoms that leave the arm where it is follow a rule: at every moment of the turn the
joints move as little as they can.
"""

from __future__ import annotations

from collections.abc import Callable
from typing import TYPE_CHECKING, Any, NamedTuple

import numpy as np
import pinocchio as pin
from numpy.typing import NDArray
from scipy.spatial.transform import Rotation

from ..chain.kinematics.closing import close, nearest_closed
from ..chain.structure.chain_state import ChainState
from ..core.errors import LoopNotClosed
from ..core.progress import track
from ..core.records import reduced_tuple
from ..core.validation import FloatArray, as_count, as_single_rotation
from ..load_case.pose_stacks import pose_matrices
from .balance.device_state import NONE
from .device_model import REACHED, DeviceModel, device_model
from .turns.idle_joints import CLOSED, idle_motions, settled, undriven_motions

if TYPE_CHECKING:
    from .chain_device import ChainDevice

__all__: list[str] = []

#: Configurations whose links are this near, m and entries of rotations, are one.
_ALIKE = 1e-6


class Postures(NamedTuple):
    """Configurations for N poses.

    Attributes
    ----------
    q : ndarray
        Of the held tree, shape (N, nq); that of the nearest pose reached where a pose is out of reach.
    reached : ndarray of bool
        Shape (N,).
    share : ndarray
        Part of the turn from rest that was followed, shape (N,); 1 where the pose is reached.
    why : ndarray of int8
        Shape (N,): 0 where the pose is reached; 1 where it is out of reach, because the loops cannot close on the way;
        2 where it is beyond a singular configuration, at which the assembly mode from rest ends.
    """

    q: FloatArray
    reached: NDArray[np.bool_]
    share: FloatArray
    why: NDArray[np.int8]

    def __reduce__(self) -> tuple[Any, ...]:
        return reduced_tuple(self)


def closed_at_rest(model: DeviceModel) -> FloatArray:
    """The closed configuration with the arm hanging, nearest to where the file draws the links, shape (nq,).

    Raises
    ------
    LoopNotClosed
        If the loops do not close there.
    """
    if model.closed_at_rest is None:
        state, q = model.held, model.held.neutral()
        q[model.q_from] = model.device.chain.reference_configuration()[model.q_from]
        model.closed_at_rest = np.asarray(close(state, q, hold=[str(state.model.names[model.arm])]))
    return model.closed_at_rest


def postures(model: DeviceModel, matrices: FloatArray, progress: bool = False, settle: bool = True) -> Postures:
    """Follow the device from rest to every pose.

    Parameters
    ----------
    model : DeviceModel
        The device.
    matrices : ndarray
        Shape (N, 3, 3).
    progress : bool
        Whether to show a bar.
    settle : bool
        Whether joints that no drive holds settle.

    Raises
    ------
    LoopNotClosed
        If the loops do not close with the arm hanging.
    """
    from .turns.turn_stack import followed_turns  # here: a wrist needs none of it

    q, share, why = followed_turns(model, closed_at_rest(model), matrices, progress)
    if settle and _undriven(model):
        for k in track(np.flatnonzero(why == REACHED), "joints that hang", progress):
            q[k] = settled(model, q[k])
    return Postures(q, why == REACHED, share, why)


def reached_postures(
    model: DeviceModel, matrices: FloatArray, progress: bool = False, given: Callable[..., Postures] | None = None
) -> Postures:
    """As :func:`postures`, then as ``given``; none is reached where the loops do not close with the arm hanging."""
    try:
        found = postures(model, matrices, progress)
        return found if given is None else given(model, found)
    except LoopNotClosed:
        count = len(matrices)
        q = np.tile(model.held.neutral(), (count, 1))
        return Postures(q, np.zeros(count, dtype=bool), np.zeros(count), np.ones(count, dtype=np.int8))


def nearest_reached(device: ChainDevice, pose: Rotation) -> Rotation | None:
    """Where the way of a device to a pose ends that turns the arm about fewer than three axes; None of others.

    The device's centre is the shoulder's.
    """
    from .turns.own_ways import lacks_turns, own_way  # here: few devices need it

    model = device_model(device)
    start = closed_at_rest(model)
    if not lacks_turns(model, start):
        return None
    return Rotation.from_quat(own_way(model, start, pose.as_quat())[0][model.arm_q])


def _undriven(model: DeviceModel) -> int:
    """Freedoms that leave the arm and all drives at rest."""
    if "undriven" not in model.kept:
        model.kept["undriven"] = undriven_motions(model, closed_at_rest(model)).shape[1]
    return int(model.kept["undriven"])


def posture_rule(device: ChainDevice) -> str:
    """How the configuration of a device in a pose is chosen, in words.

    Parameters
    ----------
    device : ChainDevice
        The device.

    Returns
    -------
    str
        For a caption, without a full stop.

    Raises
    ------
    LoopNotClosed
        If its loops do not close with the arm hanging.

    Examples
    --------
    >>> from exo_pin.device import ChainDevice
    >>> from exo_pin.device.postures import posture_rule
    >>> posture_rule(ChainDevice.from_chain(ep.load("prototype").chain))
    'joints follow the straight turn of the arm from rest'
    """
    model = device_model(device)
    start = closed_at_rest(model)
    idle, undriven = idle_motions(model, start).shape[1], _undriven(model)
    rules = ["joints follow the straight turn of the arm from rest"]
    if idle > undriven:
        rules.append("idle joints move as little as possible along it")
    if undriven:
        rules.append("joints that no drive holds settle where gravity and springs leave them")
    return "; ".join(rules)


def following(model: DeviceModel, q: FloatArray, arm: FloatArray, opening: FloatArray | None = None) -> FloatArray:
    """Motion of all joints, shape (nv,) or (nv, k), for one or some of the arm, in its own axes: the least one.

    Of soft joints it is the least that lets the others close the loops.

    Parameters
    ----------
    model : DeviceModel
        The device.
    q : ndarray
        Closed configuration.
    arm : ndarray
        Angular velocity or acceleration of the arm, shape (3,) or (3, k).
    opening : ndarray, optional
        Shape (rows,), what an acceleration must close besides: J̇ v.
    """
    top, passive, soft = model.held.topology, model.passive, model.soft
    out = np.zeros((model.held.nv, *arm.shape[1:]))
    out[model.arm_v] = arm
    J = model.scaled_rows(q)
    if J.size:
        # Angles have no scale.
        driven = J[:, model.arm_v] @ arm
        driven = driven if opening is None else driven + opening * top.row_scale
        if soft.size:
            U, s, _ = np.linalg.svd(J[:, passive])
            left = U[:, int((s > NONE * s[:1]).sum()) :].T
            gives, opens = left @ J[:, soft], left @ driven
            # Redundant rows, as of a planar loop, are rounding on both sides, and ask nothing of a soft joint.
            gives[np.abs(gives) < NONE] = 0.0
            move = -np.linalg.lstsq(gives, opens, rcond=NONE)[0]
            driven, out[soft] = driven + J[:, soft] @ move, (move.T * top.column[soft]).T
        out[passive] = -(np.linalg.lstsq(J[:, passive], driven, rcond=NONE)[0].T * top.column[passive]).T
    return out


def configurations_of(device: ChainDevice, poses: Rotation) -> FloatArray:
    """Configurations of the chain in poses, shape (..., nq); NaN where a pose is out of reach."""
    shape, matrices = pose_matrices(poses)
    model = device_model(device)
    found = postures(model, matrices)
    return np.where(found.reached[:, None], found.q, np.nan).reshape(*shape, model.held.nq)


def placements(state: ChainState, q: FloatArray) -> FloatArray:
    """Rotations and positions of all bodies, shape (njoints - 1, 4, 3)."""
    state.buffers.linearise(q)
    return np.array(state.buffers.poses[1:])


def assembly_modes(device: ChainDevice, poses: Rotation, starts: int, seed: int) -> FloatArray:
    """Closed configurations in one pose, shape (k, nq), that of the mode from rest first; see :data:`_ALIKE`."""
    matrix = as_single_rotation("poses", poses).as_matrix()
    model, starts = device_model(device), as_count("starts", starts, 0)
    state, rng = model.held, np.random.default_rng(seed)
    found = postures(model, matrix[None])
    modes = [found.q[0]] if found.reached[0] else []
    places = [placements(state, q) for q in modes]
    held = state.velocity_indices([str(state.model.names[model.arm])])
    reach = np.where(state.topology.metres, state.topology.length, np.pi)
    for _ in range(starts):
        start = pin.integrate(state.model, closed_at_rest(model), rng.uniform(-reach, reach))
        start[model.arm_q] = Rotation.from_matrix(matrix).as_quat()
        try:
            q, _ = nearest_closed(state, start, held, CLOSED, 60)
        except LoopNotClosed:
            continue
        # Where the links are counts: whole turns of a hinge do not.
        place = placements(state, q)
        if all(np.abs(place - other).max() > _ALIKE for other in places):
            modes.append(q)
            places.append(place)
    return np.array(modes).reshape(-1, state.nq)
