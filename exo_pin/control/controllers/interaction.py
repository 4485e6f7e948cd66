"""Controllers with a person in the loop: gravity compensation, impedance and admittance on the rotation group.

**Gravity compensation** carries a share of the arm's weight wherever the arm is, and the whole weight of the device.

**Impedance.** Seen by the person, the arm is held by a spring and a damper at the reference:

    M = K log(R_r Rᵀ) + D (ω_r - ω), beside the moments of weight and of the reference's motion

**Assist-as-needed.** The spring acts beyond a dead zone ε about the reference, the person carries the weight, and a
moment a learns what the person lacks and forgets it, so that a person who follows alone gets nothing:

    M = K e + D (ω_r - ω) + a,    a' = K e/T_i - a/T_f,    e = log(R_r Rᵀ) less ε

A person who lacks the moment d is held ε + d/(K (1 + T_f/T_i)) off.

All three are :class:`.ModelController` with other gains. Sources of the third: Emken, Benitez, Reinkensmeyer, J.
NeuroEng. Rehabil. 4:8 (2007), forgetting factor and error weighting; Wolbrecht and others, IEEE TNSRE 16 (2008) 286.

**Admittance.** A virtual body follows the reference and gives way to what the person does,

    J η_v = M_p + K log(R_r R_vᵀ) + D (ω_r - ω_v),

and the arm follows the virtual body with stiff gains. M_p is not measured. It is what the drives' commanded efforts do
not make of the motion that the arm is seen to make, with the acceleration by differences of ω, smoothed by a filter of
first order. Errors of the model, friction among them, count as the person.
"""

from __future__ import annotations

from collections.abc import Callable
from typing import Any

import numpy as np
from scipy.spatial.transform import Rotation

from ...core.errors.checked import checked
from ...core.validation import FloatArray, as_positive, require_type
from ...load_case import Load, Motion
from ..plant.plant import Plant
from ..trajectories.reference import ReferenceState
from .model_controller import FeedbackGains, ModelController, gains_for


@checked
def gravity_compensation(
    plant: Plant, share: float = 1.0, rate: float = 100.0, fault_aware: bool = False
) -> ModelController:
    """A controller that carries a share of the weight of the person's arm, and the device, wherever the arm is.

    Parameters
    ----------
    plant : Plant
        What the controller takes for true.
    share : float
        0 to 1.
    rate : float
        Hz.
    fault_aware : bool
        See :class:`.FeedbackGains`.

    Returns
    -------
    ModelController

    Examples
    --------
    >>> from exo_pin import control
    >>> exo = ep.load("three-linear-actuators")
    >>> plant = ep.Plant(exo)
    >>> start = plant.held(exo.pose(flexion=40), exo.reaction(exo.pose(flexion=40)).actuator_forces)
    >>> run = plant.simulate(control.gravity_compensation(plant), 0.3, start)
    >>> bool((run.rotations[-1] * run.rotations[0].inv()).magnitude() < 0.02)  # rad: the arm stays where it is left
    True
    """
    gains = FeedbackGains(stiffness=0.0, damping=0.0, integral_time=np.inf, weight_share=share, fault_aware=fault_aware)
    return ModelController(plant, None, gains, rate)


@checked
def impedance(
    plant: Plant,
    reference: Callable[[float], Any],
    stiffness: float,
    damping: float,
    rate: float = 100.0,
    fault_aware: bool = False,
) -> ModelController:
    """A controller by which the arm is held at a reference by a spring and a damper.

    Parameters
    ----------
    plant : Plant
        What the controller takes for true.
    reference : callable
        As for :class:`.ModelController`.
    stiffness, damping : float
        K and D, N m/rad and N m s/rad.
    rate : float
        Hz.
    fault_aware : bool
        See :class:`.FeedbackGains`.

    Returns
    -------
    ModelController

    Examples
    --------
    >>> from exo_pin import control
    >>> plant = ep.Plant(ep.load("four-cables"))
    >>> control.impedance(plant, control.flexion(), 30.0, 5.0).gains.stiffness  # N m/rad
    30.0
    """
    gains = FeedbackGains(
        stiffness=stiffness, damping=damping, integral_time=np.inf, fault_aware=fault_aware, compliant=True
    )
    return ModelController(plant, reference, gains, rate)


@checked
def assist_as_needed(
    plant: Plant,
    reference: Callable[[float], Any],
    stiffness: float,
    damping: float,
    dead_zone: float = 0.05,
    integral_time: float = 0.5,
    forgetting_time: float = 2.0,
    rate: float = 100.0,
) -> ModelController:
    """A controller that gives the person what is lacking, and no more; see the module.

    Parameters
    ----------
    plant : Plant
        What the controller takes for true.
    reference : callable
        As for :class:`.ModelController`.
    stiffness, damping : float
        K and D, N m/rad and N m s/rad.
    dead_zone : float
        ε, rad.
    integral_time, forgetting_time : float
        T_i and T_f, s.
    rate : float
        Hz.

    Returns
    -------
    ModelController

    Examples
    --------
    >>> from exo_pin import control
    >>> plant = ep.Plant(ep.load("four-cables"))
    >>> control.assist_as_needed(plant, control.flexion(), 30.0, 5.0).gains.weight_share  # the person's part
    0.0
    """
    gains = FeedbackGains(
        stiffness=stiffness, damping=damping, integral_time=integral_time, weight_share=0.0, dead_zone=dead_zone,
        forgetting_time=forgetting_time, compliant=True,
    )  # fmt: skip
    return ModelController(plant, reference, gains, rate)


class AdmittanceController:
    """A virtual body that gives way to the person, and an arm that follows it; see the module.

    Parameters
    ----------
    plant : Plant
        What the controller takes for true.
    reference : callable
        As for :class:`.ModelController`.
    inertia, damping, stiffness : float
        J, D and K of the virtual body, kg m², N m s/rad and N m/rad.
    gains : FeedbackGains, optional
        With which the arm follows; those for the arm if left out.
    filter_time : float
        Of the filter of M_p, s.
    rate : float
        Hz.

    Attributes
    ----------
    interaction : ndarray
        M_p of the last sample, shape (3,), N m, base frame.

    Examples
    --------
    >>> from exo_pin import control
    >>> exo = ep.load("three-linear-actuators")
    >>> plant, reference = ep.Plant(exo), control.flexion()
    >>> yielding = control.AdmittanceController(plant, reference, inertia=0.5, damping=3.0, stiffness=5.0)
    >>> start = plant.held(exo.pose(), exo.reaction(exo.pose(), limits="none").actuator_forces)
    >>> plant.simulate(yielding, 0.1, start).status
    'completed'
    """

    def __init__(
        self,
        plant: Plant,
        reference: Callable[[float], Any],
        inertia: float,
        damping: float,
        stiffness: float,
        gains: FeedbackGains | None = None,
        filter_time: float = 0.05,
        rate: float = 100.0,
    ) -> None:
        require_type("plant", plant, Plant, "a Plant")
        require_type("reference", reference, Callable, "a function of time")
        self._inertia, self._time = as_positive("inertia", inertia), as_positive("filter_time", filter_time)
        self._damping = as_positive("damping", damping, zero=True)
        self._stiffness = as_positive("stiffness", stiffness, zero=True)
        self._interval, self._given = 1.0 / as_positive("rate", rate), reference
        chosen = gains_for(plant.mechanism) if gains is None else gains
        self._inner = ModelController(plant, self._followed, chosen, rate)
        self.reset()

    def reset(self) -> None:
        """Start again, with the virtual body at the reference.

        Examples
        --------
        >>> from exo_pin import control
        >>> plant = ep.Plant(ep.load("three-linear-actuators"))
        >>> controller = control.AdmittanceController(plant, control.flexion(), 0.5, 3.0, 5.0)
        >>> controller.reset()
        >>> controller.interaction
        array([0., 0., 0.])
        """
        self._inner.reset()
        self.interaction: FloatArray = np.zeros(3)
        self._before: FloatArray | None = None
        first = self._given(0.0)
        self._virtual, self._last = ReferenceState(first.orientation, np.zeros(3), np.zeros(3)), 0.0

    def __call__(self, t: float, measurement: Any) -> FloatArray:
        """Commands at a sample; see :class:`Controller`."""
        self._see(measurement)
        wanted, now, step = self._given(t), self._virtual, self._interval
        error = (wanted.orientation * now.orientation.inv()).as_rotvec()
        pull = self._stiffness * error + self._damping * (wanted.angular_velocity - now.angular_velocity)
        turning = (self.interaction + pull) / self._inertia
        velocity = now.angular_velocity + step * turning
        # A step that keeps up with its own damper: implicit Euler in the pose, explicit in the moments.
        self._virtual = ReferenceState(Rotation.from_rotvec(step * velocity) * now.orientation, velocity, turning)
        self._last = t
        return self._inner(t, measurement)

    def _followed(self, t: float) -> ReferenceState:
        """What the arm follows: the virtual body, as it goes on from the last sample."""
        (pose, velocity, turning), ahead = self._virtual, t - self._last
        on = Rotation.from_rotvec(ahead * velocity + 0.5 * ahead**2 * turning) * pose
        return ReferenceState(on, velocity + ahead * turning, turning)

    def _see(self, measurement: Any) -> None:
        """Take what the drives did not make of the motion since the last sample for the person's."""
        velocity, planned, inner = np.asarray(measurement.angular_velocity), self._inner.planned, self._inner
        if self._before is not None and planned is not None:
            motion = Motion(velocity, (velocity - self._before) / self._interval)
            load: Load | None = inner.plant.load
            seen = inner.plans.left(measurement.orientation, motion, planned.tensions, load)
            self.interaction = self.interaction + self._interval / self._time * (seen - self.interaction)
        self._before = velocity
