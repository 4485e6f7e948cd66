"""The plant in time in minimal coordinates, piece by piece between two instants at which something switches."""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np

from ....core.validation import FloatArray
from ..equations.integrator import DONE, TOO_SMALL, advance
from ..equations.plant_kernels import Tables
from ..snapshot import equations_state
from ..state import PlantState
from .drive_schedule import Piece

if TYPE_CHECKING:
    from ..plant import Plant

#: Units of the state in which its tolerances are equal: rad, rad/s, Pa, 1, J, kg, m, m/s.
_UNITS = {
    "turn": 1.0, "speed": 1.0, "pressure": 1e4, "bristle": 1.0, "energy": 1.0, "air": 1e-5, "position": 0.1,
    "drive speed": 0.1,
}  # fmt: skip
#: The step that an integration tries first, s.
FIRST_STEP = 1e-5


def _tolerances(tables: Tables, rtol: float) -> FloatArray:
    """Absolute tolerances of the state, shape (size,)."""
    u, n, motors = _UNITS, len(tables.base), tables.motors[:, 0]
    parts = [(3, "turn"), (3, "speed"), (n, "pressure"), (n + 3, "bristle"), (1, "pressure"), (3 * n + 1, "energy")]
    parts += [(2, "air"), (n, "drive speed"), (n, "energy")]
    atol = rtol * np.concatenate([np.full(count, u[name]) for count, name in parts])
    atol[6 : 6 + n][motors > 0.0] = rtol * u["position"]
    return atol


class MinimalMotion:
    """A plant at one instant, which can be moved on; limbs are massless.

    Attributes
    ----------
    q, y : ndarray
        Quaternion (4,), and state of the equations with ξ = 0.
    step, steps : float, int
        The step tried next, s, and the steps taken.
    """

    def __init__(self, plant: Plant, start: PlantState, rtol: float) -> None:
        self._tables, self._rtol, self._atol = plant.tables, rtol, _tolerances(plant.tables, rtol)
        self.q, self.y, self.step, self.steps = start.quaternion.copy(), equations_state(plant, start), start.step, 0

    def kinematics(self) -> tuple[FloatArray, FloatArray]:
        """Quaternion and state of the equations, with ξ = 0."""
        return self.q, self.y

    def advance(self, pieces: list[Piece]) -> str:
        """Move on through some pieces of time; return when and why that did not succeed, or nothing."""
        for piece in pieces:
            ended, taken, self.step, left = advance(
                self._tables, piece.flows, self.q, self.y, piece.end - piece.start, self.step, self._rtol, self._atol
            )
            self.steps += taken
            if ended != DONE:
                reason = "steps would have to be too small" if ended == TOO_SMALL else "the motion is not finite"
                return f"stopped at {piece.end - left:.6g} s: {reason}"
        return ""
