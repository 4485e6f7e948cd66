"""What equilibrium does not determine in one pose: tensions that balance themselves, and side forces."""

from __future__ import annotations

from collections.abc import Callable
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from ...core.validation import FloatArray
from .certificate import is_determined

__all__ = ["Freedom"]

#: Effect on a force, relative to the largest, below which there is none.
_NO_EFFECT = 1e-9


class Freedom(NamedTuple):
    """Forces that balance themselves in one pose, and their effects.

    Attributes
    ----------
    own : int
        Number of tensions among them; side forces follow.
    of_f, of_g, of_shoulder : ndarray
        Effects on f, g and F_s, shapes (n, m), (n, m) and (3, m).
    elastic : callable
        Takes effects of tensions on F_s, shape (3, k), and returns the changes of f, g and F_s that follow from the
        displacement of limbs and shoulder, shape (2 n + 3, k), beside the change of f itself.
    fixed : callable
        Takes directions within the freedom, shape (m, k), and returns which of f, g and F_s are the same for all of
        them within the bounds, shape (2 n + 3,).
    """

    own: int
    of_f: FloatArray
    of_g: FloatArray
    of_shoulder: FloatArray
    elastic: Callable[[FloatArray], FloatArray]
    fixed: Callable[[FloatArray], NDArray[np.bool_]]

    @property
    def all(self) -> FloatArray:
        """Effects on f, g and F_s one below the other, shape (2 n + 3, m)."""
        return np.concatenate([self.of_f, self.of_g, self.of_shoulder])

    @property
    def of_tensions(self) -> FloatArray:
        """Effects of the tensions that balance themselves, shape (2 n + 3, own)."""
        return self.all[:, : self.own]

    def without_shoulder(self) -> FloatArray:
        """Directions that leave F_s as it is, shape (m, k)."""
        if self.of_shoulder.shape[1] == 0:
            return np.zeros((0, 0))
        _, values, Vt = np.linalg.svd(self.of_shoulder)
        return Vt[int((values > _NO_EFFECT * values[0]).sum()) :].T

    def is_fixed(self, effect: FloatArray) -> NDArray[np.bool_]:
        """Whether each row of an effect is zero."""
        return is_determined(effect)
