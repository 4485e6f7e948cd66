"""What the plant needs to know of a limb's drive, whatever it is."""

from __future__ import annotations

from abc import ABC, abstractmethod
from dataclasses import dataclass
from typing import ClassVar

from ....core.errors import MissingData
from ....core.validation import FloatArray
from ....design import Limb

__all__ = ["Drive", "contraction_span"]


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


def contraction_span(limb: Limb) -> tuple[float, float]:
    """Length l_0 of a limb at which its contraction ratio is zero, and the span that counts as 1, m: (l_0 - l)/span.

    The span is the nominal length of a muscle or of a stroke; with a tackle it is the ratio times that of the muscle,
    and l_0 the longest length of the limb.

    Parameters
    ----------
    limb : Limb
        With a stroke and its end fitting.

    Raises
    ------
    MissingData
        If they are not known.

    Notes
    -----
    Source: thesis (5-4).
    """
    stroke, tackle = limb.stroke, None if limb.actuator is None else limb.actuator.tackle
    if stroke is None or stroke.end_fitting is None:
        raise MissingData(["stroke with end_fitting"], "a contraction ratio")
    if tackle is not None:
        return stroke.nominal_length * stroke.longest + stroke.end_fitting, tackle.ratio * tackle.muscle_length
    return stroke.nominal_length + stroke.end_fitting, stroke.nominal_length
