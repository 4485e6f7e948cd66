"""Postures that the user gives: values of joints that move while the arm rests, or whole configurations.

From where the straight turn ends the arm is held, and the named joints go to their values on a straight way. All others
follow with the least motion that keeps the loops closed. A step is taken only where its two halves arrive at the same
configuration (:data:`_ALIKE`) and the loops close near where the joints' rates lead; where steps of :data:`_SHORTEST`
fail, the way ends. Where the named joints determine all idle freedoms, the end is a configuration of its own, whatever
the way; else the others are where least motion leaves them.
"""

from __future__ import annotations

from collections.abc import Mapping
from typing import TYPE_CHECKING, Any, NamedTuple

import numpy as np
import pinocchio as pin
from numpy.typing import NDArray
from scipy.spatial.transform import Rotation

from ...chain.kinematics.closing import nearest_closed
from ...chain.structure.motion_axes import q_slice
from ...core.errors import InvalidInput, LoopNotClosed, UnknownName
from ...core.records import reduced_tuple
from ...core.tables import enumerated
from ...core.validation import FloatArray, as_finite
from ..device_model import UNREACHED, DeviceModel
from .idle_joints import CLOSED, CORRECTIONS, JUMP, STILL, idle_motions, settled, undriven_motions

if TYPE_CHECKING:
    from ..chain_device import ChainDevice

__all__ = ["GivenPosture", "given_posture", "posed", "stepped"]

#: Longest step of a way and the shortest, rad and characteristic lengths.
_LONGEST, _SHORTEST = 0.2, 1e-6
#: Two half steps and a whole one agree to this.
_ALIKE = 1e-6
#: What closing may correct of any step, besides its part of it, rad and characteristic lengths.
_SMALL = 1e-6
#: Difference of a given configuration from its pose and from the closed one nearby, rad and m, that is rounding.
_SAME, _ELSEWHERE = 1e-6, 0.3
_UNITS = {"_deg": (False, np.pi / 180.0), "_rad": (False, 1.0), "_mm": (True, 1e-3), "_m": (True, 1.0)}


class GivenPosture(NamedTuple):
    """The posture of N poses.

    Attributes
    ----------
    joints : tuple of str
        Joints that have values; none where whole configurations are given.
    values : ndarray
        Shape (N, m), m or rad; or configurations of the chain, shape (N, nq).
    """

    joints: tuple[str, ...]
    values: FloatArray

    def __reduce__(self) -> tuple[Any, ...]:
        return reduced_tuple(self)

    def at(self, rows: Any) -> GivenPosture:
        """The posture of some of the poses."""
        return GivenPosture(self.joints, self.values[rows])

    @property
    def words(self) -> str:
        """Rule of the posture, for a caption."""
        if not self.joints:
            return "the configuration that was asked for"
        ends = np.unique(self.values, axis=0)
        shown = [f"{name} at {ends[0, i]:.4g}" if len(ends) == 1 else name for i, name in enumerate(self.joints)]
        return f"{enumerated(shown)} as asked for (rad, m), reached from the straight turn with the arm held"


def given_posture(device: ChainDevice, posture: Any, shape: tuple[int, ...]) -> GivenPosture | None:
    """The posture of a stack of poses, from what a user gives.

    Parameters
    ----------
    device : ChainDevice
        The device.
    posture : mapping, array_like or None
        Values by joint, m or rad, or in the unit that the name ends in; or configurations, shape (..., nq).
    shape : tuple of int
        Of the stack, N poses in all.

    Raises
    ------
    UnknownName
        If there is no such joint.
    InvalidInput
        If a joint has not one coordinate, or a value is not finite or does not broadcast.
    """
    if posture is None:
        return None
    count, chain = int(np.prod(shape)), device.chain
    if not isinstance(posture, Mapping):
        nq = chain.model.nq
        flat = np.broadcast_to(as_finite("posture", posture, (nq,), stack=True), (*shape, nq))
        return GivenPosture((), flat.reshape(count, nq))
    found: dict[str, FloatArray] = {}
    for name, value in posture.items():
        joint, size = _joint_of(device, name)
        if joint in found:
            raise InvalidInput(f"expected each joint of a posture once, got {joint} twice")
        values = size * as_finite(f"posture of {name}", value, (), stack=True)
        try:
            found[joint] = np.broadcast_to(values, shape).reshape(count)
        except ValueError:
            raise InvalidInput(f"expected the posture of {name} to broadcast to {shape}, got {values.shape}") from None
    if not found:
        raise InvalidInput("expected a posture to name joints, got an empty one")
    return GivenPosture(tuple(found), np.stack(list(found.values()), axis=1))


def _joint_of(device: ChainDevice, name: Any) -> tuple[str, float]:
    """The joint that a name means, and the SI value of its unit."""
    chain = device.chain
    known = {str(each) for each in chain.model.names[1:]} - {device.arm_joint}
    own = {each for each in known if chain.velocity_indices([each]).size == 1}
    if name in own:
        return str(name), 1.0
    for ending, (metres, size) in _UNITS.items():
        stem = str(name).removesuffix(ending)
        if stem != name and stem in own and bool(chain.metres[chain.velocity_slice(stem)][0]) == metres:
            return stem, size
    if name in known:
        raise InvalidInput(f"expected joints of one coordinate in a posture, got {name!r}")
    raise UnknownName("joint of a posture", name, sorted(own))


def posed(model: DeviceModel, found: Any, given: GivenPosture, matrices: FloatArray) -> Any:
    """Postures with the user's values.

    Parameters
    ----------
    model : DeviceModel
        The device.
    found : Postures
        By the straight turn.
    given : GivenPosture
        Of the same poses.
    matrices : ndarray
        The poses, shape (N, 3, 3); a configuration may be given where the straight turn does not end.

    Raises
    ------
    InvalidInput
        If the joints do not move by themselves while the arm rests, or a configuration is not that of its pose.
    """
    q, reached, share, why = (part.copy() for part in found)
    if not given.joints:
        for k, (own, pose) in enumerate(zip(given.values, Rotation.from_matrix(matrices).as_quat(), strict=True)):
            q[k] = _closed_at(model, own, pose)
        return type(found)(q, np.ones_like(reached), np.ones_like(share), np.zeros_like(why))
    for k in np.flatnonzero(reached).tolist():
        q[k], done = _moved_to(model, q[k], given.joints, given.values[k])
        if done < 1.0:
            reached[k], share[k], why[k] = False, done, UNREACHED
        elif undriven_motions(model, q[k]).shape[1]:
            there = settled(model, q[k])
            places = np.array([[_coordinate(model, each, joint) for joint in given.joints] for each in (q[k], there)])
            # A named joint that no drive holds stays where it was asked for.
            q[k] = there if np.abs(places[0] - places[1]).max() <= _ALIKE else q[k]
    return type(found)(q, reached, share, why)


def _closed_at(model: DeviceModel, q: FloatArray, pose: FloatArray) -> FloatArray:
    """The closed configuration at a given one, with the arm in its pose."""
    state, start = model.held, q.copy()
    turn = Rotation.from_quat(pose).inv() * Rotation.from_quat(q[model.arm_q])
    start[model.arm_q] = pose
    try:
        closed = nearest_closed(state, start, model.fixed, CLOSED, CORRECTIONS)[0]
    except LoopNotClosed:
        closed = np.full(len(q), np.inf)
    # With its centre elsewhere the device closes elsewhere.
    near = _ELSEWHERE if model.is_shifted else _SAME
    if turn.magnitude() > _SAME or not np.abs(closed - start).max() <= near:
        raise InvalidInput(
            "expected a posture to be a closed configuration of the chain in its pose, as exo.configurations and "
            "exo.assembly_modes return, or values of joints by name"
        )
    return np.asarray(closed)


def _moved_to(
    model: DeviceModel, q: FloatArray, joints: tuple[str, ...], values: FloatArray
) -> tuple[FloatArray, float]:
    """The configuration with joints at their values, and the part of the way that was followed."""
    state = model.held
    named = state.velocity_indices(list(joints))
    scale = state.topology.column[named]
    delta = values - np.array([_coordinate(model, q, joint) for joint in joints])
    _require_idle(model, q, joints, named)
    length, left = float(np.abs(delta / scale).max()), 1.0
    longest = _LONGEST / max(length, _LONGEST)
    part = longest
    while left > 0.0:
        part = min(part, left)
        there = stepped(model, q, part * delta, named)
        if there is not None:
            q, left, part = there, left - part, min(2.0 * part, longest)
        elif part * length < _SHORTEST:
            break
        else:
            part *= 0.5
    return q, 1.0 - left


def stepped(model: DeviceModel, q: FloatArray, delta: FloatArray, named: NDArray[np.intp]) -> FloatArray | None:
    """The configuration one verified step on, or None.

    Parameters
    ----------
    model : DeviceModel
        The device.
    q : ndarray
        Closed configuration of the held tree, shape (nq,).
    delta : ndarray
        Change of named coordinates, shape (m,), m or rad.
    named : ndarray of int
        Where they stand in v.
    """
    whole, first = _step(model, q, delta, named), _step(model, q, 0.5 * delta, named)
    both = None if whole is None or first is None else _step(model, first, 0.5 * delta, named)
    if whole is None or both is None:
        return None
    return both if _apart(model, whole, both) <= _ALIKE else None


def _apart(model: DeviceModel, one: FloatArray, other: FloatArray) -> float:
    state = model.held
    return float(np.abs(pin.difference(state.model, one, other) / state.topology.column).max())


def _step(model: DeviceModel, q: FloatArray, delta: FloatArray, named: NDArray[np.intp]) -> FloatArray | None:
    """One step of the Runge-Kutta method of fourth order along the least motion, closed again."""
    state, rates = model.held, list[FloatArray]()
    for share in (0.0, 0.5, 0.5, 1.0):
        at = q if not rates else pin.integrate(state.model, q, share * rates[-1])
        rate = _least(model, at, delta, named)
        if rate is None:
            return None
        rates.append(rate)
    motion = (rates[0] + 2.0 * rates[1] + 2.0 * rates[2] + rates[3]) / 6.0
    there = pin.integrate(state.model, q, motion)
    held = np.union1d(model.fixed, named)
    try:
        closed = nearest_closed(state, there, held, CLOSED, CORRECTIONS)[0]
    except LoopNotClosed:
        return None
    size = float(np.abs(motion / state.topology.column).max())
    return closed if _apart(model, there, closed) <= JUMP * size + _SMALL else None


def _least(model: DeviceModel, q: FloatArray, delta: FloatArray, named: NDArray[np.intp]) -> FloatArray | None:
    """Least motion that changes named coordinates so, with the arm at rest, shape (nv,); None where there is none."""
    motions = idle_motions(model, q)
    column = model.held.topology.column
    U, s, Vt = np.linalg.svd(motions[named], full_matrices=False)
    if len(s) < len(named) or s[-1] <= STILL:
        return None
    return np.asarray(column * (motions @ (Vt.T @ ((U.T @ (delta / column[named])) / s))))


def _require_idle(model: DeviceModel, q: FloatArray, joints: tuple[str, ...], named: NDArray[np.intp]) -> None:
    motions = idle_motions(model, q)
    s = np.linalg.svd(motions[named], compute_uv=False)
    if len(s) == len(named) and s[-1] > STILL:
        return
    names, moving = model.held.model.names, np.linalg.norm(motions, axis=1) > STILL
    idle = [str(names[j]) for j in dict.fromkeys(np.array(model.held.topology.owners)[moving].tolist())]
    free = f"of {motions.shape[1]} such freedoms, in {enumerated(idle)}" if idle else "the device has no such freedom"
    raise InvalidInput(
        f"expected joints that move independently while the arm rests in a posture, got {enumerated(joints)}: {free}"
    )


def _coordinate(model: DeviceModel, q: FloatArray, joint: str) -> float:
    own = q[q_slice(model.held.model, model.held.joint_index(joint))]
    return float(own[0] if own.size == 1 else np.arctan2(own[1], own[0]))
