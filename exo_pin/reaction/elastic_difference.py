"""Error of the elastic formula for small displacements against the equilibrium at the displaced geometry."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

import numpy as np

from ..core.validation import FloatArray, ReadOnly
from ..load_case.case import Case
from .assumptions import Assumptions
from .constraints.limb_limits import Limits
from .result import Reaction
from .solve_case import solve

__all__ = ["ElasticDifference", "elastic_difference"]


@dataclass(frozen=True, eq=False)
class ElasticDifference(ReadOnly):
    """Two answers to the same query, poses of shape (...).

    Attributes
    ----------
    linear, finite : Reaction
        By the split "elastic_linear", and by "elastic".
    """

    linear: Reaction
    finite: Reaction

    @property
    def shoulder_force(self) -> FloatArray:
        """F_s of the linear formula less that of the displaced geometry, shape (..., 3), N."""
        return np.asarray(self.linear.shoulder_force - self.finite.shoulder_force)

    @property
    def relative(self) -> FloatArray:
        """Size of this difference over |F_s| at the displaced geometry, shape (...); NaN where an answer is missing."""
        size, miss = self.finite.magnitude, np.linalg.norm(self.shoulder_force, axis=-1)
        return np.divide(miss, size, out=np.full_like(np.asarray(miss), np.nan), where=size > 0.0)

    def __str__(self) -> str:
        known = self.relative[np.isfinite(self.relative)]
        count, lost = self.relative.size, int((self.linear.has_answer & ~self.finite.has_answer).sum())
        if not known.size:
            return f"None of {count} poses has an answer by both formulas; {lost} have one by the linear formula alone."
        middle, most, worst = (100.0 * float(np.quantile(known, q)) for q in (0.5, 0.9, 1.0))
        if count == 1:
            return (
                f"|F_s| is {float(self.linear.magnitude.max()):.2f} N by the linear formula and "
                f"{float(self.finite.magnitude.max()):.2f} N at the displaced geometry; F_s differs by {worst:.1f} %."
            )
        return (
            f"F_s of the linear formula differs by {middle:.1f} % (median), {most:.1f} % (ninth decile) and "
            f"{worst:.1f} % (largest) over {known.size} poses; {lost} more have an answer by the linear formula alone."
        )


def elastic_difference(device: Any, case: Case, limits: Limits) -> ElasticDifference:
    """Answers of both splits; see :meth:`exo_pin.ShoulderExo.elastic_difference`."""
    splits = ("elastic_linear", "elastic")
    return ElasticDifference(*(solve(device, case, Assumptions(split, limits)) for split in splits))
