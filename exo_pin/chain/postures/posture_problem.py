"""Problems of a best posture: what is minimised, which joints are held, which limits are kept."""

from __future__ import annotations

from collections.abc import Iterable
from typing import NamedTuple, Protocol

import numpy as np
from numpy.typing import ArrayLike

from ...core.validation import FloatArray, as_positive
from ..kinematics.closing import nearest_closed, reference_configuration
from ..structure.chain_state import ChainState
from ..structure.motion_axes import Limits, limits_of

_CLOSING_STEPS = 60


class _Objective(Protocol):
    """A smooth function of the configuration."""

    def value(self, q: FloatArray) -> float:
        """Its value."""

    def gradient(self, q: FloatArray) -> FloatArray:
        """Shape (nv,), its change with a step in the axes of v."""

    def scale(self, q: FloatArray) -> float:
        """A gradient, in coordinates with metres divided by the characteristic length, against which it is zero."""


class PostureProblem(NamedTuple):
    """What is minimised, and within what."""

    state: ChainState
    objective: _Objective
    held: np.ndarray  # indices in v of coordinates that do not move
    limits: Limits | None  # those that are kept
    tolerance: float  # largest residual of a closed loop, m and rad

    def closed(self, q: FloatArray, held: np.ndarray, restarts: int = 0) -> FloatArray:
        """The closed configuration near q, within the limits.

        Raises
        ------
        LoopNotClosed
            If there is none.
        BeyondLimits
            If there is one beyond the limits only.
        """
        kept = self.limits is not None
        return nearest_closed(self.state, q, held, self.tolerance, _CLOSING_STEPS, kept, restarts)[0]


def problem_of(
    state: ChainState, objective: _Objective, hold: Iterable[str], respect_limits: bool, tolerance: float
) -> PostureProblem:
    """A problem, its input checked."""
    limits = limits_of(state.model) if respect_limits else None
    return PostureProblem(
        state, objective, state.velocity_indices(hold), limits, min(as_positive("tolerance", tolerance), state.closed)
    )


def start_of(problem: PostureProblem, near: ArrayLike | None) -> FloatArray:
    """The closed configuration near a given one, or near the file's."""
    state = problem.state
    return problem.closed(
        reference_configuration(state) if near is None else state.configuration(near), problem.held, 8
    )
