"""The drives of the limbs, one limb at a time: pneumatic muscles with their air, motor drives; compiled.

The air of muscle i, of absolute pressure p and volume V, with polytropic exponent κ:

    V p' = κ (R T ṁ - p V')        V' = (dV/dx) (x_l l-rate + x_p p')

A bundle of muscles side by side has one pressure, as each of them has its own valve, and so many times the flow.
Motor drives are those of :mod:`.motor_kernels`. Places of the state: :func:`.plant_kernels.state_size`.
"""

from __future__ import annotations

from typing import Any

from ....core.compiled import kernel
from ....muscle.valve.flow import ATMOSPHERE, GAS_CONSTANT, REFERENCE_TEMPERATURE, mass_flow
from .friction_kernels import slip
from .motor_kernels import is_motor, motor_rates, motor_tension
from .muscle_kernels import COLUMNS, air_volume, tension

#: Columns of the table of the air, and of what acts on a drive between two instants.
AIR = ("exponent", "supply", "regulator", "regulator_ratio", "manifold")
FLOWS = (
    "fill", "fill_ratio", "vent", "vent_ratio", "leak", "leak_ratio", "intact", "effort", "powered", "brake",
)  # fmt: skip
_PRESLIDING, _RATIO, _COUNT = (COLUMNS.index(name) for name in ("presliding", "ratio", "count"))


@kernel
def limb_tension(t: Any, i: int, y: Any, speed: float, length: float) -> Any:
    """Tension of a whole limb in N, and the contraction of its muscle's bladder in m, which a motor drive has not."""
    n = t.base.shape[0]
    if is_motor(t.motors[i]):
        return motor_tension(t.motors[i], length, speed, y[6 + i], y[13 + 5 * n + i])[0], 0.0
    pull, _, bladder, _, _ = tension(t.law, t.muscles[i], i, length, speed, y[6 + i] - ATMOSPHERE, y[6 + n + i])
    return pull, bladder


@kernel
def _motor_limb(t: Any, flows: Any, i: int, y: Any, speed: float, length: float, out: Any) -> Any:
    """Rates of one motor drive; returns its tension, and no air."""
    n = t.base.shape[0]
    row = t.motors[i]
    rate = y[13 + 5 * n + i]
    flow = (flows[i, 7], flows[i, 8], flows[i, 9], flows[i, 6])
    pull, acceleration, bristle, force, loss, power = motor_rates(
        row, flow, length, speed, y[6 + i], rate, y[6 + n + i]
    )
    out[6 + i] = rate
    out[6 + n + i] = bristle
    out[10 + 2 * n + i] = -pull * speed
    out[10 + 3 * n + i] = -force * rate
    out[10 + 4 * n + i] = loss
    out[13 + 5 * n + i] = acceleration
    out[13 + 6 * n + i] = max(power, 0.0)
    return pull, 0.0, 0.0


@kernel
def _muscle_limb(t: Any, flows: Any, i: int, y: Any, speed: float, length: float, out: Any) -> Any:
    """Air and friction of one limb of muscles: fill its rates and return its tension and the air that it takes."""
    n = t.base.shape[0]
    row = t.muscles[i]
    p, z = y[6 + i], y[6 + n + i]
    pull, loss, bladder, by_x, by_p = tension(t.law, row, i, length, speed, p - ATMOSPHERE, z)
    volume, area = air_volume(row, bladder)
    supply = y[9 + 2 * n]
    filled = mass_flow(supply, p, flows[i, 0], flows[i, 1])
    vented = mass_flow(p, ATMOSPHERE, flows[i, 2], flows[i, 3]) + mass_flow(p, ATMOSPHERE, flows[i, 4], flows[i, 5])
    inflow = GAS_CONSTANT * REFERENCE_TEMPERATURE * (filled - vented)
    exponent = t.air[0]
    swept = area * by_x * -speed
    rate = exponent * (inflow - p * swept) / (volume + exponent * p * area * by_p)
    out[6 + i] = rate
    v = speed / row[_RATIO]
    out[6 + n + i] = (-v - slip(-v * z, abs(z)) * abs(v) * z) / row[_PRESLIDING]
    intact, count = flows[i, 6], row[_COUNT]
    pull, loss = intact * pull, intact * loss
    out[10 + 2 * n + i] = -pull * speed
    out[10 + 3 * n + i] = count * (p - ATMOSPHERE) * (swept + area * by_p * rate)
    out[10 + 4 * n + i] = loss
    out[13 + 5 * n + i], out[13 + 6 * n + i] = 0.0, 0.0
    return pull, count * filled, count * vented


@kernel
def drive_rates(t: Any, flows: Any, i: int, y: Any, speed: float, length: float, out: Any) -> Any:
    """Fill the rates of the drive of limb ``i``; return its tension, and the air drawn and let out in kg/s."""
    if is_motor(t.motors[i]):
        return _motor_limb(t, flows, i, y, speed, length, out)
    return _muscle_limb(t, flows, i, y, speed, length, out)


@kernel
def manifold_rates(t: Any, y: Any, drawn: float, let_out: float, out: Any) -> None:
    """Pressure of the manifold, if it is not held by its regulator, and the air that comes and goes."""
    n = t.base.shape[0]
    fresh = drawn
    out[9 + 2 * n] = 0.0
    if t.air[4] > 0.0:
        fresh = mass_flow(t.air[1], y[9 + 2 * n], t.air[2], t.air[3])
        out[9 + 2 * n] = t.air[0] * GAS_CONSTANT * REFERENCE_TEMPERATURE * (fresh - drawn) / t.air[4]
    out[11 + 5 * n] = fresh
    out[12 + 5 * n] = let_out
