"""Equilibrium of a device and the arm in it, pose by pose, from the equations of motion of the closed chain.

In the tree whose arm flies free, M a + h - springs = B f + Jᵀ λ + F_s, with the drives f, the loops' multipliers λ and
F_s in the three rows of the arm's translation. The other rows hold for some f and λ if and only if their sum over every
motion that the loops allow is zero. Three of these motions turn the arm about the axes of the base frame; they give the
moment balance M_f f = m. Where λ is then not unique, its self-stresses do no work: some of them change F_s.

Motions that leave the arm where it is must not be driven: drives and weights that would move the device within itself
are answered as if a brake held that motion, and the answer's cautions say so.
"""

from __future__ import annotations

from typing import Any, NamedTuple

import numpy as np
from numpy.typing import NDArray

from ..core.errors import ExoPinError
from ..core.progress import track
from ..core.records import reduced_tuple
from ..core.validation import FloatArray
from ..load_case.pose_stacks import Query, arm_loads
from .chain_device import ChainDevice
from .device_model import device_model
from .device_state import DeviceState
from .least_loads import NONE
from .pose_forces import PoseForces, attachment_count
from .postures import Postures, closed_at_rest, postures

__all__ = ["device_equilibrium"]

#: Share of a moment that no drive makes, above which a pose is singular.
_MISSING = 1e-7
#: Smallest singular value of M_f, over the largest, of a pose that is near a singular one.
_NEAR = 1e-3
#: Status codes of the closed form (:data:`exo_pin.wrist.limbs.STATUS`) and the one of a pose out of reach.
_OK, _NEAR_SINGULAR, _SINGULAR, _NOT_SOLVED = 0, 1, 2, 4


class PartsMoved(NamedTuple):
    """How the parts of a device give way in N poses.

    Attributes
    ----------
    interfaces : ndarray
        Displacement and rotation vector of harness and cuff, shape (N, 2, 6), m and rad; zero of a rigid one.
    centre : ndarray
        Displacement of the shoulder's centre, shape (N, 3), m, base frame.
    links : ndarray
        Displacement and rotation vector of each link that gives way, shape (N, L, 6), m and rad, axes of the link.
    share : ndarray
        Share of load and offset up to which an equilibrium was followed, shape (N,).
    """

    interfaces: FloatArray
    centre: FloatArray
    links: FloatArray
    share: FloatArray

    def __reduce__(self) -> tuple[Any, ...]:
        return reduced_tuple(self)

    @classmethod
    def none(cls, count: int, links: int) -> PartsMoved:
        """Of N poses, to be filled."""
        shapes = (count, 2, 6), (count, 3), (count, links, 6), (count,)
        return cls(*(np.full(shape, np.nan) for shape in shapes))


class DeviceEquilibrium(NamedTuple):
    """N poses of a device.

    Attributes
    ----------
    state : DeviceState
        Forces.
    q : ndarray
        Configurations of the chain, shape (N, nq).
    coordinates : ndarray
        Of the drives, shape (N, p), m or rad; zero for the wearer's moments, NaN where the pose is not reached.
    status : ndarray of int8
        Shape (N,), as :data:`exo_pin.wrist.limbs.STATUS`.
    reached : ndarray of bool
        Shape (N,).
    share : ndarray
        Part of the turn from rest that the device follows, shape (N,).
    margin : ndarray
        Smallest over largest singular value of M_f, shape (N,).
    weak_axis : ndarray
        Axis about which the drives hold least, shape (N, 3), base frame; NaN where loops keep the arm from turning.
    braked : ndarray
        Generalised force of an imagined brake in motions that leave the arm where it is, shape (N,), N or N m.
    rates : ndarray
        Rates of the drives' coordinates, shape (N, p); zero at rest.
    freedom : ndarray
        Turn of the arm about its worst axis over the motion of all joints that it needs, shape (N,), from 0 to 1.
    self_stresses : ndarray of int
        Reactions that equilibrium does not determine, shape (N,).
    moved : PartsMoved or None
        Displacements of a device that gives way.
    """

    state: DeviceState
    q: FloatArray
    coordinates: FloatArray
    status: NDArray[np.int8]
    reached: NDArray[np.bool_]
    share: FloatArray
    margin: FloatArray
    weak_axis: FloatArray
    braked: FloatArray
    rates: FloatArray
    freedom: FloatArray
    self_stresses: NDArray[np.int64]
    moved: PartsMoved | None = None

    def __reduce__(self) -> tuple[Any, ...]:
        return reduced_tuple(self)


def device_equilibrium(
    device: ChainDevice,
    query: Query,
    base: tuple[float, float, float] = (0.0, 0.0, 0.0),
    cuff: tuple[float, float, float] = (0.0, 0.0, 0.0),
    progress: bool = False,
) -> DeviceEquilibrium:
    """Equilibrium of a device in a stack of poses.

    Parameters
    ----------
    device : ChainDevice
        The device; an arm without inertia must be at rest.
    query : Query
        Poses, motion and load.
    base, cuff : tuple of float
        Shifts of torso side and arm side of the device, m, in base and arm frame.
    progress : bool
        Whether to show a bar.
    """
    model, count, p = device_model(device, base, cuff), len(query.matrices), device.limb_count
    places = attachment_count(model)
    state = DeviceState.zeros(count, p, places)
    status = np.full(count, _NOT_SOLVED, dtype=np.int8)
    margin, braked, weak = np.full(count, np.nan), np.zeros(count), np.full((count, 3), np.nan)
    coordinates, rates = np.full((count, p), np.nan), np.zeros((count, p))
    freedom, stresses = np.full(count, np.nan), np.zeros(count, dtype=np.int64)
    try:
        found = postures(model, query.matrices, closed_at_rest(model), progress)
    except ExoPinError:
        q = np.tile(model.held.neutral(), (count, 1))
        found = Postures(q, np.zeros(count, dtype=bool), np.zeros(count))
    arm = device.arm
    on_cuff = np.zeros((count, 6)) if arm is None else arm_loads(arm, device.gravity, query)[2]
    for k in track(np.flatnonzero(found.reached).tolist(), "reaction", progress):
        try:
            pose = PoseForces.of(model, found.q[k], query, k, on_cuff[k])
        except ExoPinError:
            continue
        braked[k], freedom[k], stresses[k] = pose.fill(state, k)
        coordinates[k, len(model.drives) :] = 0.0
        coordinates[k, : len(model.drives)], rates[k, : len(model.drives)] = pose.coordinates, pose.rates
        status[k], margin[k], weak[k] = _judged(state.moment_of_f[k], state.moment[k])
        if status[k] == _SINGULAR and freedom[k] <= NONE:
            weak[k] = np.nan
    return DeviceEquilibrium(
        state, found.q, coordinates, status, found.reached, found.share, margin, weak, braked, rates, freedom, stresses
    )


def _judged(moment_of_f: FloatArray, moment: FloatArray) -> tuple[int, float, FloatArray]:
    """Status, margin and weakest axis of a pose."""
    U, values, _ = np.linalg.svd(moment_of_f)
    margin = float(values[-1] / values[0]) if values[0] > 0.0 else 0.0
    kept = values > NONE * values[0]
    missing = U[:, : len(values)][:, ~kept].T @ moment
    scale = float(np.abs(moment).max())
    # Where drives turn the arm about fewer axes than there are drives, only rounding would decide what they give.
    if np.abs(missing).max(initial=0.0) > _MISSING * scale or not kept.all():
        return _SINGULAR, margin, U[:, -1]
    return (_OK if margin > _NEAR else _NEAR_SINGULAR), margin, U[:, -1]
