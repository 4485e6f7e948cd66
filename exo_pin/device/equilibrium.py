"""Equilibrium of a device and the arm in it, from the equations of motion of the closed chain.

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

from collections.abc import Iterable
from functools import partial
from typing import Any, NamedTuple

import numpy as np
from numpy.typing import NDArray

from ..core.progress import track
from ..core.records import reduced_tuple
from ..core.validation import FloatArray
from ..load_case.pose_stacks import Query, arm_loads
from ..numerics.vectors import NEAR_MARGIN, SINGULAR_MARGIN, margin_of_values
from .balance.balanced_forces import Freedoms, fill_forces
from .balance.device_loads import device_loads
from .balance.device_state import NONE, DeviceState, moments_of
from .chain_device import ChainDevice
from .device_model import DeviceModel, device_model, models_at
from .device_structure import Structure
from .postures import reached_postures
from .turns.given_postures import GivenPosture, posed

__all__ = ["device_equilibrium"]

#: Status codes of the closed form (:data:`exo_pin.wrist.limbs.STATUS`) and the one of a pose out of reach.
_OK, _NEAR_SINGULAR, _SINGULAR, _NOT_SOLVED, _NO_EQUILIBRIUM = 0, 1, 2, 4, 5
#: Poses that are worked on together.
_BLOCK = 256


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
    arm : ndarray
        Orientation of the arm, shape (N, 3, 3): as asked where the drives hold it, turned where they are locked.
    efforts : ndarray
        Of the equilibrium, shape (N, p), N or N m.
    undetermined : ndarray of int
        Independent efforts and forces that equilibrium alone, without any stiffness, leaves open, shape (N,).
    determined : ndarray of bool
        Which efforts and components of F_s it determines, shape (N, p + 3).
    """

    interfaces: FloatArray
    centre: FloatArray
    links: FloatArray
    share: FloatArray
    arm: FloatArray
    efforts: FloatArray
    undetermined: NDArray[np.int64]
    determined: NDArray[np.bool_]

    def __reduce__(self) -> tuple[Any, ...]:
        return reduced_tuple(self)

    @classmethod
    def none(cls, count: int, links: int, efforts: int) -> PartsMoved:
        """Of N poses, to be filled."""
        shapes = (count, 2, 6), (count, 3), (count, links, 6), (count,), (count, 3, 3), (count, efforts)
        every = np.ones((count, efforts + 3), dtype=bool)
        parts = [np.full(shape, np.nan) for shape in shapes]
        return cls._make([*parts, np.zeros(count, dtype=np.int64), every])


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
        not solved, and what its loads make means nothing.
    data_margin : ndarray
        Distance of the springs to the ends of their laws, over the range of each, shape (N,): the least; infinite where
        no law has an end, NaN out of reach.
    moved : PartsMoved or None
        Displacements of a device that gives way.
    rule : str
        How its postures were chosen, where the user chose them.
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
    rule: str = ""

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
    offset: tuple[FloatArray, FloatArray] | None = None,
    progress: bool = False,
    posture: GivenPosture | None = None,
) -> DeviceEquilibrium:
    """Equilibrium of a device in a stack of poses.

    Parameters
    ----------
    device : ChainDevice
        The device; an arm without inertia must be at rest.
    query : Query
        Poses, motion and load.
    offset : tuple of ndarray, optional
        Shifts of torso side and arm side of the device, shape (N, 3) or (1, 3) each, m, in base and arm frame.
    progress : bool
        Whether to show a bar.
    posture : GivenPosture, optional
        Values of idle joints.
    """
    model, count, p = device_model(device), len(query.matrices), device.limb_count
    structure, own, arm = device.structure, len(device.efforts), device.arm
    state = DeviceState.zeros(count, p, model.attachments.entries, structure.held)
    out = DeviceEquilibrium(
        state, np.empty((count, model.held.nq)), np.full((count, p), np.nan),
        np.full(count, _NOT_SOLVED, dtype=np.int8), np.empty(count, dtype=bool), np.empty(count),
        np.full(count, np.nan), np.full((count, 3), np.nan),
        np.zeros((count, model.free.model.njoints)), np.zeros((count, p)), np.full(count, np.nan),
        np.zeros(count, dtype=np.int64), np.empty(count, dtype=np.int8), nothing_lacking(count),
        np.full(count, np.nan), rule="" if posture is None else posture.words,
    )  # fmt: skip
    on_cuff = np.zeros((count, 6)) if arm is None else arm_loads(arm, device.gravity, query)[2]
    for own_rows, model in models_at(device, offset, count):
        matrices = query.matrices[own_rows]
        given = None if posture is None else partial(posed, given=posture.at(own_rows), matrices=matrices)
        found = reached_postures(model, matrices, progress, given)
        out.q[own_rows], out.reached[own_rows] = found.q, found.reached
        out.share[own_rows], out.why[own_rows] = found.share, found.why
        rows = own_rows[found.reached]
        blocks: Iterable[int] = range(0, len(rows), _BLOCK)
        for first in track(blocks, "reaction", True) if progress else blocks:
            _fill(out, model, structure, query, rows[first : first + _BLOCK], on_cuff, own)
    return out


def _fill(
    out: DeviceEquilibrium,
    model: DeviceModel,
    structure: Structure,
    query: Query,
    rows: NDArray[np.intp],
    on_cuff: FloatArray,
    own: int,
) -> None:
    """Write poses that the device reaches, as far as their loops are closed and data cover them."""
    loads = device_loads(model, out.q[rows], query.rows(rows))
    closed = loads.equations.closed
    if not closed.all():
        rows = rows[closed]
        if rows.size:
            _fill(out, model, structure, query, rows, on_cuff, own)
        return
    for k, parts in loads.lacking.items():
        out.lacking[rows[k]] = parts
    out.data_margin[rows] = loads.data_margin
    out.coordinates[rows] = 0.0
    out.coordinates[rows, :own], out.rates[rows, :own] = loads.driven.coordinates, loads.rates
    R, state = query.matrices[rows], DeviceState(*(part[rows] for part in out.state))
    found = fill_forces(model, loads, R, on_cuff[rows], state)
    status, margin, weak = _judged(state.moment_of_f[..., :own], found, structure)
    weak[(status == _SINGULAR) & (found.freedom <= NONE)] = np.nan
    unknown = np.array(list(loads.lacking), dtype=np.intp)
    status[unknown], found.unheld[unknown] = _NOT_SOLVED, 0.0
    # Where all drives have a direction.
    good = np.ones(len(rows), dtype=bool)
    good[list(loads.driven.lacking)] = False
    for whole, part in zip(out.state, state, strict=True):
        part[~good] = 0.0
        whole[rows] = part
    rows = rows[good]
    out.status[rows], out.margin[rows], out.weak_axis[rows] = status[good], margin[good], weak[good]
    out.freedom[rows], out.self_stresses[rows] = found.freedom[good], found.self_stresses[good]
    out.unheld[rows] = found.unheld[good]


def margins(rows: FloatArray, structure: Structure) -> tuple[FloatArray, FloatArray, FloatArray]:
    """Margins of the rows M_f of N poses, shape (N,), the axes of the least moments, and values of the idle rows."""
    moments, of_idle = moments_of(rows / np.array(structure.scales))
    U, values, _ = np.linalg.svd(moments)
    margin = margin_of_values(values[:, : structure.moments]) if structure.moments else np.ones(len(rows))
    return margin, U[:, :, 2].copy(), of_idle


def _judged(rows: FloatArray, here: Freedoms, structure: Structure) -> tuple[NDArray[np.int8], FloatArray, FloatArray]:
    """Status, margin and weakest axis of N poses.

    Parameters
    ----------
    rows : ndarray
        M_f of drives and brakes, shape (N, 3 + d, p).
    here, structure : Freedoms, Structure
        Motions of the device in these poses, and in general.
    """
    margin, axis, of_idle = margins(rows, structure)
    firm = of_idle[:, -1] > NEAR_MARGIN * of_idle[:, 0] if of_idle.shape[1] else np.ones(len(rows), dtype=bool)
    loaded = here.unheld.any(axis=1)
    # Loops lose a constraint: a motion that the device does not have elsewhere is loaded.
    lost = (here.held > structure.held) | ((here.held + here.free > structure.idle) & loaded)
    # Where drives turn the arm about fewer axes than there are drives, only rounding would decide what they give.
    few = (margin < SINGULAR_MARGIN) & (structure.moments == 3)
    near = (margin < NEAR_MARGIN) | ~firm
    kinds = [_SINGULAR, _NO_EQUILIBRIUM, _SINGULAR, _NEAR_SINGULAR]
    return np.select([lost, loaded, few, near], kinds, _OK).astype(np.int8), margin, axis
