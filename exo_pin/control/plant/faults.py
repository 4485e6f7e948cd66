"""What can fail in the plant: air that leaks, valves that stick, limbs that break, motors without current."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Any, Literal, get_args

import numpy as np

from ...core.errors import InvalidInput
from ...core.errors.checked import checked
from ...core.validation import (
    as_choice,
    as_count,
    as_finite,
    require_type,
    set_fields,
    set_positive,
)
from ...muscle.valve.flow import Valve
from .any_device.arm_actions import check_span

FaultKind = Literal[
    "leak", "burst", "torn", "stuck valve", "no current", "slipping brake", "jam", "encoder loss", "supply drop"
]

#: Kinds of faults.
FAULTS = get_args(FaultKind)
#: Those of muscles and valves, and those of motors; "torn" is of any limb.
_OF_MUSCLES = ("leak", "burst", "stuck valve")
_OF_MOTORS = ("no current", "slipping brake", "jam", "encoder loss", "supply drop")
#: A hole of 4 mm: C = 0.8 · 0.685 A/(ρ_0 sqrt(R T_0)), the choked flow of a nozzle with a discharge coefficient of 0.8.
_BURST = Valve(2e-8, 0.5)


#: Faults as they are typed: kind and command.
WORDS: dict[str, tuple[Any, float]] = {
    "stuck-open": ("stuck valve", 1.0),
    "stuck-shut": ("stuck valve", -1.0),
    **{
        kind.replace(" ", "-"): (kind, -1.0) for kind in FAULTS if kind not in ("leak", "stuck valve", "slipping brake")
    },
}


@checked
@dataclass(frozen=True)
class Fault:
    """A fault of one limb's drive, from a time on.

    Parameters
    ----------
    kind : {"leak", "burst", "torn", "stuck valve", "no current", "slipping brake", ...}
        Of muscles: "leak": air escapes through ``leak``; "burst": through a hole of 4 mm, and the braid still holds the
        arm; "stuck valve": whatever the command, the valve does what ``command`` would make it do. Of motors: "no
        current": the motor does nothing, and the brake of the drive, if it has one, closes; "slipping brake": the same
        with a brake that holds only ``brake_force``; "jam": it is stuck, up to five times its limit; "encoder loss":
        its position and speed read zero; "supply drop": it gives ``share`` of what is commanded. Of any drive: "torn":
        muscle, cable, rod or shaft has come off, and it carries nothing.
    limb : int
        From 0.
    start, end : float
        When it begins and ends, s.
    leak : Valve or None
        Of a leak.
    command : float
        Of a stuck valve, -1 to 1.
    brake_force : float or None
        Of a slipping brake, along the limb, N.
    share : float
        Of the commanded force that is left when the supply drops, 0 to 1.
    reported_after : float or None
        Time from its beginning on until the drive's electronics report it (:attr:`.Measurement.faulty`), s; None if
        they never do.

    Raises
    ------
    InvalidInput
        If something is out of its range, or a leak has no valve.

    Examples
    --------
    >>> torn = ep.Fault("torn", limb=2, start=1.5)
    >>> ep.Fault.from_text("torn,3,1.5", limb_count=3) == torn  # on the command line limbs count from 1
    True
    """

    kind: FaultKind
    limb: int
    start: float = 0.0
    end: float = float("inf")
    leak: Valve | None = None
    command: float = -1.0
    brake_force: float | None = None
    share: float = 0.5
    reported_after: float | None = None

    def __post_init__(self) -> None:
        as_choice("kind", self.kind, FAULTS)
        set_fields(self, limb=as_count("limb", self.limb))
        check_span(self)
        if (self.kind == "leak") != isinstance(self.leak, Valve):
            raise InvalidInput('expected leak as a Valve with kind "leak", and with no other kind')
        if (self.kind == "slipping brake") != (self.brake_force is not None):
            raise InvalidInput('expected brake_force with kind "slipping brake", and with no other kind')
        if not 0.0 <= float(as_finite("share", self.share, ())) <= 1.0:
            raise InvalidInput(f"expected share from 0 to 1, got {self.share!r}")
        set_positive(self, "brake_force", "reported_after", zero=True, optional=True)
        if not -1.0 <= float(as_finite("command", self.command, ())) <= 1.0:
            raise InvalidInput(f"expected command from -1 to 1, got {self.command!r}")

    @classmethod
    def from_text(cls, text: str, limb_count: int) -> Fault:
        """The fault that a text such as ``"burst,3,4"`` describes.

        Parameters
        ----------
        text : str
            One of :data:`WORDS`, the number of the limb from 1, and when it begins, s.
        limb_count : int
            n.

        Returns
        -------
        Fault

        Examples
        --------
        >>> fault = ep.Fault.from_text("burst,3,4", limb_count=3)
        >>> fault.kind, fault.limb, fault.start
        ('burst', 2, 4.0)
        """
        word, _, rest = text.partition(",")
        kind, command = WORDS[as_choice("fault", word, WORDS)]
        try:
            limb, start = (float(part) for part in rest.split(","))
        except ValueError:
            raise InvalidInput(f"expected a fault as KIND,LIMB,START, got {text!r}") from None
        if limb not in range(1, limb_count + 1):
            raise InvalidInput(f"expected a limb from 1 to {limb_count} in {text!r}, got {limb:g}")
        return cls(kind, int(limb) - 1, start, command=command)

    @property
    def hole(self) -> Valve | None:
        """Through which air escapes, if it does."""
        return _BURST if self.kind in ("burst", "torn") else self.leak

    def acts(self, time: float) -> bool:
        """Whether it is there at a time in s.

        Parameters
        ----------
        time : float
            s.

        Returns
        -------
        bool

        Examples
        --------
        >>> leak = ep.Fault("leak", limb=0, start=1.0, end=2.0, leak=ep.Valve(1e-9))
        >>> [leak.acts(time) for time in (0.5, 1.0, 2.5)]  # s
        [False, True, False]
        """
        return self.start <= time < self.end

    def is_reported(self, time: float) -> bool:
        """Whether the drive's electronics report it at a time in s.

        Parameters
        ----------
        time : float
            s.

        Returns
        -------
        bool

        Examples
        --------
        >>> jam = ep.Fault("jam", limb=1, start=1.0, reported_after=0.05)
        >>> [jam.is_reported(time) for time in (0.5, 1.0, 1.1)]  # s
        [False, False, True]
        """
        return self.reported_after is not None and self.acts(time) and time >= self.start + self.reported_after


def as_faults(
    faults: Fault | Sequence[Fault], motors: Sequence[bool], duration: float = float("inf")
) -> tuple[Fault, ...]:
    """Faults of a plant whose limbs have motors or not, in a run of a duration in s.

    Raises
    ------
    InvalidInput
        If something is no fault, of a limb that is not there, one that its drive cannot have, or begins after the run.
    """
    every = tuple(faults) if not isinstance(faults, Fault) and np.iterable(faults) else (faults,)
    for fault in every:
        require_type("faults", fault, Fault, "Fault records")
        if fault.limb >= len(motors):
            raise InvalidInput(f"expected a fault of limb 0 to {len(motors) - 1}, got limb {fault.limb}")
        if fault.kind in (_OF_MUSCLES if motors[fault.limb] else _OF_MOTORS):
            drive, others = ("a motor", _OF_MUSCLES) if motors[fault.limb] else ("pneumatic muscles", _OF_MOTORS)
            known = ", ".join(repr(kind) for kind in FAULTS if kind not in others)
            raise InvalidInput(
                f"expected one of {known} of limb {fault.limb + 1}, which has {drive}; got {fault.kind!r}"
            )
        if fault.start >= duration:
            raise InvalidInput(
                f"expected a fault that begins within the run of {duration:g} s, got {fault.kind!r} of limb "
                f"{fault.limb} at {fault.start:g} s"
            )
    return every
