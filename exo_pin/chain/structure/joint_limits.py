"""Joint limits of the coordinates that have some."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
import pinocchio as pin
from numpy.typing import NDArray

from ...core.validation import FloatArray

__all__ = ["Limits", "limits_of"]


@dataclass(frozen=True, eq=False)
class Limits:
    """Limits of k coordinates that are angles or lengths.

    Attributes
    ----------
    joints : tuple of str
        The joint of each.
    q_index, v_index : ndarray of int
        Shape (k,), their indices in q and v.
    lower, upper : ndarray
        Shape (k,), rad or m.
    """

    joints: tuple[str, ...]
    q_index: NDArray[np.int64]
    v_index: NDArray[np.int64]
    lower: FloatArray
    upper: FloatArray

    def holds(self, q: FloatArray) -> bool:
        """Whether q is within all limits."""
        here = q[self.q_index]
        return bool(((self.lower <= here) & (here <= self.upper)).all())

    def clipped(self, q: FloatArray, weight: FloatArray) -> FloatArray:
        """q with the coordinates that may move (weight, shape (nv,), above zero) put within their limits."""
        q = q.copy()
        inside = np.clip(q[self.q_index], self.lower, self.upper)
        q[self.q_index] = np.where(weight[self.v_index] > 0.0, inside, q[self.q_index])
        return q


def limits_of(model: pin.Model) -> Limits:
    """The limits of a model's joints whose configuration is a vector."""
    joints, q_index, v_index = [], [], []
    lower, upper = np.asarray(model.lowerPositionLimit), np.asarray(model.upperPositionLimit)
    for joint in range(1, model.njoints):
        # Quaternions and cosine-sine pairs have more coordinates than velocities.
        if model.nqs[joint] != model.nvs[joint]:
            continue
        for k in range(model.nqs[joint]):
            index = model.idx_qs[joint] + k
            if np.isfinite(lower[index]) or np.isfinite(upper[index]):
                joints.append(model.names[joint])
                q_index.append(index)
                v_index.append(model.idx_vs[joint] + k)
    at = np.array(q_index, dtype=np.int64)
    return Limits(tuple(joints), at, np.array(v_index, dtype=np.int64), lower[at], upper[at])
