"""Where the air comes from, and the valves of a muscle."""

from __future__ import annotations

from dataclasses import dataclass
from functools import cached_property
from typing import Literal

from ...core.errors import InvalidInput
from ...core.fields import set_positive
from ...core.validation import as_choice, require_type
from .flow import ATMOSPHERE, Valve

ValveLayout = Literal["3/2", "fill and vent"]
Modulation = Literal["switched", "averaged"]

#: How a muscle's valves are laid out.
LAYOUTS = ("3/2", "fill and vent")
#: How they are driven.
MODULATIONS = ("switched", "averaged")


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
    modulation : {"switched", "averaged"}
        "switched" opens and closes each valve at its exact times in every period of the pulses; "averaged" passes the
        share of the flow all the time, as a very fast pulsing would.
    frequency : float
        Of the pulses, Hz. The command is taken over at the start of each period.

    Raises
    ------
    InvalidInput
        If a part has a wrong type or range.

    Notes
    -----
    Thesis Section 5.2.1 has a manifold with four branches, each with a solenoid valve, printed as "three way two port"
    and read here as a 3/2-way valve, and a restriction valve; its pulses come at 20 Hz.
    """

    fill: Valve
    vent: Valve
    restrictor: Valve | None = None
    layout: ValveLayout = "3/2"
    modulation: Modulation = "switched"
    frequency: float = 20.0

    def __post_init__(self) -> None:
        require_type("fill", self.fill, Valve)
        require_type("vent", self.vent, Valve)
        require_type("restrictor", self.restrictor, Valve | None)
        as_choice("layout", self.layout, LAYOUTS)
        as_choice("modulation", self.modulation, MODULATIONS)
        set_positive(self, "frequency")

    @cached_property
    def paths(self) -> tuple[Valve, Valve]:
        """Fill and vent path, each with the restrictor."""
        behind = () if self.restrictor is None else (self.restrictor,)
        return self.fill.in_series(*behind), self.vent.in_series(*behind)

    def shares(self, command: float) -> tuple[float, float]:
        """Shares of the time for which a command fills and vents, 0 to 1 each; a command beyond ±1 counts as ±1."""
        u = min(max(float(command), -1.0), 1.0)
        if self.layout == "3/2":
            return 0.5 * (1.0 + u), 0.5 * (1.0 - u)
        return max(u, 0.0), max(-u, 0.0)
