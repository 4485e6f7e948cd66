"""What can fail in the plant: leaks, bursts, torn muscles, stuck valves."""

from __future__ import annotations

from collections.abc import Iterable, Sequence
from dataclasses import dataclass
from typing import Literal

from ...core.errors import InvalidInput
from ...core.validation import as_choice, as_finite, as_positive, as_real
from ...muscle.valve.flow import Valve

__all__ = ["FAULTS", "Fault", "as_faults"]

FaultKind = Literal["leak", "burst", "torn", "stuck valve"]

#: Kinds of faults.
FAULTS = ("leak", "burst", "torn", "stuck valve")
#: A hole of 4 mm: C = 0.8 · 0.685 A/(ρ_0 sqrt(R T_0)), the choked flow of a nozzle with a discharge coefficient of 0.8.
_BURST = Valve(2e-8, 0.5)


@dataclass(frozen=True)
class Fault:
    """A fault of one muscle or its valve, from a time on.

    Parameters
    ----------
    kind : {"leak", "burst", "torn", "stuck valve"}
        "leak": air escapes through ``leak``. "burst": through a hole of 4 mm; the braid still holds the
        arm. "torn": the muscle has come off, and its limb carries nothing. "stuck valve": whatever the command, the
        valve does what ``command`` would make it do.
    muscle : int
        From 0.
    start, end : float
        When it begins and ends, s.
    leak : Valve or None
        Of a leak.
    command : float
        Of a stuck valve, -1 to 1.

    Raises
    ------
    InvalidInput
        If something is out of its range, or a leak has no valve.
    """

    kind: FaultKind
    muscle: int
    start: float = 0.0
    end: float = float("inf")
    leak: Valve | None = None
    command: float = -1.0

    def __post_init__(self) -> None:
        as_choice("kind", self.kind, FAULTS)
        if isinstance(self.muscle, bool) or not isinstance(self.muscle, int) or self.muscle < 0:
            raise InvalidInput(f"expected muscle as an index from 0, got {self.muscle!r}")
        as_positive("start", self.start, zero=True)
        end = as_real("end", self.end)
        if end.shape != () or not end > self.start:
            raise InvalidInput(f"expected end after start, got {self.end!r} and {self.start!r}")
        if (self.kind == "leak") != isinstance(self.leak, Valve):
            raise InvalidInput('expected leak as a Valve with kind "leak", and with no other kind')
        if not -1.0 <= float(as_finite("command", self.command, ())) <= 1.0:
            raise InvalidInput(f"expected command from -1 to 1, got {self.command!r}")

    @property
    def hole(self) -> Valve | None:
        """Through which air escapes, if it does."""
        return _BURST if self.kind in ("burst", "torn") else self.leak

    def acts(self, time: float) -> bool:
        """Whether it is there at a time in s."""
        return self.start <= time < self.end


def as_faults(faults: Fault | Sequence[Fault], count: int) -> tuple[Fault, ...]:
    """Faults of a plant with ``count`` muscles.

    Raises
    ------
    InvalidInput
        If something is no fault, or of a muscle that is not there.
    """
    if not isinstance(faults, Fault | Iterable):
        raise InvalidInput(f"expected faults as Fault records, got {type(faults).__name__}")
    every = (faults,) if isinstance(faults, Fault) else tuple(faults)
    for fault in every:
        if not isinstance(fault, Fault):
            raise InvalidInput(f"expected faults as Fault records, got {type(fault).__name__}")
        if fault.muscle >= count:
            raise InvalidInput(f"expected a fault of muscle 0 to {count - 1}, got muscle {fault.muscle}")
    return every
