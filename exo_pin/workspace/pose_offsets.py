"""Where the device's centre lies in each pose of a stack: offsets as the kernels of a workspace take them.

A_i + base and B_i + cuff are the joints seen from the anatomical centre O, the first in the base frame, the second in
the arm's. All that a workspace checks is computed with these points and with moments about O, so that the moment of f_i
is that of the limb's displaced line: (R (B_i + cuff)) × (-f_i s_i).

The torso goes with the base. What base and cuff differ by is taken for the motion of O against the torso, because the
device fits at rest: the torso is displaced by base - cuff. A device that only sits in another place (base and cuff
alike) leaves the torso where it is.
"""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
from numpy.typing import ArrayLike
from scipy.spatial.transform import Rotation

from ..core.records import Record
from ..core.validation import FloatArray
from ..load_case import CentreOffset, CentrePath
from ..wrist.forces.displaced import as_offset


class PoseOffsets(Record):
    """Offsets of the device's centre from the shoulder's in N poses.

    Parameters
    ----------
    base : ndarray
        Of the centre that base ring and torso hold, shape (N, 3), or (1, 3) for all poses, m, base frame.
    cuff : ndarray
        Of the centre that platform and arm carry, of the same shape, m, arm frame.
    path : CentrePath, optional
        Which they come from, if from one: it gives the offsets of other poses, too.

    Attributes
    ----------
    base, cuff, path
        As given; arrays contiguous and writable, for which the kernels are compiled.
    """

    def __init__(self, base: FloatArray, cuff: FloatArray, path: CentrePath | None = None) -> None:
        self.base, self.cuff = np.array(base, order="C"), np.array(cuff, order="C")
        self.path = path

    @classmethod
    def none(cls) -> PoseOffsets:
        """The two centres are one."""
        return cls(np.zeros((1, 3)), np.zeros((1, 3)))

    @classmethod
    def of(cls, given: CentreOffset | CentrePath | ArrayLike | None, poses: Rotation) -> PoseOffsets:
        """Offsets of a stack of poses, shape (...), in any form that :meth:`exo_pin.ShoulderExo.reaction` takes.

        Raises
        ------
        InvalidInput
            If they are not finite, too large, of a shape that does not fit the poses, or if the path does not reach as
            far as the poses.
        """
        if given is None:
            return cls.none()
        path = given if isinstance(given, CentrePath) else None
        base, cuff = as_offset(given.offset(poses) if isinstance(given, CentrePath) else given, poses.shape)
        is_single = base.strides[0] == 0 and cuff.strides[0] == 0
        return cls(base[:1], cuff[:1]) if is_single else cls(base, cuff, path)

    @classmethod
    def joined(cls, parts: Sequence[PoseOffsets], count: int) -> PoseOffsets:
        """Offsets of several stacks of ``count`` poses each, one after the other; rest gets that of the first."""
        if all(part.is_aligned for part in parts):
            return cls.none()
        base, cuff = (
            np.concatenate([np.broadcast_to(getattr(part, side), (count, 3)) for part in parts])
            for side in ("base", "cuff")
        )
        return cls(base, cuff, parts[0].path)

    @property
    def is_aligned(self) -> bool:
        """Whether there is no offset in any pose."""
        return not (self.base.any() or self.cuff.any())

    def spread(self, count: int) -> tuple[FloatArray, FloatArray]:
        """Base and cuff offsets of N poses, shape (N, 3) each."""
        return np.broadcast_to(self.base, (count, 3)), np.broadcast_to(self.cuff, (count, 3))

    def rows(self, chosen: np.ndarray) -> PoseOffsets:
        """Offsets of some of the poses, given by their indices."""
        return self if len(self.base) == 1 else PoseOffsets(self.base[chosen], self.cuff[chosen], self.path)

    def at(self, matrices: FloatArray, nearest: int) -> PoseOffsets:
        """Offsets of poses that are not in the stack, shape (M, 3, 3).

        Offsets that were given pose by pose say nothing of them; they get those of the pose ``nearest`` of the stack.
        """
        if self.path is not None:
            return PoseOffsets.of(self.path, Rotation.from_matrix(matrices))
        return self.rows(np.array([nearest]))
