"""Poses, arm, motion and load of a stack, block by block."""

from __future__ import annotations

import math

import numpy as np
from scipy.spatial.transform import Rotation

from ...core.errors import InvalidInput
from ...core.validation import FloatArray, require_type
from ...design import Mechanism
from ...load_case import Load, Motion
from ...load_case.pose_stacks import Rows
from .map_blocks import Terms

#: Vectors of motion and load, in the order of the last fields of :class:`Terms`.
_VECTORS = {"motion": ("angular_velocity", "angular_acceleration"), "load": ("force", "moment", "at")}


class PoseBlocks:
    """Quaternions of a stack of poses, block by block: a Rotation returns a copy of all of them."""

    def __init__(self, poses: Rotation) -> None:
        self.shape: tuple[int, ...] = poses.shape
        self.count = math.prod(self.shape)
        self._stack = poses
        # Stacks of one dimension can be cut before they are copied. SciPy stores the others as one array anyway.
        self._whole = None if len(self.shape) == 1 else np.reshape(poses.as_quat(), (-1, 4))

    def block(self, start: int, stop: int) -> FloatArray:
        """Rows of the flat stack, shape (stop - start, 4)."""
        rows = self._stack[start:stop].as_quat() if self._whole is None else self._whole[start:stop]
        rows = np.require(rows, dtype=np.float64, requirements=["C", "W"])
        # A sum is not finite if any of its terms is not, and entries of unit quaternions are too small to overflow.
        if not math.isfinite(rows.sum()):
            raise InvalidInput("expected poses to be finite")
        return rows


class TermBlocks:
    """Arm, motion and load, block by block."""

    def __init__(self, mechanism: Mechanism, motion: Motion | None, load: Load | None, shape: tuple[int, ...]) -> None:
        self._rows: list[Rows] = []
        for name, value, kind in (("motion", motion, Motion), ("load", load, Load)):
            if value is not None:
                require_type(name, value, kind)
            for field in _VECTORS[name]:
                vectors = np.zeros(3) if value is None else np.asarray(getattr(value, field))
                self._rows.append(Rows(f"{name}.{field}", vectors, shape))
        arm = mechanism.require_arm("weight" if motion is None else "motion", inertia=motion is not None)
        self._fixed = (
            arm.mass,
            np.array(arm.centre_of_mass).reshape(1, 3),
            # At rest inertia has no effect, so it may be unknown.
            np.zeros((3, 3)) if motion is None else np.array(arm.inertia_about_origin),
            np.array(mechanism.gravity).reshape(1, 3),
            motion is not None,
            load is not None,
            load is not None and load.frame == "arm",
        )

    def block(self, start: int, stop: int) -> Terms:
        """Arm, motion and load of rows of the flat stack."""
        return Terms(*self._fixed, *(rows.block(start, stop) for rows in self._rows))
