"""A limb with a motor: a cable on a winch, or a linear actuator."""

from __future__ import annotations

from dataclasses import dataclass, replace
from typing import ClassVar

import numpy as np

from ....core.errors import MissingData
from ....core.validation import FloatArray
from ....design import Limb
from ..equations.motor_kernels import MOTOR_COLUMNS
from ..options import PlantOptions
from .drive import Drive
from .motor_parameters import MotorParameters


@dataclass(frozen=True)
class MotorDrive(Drive):
    """A winch or a linear actuator, seen along the limb.

    Attributes
    ----------
    parameters : MotorParameters
        Of motor and transmission.
    pull_limit, push_limit : float
        Greatest forces of the limb by the design, N; the motor's own limit is the larger of the two, either way.
    """

    is_motor: ClassVar[bool] = True
    parameters: MotorParameters
    pull_limit: float
    push_limit: float

    @property
    def pushes(self) -> bool:
        """Whether it can push."""
        return self.word == "actuator"

    @property
    def force_limit(self) -> float:
        """Of the motor, N."""
        return max(self.pull_limit, self.push_limit)

    @property
    def stiffness(self) -> float:
        """Of the limb between drive and arm, N/m."""
        return self.parameters.series_stiffness(self.longest)

    def row(self) -> FloatArray:
        """See :meth:`Drive.row`."""
        own = self.parameters
        # Some columns are parameters as they stand.
        values = vars(own) | {
            "present": 1.0,
            "inverse_mass": 1.0 / own.mass,
            "force_limit": self.force_limit,
            "stall_force": own.stall_ratio * self.force_limit,
            "stiffness": self.stiffness,
            "damping": own.damping_time * self.stiffness,
            "pushes": float(self.pushes),
            "shortest": self.shortest,
            "longest": self.longest,
        }
        return np.array([values[name] for name in MOTOR_COLUMNS])


def motor_drive(limb: Limb, place: str, options: PlantOptions) -> MotorDrive:
    """The motor drive of a limb.

    Raises
    ------
    MissingData
        If force limit, stroke or end fitting are not known; it names them as parts of ``place``.
    """
    actuator, stroke = limb.actuator, limb.stroke
    missing = []
    if stroke is None or stroke.end_fitting is None:
        missing.append(f"{place}.stroke.end_fitting")
    if actuator is None or actuator.pull_limit is None:
        missing.append(f"{place}.actuator.pull_limit")
    elif actuator.push_limit is None:
        missing.append(f"{place}.actuator.push_limit")
    if missing:
        raise MissingData(missing, "a plant with motors")
    assert actuator is not None
    assert stroke is not None
    assert stroke.end_fitting is not None
    assert actuator.pull_limit is not None
    assert actuator.push_limit is not None
    parameters: MotorParameters = options.winch if actuator.family == "cable" else options.linear_actuator
    if actuator.speed_limit is not None:
        parameters = replace(parameters, no_load_speed=actuator.speed_limit)
    short, long = (stroke.nominal_length * share + stroke.end_fitting for share in (stroke.shortest, stroke.longest))
    word = "cable" if actuator.family == "cable" else "actuator"
    return MotorDrive(
        word, short, long, parameters.least_tension, parameters, actuator.pull_limit, actuator.push_limit,
    )  # fmt: skip
