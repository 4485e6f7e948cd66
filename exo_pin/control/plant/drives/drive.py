"""What the plant needs to know of a limb's drive, whatever it is."""

from __future__ import annotations

from abc import ABC, abstractmethod
from dataclasses import dataclass
from typing import Any, ClassVar

from ....core.validation import FloatArray

#: By how much a length may be beyond a stroke, m.
_ROUND = 1e-6


@dataclass(frozen=True)
class Drive(ABC):
    """The drive of one limb.

    =============== ==================================== =======================================================
    part            pneumatic muscle                     winch or linear actuator
    =============== ==================================== =======================================================
    state           pressure, friction                   length let out, its rate, friction
    command         of its valves, -1 vents, 1 fills     force of the motor over its limit, 1 pulls in
    tension         static law, damping, friction        spring and damper in series, a cable only pulls
    energy in       compressed air                       electric energy
    energy stored   in the air (not counted)             in the moving drive, the stretched limb and the stops
    =============== ==================================== =======================================================

    Attributes
    ----------
    word : str
        What it is called in verdicts: "muscle", "cable", "actuator".
    shortest, longest : float
        Ends of the limb's stroke, joint to joint, m.
    least_tension : float
        That a controller keeps, N: a cable shall stay taut. Zero for a drive that need not be.
    """

    is_motor: ClassVar[bool] = False
    word: str
    shortest: float
    longest: float
    least_tension: float

    @abstractmethod
    def row(self) -> FloatArray:
        """Parameters as the equations read them: a row of the table of muscles or of that of motor drives."""

    def spans(self, length: Any) -> Any:
        """Whether a length of the limb in m, or each of several, is within its stroke."""
        return (length >= self.shortest - _ROUND) & (length <= self.longest + _ROUND)
