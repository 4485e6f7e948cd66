"""Where the drives of a device stand, and its singular poses: drives that do not hold the arm, links that block it."""

from __future__ import annotations

from dataclasses import dataclass, replace
from typing import TYPE_CHECKING, Any

import numpy as np
from numpy.typing import NDArray
from scipy.spatial.transform import Rotation

from ..chain import ClosedChain
from ..core.results import Result
from ..core.validation import FloatArray, ReadOnly
from ..load_case.pose_stacks import as_query
from ..numerics.vectors import NEAR_MARGIN, SINGULAR_MARGIN
from .balance.device_state import moments_of
from .chain_device import ChainDevice
from .device_model import SINGULAR_BEFORE
from .equilibrium import DeviceEquilibrium, device_equilibrium

if TYPE_CHECKING:
    from .protocol import Device

#: Freedom of the arm below which the device does not follow it.
_BLOCKED = 1e-7


@dataclass(frozen=True, eq=False)
class DeviceSingularity(Result, ReadOnly):
    """How far poses of a device are from singular ones, for poses of shape (...).

    Attributes
    ----------
    kind : ndarray of str
        Shape (...): "regular"; "near" (margin below 1e-3); "actuation" (drives and brakes do not hold the arm about an
        axis: with locked drives it moves);
        "serial" (the arm cannot turn about an axis, because the device cannot follow); "loops" (loops of the device
        lose a constraint); "passive" (it has too few drives to hold the arm in any pose); "not_evaluated" (a drive's
        route has no direction there); "out_of_reach"; "beyond_singular" (on the way from rest its assembly mode ends at
        a singular configuration); "undetermined" (regular by these numbers, and singular within the digits of a
        robot's file, by the verdict of :meth:`exo_pin.ClosedChain.mobility`). Springs and loads do not count.
    smallest_singular_value : ndarray
        Shape (...), in its own unit, of the moments per unit of effort, over all efforts that leave the device's own
        motions at rest: in m of drives in N, else without unit (of drives in N and others in N m, as in ``margin``).
    margin : ndarray
        Shape (...), dimensionless, from 0 to 1, of as many moments as the device can make in general; as of
        :attr:`exo_pin.Reaction.margin`. Where some drives have efforts in N and others in N m, moments of the former
        count over the mean lever of their drives.
    freedom : ndarray
        Shape (...), from 0 to 1: turn of the arm about its worst axis over the motion of all joints that it needs,
        metres over the chain's characteristic length.
    lost_direction : ndarray
        Shape (..., 3), base frame: the axis about which the drives hold least.
    self_stresses : ndarray of int
        Shape (...): reactions that equilibrium does not determine.
    determinant : ndarray
        Shape (...), in its own unit: of the moments per unit of effort of three drives that hold the arm alone, in
        which joints have no other motion, in the units of their efforts; its sign differs on the two sides of the
        singular surface. NaN of other devices.
    """

    kind: NDArray[np.str_]
    smallest_singular_value: FloatArray
    margin: FloatArray
    freedom: FloatArray
    lost_direction: FloatArray
    self_stresses: NDArray[np.int64]
    determinant: FloatArray


def _found(device: ChainDevice, poses: Rotation) -> tuple[tuple[int, ...], DeviceEquilibrium]:
    query = as_query(poses)
    return query.shape, device_equilibrium(device, query)


def _filled(found: DeviceEquilibrium) -> NDArray[np.bool_]:
    """Shape (N,): poses whose moments are known."""
    return found.reached & np.isfinite(found.margin)


def placed_readings(device: ChainDevice, found: DeviceEquilibrium) -> tuple[FloatArray, FloatArray]:
    """Positions of the drives (N, n) and their rates (N, n, 3), NaN where they were not found; see below."""
    n = len(device.drives)
    known = _filled(found)[:, None]
    pulls = np.array([drive.pulls or drive.route is not None for drive in device.drives], dtype=bool)
    work = np.swapaxes(found.state.moment_of_f[:, :3, :n], 1, 2)
    rates = np.where(pulls, -1.0, 1.0)[:, None] * np.where(known[..., None], work, np.nan)
    return np.where(known, found.coordinates[:, :n], np.nan), rates


def device_jacobian(device: ChainDevice, poses: Rotation) -> FloatArray:
    """Power of the drives per effort and angular velocity, shape (..., n, 3); NaN where it was not found.

    Joints whose motions leave the arm where it is move as little as they can.
    """
    shape, found = _found(device, poses)
    n = len(device.drives)
    J = np.swapaxes(found.state.moment_of_f[:, :3, :n], 1, 2)
    return np.where(_filled(found)[:, None, None], J, np.nan).reshape(*shape, n, 3)


def position_rates(device: ChainDevice, poses: Rotation) -> FloatArray:
    """Rates of what :func:`drive_positions` returns: of a drive that pulls, of its length."""
    query = as_query(poses)
    return placed_readings(device, device_equilibrium(device, query))[1].reshape(*query.shape, len(device.drives), 3)


def device_singularity(device: ChainDevice, poses: Rotation) -> DeviceSingularity:
    """Analyse poses of a device."""
    shape, found = _found(device, poses)
    n = len(device.efforts)
    moments = moments_of(found.state.moment_of_f[:, :, :n] / np.array(device.structure.scales))[0]
    U, values, _ = np.linalg.svd(np.pad(moments, ((0, 0), (0, 0), (0, max(0, 3 - n)))))
    there, margin = _filled(found), found.margin
    kind = np.full(len(found.q), "regular", dtype="<U15")
    kind[margin < NEAR_MARGIN] = "near"
    kind[found.self_stresses > device.structure.self_stresses] = "loops"
    kind[margin < SINGULAR_MARGIN] = "actuation"
    if not device.holds_alone:
        kind[:] = "passive"
    kind[found.freedom < _BLOCKED] = "serial"
    kind[~there] = "not_evaluated"
    kind[~found.reached] = "out_of_reach"
    kind[found.why == SINGULAR_BEFORE] = "beyond_singular"
    return DeviceSingularity(
        kind.reshape(shape),
        np.where(there, values[:, 2], np.nan).reshape(shape),
        margin.reshape(shape),
        found.freedom.reshape(shape),
        np.where(there[:, None], U[:, :, 2], np.nan).reshape(*shape, 3),
        found.self_stresses.reshape(shape),
        np.where(there, moment_volume(device, found), np.nan).reshape(shape),
    )


def with_doubts(device: Device, poses: Rotation, found: Any) -> Any:
    """Singularities of poses, "undetermined" for regular where :func:`in_doubt`; numbers of a design are as given."""
    if device.accelerate("singularity") is not None or not is_rounded(device.chain):
        return found
    q = drive_positions(device.as_chain(), poses).q
    doubt = in_doubt(device.chain, q.reshape(-1, q.shape[-1])).reshape(found.kind.shape)
    doubt &= np.isin(found.kind, ("regular", "near"))
    return replace(found, kind=np.where(doubt, "undetermined", found.kind))


def is_rounded(chain: ClosedChain) -> bool:
    """Whether the geometry is known to the digits of a file."""
    return bool(chain.description.tolerance or chain.description.rounding)


def in_doubt(chain: ClosedChain, q: FloatArray) -> NDArray[np.bool_]:
    """Shape (N,): where digits may make or hide a singular pose of configurations, shape (N, nq), not of NaN ones."""
    doubt = np.zeros(len(q), dtype=bool)
    for k in np.flatnonzero(np.isfinite(q).all(axis=1)) if is_rounded(chain) else ():
        doubt[k] = chain.mobility(q[k], part="orientation").verdict != "regular"
    return doubt


def moment_volume(device: ChainDevice, found: DeviceEquilibrium) -> FloatArray:
    """See :attr:`DeviceSingularity.determinant`, shape (N,): with idle motions, which have no axes, it has no sign."""
    rows = found.state.moment_of_f[..., : len(device.efforts)]
    return np.linalg.det(rows) if rows.shape[1:] == (3, 3) else np.full(len(rows), np.nan)


@dataclass(frozen=True, eq=False)
class DrivePositions(Result, ReadOnly):
    """Drives of a device in a pose or a stack of poses of shape (...), on the assembly mode that continues from rest.

    Attributes
    ----------
    positions : ndarray
        Shape (..., n), m, or rad of a drive in a hinge; of a routed one the length of its route. NaN out of reach.
    q : ndarray
        Joints of the chain, shape (..., nq), as Pinocchio orders them; NaN out of reach.
    reached : ndarray of bool
        Shape (...): whether the device follows the arm from rest to the pose.
    """

    positions: FloatArray
    q: FloatArray
    reached: NDArray[np.bool_]


def drive_positions(device: ChainDevice, poses: Rotation) -> DrivePositions:
    """Inverse kinematics of a device."""
    query = as_query(poses)
    found = device_equilibrium(device, query)
    shape, known = query.shape, found.reached[:, None]
    own = found.coordinates[:, : len(device.drives)]
    positions, q = (np.where(known, part, np.nan).reshape(*shape, part.shape[1]) for part in (own, found.q))
    return DrivePositions(positions, q, found.reached.reshape(shape))
