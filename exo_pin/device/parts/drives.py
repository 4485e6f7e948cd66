"""What drives and what loads the links of a device: motors, actuators of slides, routed cables and springs.

Brakes: joints of a device that are locked while it is at rest.
"""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np

from ...core.errors import InvalidInput
from ...core.errors.checked import checked
from ...core.validation import as_finite, as_positive, require_type, require_types, set_fields, set_positive
from ...design import Actuator, Limb, Stroke
from .laws import SpringLaw
from .routes import Route


def _require_place(record: Drive | Spring) -> None:
    """Check that a drive or spring has a name, and acts on a joint or along a route."""
    if not isinstance(record.name, str) or not record.name:
        raise InvalidInput(f"expected a name, got {record.name!r}")
    if (record.joint is None) == (record.route is None):
        raise InvalidInput(f"expected {record.name!r} on a joint or along a route, and not on both")
    if record.joint is not None and not isinstance(record.joint, str):
        raise InvalidInput(f"expected the name of a joint for {record.name!r}, got {record.joint!r}")
    require_type("route", record.route, Route | None)


@checked
@dataclass(frozen=True)
class Drive:
    """An actuator between two links: in a joint of one coordinate, or along a route.

    Attributes
    ----------
    name : str
        Its name in tables and texts.
    joint : str or None
        A hinge or slide of the chain. The effort is positive towards larger coordinates, N m or N.
    route : Route or None
        The way of a cable or muscle. The effort is its tension, N.
    pulls : bool
        Of a slide: whether the effort is counted as a tension, which shortens the slide, as of a limb between two
        joints.
    zero_length : float
        Of a slide that is a limb: distance of the limb's joints where the slide's coordinate is zero, m. What is said
        and asked of the drive's coordinate is then the limb's length. 0 if it is the coordinate itself.
    lower, upper : float or None
        Least and greatest effort; None where they are not known. Those of an ``actuator`` besides.
    least, greatest : float or None
        Range of the joint's coordinate, m or rad; None where it has no end.
    speed_limit : float or None
        Greatest speed of the coordinate or of the route's length, rad/s or m/s; that of an ``actuator`` if it is less.
    power_limit : float or None
        Greatest mechanical power, W; likewise.
    play, resolution : float or None
        How far the coordinate or length may shift while the drive stands, end to end, and the least difference that its
        sensor tells apart, rad or m; those of an ``actuator`` where they are left out, None where they are not known.
    actuator, stroke : Actuator, Stroke or None
        Of a route, or of a slide that is counted by its tension: limits by length, as of a limb.

    Examples
    --------
    >>> from exo_pin.device import Drive
    >>> motor = Drive("elevation", joint="elevation_hinge", lower=-40.0, upper=40.0, speed_limit=3.0)
    >>> motor.missing_limits(known_forces=False)  # nothing lacks
    []
    """

    name: str
    joint: str | None = None
    route: Route | None = None
    pulls: bool = False
    lower: float | None = None
    upper: float | None = None
    least: float | None = None
    greatest: float | None = None
    speed_limit: float | None = None
    power_limit: float | None = None
    actuator: Actuator | None = None
    stroke: Stroke | None = None
    zero_length: float = 0.0
    play: float | None = None
    resolution: float | None = None
    #: It is a drive, and no limb.
    kind = "drive"
    #: What a device's structure gives way is not a property of its drives.
    guide = None

    def __post_init__(self) -> None:
        _require_place(self)
        for name in ("lower", "upper", "least", "greatest"):
            value = getattr(self, name)
            if value is not None:
                set_fields(self, **{name: float(as_finite(name, value, ()))})
        for low, high in (("lower", "upper"), ("least", "greatest")):
            ends = getattr(self, low), getattr(self, high)
            if None not in ends and ends[0] > ends[1]:
                raise InvalidInput(f"expected {low} <= {high} of {self.name!r}, got {ends[0]:g} and {ends[1]:g}")
        set_positive(self, "speed_limit", "power_limit", optional=True)
        require_types(self, actuator=Actuator | None, stroke=Stroke | None)
        set_positive(self, "zero_length", zero=True)
        if self.zero_length and not self.pulls:
            raise InvalidInput(f"expected {self.name!r} with pulls=True: zero_length is of a slide that is a limb")
        for name in ("speed_limit", "power_limit"):
            known = [value for part in (self, self.actuator) if (value := getattr(part, name, None)) is not None]
            set_fields(self, **{name: min(known, default=None)})
        set_positive(self, "play", "resolution", zero=True, optional=True)
        for name in ("play", "resolution"):
            if getattr(self, name) is None:
                set_fields(self, **{name: getattr(self.actuator, name, None)})
        if self.joint is not None and not self.pulls and (self.actuator is not None or self.stroke is not None):
            raise InvalidInput(f"expected {self.name!r} with pulls=True: its actuator's limits are those of a tension")
        if self.route is not None and self.actuator is None and self.lower is None:
            # A cable cannot push.
            set_fields(self, lower=0.0)

    @classmethod
    def geared(
        cls, name: str, joint: str, torque: float, ratio: float = 1.0, speed: float | None = None, **more: float
    ) -> Drive:
        """A motor with a gear: its greatest torque times the ratio, its greatest speed over it.

        Parameters
        ----------
        name, joint : str
            Of the drive, and of the hinge that it turns.
        torque : float
            Greatest torque of the motor in either direction, N m.
        ratio : float
            Of the gear, motor to joint. Friction of the gear is left out.
        speed : float, optional
            Greatest speed of the motor, rad/s.
        **more : float
            Further limits of the joint.

        Returns
        -------
        Drive

        Examples
        --------
        >>> from exo_pin.device import Drive
        >>> drive = Drive.geared("elevation", "elevation_hinge", torque=0.8, ratio=50.0, speed=300.0)
        >>> drive.upper, drive.speed_limit  # N m, rad/s at the joint
        (40.0, 6.0)
        """
        torque, ratio = as_positive("torque", torque), as_positive("ratio", ratio)
        limit = None if speed is None else as_positive("speed", speed) / ratio
        return cls(name, joint, lower=-torque * ratio, upper=torque * ratio, speed_limit=limit, **more)  # type: ignore[arg-type]

    @property
    def effort_range(self) -> tuple[float, float]:
        """Least and greatest effort, N m or N; NaN where it is not known, or a law of a muscle gives it."""
        own = tuple(float("nan") if end is None else end for end in (self.lower, self.upper))
        if self.actuator is None:
            return own  # type: ignore[return-value]
        low, high = self.actuator.effort_range
        return float(np.fmax(own[0], low)), float(np.fmin(own[1], high))

    @property
    def length_range(self) -> tuple[float, float]:
        """Range of its coordinate, m or rad; NaN for a route, or the length of a limb, whose stroke is not known."""
        if self.stroke is not None and self.stroke.end_fitting is not None:
            return Limb(stroke=self.stroke).length_range
        of_length = self.joint is None or self.zero_length > 0.0
        none = float("nan") if of_length and self.least is None and self.greatest is None else float("inf")
        return -none if self.least is None else self.least, none if self.greatest is None else self.greatest

    def missing_limits(self, known_forces: bool) -> list[str]:
        """Limits that are not known, in words; those of the effort are left out with ``known_forces``.

        Parameters
        ----------
        known_forces : bool
            Whether the limits of the effort are given otherwise.

        Returns
        -------
        list of str

        Examples
        --------
        >>> from exo_pin.device import Drive
        >>> Drive("rotation", joint="rotation_hinge", upper=10.0).missing_limits(known_forces=False)
        ['least effort']
        """
        lacking = ["range of length"] if np.isnan(self.length_range[0]) else []
        if known_forces:
            return lacking
        names = zip(("least effort", "greatest effort"), self.effort_range, strict=True)
        law = self.actuator is not None and self.actuator.force_law is not None
        return lacking + [name for name, end in names if np.isnan(end) and not (law and name.startswith("great"))]

    def idle(self) -> Drive:
        """The same drive when it gives no effort.

        Returns
        -------
        Drive

        Examples
        --------
        >>> from exo_pin.device import Drive
        >>> lost = Drive("rotation", joint="rotation_hinge", lower=-10.0, upper=10.0).idle()
        >>> lost.lower, lost.upper  # N m
        (0.0, 0.0)
        """
        return replace(self, lower=0.0, upper=0.0, actuator=None, stroke=None)

    def mirrored(self) -> Drive:
        """Mirror image in the x-z plane: a joint keeps its coordinate and effort, and a route is the mirrored one.

        Returns
        -------
        Drive

        Examples
        --------
        >>> from exo_pin.device import Drive, Route
        >>> cable = Drive("cable", route=Route.over(("universe", [0.0, 0.1, 0.2]), ("arm", [0.0, 0.04, -0.2])))
        >>> [point.point[1] for point in cable.mirrored().route.points]  # m
        [-0.1, -0.04]
        """
        return self if self.route is None else replace(self, route=self.route.mirrored())


@checked
@dataclass(frozen=True)
class Spring:
    """A spring of any law: in a joint of one coordinate, over a lever or pulley, or along a route.

    Attributes
    ----------
    name : str
        Its name.
    law : SpringLaw
        Tension by the route's length; on a joint the derivative of its energy by the joint's coordinate, which is
        minus the joint's effort as URDF, MuJoCo and OpenSim count it, and as a device file states it.
    joint : str or None
        A hinge or slide of the chain.
    route : Route or None
        Its way: two ends for a strut or a spring in the open, via points for one with a cable over pulleys.

    Examples
    --------
    >>> from exo_pin.device import LinearSpring, Route, Spring
    >>> way = Route.over(("universe", [0.0, 0.0, 0.25]), ("arm", [0.0, 0.0, -0.2]))
    >>> spring = Spring("support", LinearSpring(400.0, slack=0.1), route=way)
    >>> float(spring.law.force(0.45).round(6))  # N, of the hanging arm: 0.25 + 0.2 m long
    140.0
    """

    name: str
    law: SpringLaw
    joint: str | None = None
    route: Route | None = None

    def __post_init__(self) -> None:
        _require_place(self)
        require_type("law", self.law, SpringLaw)

    def mirrored(self) -> Spring:
        """Mirror image in the x-z plane: the same law, of the same coordinate or of the length of a mirrored route.

        Returns
        -------
        Spring

        Examples
        --------
        >>> from exo_pin.device import ConstantForce, Route, Spring
        >>> way = Route.over(("universe", [0.0, 0.05, 0.25]), ("arm", [0.0, 0.0, -0.2]))
        >>> Spring("support", ConstantForce(40.0), route=way).mirrored().route.points[0].point  # m
        (0.0, -0.05, 0.25)
        """
        return self if self.route is None else replace(self, route=self.route.mirrored())


@checked
@dataclass(frozen=True)
class Brake:
    """A brake that locks a hinge or slide of the chain; its effort is a reaction of either sign.

    Attributes
    ----------
    name : str
        Its name in tables and texts.
    joint : str
        A joint of one coordinate. The effort is positive towards larger coordinates, N m or N.
    limit : float or None
        Greatest effort, N m or N, in either direction; None where it is not known.

    Examples
    --------
    >>> from exo_pin.device import Brake
    >>> Brake("rail_brake", joint="rail_slide", limit=300.0).as_drive.lower  # N
    -300.0
    """

    name: str
    joint: str
    limit: float | None = None

    def __post_init__(self) -> None:
        for what, value in (("a name", self.name), ("the name of a joint", self.joint)):
            if not isinstance(value, str) or not value:
                raise InvalidInput(f"expected {what} of a brake, got {value!r}")
        set_positive(self, "limit", zero=True, optional=True)

    @property
    def as_drive(self) -> Drive:
        """What it is in equilibrium: an effort within its limits."""
        return Drive(self.name, self.joint, lower=None if self.limit is None else -self.limit, upper=self.limit)
