"""The drives of the limbs, one limb at a time: pneumatic muscles with their air, motor drives; compiled.

The air of muscle i, of absolute pressure p and volume V, with polytropic exponent κ:

    V p' = κ (R T ṁ - p V')        V' = (dV/dx) (x_l l-rate + x_p p')

A bundle of muscles side by side has one pressure, as each of them has its own valve, and so many times the flow.

Motor drives, a cable on a winch or a linear actuator, are written along the limb. s is the length that the drive lets
out, the limb's length without tension; T the tension; F the motor's force, which pulls in:

    m s'' = T - F - c s' - (F_c + μ |T| + F_brake) z - stops

m, c and F_c are what rotor, gear and drum or screw have, carried over to the limb; μ is the friction of gear and screw
that grows with the load; the friction z is elastoplastic. The limb, of length l, is a spring and a damper in series
with the drive:

    T = k (l - s) + d (l' - s')

A cable has T = 0 where l <= s, and its damping takes or adds at most k (l - s), so that T is never negative.

The motor is a direct-current machine with a current-controlled amplifier: the amplifier's current limits |F| to F_max,
its voltage to F <= F_0 (1 - v/v_0), v = -s' the speed at which the drive pulls in, v_0 the speed without load and F_0
the stall force at full voltage; and likewise the other way. From F_0 v_0 = U²/R the copper takes F² v_0/F_0. Energy
that a motor gives back when it is driven is not counted: its amplifier burns it.

Dry friction is force or moment (bound) z, with z' = (v - α |v| z)/δ and the presliding displacement δ. α is 0 while
|z| < 0.7 or the motion unloads, so that the joint sticks elastically and without creep, and rises to 1 at |z| = 1,
where it slides.

Places of the state: :data:`.plant_kernels.STATE`.

Source: P. Dupont, V. Hayward, B. Armstrong, F. Altpeter, Single state elastoplastic friction models, IEEE Trans.
Automatic Control 47 (2002) 787.
"""

from __future__ import annotations

import math
from typing import Any

from ....core.compiled import kernel
from ....muscle.valve.flow import ATMOSPHERE, GAS_CONSTANT, REFERENCE_TEMPERATURE, mass_flow
from .muscle_kernels import COLUMNS, air_volume, tension

#: Columns of the table of the air, and of what acts on a drive between two instants.
AIR = ("exponent", "supply", "regulator", "regulator_ratio", "manifold")
FLOWS = (
    "fill", "fill_ratio", "vent", "vent_ratio", "leak", "leak_ratio", "intact", "effort", "powered", "brake",
)  # fmt: skip
_MUSCLE_PRESLIDING, _RATIO, _COUNT = (COLUMNS.index(name) for name in ("presliding", "ratio", "count"))
#: Columns of the table of motor drives, one row a limb; "present" is 0 for a limb with another drive.
MOTOR_COLUMNS = (
    "present", "inverse_mass", "force_limit", "stall_force", "no_load_speed", "viscous", "coulomb", "load_friction",
    "presliding", "stiffness", "damping", "pushes", "shortest", "longest", "stop_stiffness", "stop_damping",
)  # fmt: skip
(
    _PRESENT, _INVERSE, _LIMIT, _STALL, _SPEED, _VISCOUS, _COULOMB, _SHARE, _PRESLIDING, _STIFFNESS, _DAMPING, _PUSHES,
    _SHORTEST, _LONGEST, _STOP, _STOP_DAMPING,
) = range(len(MOTOR_COLUMNS))  # fmt: skip
#: |z| of the friction below which it is elastic.
_ELASTIC = 0.7


@kernel
def slip(loaded: float, size: float) -> float:
    """α of the friction, for z · v and |z|."""
    if loaded <= 0.0 or size <= _ELASTIC:
        return 0.0
    if size >= 1.0:
        return 1.0
    return 0.5 - 0.5 * math.cos(math.pi * (size - _ELASTIC) / (1.0 - _ELASTIC))


@kernel
def is_motor(row: Any) -> bool:
    """Whether a row of the table of motor drives is one."""
    return row[_PRESENT] > 0.0


@kernel
def motor_tension(row: Any, length: float, speed: float, s: float, rate: float) -> Any:
    """Tension of the limb in N, and the power that its damping takes in W.

    ``length`` and ``speed`` are those of the limb, ``s`` and ``rate`` those of the drive, m and m/s.
    """
    stretch = length - s
    elastic, opening = row[_STIFFNESS] * stretch, speed - rate
    damped = row[_DAMPING] * opening
    if row[_PUSHES] <= 0.0:
        if stretch <= 0.0:
            return 0.0, 0.0
        damped = min(max(damped, -elastic), elastic)
    return elastic + damped, damped * opening


@kernel
def motor_force(row: Any, demanded: float, pulling_in: float) -> float:
    """Force in N that the amplifier's current and voltage allow, at the speed at which the drive pulls in."""
    relative = pulling_in / row[_SPEED]
    limit = row[_LIMIT]
    most = min(limit, max(row[_STALL] * (1.0 - relative), -limit))
    least = max(-limit, min(-row[_STALL] * (1.0 + relative), limit))
    return min(max(demanded, least), most)


@kernel
def _stop(row: Any, s: float, rate: float) -> Any:
    """Force of the end stops along growing s in N, the power that they take in W, and their energy in J."""
    depth, sign = row[_SHORTEST] - s, 1.0
    if s - row[_LONGEST] > depth:
        depth, sign = s - row[_LONGEST], -1.0
    if depth <= 0.0:
        return 0.0, 0.0, 0.0
    elastic = row[_STOP] * depth
    push = max(elastic - sign * row[_STOP_DAMPING] * rate, 0.0)
    return sign * push, (elastic - push) * sign * rate, 0.5 * elastic * depth


@kernel
def motor_rates(row: Any, flow: Any, length: float, speed: float, s: float, rate: float, z: float) -> Any:
    """Rates of one motor drive.

    ``flow`` holds the demanded motor force N, whether the motor has current, the force of the brake N, and whether the
    limb is whole. Returns tension N, s'' m/s², z' 1/s, motor force N, power of losses W, electric power W.
    """
    demanded, powered, brake, intact = flow
    pull, loss = motor_tension(row, length, speed, s, rate)
    pull, loss = intact * pull, intact * loss
    force = powered * motor_force(row, demanded, -rate)
    stop, stop_loss, _ = _stop(row, s, rate)
    bound = row[_COULOMB] + row[_SHARE] * abs(pull) + brake
    friction = row[_VISCOUS] * rate + bound * z
    acceleration = row[_INVERSE] * (pull - force - friction + stop)
    bristle = (rate - slip(rate * z, abs(z)) * abs(rate) * z) / row[_PRESLIDING]
    heat = force * force * row[_SPEED] / row[_STALL]
    return pull, acceleration, bristle, force, loss + friction * rate + stop_loss, heat - force * rate


@kernel
def motor_energy(row: Any, length: float, s: float, rate: float, intact: float) -> float:
    """Energy in J of the moving drive, of the stretched limb and of the stops."""
    stretch = length - s
    if row[_PUSHES] <= 0.0:
        stretch = max(stretch, 0.0)
    energy = 0.5 * intact * row[_STIFFNESS] * stretch * stretch + _stop(row, s, rate)[2]
    if row[_INVERSE] > 0.0:
        energy += 0.5 * rate * rate / row[_INVERSE]
    return energy


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
    out[6 + n + i] = (-v - slip(-v * z, abs(z)) * abs(v) * z) / row[_MUSCLE_PRESLIDING]
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
