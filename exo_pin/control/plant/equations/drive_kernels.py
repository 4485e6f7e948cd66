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

A cable has T = 0 where l <= s, and its damping takes or adds at most k (l - s), so that T is never negative. With play
b between drive and limb, k (l - s) becomes k (l - s ∓ b/2) beyond b/2 and zero within, and damping is at most that.
The motor of a joint is the same with efforts T and F that are positive along the coordinate l ("along" 1, of limbs -1).

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

One muscle of the plant: pull, length, volume of its air, and the pressure for a wanted tension, compiled.

With the limb's length l the muscle's contraction is x = (L_0 + e - l)/r, e its end fitting and r = 1 for a muscle in
line with its limb (5-4). A muscle that pulls a cable over a tackle of ratio r : 1 takes up r times its contraction;
L_0 + e is then the length of the limb at which the muscle is as long as at rest. Its pull is

    S(x, P) = min(F(x, P), capability line)     0 <= x <= x_free, F the static law, P gauge
    S(x, P) = 0                                 x > x_free, the first x >= 0 with F = 0: the muscle hangs in a bow
    S(x, P) = S(0, P) - k_b x                   x < 0: the braid is taut, k_b its stiffness

A muscle never pushes. With a spring of stiffness k in series (Section 6.2) the muscle is shorter by the spring's
extension d: k d = S(x + d, P). Damping (3-21) and friction (3-12) oppose the motion by at most S, so that both fade
where the muscle goes slack and the tension stays between 0 and 2 S. Pulleys add a friction in proportion to S. A limb
of N muscles side by side pulls with N/r of that.

The air's volume is that of a cylinder in an inextensible braid, (3-2) to (3-4), V = L (b² - L²)/(4 π n²), and the
volume of the tube. A slack muscle has its own free length, not the limb's.
"""

from __future__ import annotations

import math
from typing import Any

from ....core.compiled import kernel
from ....muscle.valve.flow import ATMOSPHERE, GAS_CONSTANT, REFERENCE_TEMPERATURE, mass_flow

#: Columns of the table of muscles, one row a muscle. "law" is how many strains and bars its coefficients have.
COLUMNS = (
    "nominal_length", "end_fitting", "capability_slope", "capability_intercept", "braid_stiffness", "damping_1",
    "damping_2", "friction", "friction_2", "friction_1", "friction_0", "friction_load", "presliding",
    "spring_stiffness", "thread", "turns", "dead_volume", "ratio", "count", "pulley_friction",
)  # fmt: skip
(
    _LENGTH, _FITTING, _SLOPE, _INTERCEPT, _BRAID, _D1, _D2, _CONSTANT, _N2, _N1, _N0, _LOAD, _MUSCLE_PRESLIDING,
    _SPRING, _THREAD, _TURNS, _DEAD, _RATIO, _COUNT, _PULLEYS,
) = range(len(COLUMNS))  # fmt: skip
#: Strain at which the search for the free contraction ends, and its steps.
_LARGEST_STRAIN, _STEPS = 0.5, 50
#: Halvings of the interval of pressure: 4 bar to 4e-7 Pa.
_HALVINGS = 40
_BAR = 1e5
_STANDARD_GRAVITY = 9.81


@kernel
def static_law(law: Any, i: int, strain: float, bar: float) -> Any:
    """Force in N, its slope by strain and by bar, of muscle ``i``; ``law`` has shape (n, I, J), N, powers ascending."""
    force, slope, gain = 0.0, 0.0, 0.0
    for a in range(law.shape[1] - 1, -1, -1):
        row, row_gain = 0.0, 0.0
        for b in range(law.shape[2] - 1, -1, -1):
            row_gain = row_gain * bar + row
            row = row * bar + law[i, a, b]
        slope = slope * strain + force
        force = force * strain + row
        gain = gain * strain + row_gain
    return force, slope, gain


@kernel
def free_contraction(law: Any, i: int, bar: float) -> Any:
    """Strain at which the muscle pulls with nothing, its slope by bar, and whether there is one below one half."""
    force, slope, gain = static_law(law, i, 0.0, bar)
    if force <= 0.0:
        return 0.0, 0.0, True
    low = 0.0
    for step in range(1, _STEPS + 1):
        high = _LARGEST_STRAIN * step / _STEPS
        if static_law(law, i, high, bar)[0] <= 0.0:
            strain = low
            for _ in range(60):
                force, slope, gain = static_law(law, i, strain, bar)
                if force > 0.0:
                    low = strain
                else:
                    high = strain
                newer = strain - force / slope if slope != 0.0 else 0.5 * (low + high)
                if not low <= newer <= high:
                    newer = 0.5 * (low + high)
                if abs(newer - strain) <= 1e-15:
                    break
                strain = newer
            force, slope, gain = static_law(law, i, strain, bar)
            return strain, -gain / slope if slope < 0.0 else 0.0, True
        low = high
    return _LARGEST_STRAIN, 0.0, False


@kernel
def muscle_pull(law: Any, row: Any, i: int, x: float, bar: float) -> Any:
    """Pull S of a muscle without spring in N, the contraction of its bladder in m, dS/dx, dS/dbar, dx_bladder/dbar."""
    length = row[_LENGTH]
    inside = max(x, 0.0)
    force, slope, gain = static_law(law, i, inside / length, bar)
    if force <= 0.0 or slope >= 0.0:
        # Not on the falling branch that begins at x = 0, unless the law itself has no zero there.
        strain, by_bar, _ = free_contraction(law, i, bar)
        if inside >= strain * length:
            braid = -row[_BRAID] * x if x < 0.0 else 0.0
            # A muscle that pulls with nothing at its nominal length is as long as that until air shortens it.
            return braid, strain * length, -row[_BRAID] if x < 0.0 else 0.0, 0.0, by_bar * length
    limit = max(row[_SLOPE] * bar + row[_INTERCEPT], 0.0)
    by_x = slope / length
    if force > limit:
        force, by_x, gain = limit, 0.0, row[_SLOPE] if limit > 0.0 else 0.0
    if x < 0.0:
        return force - row[_BRAID] * x, 0.0, -row[_BRAID], gain, 0.0
    return force, x, by_x, gain, 0.0


@kernel
def _with_spring(law: Any, row: Any, i: int, x: float, bar: float) -> Any:
    """As :func:`muscle_pull` for muscle and spring: S, bladder's contraction, its slopes by x and by bar."""
    pull, bladder, by_x, by_bar, free_by_bar = muscle_pull(law, row, i, x, bar)
    stiffness = row[_SPRING]
    if pull <= 0.0:
        # Beyond the free contraction the bladder keeps its length. Before it, where the capability line leaves no pull,
        # it shortens with the limb.
        return pull, bladder, 1.0 if 0.0 < x <= bladder else 0.0, free_by_bar
    if stiffness <= 0.0:
        return pull, bladder, 1.0 if x >= 0.0 else 0.0, 0.0
    low, high = 0.0, pull / stiffness
    extension = high * stiffness / (stiffness - by_x)
    for _ in range(100):
        pull, bladder, by_x, by_bar, free_by_bar = muscle_pull(law, row, i, x + extension, bar)
        excess = stiffness * extension - pull
        if excess > 0.0:
            high = extension
        else:
            low = extension
        newer = extension - excess / (stiffness - by_x)
        if not low < newer < high:
            newer = 0.5 * (low + high)
        if abs(newer - extension) <= 1e-16 + 1e-14 * abs(extension):
            break
        extension = newer
    if x + extension < 0.0:
        return stiffness * extension, 0.0, 0.0, 0.0
    return stiffness * extension, bladder, stiffness / (stiffness - by_x), by_bar / (stiffness - by_x)


@kernel
def friction_bound(row: Any, x: float, bar: float, pull: float) -> float:
    """Largest Coulomb friction in N: the constant, or (3-16) with the pull in place of the hung weight.

    Source: thesis (3-16).
    """
    bound = row[_CONSTANT]
    factor = bar - row[_LOAD] * pull / _STANDARD_GRAVITY
    polynomial = (row[_N2] * x + row[_N1]) * x + row[_N0]
    if factor > 0.0 and polynomial > 0.0:
        bound += factor * polynomial
    return bound


@kernel
def tension(law: Any, row: Any, i: int, length: float, speed: float, pressure: float, bristle: float) -> Any:
    """Tension of a limb, and what its muscle is doing.

    ``length`` in m and ``speed``, the rate of the limb's length, in m/s; ``pressure`` gauge, Pa; ``bristle`` from -1 to
    1, the state of the friction. Returns tension N, loss W, contraction of the bladder m, and its slopes by minus the
    limb's length and by pressure, m/Pa.

    Source: thesis (3-21), (5-4).
    """
    bar = max(pressure, 0.0) / _BAR
    ratio, count = row[_RATIO], row[_COUNT]
    x, shortening = (row[_LENGTH] + row[_FITTING] - length) / ratio, -speed / ratio
    pull, bladder, by_x, by_bar = _with_spring(law, row, i, x, bar)
    by_pressure = by_bar / _BAR if pressure > 0.0 else 0.0
    if pull <= 0.0:
        return 0.0, 0.0, bladder, by_x / ratio, by_pressure
    opposing = bar * max(row[_D1] * shortening + row[_D2], 0.0) * shortening
    opposing += (friction_bound(row, bladder, bar, pull) + row[_PULLEYS] * pull) * bristle
    opposing = min(max(opposing, -pull), pull)
    return count * (pull - opposing) / ratio, count * opposing * shortening, bladder, by_x / ratio, by_pressure


@kernel
def air_volume(row: Any, bladder: float) -> Any:
    """Volume of a muscle's air and of its tube in m³, and dV/dx in m², at a contraction of its bladder in m.

    Source: thesis (3-2), (3-3), (3-4).
    """
    length = row[_LENGTH] - bladder
    square = 4.0 * math.pi * row[_TURNS] * row[_TURNS]
    thread = row[_THREAD] * row[_THREAD]
    return (length * (thread - length * length) / square + row[_DEAD], (3.0 * length * length - thread) / square)


@kernel
def static_tensions(law: Any, muscles: Any, lengths: Any, pressure: float, out: Any) -> None:
    """Fill ``out`` (n,) with the tensions in N at rest, at limb lengths (n,) in m and one gauge pressure in Pa."""
    for i in range(lengths.shape[0]):
        out[i] = tension(law, muscles[i], i, lengths[i], 0.0, pressure, 0.0)[0]


@kernel
def pressures_for(law: Any, muscles: Any, lengths: Any, wanted: Any, highest: float, out: Any) -> None:
    """Fill ``out`` (n,) with the highest gauge pressures in Pa at which the muscles pull no more than wanted.

    ``wanted`` (n,) in N. A muscle that shall not pull gets the pressure at which it would begin to, to be ready; one
    that is too short to pull at any pressure is vented.
    """
    for i in range(lengths.shape[0]):
        row = muscles[i]
        if tension(law, row, i, lengths[i], 0.0, highest, 0.0)[0] <= 0.0:
            out[i] = 0.0
            continue
        low, high = 0.0, highest
        if tension(law, row, i, lengths[i], 0.0, high, 0.0)[0] <= wanted[i]:
            out[i] = high
            continue
        for _ in range(_HALVINGS):
            middle = 0.5 * (low + high)
            if tension(law, row, i, lengths[i], 0.0, middle, 0.0)[0] > wanted[i]:
                high = middle
            else:
                low = middle
        out[i] = low


#: Columns of the table of the air, and of what acts on a drive between two instants.
AIR = ("exponent", "supply", "regulator", "regulator_ratio", "manifold")
FLOWS = (
    "fill", "fill_ratio", "vent", "vent_ratio", "leak", "leak_ratio", "intact", "effort", "powered", "brake",
)  # fmt: skip
#: Columns of the table of motor drives, one row a limb; "present" is 0 for a limb with another drive.
MOTOR_COLUMNS = (
    "present", "inverse_mass", "force_limit", "stall_force", "no_load_speed", "viscous", "coulomb", "load_friction",
    "presliding", "stiffness", "damping", "pushes", "shortest", "longest", "stop_stiffness", "stop_damping", "play",
    "copper", "along",
)  # fmt: skip
(
    _PRESENT, _INVERSE, _LIMIT, _STALL, _SPEED, _VISCOUS, _COULOMB, _SHARE, _PRESLIDING, _STIFFNESS, _DAMPING, _PUSHES,
    _SHORTEST, _LONGEST, _STOP, _STOP_DAMPING, _PLAY,
    _COPPER, _ALONG,
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
def _stretch(row: Any, gap: float) -> float:
    """By how much the limb is stretched beyond the play, m, below zero where it is pressed, for l - s in m."""
    half = 0.5 * row[_PLAY]
    if row[_PUSHES] <= 0.0:
        return max(gap - half, 0.0)
    return max(gap - half, 0.0) + min(gap + half, 0.0)


@kernel
def motor_tension(row: Any, length: float, speed: float, s: float, rate: float) -> Any:
    """Tension of the limb in N, and the power that its damping takes in W.

    ``length`` and ``speed`` are those of the limb, ``s`` and ``rate`` those of the drive, m and m/s.
    """
    along = row[_ALONG]
    elastic, opening = row[_STIFFNESS] * _stretch(row, along * (s - length)), along * (rate - speed)
    damped = row[_DAMPING] * opening
    if row[_PUSHES] <= 0.0 or row[_PLAY] > 0.0:
        damped = min(max(damped, -abs(elastic)), abs(elastic))
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
    along = row[_ALONG]
    force = powered * motor_force(row, demanded, along * rate)
    stop, stop_loss, _ = _stop(row, s, rate)
    bound = row[_COULOMB] + row[_SHARE] * abs(pull) + brake
    friction = row[_VISCOUS] * rate + bound * z
    acceleration = row[_INVERSE] * (along * (force - pull) - friction + stop)
    bristle = (rate - slip(rate * z, abs(z)) * abs(rate) * z) / row[_PRESLIDING]
    power = row[_COPPER] * force * force + along * force * rate
    return pull, acceleration, bristle, force, loss + friction * rate + stop_loss, power


@kernel
def _motor_energy(row: Any, length: float, s: float, rate: float, intact: float) -> float:
    """Energy in J of the moving drive, of the stretched limb and of the stops."""
    stretch = _stretch(row, row[_ALONG] * (s - length))
    energy = 0.5 * intact * row[_STIFFNESS] * stretch * stretch + _stop(row, s, rate)[2]
    if row[_INVERSE] > 0.0:
        energy += 0.5 * rate * rate / row[_INVERSE]
    return energy


@kernel(cost=301)
def limb_numbers(t: Any, flows: Any, i: int, y: Any, speed: float, length: float) -> Any:
    """Tension of a limb in N, contraction of its muscle's bladder in m, force of its motor in N, stored energy in J."""
    n, row, intact = t.base.shape[0], t.motors[i], flows[i, 6]
    s, rate = y[6 + i], y[13 + 5 * n + i]
    if row[_PRESENT] <= 0.0:
        pull, _, bladder, _, _ = tension(t.law, t.muscles[i], i, length, speed, s - ATMOSPHERE, y[6 + n + i])
        return intact * pull, bladder, 0.0, 0.0
    force = flows[i, 8] * motor_force(row, flows[i, 7], row[_ALONG] * rate)
    pull = motor_tension(row, length, speed, s, rate)[0]
    return intact * pull, 0.0, force, _motor_energy(row, length, s, rate, intact)


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
    out[10 + 2 * n + i] = row[_ALONG] * pull * speed
    out[10 + 3 * n + i] = row[_ALONG] * force * rate
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


@kernel(cost=301)
def drive_rates(t: Any, flows: Any, i: int, y: Any, speed: float, length: float, out: Any) -> Any:
    """Fill the rates of the drive of limb ``i``; return its tension, and the air drawn and let out in kg/s."""
    if t.motors[i, _PRESENT] > 0.0:
        return _motor_limb(t, flows, i, y, speed, length, out)
    return _muscle_limb(t, flows, i, y, speed, length, out)


@kernel(cost=301)
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
