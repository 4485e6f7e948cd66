"""One muscle of the plant: pull, length, volume of its air, and the pressure for a wanted tension, compiled.

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

#: Columns of the table of muscles, one row a muscle. "law" is how many strains and bars its coefficients have.
COLUMNS = (
    "nominal_length", "end_fitting", "capability_slope", "capability_intercept", "braid_stiffness", "damping_1",
    "damping_2", "friction", "friction_2", "friction_1", "friction_0", "friction_load", "presliding",
    "spring_stiffness", "thread", "turns", "dead_volume", "ratio", "count", "pulley_friction",
)  # fmt: skip
(
    _LENGTH, _FITTING, _SLOPE, _INTERCEPT, _BRAID, _D1, _D2, _CONSTANT, _N2, _N1, _N0, _LOAD, _PRESLIDING, _SPRING,
    _THREAD, _TURNS, _DEAD, _RATIO, _COUNT, _PULLEYS,
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
