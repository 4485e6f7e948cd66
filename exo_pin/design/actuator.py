"""What the actuator of a limb can do: whether it can push, how hard it can pull, how fast it is; and its tackle."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Literal

from ..core.errors import InvalidInput
from ..core.errors.base import echo
from ..core.files.toml_tables import parse_toml, toml_text
from ..core.validation import as_choice, as_finite, set_fields, set_positive

ActuatorFamily = Literal["pneumatic muscle", "cable", "linear"]

#: Families of actuators; a pneumatic muscle and a cable only pull, a linear actuator also pushes.
ACTUATOR_FAMILIES = ("pneumatic muscle", "cable", "linear")


#: Supplies of muscles lie between these, Pa, gauge.
_PRESSURES = (100.0, 1e7)


def _check_pressure(supply: float) -> None:
    """Raise for a supply in another unit."""
    low, high = _PRESSURES
    if not low <= supply <= high:
        unit = "bar" if supply < low else "pascals under bar"
        raise InvalidInput(f"expected supply_pressure in Pa, from {low:g} to {high:g}, got {supply:g} ({unit}?)")


def as_law(given: object) -> str:
    """The name of a law, or the text of a parameter file as TOML writes it, so that equal laws are equal texts."""
    if not isinstance(given, str) or not given:
        raise InvalidInput(
            "expected force_law as the name of a static law or the text of a parameter file, such as "
            f"Path('law.toml').read_text(); got {echo(given)}"
        )
    return toml_text(parse_toml(given, None).content) if is_law_text(given) else given


def is_law_text(law: str) -> bool:
    """Whether a law is a text of its own, and not the name of a published one."""
    return "\n" in law


@dataclass(frozen=True)
class Tackle:
    """Pneumatic muscles side by side that pull one cable over a tackle of ratio r : 1.

    The cable takes up r times the contraction of a muscle, and its tension is 1/r of what the muscles pull together.

    Attributes
    ----------
    ratio : float
        r, 1 or more.
    muscle_length : float
        Nominal length of a muscle, m. The muscles are at their nominal length where the limb is at its longest.
    force_law : str
        Name of the static law of one muscle (:func:`exo_pin.muscle.muscle_models`), or the text of a parameter file;
        scaled to ``muscle_length``. In a design file a name, a parameter file beside it (``"law.toml"``), or its
        content as a table.
    supply_pressure : float
        Greatest gauge pressure, Pa.
    count : int
        Muscles side by side.

    Raises
    ------
    InvalidInput
        If a number is out of its range.

    Examples
    --------
    >>> tackle = ep.design.Tackle(ratio=2.0, muscle_length=0.3, force_law="best", supply_pressure=4e5, count=2)
    >>> tackle.count / tackle.ratio  # tension of the cable over the pull of one muscle
    1.0
    """

    ratio: float
    muscle_length: float
    force_law: str
    supply_pressure: float
    count: int = 1

    def __post_init__(self) -> None:
        set_positive(self, "ratio", "muscle_length", "supply_pressure")
        _check_pressure(self.supply_pressure)
        if self.ratio < 1.0:
            raise InvalidInput(f"expected a ratio of 1 or more, got {self.ratio:g}")
        count = float(as_finite("count", self.count, ()))
        if isinstance(self.count, bool) or count != int(count) or count < 1:
            raise InvalidInput(f"expected count as a number of muscles from 1, got {self.count!r}")
        set_fields(self, count=int(count))
        set_fields(self, force_law=as_law(self.force_law))


@dataclass(frozen=True)
class Actuator:
    """The actuator of a limb. Which lengths it takes is in :class:`exo_pin.Stroke`.

    Attributes
    ----------
    family : {"pneumatic muscle", "cable", "linear"}
        A pneumatic muscle and a cable only pull; a linear actuator pulls and pushes.
    pull_limit : float or None
        Greatest tension at any length, N; None where it is not known, or where ``force_law`` gives it.
    push_limit : float or None
        Greatest compression of a linear actuator, N; None where it is not known. Zero for the other families.
    force_law : str or None
        Of a pneumatic muscle: the name of its static law (:func:`exo_pin.muscle.muscle_models`), or the text of a
        parameter file, which gives the greatest tension at a length and pressure. It is scaled to the nominal length of
        the limb's stroke. In a design file a name, a parameter file beside it (``"law.toml"``), or its content as a
        table.
    supply_pressure : float or None
        Of a pneumatic muscle with a ``force_law``: greatest gauge pressure, Pa.
    speed_limit : float or None
        Greatest rate of the limb's length in either direction, m/s; None where it is not known.
    power_limit : float or None
        Greatest mechanical power, tension times the rate at which the limb shortens, W; None where it is not known.
    travel_limit : float or None
        Greatest difference between the longest and the shortest length of the limb, m, for the fit of a stroke; None if
        only the family limits it. Of a cable that a pneumatic muscle pulls over a pulley: a quarter of the muscle's
        nominal length, times the ratio of its tackle.
    least_tension : float or None
        Tension that a limb that only pulls must keep, so that it does not hang, N; None for zero.
    play : float or None
        How far the length may shift while the drive stands, end to end, m: backlash of gear and joints; None where it
        is not known.
    resolution : float or None
        Least difference of lengths that the drive's sensor tells apart, m; None where it is not known.
    tackle : Tackle or None
        Of a cable that pneumatic muscles pull over pulleys: these muscles; None for a cable on a winch.

    Raises
    ------
    InvalidInput
        If a limit is negative or does not belong to the family, a law comes without its pressure, or the least tension
        is above the greatest.

    Examples
    --------
    >>> motor = ep.Actuator("linear", pull_limit=300.0, push_limit=300.0)
    >>> motor.push_limit, ep.Actuator("cable", pull_limit=400.0).push_limit
    (300.0, 0.0)
    """

    family: ActuatorFamily
    pull_limit: float | None = None
    push_limit: float | None = None
    force_law: str | None = None
    supply_pressure: float | None = None
    speed_limit: float | None = None
    power_limit: float | None = None
    travel_limit: float | None = None
    tackle: Tackle | None = None
    least_tension: float | None = None
    play: float | None = None
    resolution: float | None = None

    def __post_init__(self) -> None:
        as_choice("actuator family", self.family, ACTUATOR_FAMILIES)
        set_positive(self, "pull_limit", "push_limit", zero=True, optional=True)
        if self.pulls_only:
            if self.push_limit:
                raise InvalidInput(
                    f"expected no push_limit for a {self.family}, which cannot push, got {self.push_limit:g} N; "
                    'leave it out, or choose the family "linear"'
                )
            set_fields(self, push_limit=0.0)
        set_positive(self, "speed_limit", "power_limit", "travel_limit", "supply_pressure", optional=True)
        if self.supply_pressure is not None:
            _check_pressure(self.supply_pressure)
        set_positive(self, "least_tension", "play", "resolution", zero=True, optional=True)
        if self.least_tension is not None and not self.pulls_only:
            raise InvalidInput("expected no least_tension for a linear actuator, which may push")
        if self.least_tension is not None and self.pull_limit is not None and self.least_tension > self.pull_limit:
            raise InvalidInput(
                f"expected least_tension below pull_limit, got {self.least_tension:g} and {self.pull_limit:g} N"
            )
        if (self.force_law is None) != (self.supply_pressure is None):
            raise InvalidInput("expected force_law and supply_pressure together: the law gives the pull at a pressure")
        if self.tackle is not None and (self.family != "cable" or not isinstance(self.tackle, Tackle)):
            raise InvalidInput(f'expected a Tackle with the family "cable" only, got {echo(self.tackle)}')
        if self.force_law is not None:
            set_fields(self, force_law=as_law(self.force_law))
        if self.force_law is not None and self.family != "pneumatic muscle":
            raise InvalidInput(
                f'expected a force_law for the family "pneumatic muscle" only, got one for {self.family!r}'
            )

    @property
    def effort_range(self) -> tuple[float, float]:
        """Least and greatest tension at any length, N; NaN where it is not known."""
        least = float("nan") if self.push_limit is None else self.least_tension or -self.push_limit
        return least, float("nan") if self.pull_limit is None else self.pull_limit

    def missing_limits(self) -> list[str]:
        """Limits of the force that are not known, in words.

        Returns
        -------
        list of str
            Empty if all are known.

        Examples
        --------
        >>> ep.Actuator("linear", pull_limit=300.0).missing_limits()
        ['greatest push']
        """
        lacking = ["greatest pull"] if self.pull_limit is None and self.force_law is None else []
        return lacking + (["greatest push"] if self.push_limit is None else [])

    @property
    def pulls_only(self) -> bool:
        """Whether it cannot push."""
        return self.family != "linear"
