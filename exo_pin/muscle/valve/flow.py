"""Mass flow of air through a valve after ISO 6358, valves in series, where the air comes from, and a muscle's valves.

With the upstream absolute pressure p_1, the downstream p_2, the upstream temperature T_1 and r = p_2/p_1,

    ṁ = C p_1 ρ_0 sqrt(T_0/T_1)                                      r <= b, choked
    ṁ = C p_1 ρ_0 sqrt(T_0/T_1) (1 - ((r - b)/(1 - b))²)^m           r > b, subsonic, m = 1/2

with the sonic conductance C, the critical pressure ratio b and the reference air (ANR) of ρ_0 = 1.185 kg/m³ at
T_0 = 293.15 K and 100 kPa. At r = 1 the slope of the subsonic formula is infinite, which no real valve has: above
r = 0.999 the flow is laminar, proportional to the pressure difference, as block libraries for pneumatics do it
(0.995 to 0.999). Air in valve and muscle is at T_0 (**assumption**: tubes and bladder are thin).

Source: ISO 6358-1:2013; the law itself: F. E. Sanville, A new method of specifying the flow capacity of pneumatic fluid
power valves, 2nd Int. Fluid Power Symposium, BHRA, 1971.
"""

from __future__ import annotations

from dataclasses import dataclass
from functools import cached_property
from typing import Any, Literal

import numpy as np
from numpy.typing import ArrayLike

from ...core.compiled import kernel
from ...core.errors import InvalidInput
from ...core.errors.checked import checked
from ...core.validation import FloatArray, as_choice, broadcast, require_type, require_types, set_positive

#: Standard atmosphere, Pa: what gauge pressure is counted from.
ATMOSPHERE = 101325.0
#: The reference air of ISO 6358 (ISO 8778): kg/m³ at 100 kPa, 20 °C and 65 % humidity; its temperature, K.
REFERENCE_DENSITY, REFERENCE_TEMPERATURE = 1.185, 293.15
#: Gas constant of that air, J/(kg K): p_0/(ρ_0 T_0).
GAS_CONSTANT = 1e5 / (REFERENCE_DENSITY * REFERENCE_TEMPERATURE)
#: Pressure ratio above which the flow is laminar.
LAMINAR_RATIO = 0.999


@kernel
def mass_flow(upstream: float, downstream: float, conductance: float, critical_ratio: float) -> float:
    """Mass flow in kg/s between two absolute pressures in Pa, positive from the first to the second."""
    high, low, sign = upstream, downstream, 1.0
    if downstream > upstream:
        high, low, sign = downstream, upstream, -1.0
    if high <= 0.0 or conductance == 0.0:
        return 0.0
    choked = sign * conductance * high * REFERENCE_DENSITY
    ratio = low / high
    if ratio <= critical_ratio:
        return choked
    if ratio < LAMINAR_RATIO:
        part = (ratio - critical_ratio) / (1.0 - critical_ratio)
        return choked * (1.0 - part * part) ** 0.5
    part = (LAMINAR_RATIO - critical_ratio) / (1.0 - critical_ratio)
    return choked * (1.0 - part * part) ** 0.5 * (1.0 - ratio) / (1.0 - LAMINAR_RATIO)


@checked
@dataclass(frozen=True)
class Valve:
    """An open valve, a restrictor or a leak: anything through which air flows.

    Parameters
    ----------
    conductance : float
        Sonic conductance C, m³/(s Pa) of reference air. Data sheets print dm³/(s bar): 1 of these is 1e-8.
    critical_ratio : float
        Critical pressure ratio b, zero or more and below 0.999; about 0.5 for an orifice and 0.2 to 0.4 for small
        solenoid valves.

    Raises
    ------
    InvalidInput
        If a number is not in its range.

    Examples
    --------
    >>> valve = ep.Valve(1e-9, 0.3)
    >>> round(float(valve.flow(5e5, 1e5)) * 1e3, 4)  # choked: C p_1 ρ_0, in g/s
    0.5925
    """

    conductance: float
    critical_ratio: float = 0.5

    def __post_init__(self) -> None:
        set_positive(self, "conductance", "critical_ratio", zero=True)
        if self.conductance > 1e-5:
            raise InvalidInput(
                f"expected conductance in m³/(s Pa), got {self.conductance:g}; a data sheet's dm³/(s bar) times 1e-8"
            )
        if self.critical_ratio >= LAMINAR_RATIO:
            raise InvalidInput(f"expected critical_ratio below {LAMINAR_RATIO:g}, got {self.critical_ratio:g}")

    def flow(self, upstream: ArrayLike, downstream: ArrayLike) -> FloatArray:
        """Mass flow.

        Parameters
        ----------
        upstream, downstream : array_like
            Shapes that broadcast to (...), **absolute** pressures in Pa, zero or more.

        Returns
        -------
        ndarray
            Shape (...), kg/s, positive from ``upstream`` to ``downstream``, negative the other way.

        Raises
        ------
        InvalidInput
            If a pressure is negative or not finite, or the shapes do not broadcast.

        Examples
        --------
        >>> valve = ep.Valve(1e-9, 0.3)  # choked up to 0.3 of the pressure before it
        >>> open_air, behind = valve.flow(5e5, 1e5), valve.flow(5e5, 4.9e5)  # kg/s
        >>> round(float(behind / open_air), 2)
        0.24
        """
        a, b = broadcast(upstream=upstream, downstream=downstream)
        if min(a.min(initial=0.0), b.min(initial=0.0)) < 0.0:
            raise InvalidInput("expected absolute pressures in Pa, zero or more, got a negative one")
        pairs = np.stack([a.ravel(), b.ravel()], axis=1).tolist()
        return np.array([mass_flow(p, q, self.conductance, self.critical_ratio) for p, q in pairs]).reshape(a.shape)

    def in_series(self, *others: Valve) -> Valve:
        """One valve in place of this and others behind it.

        The rule for series of components with ISO 6358 data, 1/C³ = Σ 1/C_i³ and b = 1 - C² Σ (1 - b_i)/C_i². It is an
        approximation. The exact flow of two valves, with the pressure between them solved for, is within 8 % of it for
        critical ratios of 0.2 to 0.5, and within 3.5 % where one conductance is at most a third of the other; for
        critical ratios from 0 to 0.5 within 12.5 and 4.5 %.

        Parameters
        ----------
        *others : Valve
            Behind this one, in any order.

        Returns
        -------
        Valve

        Examples
        --------
        >>> valve = ep.Valve(1e-9).in_series(ep.Valve(1e-9))  # two alike: 2^(-1/3) of the conductance of one
        >>> round(valve.conductance / 1e-9, 4), round(valve.critical_ratio, 4)
        (0.7937, 0.37)
        """
        parts: tuple[Any, ...] = (self, *others)
        if not all(isinstance(part, Valve) for part in parts):
            raise InvalidInput(f"expected valves, got {[type(part).__name__ for part in parts]}")
        if not others:
            return self
        if min(part.conductance for part in parts) == 0.0:
            return Valve(0.0, self.critical_ratio)
        total = sum(part.conductance**-3 for part in parts) ** (-1.0 / 3.0)
        ratio = 1.0 - total**2 * sum((1.0 - part.critical_ratio) / part.conductance**2 for part in parts)
        return Valve(total, max(ratio, 0.0))


ValveLayout = Literal["3/2", "fill and vent"]

#: How a muscle's valves are laid out.
LAYOUTS = ("3/2", "fill and vent")


@checked
@dataclass(frozen=True)
class Supply:
    """Compressed air behind the valves: a regulator, and the manifold that feeds them.

    Parameters
    ----------
    pressure : float
        Gauge pressure of the regulator, Pa.
    regulator : Valve or None
        What limits its flow; None for a supply that holds its pressure whatever is drawn.
    volume : float or None
        Of the manifold between regulator and valves, m³; needed with ``regulator``.

    Raises
    ------
    InvalidInput
        If a number is not in its range, or a regulator comes without a volume.

    Examples
    --------
    >>> air = ep.Supply(6e5, regulator=ep.Valve(2e-9), volume=2e-3)
    >>> round(1e-5 * air.pressure), round(1e3 * air.volume)  # bar; litres between regulator and valves
    (6, 2)
    """

    pressure: float
    regulator: Valve | None = None
    volume: float | None = None

    def __post_init__(self) -> None:
        set_positive(self, "pressure")
        set_positive(self, "volume", optional=True)
        if self.pressure > 2e6:
            raise InvalidInput(f"expected pressure as gauge pressure in Pa, below 20 bar, got {self.pressure:g}")
        require_type("regulator", self.regulator, Valve | None)
        if (self.regulator is None) != (self.volume is None):
            raise InvalidInput("expected regulator and volume together: the flow through one fills the other")

    @property
    def absolute(self) -> float:
        """Absolute pressure of the regulator, Pa."""
        return self.pressure + ATMOSPHERE


@checked
@dataclass(frozen=True)
class ValveUnit:
    """The solenoid valves of one muscle and how they are pulsed.

    A **command** u from -1 to 1 is what a controller sends. With the layout "3/2", one valve that joins the muscle
    either with the supply (on) or with the atmosphere (off), it fills for the share (1 + u)/2 of the time and vents
    for the rest: u = -1 vents, u = 1 fills, and a pressure is held by pulsing. With "fill and vent", two valves that
    can both be closed, it fills for the share u if u > 0, vents for the share -u if u < 0, and holds at u = 0.

    Parameters
    ----------
    fill, vent : Valve
        Flow path from the supply to the muscle and from there to the atmosphere, without the restrictor.
    restrictor : Valve or None
        In series with both, at the muscle's inlet; None for none.
    layout : {"3/2", "fill and vent"}
    frequency : float
        Of the pulses, Hz. Each valve opens and closes at its exact times in every period.
        The command is taken over at the start of each period.

    Raises
    ------
    InvalidInput
        If a part has a wrong type or range.

    Notes
    -----
    Thesis Section 5.2.1 has a manifold with four branches, each with a solenoid valve, printed as "three way two port"
    and read here as a 3/2-way valve, and a restriction valve; its pulses come at 20 Hz.

    Examples
    --------
    >>> unit = ep.ValveUnit(fill=ep.Valve(1e-9), vent=ep.Valve(1e-9), layout="fill and vent", frequency=20.0)
    >>> unit.shares(-0.25), 1.0 / unit.frequency  # it vents for a quarter of each period; s
    ((0.0, 0.25), 0.05)
    """

    fill: Valve
    vent: Valve
    restrictor: Valve | None = None
    layout: ValveLayout = "3/2"
    frequency: float = 20.0

    def __post_init__(self) -> None:
        require_types(self, fill=Valve, vent=Valve, restrictor=Valve | None)
        as_choice("layout", self.layout, LAYOUTS)
        set_positive(self, "frequency")

    @cached_property
    def paths(self) -> tuple[Valve, Valve]:
        """Fill and vent path, each with the restrictor."""
        behind = () if self.restrictor is None else (self.restrictor,)
        return self.fill.in_series(*behind), self.vent.in_series(*behind)

    def shares(self, command: float) -> tuple[float, float]:
        """Shares of the time for which a command fills and vents, 0 to 1 each; a command beyond ±1 counts as ±1.

        Parameters
        ----------
        command : float
            -1 (vents) to 1 (fills), no unit.

        Returns
        -------
        fills, vents : float
            Shares of a period of the pulses, 0 to 1 each.

        Examples
        --------
        >>> unit = ep.ValveUnit(fill=ep.Valve(1e-9), vent=ep.Valve(1e-9))  # 3/2: it fills or vents
        >>> unit.shares(0.5)  # of the time
        (0.75, 0.25)
        """
        u = min(max(float(command), -1.0), 1.0)
        if self.layout == "3/2":
            return 0.5 * (1.0 + u), 0.5 * (1.0 - u)
        return max(u, 0.0), -min(u, 0.0) + 0.0
