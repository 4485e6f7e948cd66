"""Equilibrium of a device and the arm in it, pose by pose, from the equations of motion of the closed chain.

In the tree whose arm flies free, M a + h - springs = B f + Jᵀ λ + F_s, with the efforts f of drives and brakes, the
loops' multipliers λ and F_s in the three rows of the arm's translation. The other rows hold for some f and λ if and
only if their sum over every motion that the loops allow is zero: M_f f + w = m. Three of these motions turn the arm
about the axes of the base frame, where w is the moment of a wearer whose device cannot hold the arm. The others are
idle: they leave the arm where it is. Where drives and brakes are locked,

- a motion that is left and turns the arm is balanced by the wearer, with the least moment that will do;
- one that is left and moves the device alone is held by nobody: the pose has no equilibrium, unless nothing loads the
  motion, such as the spin of a limb between two ball joints. Friction in joints is left out.

Where λ is not unique, its self-stresses do no work: some of them change F_s. A pose that the data of a part do not
cover has its kinematics and no loads: it is not evaluated.
"""

from __future__ import annotations

from typing import Any, NamedTuple

import numpy as np
from numpy.typing import NDArray

from ..core.errors import LoopNotClosed, OpeningMotion
from ..core.progress import track
from ..core.records import reduced_tuple
from ..core.validation import FloatArray
from ..load_case.pose_stacks import Query, arm_loads
from ..numerics.vectors import NEAR_MARGIN, SINGULAR_MARGIN, margin_of_values
from .balance.device_state import DeviceState
from .balance.idle_motions import Freedoms
from .balance.least_loads import NONE
from .balance.pose_forces import PoseForces, attachment_count
from .chain_device import ChainDevice
from .device_model import device_model
from .device_structure import Structure
from .postures import Postures, closed_at_rest, postures

__all__ = ["device_equilibrium"]

#: Status codes of the closed form (:data:`exo_pin.wrist.limbs.STATUS`) and the one of a pose out of reach.
_OK, _NEAR_SINGULAR, _SINGULAR, _NOT_SOLVED, _NO_EQUILIBRIUM = 0, 1, 2, 4, 5


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
        :func:`.margin_of_values` of the moments of efforts that leave the idle motions at rest, shape (N,): of as many
        as the device can make in general (1 if it makes none).
    weak_axis : ndarray
        Axis about which the drives hold least, shape (N, 3), base frame; NaN where loops keep the arm from turning.
    unheld : ndarray
        Effort that is missing at each joint of the chain, shape (N, njoints), N or N m: of the joints that would move
        where nothing holds the device; zero elsewhere.
    rates : ndarray
        Rates of the drives' coordinates, shape (N, p); zero at rest.
    freedom : ndarray
        Turn of the arm about its worst axis over the motion of all joints that it needs, shape (N,), from 0 to 1.
    self_stresses : ndarray of int
        Reactions that equilibrium does not determine, shape (N,).
    why : ndarray of int8
        Why a pose is not reached, shape (N,), as :attr:`.Postures.why`.
    lacking : ndarray of object
        Shape (N,): of each pose a tuple of :class:`.LackingData`, the parts whose data do not cover it. Such a pose is
        not solved, and what its loads make is NaN.
    data_margin : ndarray
        Distance of the springs to the ends of their laws, over the range of each, shape (N,): the least; infinite where
        no law has an end, NaN out of reach.
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
    unheld: FloatArray
    rates: FloatArray
    freedom: FloatArray
    self_stresses: NDArray[np.int64]
    why: NDArray[np.int8]
    lacking: NDArray[np.object_]
    data_margin: FloatArray
    moved: PartsMoved | None = None

    def __reduce__(self) -> tuple[Any, ...]:
        return reduced_tuple(self)

    @property
    def evaluated(self) -> NDArray[np.bool_]:
        """Shape (N,): whether the data of all parts cover the pose, as far as the device reaches it."""
        return np.array([not parts for parts in self.lacking], dtype=bool)


def nothing_lacking(count: int) -> NDArray[np.object_]:
    """Of N poses that all data cover."""
    out = np.empty(count, dtype=object)
    for k in range(count):
        out[k] = ()
    return out


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
    structure = device.structure
    state = DeviceState.zeros(count, p, places, structure.held)
    status = np.full(count, _NOT_SOLVED, dtype=np.int8)
    margin, weak = np.full(count, np.nan), np.full((count, 3), np.nan)
    unheld = np.zeros((count, model.free.model.njoints))
    coordinates, rates = np.full((count, p), np.nan), np.zeros((count, p))
    freedom, stresses = np.full(count, np.nan), np.zeros(count, dtype=np.int64)
    lacking, data_margin = nothing_lacking(count), np.full(count, np.nan)
    try:
        found = postures(model, query.matrices, closed_at_rest(model), progress)
    except LoopNotClosed:
        q = np.tile(model.held.neutral(), (count, 1))
        found = Postures(q, np.zeros(count, dtype=bool), np.zeros(count), np.ones(count, dtype=np.int8))
    arm = device.arm
    on_cuff = np.zeros((count, 6)) if arm is None else arm_loads(arm, device.gravity, query)[2]
    for k in track(np.flatnonzero(found.reached).tolist(), "reaction", progress):
        try:
            pose = PoseForces.of(model, found.q[k], query, k, on_cuff[k])
        except (LoopNotClosed, OpeningMotion):
            continue
        own = len(model.drives)
        lacking[k], data_margin[k] = pose.lacking, pose.data_margin
        coordinates[k, own:] = 0.0
        coordinates[k, :own], rates[k, :own] = pose.coordinates, pose.rates
        if not pose.is_driven:
            continue
        found_here = pose.fill(state, k)
        freedom[k], stresses[k], unheld[k] = found_here.freedom, found_here.self_stresses, found_here.unheld
        status[k], margin[k], weak[k] = _judged(state.moment_of_f[k, :, :own], found_here, structure)
        if status[k] == _SINGULAR and freedom[k] <= NONE:
            weak[k] = np.nan
        if pose.lacking:
            state.forget_loads(k)
            status[k], unheld[k] = _NOT_SOLVED, 0.0
    return DeviceEquilibrium(
        state, found.q, coordinates, status, found.reached, found.share, margin, weak, unheld, rates, freedom, stresses,
        found.why, lacking, data_margin,
    )  # fmt: skip


def moments_of(rows: FloatArray) -> FloatArray:
    """Moments of efforts that leave the idle motions at rest, shape (3, p - d), from the rows M_f of one pose."""
    if len(rows) == 3:
        return rows
    _, s, Vt = np.linalg.svd(rows[3:])
    return np.asarray(rows[:3] @ Vt[int((s > NONE * s.max(initial=0.0)).sum()) :].T)


def margin_at(rows: FloatArray, general: int) -> tuple[float, FloatArray]:
    """Margin of the rows M_f of one pose, of ``general`` moments, and the axis of the least one."""
    U, values, _ = np.linalg.svd(moments_of(rows))
    values = np.pad(values, (0, 3 - min(3, len(values))))
    return (float(margin_of_values(values[:general])) if general else 1.0), U[:, -1]


def _judged(rows: FloatArray, here: Freedoms, structure: Structure) -> tuple[int, float, FloatArray]:
    """Status, margin and weakest axis of a pose.

    Parameters
    ----------
    rows : ndarray
        M_f of drives and brakes, shape (3 + d, p).
    here, structure : Freedoms, Structure
        Motions of the device in this pose, and in general.
    """
    general = structure.moments
    margin, axis = margin_at(rows, general)
    of_idle = np.linalg.svd(rows[3:], compute_uv=False)
    firm = not of_idle.size or of_idle[-1] > NEAR_MARGIN * of_idle[0]
    loops = here.held + here.free > structure.idle
    if here.held > structure.held or (loops and here.unheld.any()):
        # Loops lose a constraint here: a motion that the device does not have elsewhere is loaded.
        return _SINGULAR, margin, axis
    if here.unheld.any():
        return _NO_EQUILIBRIUM, margin, axis
    # Where drives turn the arm about fewer axes than there are drives, only rounding would decide what they give.
    if general == 3 and margin < SINGULAR_MARGIN:
        return _SINGULAR, margin, axis
    return (_OK if margin >= NEAR_MARGIN and firm else _NEAR_SINGULAR), margin, axis
