"""State of the plant, what sensors report of it, and what a controller is.

States of the equations become states of the plant and back bit for bit: an absolute pressure p above half the
atmosphere A is a multiple of its own rounding unit, and so is A, a whole number of pascals: p - A and its way back are
exact.

Where the plant comes to rest with constant pressures: the stable equilibrium that a damped motion leads to.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass, field
from typing import Any, NamedTuple, Protocol, runtime_checkable

import numpy as np
from numpy.typing import ArrayLike, NDArray
from scipy.spatial.transform import Rotation

from ...core.errors import InvalidInput, SolverFailed
from ...core.records import Record
from ...core.validation import FloatArray, as_finite, as_positive, set_fields, set_positive
from ...muscle.valve.flow import ATMOSPHERE
from .equations.drive_kernels import AIR, COLUMNS, FLOWS, MOTOR_COLUMNS
from .equations.plant_kernels import DONE, SHOULDER, Tables, advance, rates, state_parts

#: The step that an integration tries first, s.
FIRST_STEP = 1e-5
#: By how much a quaternion's length may differ from 1.
_UNIT = 1e-9


class Measurement(NamedTuple):
    """What sensors report at one instant; exact, until a sensor of one's own spoils it.

    Attributes
    ----------
    orientation : Rotation
        Of the arm, {O_B} to {O_A}.
    angular_velocity : ndarray
        Shape (3,), rad/s, base frame.
    pressures : ndarray
        Shape (n,), gauge, Pa.
    supply_pressure : float
        Of the manifold, gauge, Pa.
    lengths : ndarray
        Shape (n,), of the limbs between joint centres, m.
    contraction_ratios : ndarray
        Shape (n,), (L_0 - muscle length)/L_0 (5-4), where the muscle length is the limb's less its end fitting. A
        muscle that hangs in a bow is longer than this says. With a tackle or a motor: by how much the limb is shorter
        than at its longest, over the nominal length of its muscle times the ratio, or of its stroke.
    drive_positions, drive_speeds : ndarray or None
        Shape (n,), length that each motor drive lets out, m, and its rate, m/s, as an encoder of the motor reports
        them; zero for muscles. None where they are not measured.
    lost : bool
        Whether the pose is an old one, because its sensor has no reading now.
    faulty : ndarray of bool or None
        Shape (n,), drives whose electronics report a fault.

    Examples
    --------
    >>> plant = ep.Plant(ep.load("prototype"))
    >>> seen = []
    >>> run = plant.simulate(lambda t, measurement: seen.append(measurement) or np.zeros(3), 0.05)
    >>> len(seen), bool(np.allclose(seen[0].lengths, run.lengths[0]))  # one each 10 ms
    (5, True)
    """

    orientation: Rotation
    angular_velocity: FloatArray
    pressures: FloatArray
    supply_pressure: float
    lengths: FloatArray
    contraction_ratios: FloatArray
    drive_positions: FloatArray | None = None
    drive_speeds: FloatArray | None = None
    lost: bool = False
    faulty: NDArray[np.bool_] | None = None


class DriveStates(NamedTuple):
    """States of n drives at rest.

    Attributes
    ----------
    pressures : ndarray
        Shape (n,), gauge, Pa; zero for motors.
    positions : ndarray
        Shape (n,), length that a motor drive lets out, m; zero for muscles.
    """

    pressures: FloatArray
    positions: FloatArray


@runtime_checkable
class Controller(Protocol):
    """Anything that sends commands to drives: a function of time and measurement.

    A plain Python function drops in::

        def hold_one_bar(t, measurement):
            return 5.0 * (1e5 - measurement.pressures) / 1e5

        run = exo.track("abduction", controller=hold_one_bar)

    A controller that remembers something (an integral) has ``reset()`` too, which is called before each run.

    Examples
    --------
    >>> plant = ep.Plant(ep.load("prototype"))
    >>> def one_bar(t, measurement):
    ...     return (1e5 - measurement.pressures) / 2e4  # opens the more, the more is missing
    ...
    >>> run = plant.simulate(one_bar, 0.5)
    >>> (1e-5 * run.pressures[-1]).round(2)
    array([0.99, 1.08, 1.08])
    """

    def __call__(self, t: float, measurement: Measurement, /) -> ArrayLike:
        """Commands, shape (n,), -1 to 1, held until the next sample.

        Parameters
        ----------
        t : float
            s since the start of the run.
        measurement : Measurement
            What the sensors say.
        """
        ...


#: From time in s and exact measurement to the one that the controller gets. A sensor that remembers something may have
#: it as a property ``memory``, and ``recall(memory)``: it then goes on where it was, too.
Sensor = Callable[[float, Measurement], Measurement]


@dataclass(frozen=True, eq=False, kw_only=True)
class PlantState(Record):
    """Everything in the plant that its motion from an instant on depends on, before the controller is called there.

    :meth:`Plant.state`, :meth:`Plant.rest`, :meth:`Plant.held`, :meth:`Plant.step` and :meth:`Run.state` make it, and
    ``dataclasses.replace`` changes it. The controller's memory is no part of it.

    Attributes
    ----------
    time : float
        s. Pulses of valves, faults and calls of the controller follow this clock.
    quaternion : ndarray
        Shape (4,), (x, y, z, w) of the rotation from {O_B} to {O_A}.
    angular_velocity : ndarray
        Shape (3,), rad/s, base frame.
    pressures : ndarray
        Shape (n,), gauge, Pa; zero for limbs with a motor.
    drive_positions, drive_speeds : ndarray
        Shape (n,), length that each motor drive lets out, m, and its rate, m/s; zero for muscles.
    drive_friction : ndarray
        Shape (n,), by how much the bristles of each drive's dry friction are bent, -1 to 1 where they slip.
    shoulder_friction : ndarray
        Shape (3,), the same of the shoulder, base frame.
    supply_pressure : float
        Of the manifold, gauge, Pa; zero without muscles.
    commands : ndarray
        Shape (n,), last commands of the controller, -1 to 1. The current of a motor follows at once.
    pulses : ndarray
        Shape (n, 3), of each valve: number of the period that runs, -1 before the first, and the shares of it for which
        it fills and vents.
    integrals : ndarray
        Shape (4 n + 3,), since the motion began: work of tensions, work of sources, loss in drives (n each), J; loss in
        the shoulder, J; air from the supply and air to the atmosphere, kg; electric energy (n), J. The error of an
        integration's step is measured by them, too.
    step : float
        The step that the integration tries next, s.
    chain : ndarray
        Of a device that moves as a closed chain, one after the other: configuration of all joints with the arm on a
        ball joint, their velocities, bent bristles of joints with dry friction, work of the wearer and loss in the
        joints since the motion began, J, and 1 where the integration is implicit. Empty for a wrist in closed form.
    sensor : object
        ``memory`` of a sensor that has one, such as the count of its noise; None otherwise.

    Raises
    ------
    InvalidInput
        If something has a wrong shape or is out of its range.

    Examples
    --------
    >>> state = ep.Plant(ep.load("four-cables")).rest()
    >>> float(np.abs(state.angular_velocity).max()), state.pressures  # rad/s; cables have no air
    (0.0, array([0., 0., 0., 0.]))
    """

    time: float
    quaternion: FloatArray
    angular_velocity: FloatArray
    pressures: FloatArray
    drive_positions: FloatArray
    drive_speeds: FloatArray
    drive_friction: FloatArray
    shoulder_friction: FloatArray
    supply_pressure: float
    commands: FloatArray
    pulses: FloatArray
    integrals: FloatArray
    step: float
    chain: FloatArray = field(default_factory=lambda: np.zeros(0))
    sensor: Any = None

    def __post_init__(self) -> None:
        n = len(as_finite("pressures", self.pressures, (None,)))
        shapes = {
            "time": (), "quaternion": (4,), "angular_velocity": (3,), "pressures": (n,), "drive_positions": (n,),
            "drive_speeds": (n,), "drive_friction": (n,), "shoulder_friction": (3,), "supply_pressure": (),
            "commands": (n,), "pulses": (n, 3), "integrals": (4 * n + 3,), "step": (), "chain": (None,),
        }  # fmt: skip
        arrays = {name: as_finite(name, getattr(self, name), shape) for name, shape in shapes.items()}
        set_fields(self, **{name: float(array) if shapes[name] == () else array for name, array in arrays.items()})
        set_positive(self, "step")
        as_positive("time", self.time, zero=True)
        if abs(np.linalg.norm(self.quaternion) - 1.0) > _UNIT:
            raise InvalidInput(f"expected a quaternion of length 1, got {self.quaternion}")
        if not (np.append(self.pressures, self.supply_pressure) > -ATMOSPHERE).all():
            raise InvalidInput(f"expected gauge pressures above a vacuum, in Pa, got {self.pressures}")
        if np.abs(self.commands).max(initial=0.0) > 1.0:
            raise InvalidInput(f"expected commands from -1 to 1, got {self.commands}")

    @property
    def orientation(self) -> Rotation:
        """Single, {O_B} to {O_A}."""
        # SciPy 1.17.0 takes no array that cannot be written.
        return Rotation.from_quat(self.quaternion.copy())


#: Parts of the equations' state that :attr:`PlantState.integrals` holds, one after the other.
_INTEGRALS = (
    "tension_work", "source_work", "drive_loss", "shoulder_loss", "air_used", "air_vented", "electric_energy",
)  # fmt: skip


def state_values(y: FloatArray, motors: np.ndarray) -> dict[str, FloatArray]:
    """A state of the equations, or several, with gauge pressures and the positions of drives by themselves."""
    parts = state_parts(y)
    drives, manifold = parts.pop("drives"), parts.pop("manifold")[..., 0]
    return parts | {
        "pressures": np.where(motors, 0.0, drives - ATMOSPHERE),
        "drive_positions": np.where(motors, drives, 0.0),
        "supply_pressure": manifold - ATMOSPHERE,
    }


class Snapshot(NamedTuple):
    """A state at a time in s: quaternion (4,), state of the equations with ξ = 0, and the rest as :class:`PlantState`.

    A run keeps one a sample: cheaper by far than the validated state.
    """

    time: float
    q: FloatArray
    y: FloatArray
    commands: FloatArray
    pulses: FloatArray
    step: float
    chain: FloatArray
    sensor: Any

    def state(self, motors: np.ndarray) -> PlantState:
        """The same as a state of a plant whose limbs have motors or not."""
        values = state_values(self.y, motors)
        integrals = np.concatenate([values.pop(name) for name in _INTEGRALS])
        del values["turn"]
        own = {"time": self.time, "quaternion": self.q, "commands": self.commands, "pulses": self.pulses,
               "chain": self.chain}  # fmt: skip
        return PlantState(**own, **values, integrals=integrals, step=self.step, sensor=self.sensor)  # type: ignore[arg-type]


def first_chain(q: FloatArray, v: FloatArray, rubbing: int) -> FloatArray:
    """:attr:`PlantState.chain` of a motion that begins, with so many joints of dry friction."""
    return np.concatenate([q, v, np.zeros(rubbing + 3)])


def equations_state(state: PlantState, motors: np.ndarray) -> FloatArray:
    """The state of the equations, with ξ = 0, of a plant whose limbs have motors or not."""
    y = np.zeros(13 + 7 * len(motors))
    parts = state_parts(y)
    for name in ("angular_velocity", "drive_friction", "shoulder_friction"):
        parts[name][:] = getattr(state, name)
    parts["drives"][:] = np.where(motors, state.drive_positions, state.pressures + ATMOSPHERE)
    parts["drive_speeds"][:] = np.where(motors, state.drive_speeds, 0.0)
    parts["manifold"][:] = state.supply_pressure + ATMOSPHERE
    integrals = [parts[name] for name in _INTEGRALS]
    for part, values in zip(integrals, np.split(state.integrals, np.cumsum([len(p) for p in integrals])), strict=False):
        part[:] = values
    return y


#: Viscous moment over angular velocity while it settles, N m s/rad: an arm of 1 kg then creeps.
_DAMPING = 0.5
#: Time that it gets in all, s, in pieces, and the moment that is left, N m.
_PATIENCE, _PIECE, _LEFT = 120.0, 0.5, 1e-12
#: Rounding of a limb's length, m: stiffness makes a moment of it (levers are shorter than a metre).
_ROUNDING = 2e-16
#: Step of the difference quotients, rad, and moment from which they are used, N m.
_DIFFERENCE, _NEAR = 1e-6, 1e-3


def still_tables(tables: Tables, damping: float) -> Tables:
    """Tables of a plant with constant pressures, motors that stand still, no friction and a viscous shoulder."""
    air, shoulder = tables.air.copy(), tables.shoulder.copy()
    air[AIR.index("exponent")] = 0.0  # the pressures stay
    shoulder[SHOULDER.index("viscous")] = damping
    shoulder[SHOULDER.index("coulomb")] = 0.0
    muscles = tables.muscles.copy()
    muscles[:, COLUMNS.index("friction") : COLUMNS.index("presliding")] = 0.0
    muscles[:, COLUMNS.index("pulley_friction")] = 0.0
    motors = tables.motors.copy()
    motors[:, MOTOR_COLUMNS.index("inverse_mass")] = 0.0
    return tables._replace(air=air, shoulder=shoulder, muscles=muscles, motors=motors)


def still_flows(count: int) -> FloatArray:
    """Of drives that are intact, and get nothing."""
    flows = np.zeros((count, len(FLOWS)))
    flows[:, FLOWS.index("intact")] = 1.0
    return flows


def settled(tables: Tables, start: FloatArray, near: Rotation) -> Rotation:
    """Orientation at rest, from ``near``, with pressures and positions of the drives as in the state ``start``.

    Friction is left out, and motors stand still.

    Raises
    ------
    SolverFailed
        If it does not come to rest.
    """
    still, flows = still_tables(tables, _DAMPING), still_flows(len(tables.base))
    q, y = near.as_quat(), start.copy()
    parts = state_parts(y)
    parts["angular_velocity"][:] = parts["drive_speeds"][:] = 0.0
    at_rest = _AtRest(still, flows, y)
    atol, step, time, ended = np.full(len(y), 1e-6), 1e-4, 0.0, DONE
    state_parts(atol)["drives"][tables.motors[:, 0] <= 0.0] = 1.0
    while time < _PATIENCE:
        ended, _, step, _ = advance(still, flows, q, y, _PIECE, step, 1e-6, atol)
        if ended != DONE:
            break
        time += _PIECE
        if np.linalg.norm(at_rest.moment(q)) < _NEAR and np.linalg.norm(y[3:6]) < _NEAR:
            found = _balanced(at_rest, q)
            if found is not None:
                return Rotation.from_quat(found)
    raise SolverFailed("rest of the plant", float(np.linalg.norm(at_rest.moment(q))), "it goes on moving")


class _AtRest:
    """The plant's arm at rest with constant pressures."""

    def __init__(self, tables: Tables, flows: FloatArray, y: FloatArray) -> None:
        self.tables, self.flows, self.y = tables, flows, y

    def moment(self, q: FloatArray, turn: FloatArray | None = None) -> FloatArray:
        """Moment on the arm, base frame, N m, at an orientation turned by a rotation vector."""
        at, out = self.y.copy(), np.zeros(len(self.y))
        at[:3] = 0.0 if turn is None else turn
        at[3:6] = 0.0
        rates(self.tables, self.flows, q, at, out)
        R = (Rotation.from_rotvec(at[:3]) * Rotation.from_quat(q)).as_matrix()
        return np.asarray(R @ self.tables.inertia @ R.T @ out[3:6])


def _balanced(arm: _AtRest, q: FloatArray) -> FloatArray | None:
    """Newton's method to where the moment vanishes; None if it does not, or the equilibrium is not stable."""
    place = q.copy()
    stiffness = arm.tables.motors[:, MOTOR_COLUMNS.index("stiffness")].sum()
    for _ in range(30):
        here = arm.moment(place)
        columns = [arm.moment(place, _DIFFERENCE * axis) - arm.moment(place, -_DIFFERENCE * axis) for axis in np.eye(3)]
        slope = np.array(columns).T / (2.0 * _DIFFERENCE)
        if np.linalg.norm(here) < _LEFT + _ROUNDING * stiffness:
            stable = np.linalg.eigvalsh(0.5 * (slope + slope.T)).max() < 0.0
            return place if stable else None
        shift = np.linalg.lstsq(slope, -here, rcond=1e-12)[0]
        shift *= min(1.0, 0.05 / max(float(np.linalg.norm(shift)), 1e-300))
        place = (Rotation.from_rotvec(shift) * Rotation.from_quat(place)).as_quat()
    return None
