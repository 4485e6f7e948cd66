"""Split "elastic": side forces and shoulder force by stiffness, at the displaced geometry.

The centre of the arm's joint moves by δ until the shoulder's spring, the guides of UPU limbs and, where they are not
rigid, harness and cuff carry load and centre offset; forces act along the displaced limbs. The equations, their
assumptions and their solution are those of :mod:`exo_pin.wrist.forces.elastic_equilibrium`. There are two assumptions
on the actuators:

- "elastic", held: the arm stays in the given pose. The actuators adapt, so that their forces balance the moments;
  tensions that balance themselves are of least norm.
- "elastic_locked": the limbs have the lengths of the aligned device in the given pose. Load and offset move and
  turn the arm, which determines all forces, also with more than three limbs.

Within limits of f, or with a cone, the held device is as in :mod:`exo_pin.reaction.splits.elastic_linear`, solved until
the geometry of the program is the one that its forces lead to. A limb at its limit holds that force; side forces still
follow their stiffness; where the other tensions cannot take the rest, the pose is infeasible. Limits of locked
actuators are checked and not chosen within: the force in a lock is a reaction.
"""

from __future__ import annotations

from typing import Literal

import numpy as np
from numpy.typing import NDArray

from ...core.errors import InvalidInput
from ...core.validation import FloatArray, as_choice
from ...design import Mechanism
from ...numerics.vectors import NEAR_MARGIN, SINGULAR_MARGIN
from ...wrist.limbs import STATUS
from ..answer import QUERY_STATUS
from ..indeterminacy.component_assumptions import Freedom
from .elastic_linear import ElasticLinear
from .split import Chosen, PoseStack

__all__ = ["Elastic"]


class Elastic(ElasticLinear):
    """By stiffness of the limbs' guides, their joints, the shoulder, harness and cuff, at the displaced geometry.

    Parameters
    ----------
    actuators : {"held", "locked"}
        Whether the actuators hold the pose or their lengths.
    """

    name = "elastic"
    assumption = "the stiffness of guides, joints and shoulder, at the displaced geometry"
    moves = True

    def __init__(self, actuators: Literal["held", "locked"] = "held") -> None:
        self.locked = as_choice("actuators", actuators, ("held", "locked")) == "locked"
        if self.locked:
            self.name = "elastic_locked"  # type: ignore[misc]
            self.assumption = (  # type: ignore[misc]
                "the stiffness of guides, joints and shoulder, at the displaced geometry and with the limbs' lengths "
                "locked"
            )
            self.options = frozenset()  # type: ignore[misc]
            self.refusals = {"cone": _REFUSED}  # type: ignore[misc]
            self.chooses_tensions = False

    def check(self, mechanism: Mechanism) -> None:
        """Raise if the shoulder's stiffness is not known, or locked limbs are more than six."""
        super().check(mechanism)
        if self.locked and mechanism.limb_count > 6:
            raise InvalidInput(
                f"expected at most six limbs with locked actuators, got {mechanism.limb_count}: an arm with six "
                'freedoms cannot have more given lengths. split="elastic" lets the actuators adapt'
            )

    def plain(self, poses: PoseStack, rows: NDArray[np.intp]) -> tuple[FloatArray, FloatArray]:
        """The forces of the equilibrium."""
        if not self.locked:
            return super().plain(poses, rows)
        assert poses.movement is not None
        assert poses.movement.forces is not None
        delta = poses.movement.displacement[rows]
        stretch = (np.swapaxes(poses.sides[rows], 1, 2) @ delta[..., None])[..., 0] + poses.misfit[rows]
        return poses.movement.forces[rows], poses.stiffness[rows] * stretch

    def judge(self, poses: PoseStack, rows: NDArray[np.intp], answer: Chosen) -> None:
        """Mark poses in which locked limbs are, or nearly are, loaded by forces that balance themselves.

        The measure is the smallest singular value of the limbs' wrenches per N of tension, moments over the largest
        |B_i|. At zero their lengths leave a tension undetermined: no stiffness of the limbs themselves is known.
        """
        if not self.locked or not rows.size:
            return
        wrenches = poses.state.closure_of_f[rows] / np.repeat([1.0, poses.radius], 3)
        margin = np.linalg.svd(wrenches, compute_uv=False)[:, -1]
        near = margin < NEAR_MARGIN
        answer.status[rows[near]] = np.maximum(answer.status[rows[near]], STATUS.index("near_singular"))
        answer.status[rows[margin < SINGULAR_MARGIN]] = STATUS.index("singular")

    def kinds(self, freedom: Freedom) -> NDArray[np.str_]:
        """Determined by stiffness; of a held device but for tensions that balance themselves."""
        held = super().kinds(freedom)
        return np.full_like(held, "stiffness") if self.locked else held

    def extras(self, poses: PoseStack, answer: Chosen) -> dict[str, FloatArray]:
        """Displacements, poses along the first axis."""
        movement, found = poses.movement, super().extras(poses, answer)
        assert movement is not None
        assert poses.load_share is not None
        assert poses.guide_load is not None
        lost = answer.status >= STATUS.index("singular")
        if self.locked:
            found["centre_displacement"] = movement.displacement.copy()
        found |= {
            "arm_orientation": movement.arm.copy(),
            "interface_displacements": np.stack([movement.harness, movement.cuff], axis=1),
            "limb_lengths": movement.lengths.copy(),
            "guide_twist": movement.twist.copy(),
            "guide_bending": movement.bending.copy(),
        }
        for name, array in found.items():
            if name != "side_stiffness":
                array[lost] = np.nan
        # A pose with an overloaded guide has an equilibrium, and a guide load; other poses without an answer have none.
        none = lost & (answer.status != QUERY_STATUS.index("guide_overloaded"))
        guide_load = np.where(none[:, None], np.nan, poses.guide_load)
        return found | {"load_share": poses.load_share, "guide_load": guide_load}


_REFUSED = (
    "a cone cannot go with locked actuators: their forces follow from the lengths and cannot be chosen. Use "
    'split="elastic", whose actuators adapt within their limits, or split="elastic_linear"'
)
