"""What a device can do in general, away from singular poses: moments, self-stresses and idle motions."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
import pinocchio as pin
from scipy.spatial.transform import Rotation

from ..chain.dynamics.equations.equations_of_motion import equations_of_motion
from ..core.validation import FloatArray
from .balance.idle_motions import idle_rows, split_motions
from .balance.least_loads import NONE
from .balance.pose_forces import DriveMap
from .device_model import DeviceModel, device_model
from .device_record import DeviceRecord
from .postures import closed_at_rest, postures


@dataclass(frozen=True)
class Structure:
    """What a device can do in general.

    Attributes
    ----------
    moments : int
        Independent moments about O that drives and brakes make while they hold the idle motions, 0 to 3.
    open_directions : int
        Directions of F_s that equilibrium does not determine, 0 to 3.
    self_stresses : int
        All reactions that equilibrium does not determine, forces within the device among them.
    idle : int
        Freedoms of the chain that leave the arm where it is.
    held : int
        Independent ones of these on which drives or brakes act.
    """

    moments: int
    open_directions: int
    self_stresses: int
    idle: int
    held: int = 0

    @property
    def rank(self) -> int:
        """Independent rows of equilibrium that drives and brakes can meet."""
        return self.moments + self.held


def structure_of(device: DeviceRecord) -> Structure:
    """What a device can do at a pose away from rest, where no symmetry hides anything.

    Raises
    ------
    LoopNotClosed
        If its loops do not close with the arm hanging.
    """
    model = device_model(device)
    return best_structure(model, general_configurations(model))


def general_configurations(model: DeviceModel) -> FloatArray:
    """Configurations of the held tree at rest and where no symmetry hides anything, of poses reached, shape (k, nq)."""
    turns = Rotation.from_rotvec([[0.0, 0.0, 0.0], [0.11, -0.17, 0.07], [-0.05, -0.31, 0.13], [0.2, -0.08, -0.1]])
    found = postures(model, turns.as_matrix(), closed_at_rest(model))
    return found.q[found.reached]


def best_structure(model: DeviceModel, configurations: FloatArray) -> Structure:
    """The structure of the configuration with fewest self-stresses and most that drives can do."""
    found = (_structure_at(model, q) for q in configurations)
    return max(found, key=lambda s: (-s.self_stresses, s.rank, s.moments), default=Structure(0, 0, 0, 0))


def _structure_at(model: DeviceModel, q: FloatArray) -> Structure:
    equations = equations_of_motion(model.free, model.free_configuration(q), None, None)
    B, R = DriveMap(model, equations).B, pin.Quaternion(q[model.arm_q]).matrix()
    rest, top = model.rest, model.free.topology
    J = equations.jacobian * top.row_scale[:, None] * top.column
    U, s, Vt = np.linalg.svd(J[:, rest])
    rank = int((s > NONE * s[0]).sum()) if s.size else 0
    efforts = top.column[rest][:, None] * B[rest]
    turning, idle, _ = split_motions(Vt[rank:].T, np.searchsorted(rest, model.angular), R)
    moments = turning.T @ efforts
    held, _ = idle_rows(idle, efforts, moments)
    rows = held.T @ efforts
    # The moments of efforts that leave the idle motions at rest.
    null = np.linalg.svd(rows)[2][len(rows) :].T if rows.size else np.eye(efforts.shape[1])
    size = max(float(np.abs(part).max(initial=0.0)) for part in (moments, rows)) or 1.0
    independent = np.linalg.matrix_rank(moments @ null, NONE * size) if null.size else 0
    across = J[:, model.linear].T @ U[:, rank:]
    open_ = np.linalg.matrix_rank(across, NONE) if across.size else 0
    return Structure(int(independent), int(open_), len(J) - rank, idle.shape[1], held.shape[1])
