"""Split "standalone": the wrist without a shoulder, F_s = 0, (D-25)."""

from __future__ import annotations

from typing import ClassVar

import numpy as np
from numpy.typing import NDArray

from ...core.errors import InvalidInput
from ...core.validation import FloatArray
from ...design import Mechanism
from ...numerics.vectors import NEAR_MARGIN, SINGULAR_MARGIN
from ...wrist.limbs import STATUS
from .limb_and_side_forces import Pose
from .pose_stack import PoseStack
from .split import Chosen, Split


class Standalone(Split):
    """A shoulder that carries nothing: tensions and side forces hold all six components of the arm.

    There is no shoulder centre: the device turns about its own centre, which the seat of the cuff determines.
    """

    name = "standalone"
    assumption = "a shoulder that carries nothing (F_s = 0)"
    criterion = "least sum of squares of tensions and side forces"
    refusals: ClassVar = {"cone": 'a glenoid cone bounds F_s, which split="standalone" sets to zero'}
    chooses_sides = True

    def caption(self, mechanism: Mechanism) -> str:
        """The assumption in a few words."""
        return "wrist without a shoulder joint"

    def check(self, mechanism: Mechanism) -> None:
        """Raise unless tensions (one a limb) and side forces (one a UPU limb) can hold six components."""
        sides = int(mechanism.is_upu.sum())
        if mechanism.limb_count + sides < 6:
            raise InvalidInput(
                f"without a shoulder the limbs must hold six components, and {mechanism.limb_count} tensions with "
                f"{sides} side forces of UPU limbs are too few: use more limbs or more UPU limbs"
            )

    def offsets(self, matrices: FloatArray, base: FloatArray, cuff: FloatArray) -> tuple[FloatArray, FloatArray]:
        """Without a ball joint the two centres of the device stay together, and only the cuff's seat counts."""
        return np.einsum("kij,kj->ki", matrices, cuff), cuff

    def program(self, poses: PoseStack, row: int) -> Pose:
        """The shortest forces with F_s = 0 within the limits of f."""
        free = np.full(poses.upu.size, np.inf)
        return poses.program(row, g_low=-free, g_high=free, upu=poses.upu, alone=True)

    def choose(self, poses: PoseStack, rows: NDArray[np.intp], answer: Chosen) -> None:
        """The shortest forces with F_s = 0."""
        free = np.full(poses.tensions.self_stress.shape[2] + poses.upu.size, np.inf)
        for row in rows.tolist():
            answer.put_least_force(self, poses, row, -free, free)

    def judge(self, poses: PoseStack, rows: NDArray[np.intp], answer: Chosen) -> None:
        """Mark poses that are singular, or nearly, for limbs without a shoulder.

        The measure is the smallest singular value of the effect of undetermined forces on the shoulder force:
        dimensionless, N of force at O per N of limb force. ``margin`` remains that of the moments.
        """
        for row in rows.tolist():
            effect = poses.effect(row)
            reach = float(np.linalg.svd(effect, compute_uv=False)[-1]) if effect.shape[1] >= 3 else 0.0
            if reach < SINGULAR_MARGIN:
                answer.status[row] = STATUS.index("singular")
            elif reach < NEAR_MARGIN:
                answer.status[row] = STATUS.index("near_singular")
