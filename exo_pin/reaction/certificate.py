"""Which of the reactions equilibrium determines at all."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from ..validation import FloatArray

__all__ = ["Certificate", "is_determined"]

#: Effect of a self-stress on a quantity, relative to the largest, below which the quantity does not change with it.
_NO_EFFECT = 1e-9


@dataclass(frozen=True, eq=False)
class Certificate:
    """What equilibrium says about an answer, for a pose or a stack of shape (...).

    A reaction is unique if no self-stress of the mechanism (a set of closure and joint forces that balances
    itself) changes it; J. Wojtyra's criterion, Multibody Syst. Dyn. 14 (2005) 23. Here it is evaluated on the
    closure Jacobian of the pose itself.

    Attributes
    ----------
    undetermined : ndarray of int
        Shape (...): how many independent reactions equilibrium leaves open; -1 for a pose without an answer.
    redundant_closures : ndarray of int
        Shape (...): rows of the loop closures that repeat others, so that their forces cannot be told apart.
    actuator_forces : ndarray of bool
        Shape (..., n): whether f_i is unique.
    constraint_forces : ndarray of bool
        Shape (..., n): whether g_i is unique (always true for an SPS limb, which has none).
    shoulder_force : ndarray of bool
        Shape (..., 3): whether each base-frame component of F_s is unique.
    torso_wrench : ndarray of bool
        Shape (...,): whether the total wrench of limbs and shoulder on the torso is unique.
    chosen_by : str
        What filled in the rest.
    """

    undetermined: NDArray[np.int64]
    redundant_closures: NDArray[np.int64]
    actuator_forces: NDArray[np.bool_]
    constraint_forces: NDArray[np.bool_]
    shoulder_force: NDArray[np.bool_]
    torso_wrench: NDArray[np.bool_]
    chosen_by: str

    def __str__(self) -> str:
        open_ends = bool((self.undetermined > 0).any())
        return f"{self.statement} Assumed: {self.chosen_by}." if open_ends else self.statement

    @property
    def statement(self) -> str:
        """What equilibrium determines and what it leaves open, in words."""
        counts = np.unique(self.undetermined[self.undetermined >= 0])
        if counts.size == 0:
            return "No pose has an answer."
        if counts.max() == 0:
            return "Equilibrium determines every reaction."
        span = str(counts[0]) if counts.size == 1 else f"{counts[0]} to {counts[-1]}"
        sure: list[str] = []
        open_: list[str] = []
        for name, flags in (
            ("limb forces f", self.actuator_forces),
            ("side forces g", self.constraint_forces),
            ("shoulder force F_s", self.shoulder_force),
            ("total wrench on the torso", self.torso_wrench),
        ):
            (sure if flags[self.undetermined >= 0].all() else open_).append(name)
        return (
            f"Equilibrium leaves {span} reactions open. Determined: {', '.join(sure) or 'none'}. "
            f"Not determined: {', '.join(open_) or 'none'}."
        )


def is_determined(effect: FloatArray) -> NDArray[np.bool_]:
    """Whether each row of ``effect`` (quantities × self-stresses) is zero, to rounding."""
    if effect.shape[1] == 0:
        return np.ones(len(effect), dtype=bool)
    size = np.abs(effect).max(axis=1)
    return size <= _NO_EFFECT
