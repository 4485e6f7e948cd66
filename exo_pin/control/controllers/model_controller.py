"""A controller that knows arm and drives: wanted motion -> moment -> tensions -> pressures and duties, or motor forces.

With the error e = log(R_r Rᵀ), a rotation vector in the base frame, the limbs shall put on the arm the moment

    M = I η_r + ω × I ω - C × m g - M_load + K e + D (ω_r - ω) + i         i' = K e / T_i - (M - M_given) / T_t

feed-forward of the reference's motion, of the weight and of the plant's constant load, and feedback by a spring K, a
damper D and an integral, which the moment that the drives cannot give draws back (back-calculation with T_t = T_i).
Why moments and not accelerations: an arm has so little inertia about its own axis that any friction there would beat a
wanted acceleration.

The tensions for it are those nearest to the moment within what the drives can do at their lengths, and among these the
ones of least shoulder force (:mod:`exo_pin.control.controllers.planning`). Cables are kept taut. Motors get the
forces of :mod:`exo_pin.control.controllers.motor_loop`. For muscles the static law turns tensions into pressures, a
muscle that shall not pull into the pressure at which it would begin to, and :class:`ValveLoop` turns these into duties.
A 3/2-way valve that fills for the share d of the time passes d ṁ_in - (1 - d) ṁ_out, by the flows of its two paths at
the wanted pressure. The share that holds a pressure makes that zero. Ahead of a movement it is the flow that the muscle
is going to need: the change of its air m = p V/(R T) along the reference, over the next period of the pulses.

A torn limb lets its drive run away from where the arm holds the limb's end. Where that is asked for
(``FeedbackGains.lost_beyond``), such a limb gets no force any more, and the program shares its load among the others.
With ``FeedbackGains.lower_in`` the others then let the arm down to where it hangs, with no larger share of their limits
than they need as they begin: on the way they may come near poses that they cannot hold, and would press the joint.

Without a reading of the inertial sensor the arm is taken to be where the reference is: feed-forward and the last
integral alone.

Assumptions: the controller's own plant is true; muscle friction is left to the feedback; limbs
carry no side force.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass, replace
from typing import Any

import numpy as np
from scipy.spatial.transform import Rotation

from ...core.errors import InvalidInput
from ...core.errors.checked import checked
from ...core.validation import FloatArray, as_positive, require_type, set_positive
from ...design import Mechanism
from ...device import Device
from ...load_case import Load, Motion
from ...muscle.valve.flow import ATMOSPHERE, GAS_CONSTANT, REFERENCE_TEMPERATURE, ValveUnit, mass_flow
from ..plant.arm_wrench import person_arm
from ..plant.equations.drive_kernels import air_volume, tension
from ..plant.plant import Plant
from ..trajectories.paths import Turn
from ..trajectories.reference import ReferenceState
from .motor_loop import MotorLoop, measured_drives
from .planning import Tensions, planner_of


class ValveLoop:
    """The valves of a plant's muscles; see the module.

    Parameters
    ----------
    plant : Plant
        What the controller takes for true.
    gain : float
        Share of time by which a valve is opened or closed more for a pressure that is 1 bar off.
    """

    def __init__(self, plant: Plant, gain: float) -> None:
        self._plant, self._gain = plant, gain
        self._units = [(i, unit) for i, unit in enumerate(plant.units) if isinstance(unit, ValveUnit)]

    def air(self, tensions: FloatArray, lengths: FloatArray) -> FloatArray:
        """Air in one muscle of each limb that holds tensions in N at limb lengths in m, shape (n,), kg.

        Zero for motors.
        """
        tables, mass = self._plant.tables, np.zeros(len(lengths))
        pressures = self._plant.drive_states(lengths, tensions).pressures
        for i, _ in self._units:
            row, gauge = tables.muscles[i], float(pressures[i])
            bladder = tension(tables.law, row, i, float(lengths[i]), 0.0, gauge, 0.0)[2]
            mass[i] = (gauge + ATMOSPHERE) * air_volume(row, bladder)[0] / (GAS_CONSTANT * REFERENCE_TEMPERATURE)
        return mass

    def commands(
        self, tensions: FloatArray, lengths: FloatArray, measured: FloatArray, flows: FloatArray | None = None
    ) -> FloatArray:
        """Commands, shape (n,), zero for motors.

        Parameters
        ----------
        tensions, lengths : ndarray
            Wanted, N, and of the limbs, m, shape (n,).
        measured : ndarray
            Gauge pressures, shape (n,), Pa.
        flows : ndarray, optional
            That each muscle is going to need, shape (n,), kg/s.
        """
        commands, supply = np.zeros(len(lengths)), self._plant.supply
        if supply is None:
            return commands
        wanted = self._plant.drive_states(lengths, tensions).pressures
        for i, valves in self._units:
            commands[i] = self._gain * (wanted[i] - measured[i]) / 1e5
            need, p = 0.0 if flows is None else float(flows[i]), wanted[i] + ATMOSPHERE
            # Through the open fill path, and through the open vent path.
            (filling, venting), air = valves.paths, supply.absolute
            inflow = mass_flow(air, p, filling.conductance, filling.critical_ratio)
            outflow = mass_flow(p, ATMOSPHERE, venting.conductance, venting.critical_ratio)
            if valves.layout == "3/2":
                total = inflow + outflow
                commands[i] = 2.0 * (commands[i] + ((need + outflow) / total if total > 0.0 else 0.0)) - 1.0
            elif need > 0.0 < inflow:
                commands[i] += need / inflow
            elif need < 0.0 < outflow:
                commands[i] += need / outflow
        return commands


#: How far the feed-forward of the air looks ahead, s: a period of the pulses.
_AHEAD = 0.05
#: Moment of the weight, N m, up to which the standard gains hold, and damping ratio beyond it.
_STANDARD_WEIGHT, _DAMPING_RATIO = 1.5, 0.25
#: T_i beyond it, s: two and a half times I/D of a man's arm.
_INTEGRAL_TIME = 1.0


@checked
@dataclass(frozen=True)
class FeedbackGains:
    """Gains of the feedback.

    Attributes
    ----------
    stiffness : float
        K, N m/rad.
    damping : float
        D, N m s/rad.
    integral_time : float
        T_i, s; infinite for none.
    pressure : float
        Share of time by which a valve is opened or closed more for a pressure that is 1 bar off.
    bandwidth : float
        Ω of the length loop of motor drives, rad/s.
    axial_share : float
        Share of K and D about the arm's own axis, the z axis of {O_B}: an arm has little inertia there. The integral
        has none: it is as far from unstable there as about the other axes, T_i > I/D.
    air_ahead : bool
        Whether valves also pass the air that the reference is going to need.
    weight_share : float
        Share of the weight of the person's arm that the device carries besides itself, 0 to 1; the wearer carries the
        rest.
    dead_zone : float
        Angle from the reference within which the spring does nothing, rad.
    forgetting_time : float
        In which the integral fades, s; infinite for never.
    compliant : bool
        Whether the loop on the drives' own lengths follows the arm, which then gives way as the spring says; else it
        holds the reference's lengths, and is stiffer by far. Dry friction of the drives is then not compensated.
    fault_aware : bool
        Whether drives whose electronics report a fault (:attr:`.Measurement.faulty`) count as lost, so that the others
        take their load.
    lost_beyond : float
        How far a motor drive may be from where its limb is, m, before the limb counts as torn for the rest of the run
        and the others take its load; infinite for never.
    lower_in : float
        Time in which the arm is let down to where it hangs once a limb counts as lost, s; infinite for never.

    Examples
    --------
    >>> from exo_pin.control import FeedbackGains
    >>> gains = FeedbackGains(stiffness=2.0, damping=0.2)
    >>> round(float(gains.stiffness * np.deg2rad(30.0)), 2)  # N m, against 30° of error
    1.05
    """

    stiffness: float = 1.5
    damping: float = 0.1
    integral_time: float = 2.0
    pressure: float = 1.0
    bandwidth: float = 35.0
    axial_share: float = 1.0
    air_ahead: bool = False
    lost_beyond: float = np.inf
    lower_in: float = np.inf
    fault_aware: bool = False
    weight_share: float = 1.0
    dead_zone: float = 0.0
    forgetting_time: float = np.inf
    compliant: bool = False

    def __post_init__(self) -> None:
        set_positive(
            self, "stiffness", "damping", "pressure", "bandwidth", "axial_share", "weight_share", "dead_zone", zero=True
        )
        if self.weight_share > 1.0:
            raise InvalidInput(f"expected weight_share from 0 to 1, got {self.weight_share:g}")
        for name in ("integral_time", "lost_beyond", "lower_in", "forgetting_time"):
            if getattr(self, name) != np.inf:
                set_positive(self, name)


def gains_for(mechanism: Mechanism | Device) -> FeedbackGains:
    """Gains for an arm of another size than the prototype's.

    The spring grows with the moment of the weight on the outstretched arm, and the damper with the root of spring and
    inertia, so that the arm turns as well damped. The prototype's arm, 1.2 N m, has those of :class:`FeedbackGains`.

    Raises
    ------
    MissingData
        If the arm or its inertia is not known.
    InvalidInput
        If it is no device.
    """
    require_type("mechanism", mechanism, Mechanism | Device, "a Mechanism or Device")
    arm, standard = mechanism.require_arm("a model-based controller", inertia=True), FeedbackGains()
    assert arm.inertia is not None
    c = arm.centre_of_mass
    weight = arm.mass * float(np.linalg.norm(mechanism.gravity) * np.linalg.norm(c))
    if weight <= _STANDARD_WEIGHT:
        return standard
    inertia = arm.inertia + arm.mass * (c @ c * np.eye(3) - np.outer(c, c))
    greatest = float(np.linalg.eigvalsh(inertia).max())
    stiffness = standard.stiffness * weight / _STANDARD_WEIGHT
    damping = 2.0 * _DAMPING_RATIO * float(np.sqrt(stiffness * greatest))
    share = float(np.sqrt(inertia[2, 2] / greatest))
    return replace(
        standard, stiffness=stiffness, damping=damping, integral_time=_INTEGRAL_TIME, axial_share=share, air_ahead=True
    )


class ModelController:
    """Feed-forward of tensions and pressures with feedback; see the module.

    Parameters
    ----------
    plant : Plant
        What the controller takes for true; the plant that is simulated may be another.
    reference : callable or None
        ``reference(t)`` has ``orientation``, ``angular_velocity`` and ``angular_acceleration``. None for wherever the
        arm is: the weight is carried, and nothing else is wanted.
    gains : FeedbackGains, optional
        Of the feedback; ``gains_for`` the arm if left out.
    rate : float
        Samples a second, Hz.

    Attributes
    ----------
    planned : Tensions or None
        Of the last sample.
    lost : ndarray
        Limbs that count as torn, shape (n,), boolean.

    Examples
    --------
    >>> from exo_pin import control
    >>> exo = ep.load("four-cables")
    >>> controller = control.ModelController(ep.Plant(exo), control.abduction())
    >>> start = ep.Plant(exo).held(exo.pose(), np.full(4, 20.0))
    >>> run = ep.Plant(exo).simulate(controller, 0.05, start)
    >>> bool(controller.planned.tensions.min() > 0.0)  # N: cables are kept taut
    True
    """

    def __init__(
        self,
        plant: Plant,
        reference: Callable[[float], Any] | None,
        gains: FeedbackGains | None = None,
        rate: float = 100.0,
    ) -> None:
        require_type("plant", plant, Plant, "a Plant")
        require_type("gains", gains, FeedbackGains | None, "FeedbackGains")
        require_type("reference", reference, Callable | None, "a function of time")
        self.plant, self.reference = plant, reference
        self.gains = gains_for(plant.mechanism) if gains is None else gains
        self._interval = 1.0 / as_positive("rate", rate)
        self._valves = ValveLoop(plant, self.gains.pressure)
        self._arm = person_arm(plant)
        self._motors, self.plans = MotorLoop(plant.drives, self.gains.bandwidth), planner_of(plant)
        self._attained = None if reference is None else self.plans.attained(reference)
        self.reset()

    def reset(self) -> None:
        """Integral to zero.

        Examples
        --------
        >>> from exo_pin import control
        >>> exo = ep.load("four-cables")
        >>> plant, start = ep.Plant(exo), ep.Plant(exo).held(exo.pose(), np.full(4, 20.0))
        >>> controller = control.ModelController(plant, control.abduction())
        >>> once = plant.simulate(controller, 0.05, start).commands
        >>> controller.reset()
        >>> bool((plant.simulate(controller, 0.05, start).commands == once).all())
        True
        """
        self._integral = np.zeros(3)
        self.planned: Tensions | None = None
        self.lost = np.zeros(self.plant.count, dtype=bool)
        #: When the arm begins to be let down, s, how, and the share of the limits that the drives may use.
        self._down: tuple[float, Turn, float] | None = None

    def __call__(self, t: float, measurement: Any) -> FloatArray:
        """Commands at a sample; see :class:`Controller`."""
        wanted = self._wanted(t, measurement)
        if getattr(measurement, "lost", False):
            pose, velocity, error = wanted.orientation, wanted.angular_velocity, np.zeros(3)
        else:
            pose, velocity = measurement.orientation, measurement.angular_velocity
            error = (wanted.orientation * pose.inv()).as_rotvec()
            error *= max(0.0, 1.0 - self.gains.dead_zone / max(float(np.linalg.norm(error)), 1e-12))
        g, tables, R = self.gains, self.plant.tables, pose.as_matrix()
        lengths = self.plans.lengths(pose)
        if not getattr(measurement, "lost", False):
            self._notice(lengths, measurement)
        turned = g.stiffness * error + g.damping * (wanted.angular_velocity - velocity)
        # The part along the arm's own axis is reduced; the weight that is left to the person is not borne.
        turned -= (1.0 - g.axial_share) * (R[:, 2] @ turned) * R[:, 2]
        weight = np.cross(R @ self._arm.centre, self._arm.mass * tables.gravity)
        feedback = turned + self._integral + (1.0 - g.weight_share) * weight
        # The limbs carry what a load of the opposite moment would be, beside the plant's own.
        load = Load(tables.force, -feedback, tables.point)
        self.planned = self._tensions(pose, Motion(velocity, wanted.angular_acceleration), lengths, load)
        if self._down is None and self.lost.any() and g.lower_in != np.inf:
            most = np.abs(self.plant.force_limits(lengths)).max(axis=0)
            share = np.abs(self.planned.tensions[~self.lost]) / np.maximum(most[~self.lost], 1e-9)
            self._down = t, Turn(pose, -pose.as_rotvec(), g.lower_in), float(share.max(initial=0.0))
        # About the arm's own axis, too, with all of K: there dry friction of the drives is large beside the spring.
        pull = g.stiffness * error + self.planned.missing_moment
        self._integral += self._interval * (pull / g.integral_time - self._integral / g.forgetting_time)
        flows = self._needed_flows(t)
        commands = self._valves.commands(self.planned.tensions, lengths, measurement.pressures, flows)
        if self._motors.motors:
            followed = ReferenceState(pose, velocity, wanted.angular_acceleration) if g.compliant else wanted
            rubbing = not g.compliant and (self.reference is not None or self._down is not None)
            commands[self._motors.motors] = self._motors.commands(
                self.planned.tensions, self.plans.motion(followed), measurement, rubbing
            )
            # What a lost drive measures counts no more, neither for its own force.
            commands[self._motors.motors] *= ~self.lost[self._motors.motors]
        return np.clip(commands, -1.0, 1.0)

    def _wanted(self, t: float, measurement: Any) -> Any:
        """State of the reference; where there is none, the arm's own without acceleration."""
        if self._down is not None:
            begun, turn, _ = self._down
            return turn(t - begun)
        if self._attained is not None:
            return self._attained(t)
        return ReferenceState(measurement.orientation, measurement.angular_velocity, np.zeros(3))

    def _notice(self, lengths: FloatArray, measurement: Any) -> None:
        """Count limbs as torn whose drives have run away from where the arm holds the limb."""
        if self.gains.fault_aware and getattr(measurement, "faulty", None) is not None:
            self.lost |= measurement.faulty
        if self.planned is None or self.gains.lost_beyond == np.inf or not self._motors.motors:
            return
        chosen = self._motors.motors
        positions = measured_drives(measurement)[0][chosen]
        off = positions - (lengths[chosen] - self.planned.tensions[chosen] / self._motors.stiffness)
        self.lost[chosen] |= np.abs(off) > self.gains.lost_beyond

    def _tensions(self, pose: Rotation, motion: Motion, lengths: FloatArray, load: Load | None) -> Tensions:
        share = 1.0 if self._down is None else self._down[2]
        least, greatest = (np.where(self.lost, 0.0, share * each) for each in self.plant.force_limits(lengths))
        return self.plans.tensions(pose, motion, greatest, least, load)

    def _needed_flows(self, t: float) -> FloatArray | None:
        """Flow that each muscle is going to need for the reference's own motion, kg/s; None without feed-forward."""
        if not self.gains.air_ahead or self.plant.supply is None or self._attained is None or self._down is not None:
            return None
        masses = []
        for state in (self._attained(t), self._attained(t + _AHEAD)):
            lengths = self.plans.lengths(state.orientation)
            motion = Motion(state.angular_velocity, state.angular_acceleration)
            found = self._tensions(state.orientation, motion, lengths, self.plant.load)
            masses.append(self._valves.air(found.tensions, lengths))
        return np.asarray((masses[1] - masses[0]) / _AHEAD)
