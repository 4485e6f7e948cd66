"""Joint limits of the coordinates that have some."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
import pinocchio as pin
from numpy.typing import NDArray

from ...core.validation import FloatArray


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
    lower, upper = np.asarray(model.lowerPositionLimit), np.asarray(model.upperPositionLimit)
    limited = np.isfinite(lower) | np.isfinite(upper)
    found = [
        (model.names[joint], model.idx_qs[joint] + k, model.idx_vs[joint] + k)
        for joint in range(1, model.njoints)
        # Quaternions and cosine-sine pairs have more coordinates than velocities.
        if model.nqs[joint] == model.nvs[joint]
        for k in range(model.nqs[joint])
        if limited[model.idx_qs[joint] + k]
    ]
    q_index, v_index = (np.array([place[part] for place in found], dtype=np.int64) for part in (1, 2))
    return Limits(tuple(name for name, _, _ in found), q_index, v_index, lower[q_index], upper[q_index])
