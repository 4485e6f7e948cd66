"""One motor drive of the plant, a cable on a winch or a linear actuator: tension, motor force and motion, compiled.

Both are written along the limb. s is the length that the drive lets out, the limb's length without tension; T the
tension; F the motor's force, which pulls in:

    m s'' = T - F - c s' - (F_c + μ |T| + F_brake) z - stops

m, c and F_c are what rotor, gear and drum or screw have, carried over to the limb; μ is the friction of gear and screw
that grows with the load; the friction z is elastoplastic (:mod:`.friction_kernels`). The limb, of length l, is a spring
and a damper in series with the drive:

    T = k (l - s) + d (l' - s')

A cable has T = 0 where l <= s, and its damping takes or adds at most k (l - s), so that T is never negative.

The motor is a direct-current machine with a current-controlled amplifier: the amplifier's current limits |F| to F_max,
its voltage to F <= F_0 (1 - v/v_0), v = -s' the speed at which the drive pulls in, v_0 the speed without load and F_0
the stall force at full voltage; and likewise the other way. From F_0 v_0 = U²/R the copper takes F² v_0/F_0. Energy
that a motor gives back when it is driven is not counted: its amplifier burns it.
"""

from __future__ import annotations

from typing import Any

from ....core.compiled import kernel
from .friction_kernels import slip

#: Columns of the table of motor drives, one row a limb; "present" is 0 for a limb with another drive.
MOTOR_COLUMNS = (
    "present", "inverse_mass", "force_limit", "stall_force", "no_load_speed", "viscous", "coulomb", "load_friction",
    "presliding", "stiffness", "damping", "pushes", "shortest", "longest", "stop_stiffness", "stop_damping",
)  # fmt: skip
(
    _PRESENT, _INVERSE, _LIMIT, _STALL, _SPEED, _VISCOUS, _COULOMB, _SHARE, _PRESLIDING, _STIFFNESS, _DAMPING, _PUSHES,
    _SHORTEST, _LONGEST, _STOP, _STOP_DAMPING,
) = range(len(MOTOR_COLUMNS))  # fmt: skip


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
