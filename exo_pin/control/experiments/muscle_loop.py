"""One muscle with a hung mass under its own PI controller: the test of Figure 5-10, with the gains of Table 5-5.

Every 10 ms the controller reads the contraction, and its output is the share of time for which the valve fills. The
air in muscle and tube is an ideal gas, isothermal or polytropic; the volume is that of a cylinder in its braid,
(3-2) to (3-4). The mass moves by (3-26), in steps of 0.2 ms, with dry friction as an inequality: it rests while the
friction can hold it. At no contraction the braid stops it.
"""

from __future__ import annotations

from dataclasses import dataclass
from math import inf

import numpy as np

from ...core.errors import InvalidInput
from ...core.errors.checked import checked
from ...core.records import Record
from ...core.validation import FloatArray, as_positive, frozen, require_type
from ...muscle.laws.dynamic import G
from ...muscle.laws.friction import ConstantFriction
from ...muscle.laws.static import StaticModel
from ...muscle.laws.validity import BoolArray
from ...muscle.valve.flow import ATMOSPHERE, GAS_CONSTANT, REFERENCE_TEMPERATURE, mass_flow
from ..controllers.thesis_controller import PIGains, ProportionalIntegral, command_of_duty, table_5_5_gains
from ..plant.drives import MuscleDrive
from ..plant.equations.drive_kernels import air_volume
from ..plant.options import PlantOptions

#: Step of the motion, s, and of the controller.
_STEP, _SAMPLE = 2e-4, 1e-2
#: Part of the run at its end over which the steady error is taken.
_LAST = 0.2


@dataclass(frozen=True)
class MuscleLoop(Record):
    """A step of the wanted contraction, and what came.

    Attributes
    ----------
    time, contraction, velocity, pressure, duty : ndarray
        Shape (n,), s, m, m/s, Pa (gauge) and share of time, every 10 ms.
    wanted : float
        m.
    inside : ndarray of bool
        Shape (n,), whether the force law holds there.

    Examples
    --------
    >>> from exo_pin.control import muscle_loop
    >>> run = muscle_loop(ep.muscle.muscle_model("best", 0.25), 1.3, 0.15, duration=4.0)
    >>> bool(abs(run.steady_error) < 0.05), bool(run.overshoot < 0.06)  # of the step; the thesis says within 5 %
    (True, True)
    """

    time: FloatArray
    contraction: FloatArray
    velocity: FloatArray
    pressure: FloatArray
    duty: FloatArray
    wanted: float
    inside: BoolArray

    @property
    def step(self) -> float:
        """Wanted contraction less that at the start, m."""
        return self.wanted - float(self.contraction[0])

    @property
    def steady_error(self) -> float:
        """Mean of wanted less contraction over the last fifth of the time, as a share of the step."""
        last = self.time >= (1.0 - _LAST) * self.time[-1]
        return float(np.mean(self.wanted - self.contraction[last])) / self.step

    @property
    def overshoot(self) -> float:
        """Greatest excursion beyond the wanted contraction, as a share of the step."""
        return max(0.0, float(((self.contraction - self.wanted) / self.step).max()))

    @property
    def settling_time(self) -> float:
        """Time after which the contraction stays within 5 % of the step, s; infinite where it does not settle."""
        away = np.flatnonzero(np.abs(self.contraction - self.wanted) > 0.05 * abs(self.step))
        if len(away) and away[-1] + 1 >= len(self.time):
            return inf
        return float(self.time[away[-1] + 1]) if len(away) else 0.0

    @property
    def cautions(self) -> tuple[str, ...]:
        """That the motion leaves the range of the force law, if it does."""
        share = 100.0 * float(np.mean(self.inside))
        return () if share == 100.0 else (f"The motion is inside the range of the force law for {share:.0f} % of it.",)


class _Rig:
    """Mass, muscle, tube and valve."""

    def __init__(self, model: StaticModel, mass: float, options: PlantOptions, supply: float) -> None:
        self.row = MuscleDrive("muscle", 0.0, model.length, 0.0, model, model.length, supply, options).row()
        self.model, self.mass, self.options = model, mass, options
        self.supply = (supply if options.supply is None else options.supply.pressure) + ATMOSPHERE
        self.unit = options.valves
        self.paths = [(path.conductance, path.critical_ratio) for path in self.unit.paths]
        self.x, self.v, self.pressure = 0.0, 0.0, 0.0

    def advance(self, fills: float, vents: float) -> None:
        """One step of the motion; for these shares of it the valve fills and vents."""
        absolute = self.pressure + ATMOSPHERE
        # The plain form: compiling it takes longer than a run.
        flow = fills * mass_flow.plain(self.supply, absolute, *self.paths[0]) if fills else 0.0
        flow -= vents * mass_flow.plain(absolute, ATMOSPHERE, *self.paths[1]) if vents else 0.0
        volume, widening = air_volume.plain(self.row, self.x)
        rate = flow * GAS_CONSTANT * REFERENCE_TEMPERATURE - absolute * widening * self.v
        self.pressure = max(0.0, self.pressure + _STEP * self.options.polytropic_exponent * rate / volume)
        pull = max(0.0, float(self.model.unchecked_force(self.x, self.pressure)))
        net, held = pull - self.mass * G, 0.0
        damping, friction = self.options.muscle_damping, self.options.muscle_friction
        if damping is not None:
            net -= self.pressure * max(0.0, damping.rate(self.v)) * self.v
        if friction is not None:
            held = friction.bound(self.x, self.pressure, self.mass)
        # Friction takes the speed towards zero and no further.
        free = self.v + _STEP * net / self.mass
        self.v = float(np.sign(free)) * max(0.0, abs(free) - _STEP * held / self.mass)
        self.x += _STEP * self.v
        if self.x <= 0.0:
            self.x, self.v = 0.0, 0.0


@checked
def muscle_loop(
    model: StaticModel,
    mass: float,
    wanted: float,
    *,
    gains: PIGains | None = None,
    options: PlantOptions | None = None,
    duration: float = 5.0,
) -> MuscleLoop:
    """Simulate a step of the wanted contraction of one muscle with a hung mass, from empty.

    Parameters
    ----------
    model : StaticModel
        Force law, scaled to the muscle's length.
    mass : float
        Hung, kg.
    wanted : float
        Contraction over nominal length, above 0 and below 0.4.
    gains : PIGains, optional
        Duty per percent of contraction; those of Table 5-5 for the nearest length printed there if left out.
    options : PlantOptions, optional
        Valves, supply, air, damping and friction; if left out the estimates of :class:`PlantOptions`, with the friction
        of 2.5 N that Chou and Hannaford suggest. The default supply is the greatest pressure of the law.
    duration : float
        s.

    Returns
    -------
    MuscleLoop

    Raises
    ------
    InvalidInput
        If an argument is not usable.

    Notes
    -----
    The unit of the error is taken as percent, as in :class:`ContractionController`. Neither mass, step nor response of
    the test is printed.

    Source: thesis Figure 5-10, Table 5-5.

    Examples
    --------
    >>> from exo_pin.control import muscle_loop
    >>> run = muscle_loop(ep.muscle.muscle_model("best", 0.25), 1.3, 0.10, duration=1.0)
    >>> round(1e3 * run.wanted, 6), len(run.time)  # mm; samples of 10 ms
    (25.0, 101)
    """
    require_type("model", model, StaticModel)
    load, share = as_positive("mass", mass), as_positive("wanted", wanted)
    if share >= 0.4:
        raise InvalidInput(f"expected wanted as a share of the length, below 0.4, got {share:g}")
    if model.length >= 10.0:
        raise InvalidInput(f"expected a muscle in m, got one of {model.length:g} m")
    chosen = table_5_5_gains([model.length])[0] if gains is None else gains
    require_type("gains", chosen, PIGains)
    given = PlantOptions(muscle_friction=ConstantFriction()) if options is None else options
    require_type("options", given, PlantOptions)
    rig = _Rig(model, load, given, model.validity.pressure[1])
    controller = ProportionalIntegral([chosen])
    samples, period = round(as_positive("duration", duration) / _SAMPLE) + 1, 1.0 / rig.unit.frequency
    if not 2 <= samples <= 100_000:
        raise InvalidInput(f"expected a duration of 0.01 to 1000 s, got {duration:g} s")
    rows = np.empty((samples, 4))
    fills, vents, pulse = 0.0, 1.0, -inf
    for sample in range(samples):
        error = 100.0 * (share - rig.x / model.length)
        duty = float(controller.step([error], _SAMPLE)[0])
        rows[sample] = rig.x, rig.v, rig.pressure, duty
        for step in range(round(_SAMPLE / _STEP)):
            t = sample * _SAMPLE + step * _STEP
            if t >= pulse + period - 1e-9:
                pulse = t
                fills, vents = rig.unit.shares(float(command_of_duty([duty], rig.unit.layout)[0]))
            # The step in which a valve switches is shared between before and after.
            rig.advance(_part(fills * period - (t - pulse)), _part(t + _STEP - pulse - (1.0 - vents) * period))
    x, v, p, duties = (frozen(column.copy()) for column in rows.T)
    return MuscleLoop(
        time=frozen(np.linspace(0.0, (samples - 1) * _SAMPLE, samples)),
        contraction=x,
        velocity=v,
        pressure=p,
        duty=duties,
        wanted=share * model.length,
        inside=model.validity.contains(x / model.length, p),
    )


def _part(seconds: float) -> float:
    """Share of a step that is within so many seconds from its beginning."""
    return min(max(seconds / _STEP, 0.0), 1.0)
