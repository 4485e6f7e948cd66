"""What a device can do in general, away from singular poses: moments, self-stresses and idle motions."""

from __future__ import annotations

from dataclasses import dataclass, field
from typing import TYPE_CHECKING

import numpy as np
from numpy.typing import NDArray
from scipy.spatial.transform import Rotation

from ..chain.dynamics.equations.equation_stacks import equations_of_stack
from ..core.validation import FloatArray, set_fields
from .balance.balanced_forces import held_motions, loop_motions
from .balance.device_loads import driven_by
from .balance.device_state import moments_of
from .device_model import DeviceModel, device_model
from .postures import postures

if TYPE_CHECKING:
    from .chain_device import ChainDevice


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
    scales : tuple of float
        What the moments of each drive and brake count over in the margin, shape (p,). Where some have efforts in N and
        others in N m, of those in N the lever: root mean square of their moments per N, over that of the others' per
        N m, at rest and in three more poses, m. Then neither the unit of length nor the size of a crank, nor a gear of
        all hinges, changes the margin, and a slide on a crank counts as the hinge that it turns. Else 1.
    """

    moments: int
    open_directions: int
    self_stresses: int
    idle: int
    held: int = 0
    scales: tuple[float, ...] = field(default=(), kw_only=True)
    #: Independent rows of equilibrium that drives and brakes can meet.
    rank: int = field(init=False)

    def __post_init__(self) -> None:
        set_fields(self, rank=self.moments + self.held)


def structure_of(device: ChainDevice) -> Structure:
    """What a device can do at a pose away from rest, where no symmetry hides anything.

    Raises
    ------
    LoopNotClosed
        If its loops do not close with the arm hanging.
    """
    model = device_model(device)
    return best_structure(model, general_configurations(model))


def general_configurations(model: DeviceModel) -> FloatArray:
    """Configurations of the held tree at rest and where no symmetry hides anything, of poses reached, shape (k, nq).

    Joints that no drive holds are not settled: what a device can do depends on no mass and no spring.
    """
    turns = np.array([[0.0, 0.0, 0.0], [0.11, -0.17, 0.07], [-0.05, -0.31, 0.13], [0.2, -0.08, -0.1]])
    outward = 1.0 if model.device.side == "left" else -1.0  # the mirror image in the mirror images of the poses
    found = postures(model, Rotation.from_rotvec(turns * [outward, 1.0, outward]).as_matrix(), settle=False)
    return found.q[found.reached]


def best_structure(model: DeviceModel, configurations: FloatArray) -> Structure:
    """The structure of the configuration with fewest self-stresses and most that drives can do."""
    own = model.free_configuration(configurations)
    equations = equations_of_stack(model.free, own)
    R = Rotation.from_quat(configurations[:, model.arm_q]).as_matrix()
    rest, column, J = model.rest, model.free.topology.column, equations.jacobian
    motions = loop_motions(model, J, R, np.zeros((len(R), len(rest), 0)))
    efforts = column[rest][:, None] * driven_by(model, own, equations).B[:, rest]
    moments = motions.turning.mT @ efforts
    rows, held = np.zeros((len(R), 0, efforts.shape[2])), np.zeros(len(R), dtype=int)
    if motions.idle is not None:
        basis, _, held = held_motions(motions, efforts, moments, model.none)
        rows = basis.mT @ efforts
    every = np.concatenate([moments, rows], axis=1)
    independent = _rank(moments_of(every)[0], model.none * np.linalg.norm(every, axis=(1, 2)))
    open_ = _rank(J[:, :, model.linear].mT @ motions.stresses, np.full(len(R), model.none)) + len(model.twists)
    scales = _scales(every, [model.device.unit_of(drive) == "N" for drive in model.device.efforts])
    found = (
        Structure(*numbers, scales=scales)
        for numbers in np.stack([independent, open_, motions.self_stresses, motions.idle_count, held], axis=1).tolist()
    )
    return max(found, key=lambda s: (-s.self_stresses, s.rank, s.moments))


def _scales(rows: FloatArray, are_in_newton: list[bool]) -> tuple[float, ...]:
    """See :attr:`Structure.scales`; of rows of equilibrium of N poses, shape (N, r, p)."""
    square, in_newton = (rows**2).sum(axis=(0, 1)), np.array(are_in_newton, dtype=bool)
    levers = [np.sqrt(square[chosen].mean()) if chosen.any() else 0.0 for chosen in (in_newton, ~in_newton)]
    lever = float(levers[0] / levers[1]) if min(levers) > 0.0 else 1.0
    return tuple(np.where(in_newton, lever, 1.0).tolist())


def _rank(matrices: FloatArray, least: FloatArray) -> NDArray[np.intp]:
    """Number of singular values above ``least``, shape (N,), of each matrix."""
    return np.asarray((np.linalg.svd(matrices, compute_uv=False) > least[:, None]).sum(axis=1))
