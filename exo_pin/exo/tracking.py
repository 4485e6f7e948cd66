"""The design in motion, under a controller."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from os import PathLike
from typing import TYPE_CHECKING, Any

from ..core.errors import InvalidInput
from ..core.errors.checked import checked

if TYPE_CHECKING:
    from ..control import Fault, FeedbackGains, Imu, PlantOptions, Reference, Tracking
    from .shoulder_exo import ShoulderExo


@checked
def track(
    self: ShoulderExo,
    reference: Reference | str | PathLike[str],
    controller: str | Callable[[float, Any], Any] = "pi",
    *,
    options: PlantOptions | None = None,
    duration: float | None = None,
    imu: Imu | None = None,
    faults: Fault | Sequence[Fault] = (),
    feedback: FeedbackGains | None = None,
    rate: float = 100.0,
    title: str = "",
    progress: bool = False,
) -> Tracking:
    """Simulate the design while a controller follows a reference.

    Parameters
    ----------
    reference : Reference, str or path-like
        A trajectory (:mod:`exo_pin.control`); "abduction" or "flexion", the tests of Section 5.4.1; or a CSV file
        of orientations, as :func:`exo_pin.read_movement` reads it.
    controller : {"pi", "model"} or callable
        "pi": of muscles the thesis's, contraction ratios with the gains of Table 5-5; of winches and linear
        actuators their lengths. "model": tensions of least shoulder force and their pressures or motor forces,
        with feedback. Or any function ``(t, measurement) -> commands``, see
        :class:`exo_pin.control.Controller`.
    options : PlantOptions, optional
        Air, valves, motors, friction, shoulder unit; estimates if left out.
    duration : float, optional
        s; that of the reference if left out.
    imu : Imu, optional
        The inertial sensor with its errors; exact measurements if left out.
    faults : Fault or sequence of Fault
        Of muscles, valves and motors.
    feedback : FeedbackGains, optional
        Of the controller "model".
    rate : float
        Of the controller, Hz.
    title : str
        For verdict and plots.
    progress : bool
        Whether to show a bar.

    Returns
    -------
    Tracking
        Angles, lengths, pressures, tensions, shoulder force and energy over time; prints its verdict first.

    Raises
    ------
    MissingData
        If arm, actuators, strokes or end fittings are not known.
    InvalidInput
        If an argument does not fit.

    Examples
    --------
    >>> run = ep.load("four-cables").track("flexion", "model", duration=0.5)
    >>> round(run.summary()["rms_error_deg"], 1)
    0.2
    """
    from ..control import Experiment, options_for, reference_of  # here, because few queries need them

    wanted = reference_of(reference, self.side)
    name = title or getattr(wanted, "title", "") or "tracking"
    if feedback is not None and controller != "model":
        raise InvalidInput('feedback gains are for the controller "model"')
    chosen = options_for(self.mechanism) if options is None else options
    experiment = Experiment(
        "track", name, self.mechanism, wanted, controller, chosen, duration, imu, faults, rate, feedback,  # type: ignore[arg-type]
    )  # fmt: skip
    return experiment.run(progress)
