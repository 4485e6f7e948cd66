"""Singularity of the wrist from Pinocchio: rank and inverse of the closures' Jacobians.

An independent check of the closed forms in :mod:`exo_pin.wrist.singularities.measures`. The closures of the chain with
the ball joint have rank 15 of 18 in every pose, also where det X = 0, because the ball joint fixes O. Two other ranks
show the singularity. With the actuators locked, 18 closure rows and 3 locks are of rank 18, and 17 in a singular pose:
the arm can turn. Without the ball joint 18 rows of 21 coordinates are of rank 18, and there of rank 17: O can move.
"""

from __future__ import annotations

from dataclasses import dataclass
from itertools import product

import numpy as np
import pinocchio as pin
from scipy.spatial.transform import Rotation

from exo_pin.chain import ClosedChain
from exo_pin.core.validation import FloatArray
from exo_pin.design import Arm, Mechanism
from exo_pin.wrist_chain import mechanism_urdf
from exo_pin.wrist_chain.equilibrium import EquilibriumModel


@dataclass(frozen=True, eq=False)
class ChainSingularity:
    """Ranks of the closures and freedoms in one pose, from Pinocchio's constraint Jacobians.

    Attributes
    ----------
    rank : int
        Of the closures of the chain with the ball joint.
    rank_locked : int
        Of the same with the actuators locked.
    rank_alone : int
        Of the closures without the ball joint, actuators free.
    freedoms_locked, freedoms_alone : int
        Freedoms left by locked actuators (0 in a regular pose), and without the ball joint beyond the three that the
        actuators command (0 in a regular pose).
    smallest_singular_value : float
        Of the map from ω to the slides' rates, m.
    amplification : float
        Its inverse, N of limb force per N m.
    lost_direction : ndarray
        Shape (3,), base frame, the axis about which the limbs resist a moment least.
    centre_shift : float
        Largest shift of O if the closure of each limb is displaced by a unit to either side along X_i, actuators locked
        and no ball joint, m per m; inf where O is not fixed.
    """

    rank: int
    rank_locked: int
    rank_alone: int
    freedoms_locked: int
    freedoms_alone: int
    smallest_singular_value: float
    amplification: float
    lost_direction: FloatArray
    centre_shift: float


class LockedChains:
    """A mechanism's chains with and without the ball joint. May be used from several threads at once.

    Parameters
    ----------
    mechanism : Mechanism
        Three UPU limbs. Needs no arm: kinematics has no mass.
    """

    def __init__(self, mechanism: Mechanism) -> None:
        arm = Arm(1.0, np.array([0.0, 0.0, -0.2])) if mechanism.arm is None else mechanism.arm
        self._whole = EquilibriumModel(mechanism.replace(arm=arm))
        self._alone = ClosedChain.from_urdf(*mechanism_urdf(mechanism, part="wrist"))
        self._slides = [f"limb_{i + 1}_slide" for i in range(3)]
        # Coordinates of the limbs' joints, by name, in both chains: only the root joints differ.
        names = [name for name in self._whole.chain.model.names if name.startswith("limb_")]
        self._limb_q = [(self._alone.configuration_slice(n), self._whole.chain.configuration_slice(n)) for n in names]

    def singularity(self, pose: Rotation) -> ChainSingularity:
        """Analyse a single pose."""
        R = pose.as_matrix()
        q = self._whole.configuration(R, pose.as_quat())
        whole = self._whole.chain
        free, locked = whole.mobility(q), whole.mobility(q, locked=self._slides)
        alone_q = self._alone.neutral()
        alone_q[:7] = [0.0, 0.0, 0.0, *q[:4]]
        for there, here in self._limb_q:
            alone_q[there] = q[here]
        alone = self._alone.mobility(alone_q)
        held = self._rates_of_slides(q) @ R.T
        _, values, axes = np.linalg.svd(held)
        shift = np.inf
        if alone.degrees_of_freedom == 3:
            shift = self._centre_shift(alone_q, R)
        return ChainSingularity(
            free.rank,
            locked.rank,
            alone.rank,
            locked.degrees_of_freedom,
            alone.degrees_of_freedom - 3,
            float(values[2]),
            float(1.0 / values[2]) if values[2] > 0.0 else np.inf,
            axes[2],
            shift,
        )

    def _rates_of_slides(self, q: FloatArray) -> FloatArray:
        """Rates of the slides per ω in the arm's axes, shape (3, 3), on closed loops."""
        chain = self._whole.chain
        J = chain.constraint_jacobian(q)
        root = chain.velocity_slice("root_joint")
        limbs = np.setdiff1d(np.arange(chain.model.nv), np.arange(chain.model.nv)[root])
        follow = np.linalg.lstsq(J[:, limbs], -J[:, root], rcond=None)[0]
        slides = chain.velocity_indices(self._slides)
        return np.asarray(follow[np.searchsorted(limbs, slides)])

    def _centre_shift(self, q: FloatArray, R: FloatArray) -> float:
        """Largest shift of O if closure i is displaced by ±1 along X_i, the axis of its joint base_x, slides locked."""
        chain, model = self._alone, self._alone.model
        J = chain.constraint_jacobian(q)
        held = np.setdiff1d(np.arange(model.nv), chain.velocity_indices(self._slides))
        data = model.createData()
        pin.computeJointJacobians(model, data, q)
        placements = chain.placements(q)
        moved = np.empty((3, 3))
        for i, closure in enumerate(chain.closures):
            joint = f"limb_{i + 1}_base_x"
            world = pin.getJointJacobian(model, data, chain.model.getJointId(joint), pin.ReferenceFrame.WORLD)
            axis = world[3:, chain.velocity_slice(joint)][:, 0]
            gap = np.zeros(chain.row_count)
            first = chain.rows(closure.name).start
            # Rows of a rigid closure are in the axes of its frame a: first the translation.
            gap[first : first + 3] = placements[closure.frame_a].rotation.T @ axis
            v = np.linalg.lstsq(J[:, held], gap, rcond=None)[0]
            moved[:, i] = R @ v[:3]
        return float(max(np.linalg.norm(moved @ np.array([1.0, *signs])) for signs in product((1.0, -1.0), repeat=2)))
