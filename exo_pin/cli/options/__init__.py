"""Options that several commands share, as types of the commands' parameters, and what the commands do with them."""

from __future__ import annotations

import math
import sys
import warnings
from collections.abc import Iterator
from contextlib import contextmanager
from dataclasses import dataclass, fields, replace
from functools import cached_property
from typing import TYPE_CHECKING, Annotated, Any, Literal

import numpy as np
from cyclopts import Parameter
from cyclopts.validators import Number
from scipy.spatial.transform import Rotation

from ...chain.formats.leaving_out import LEAVE_OUT
from ...core.errors import InvalidInput, MissingExtra, OutsideHumanRange
from ...core.optional_packages import require_extra
from ...core.validation import FloatArray, as_positive
from ...design import Wearer
from ...design.parameters.names import assigned
from ...exo.loading import load
from ...exo.shoulder_exo import ShoulderExo
from ...load_case import CentreOffset, CentrePath, Load
from ...person.bare_arm import BARE_ARM_PERSON
from ...reaction import SPLITS, Limits

if TYPE_CHECKING:
    from ...person import Person

#: Most poses on a way.
_MOST = 1000
#: An offset, mm, below which it is likely that metres were given.
_SMALL = 0.2
#: Longest duration of a simulation or animation with samples at even steps, s; more would fill the memory.
_LONGEST = 1000.0


def called(metavar: str, **more: Any) -> Parameter:
    """How the value of an option is called in the help."""
    return Parameter(metavar=metavar, **more)


def needs(extra: str) -> Parameter:
    """A flag that needs an extra, which is checked before any work."""
    return Parameter(validator=lambda _, given: require_extra(extra) if given else None)


Degrees = Annotated[float, called("DEG")]
Newtons = Annotated[float, called("N")]
Millimetres = Annotated[float, called("MM")]
Kilograms = Annotated[float, called("KG")]
Seconds = Annotated[float, called("S")]
Bar = Annotated[float, called("BAR")]
Percent = Annotated[float, called("PERCENT", validator=Number(gte=0.0))]
Share = Annotated[float, called("PERCENT", validator=Number(gte=0.0, lte=100.0))]
Texts = tuple[str, ...]
Progress = Annotated[bool, Parameter(help="Show a progress bar.")]
Split = Annotated[str, called("NAME", help=f"Assumption on the side forces of the limbs: {', '.join(SPLITS)}.")]
Side = Annotated[Literal["left", "right"] | None, Parameter(help="Side of the body (default: as in the design).")]
Design = Annotated[
    str,
    Parameter(
        help="Name of a design from 'exo-pin presets', a .toml file, or a robot as .urdf, .xml (MJCF) or .sdf "
        "(the default is one that a person can wear)."
    ),
]
LimitsText = Annotated[
    str,
    called(
        "WORD|MIN,MAX",
        help="Limits of the limb forces: design (those of its actuators), none (equilibrium alone), pull (as design, "
        "and limbs only pull), or as design with a least and a greatest force, N, tension positive, such as 0,200.",
    ),
]
Offset = Annotated[
    tuple[float, float, float] | None,
    called(
        "X_MM Y_MM Z_MM",
        help="Offset of the device's centre from the shoulder's: forward, left and up, mm (default 0 0 0).",
    ),
]
LeaveOut = Annotated[
    Texts,
    called(
        "NAME",
        help=f"Element of a robot's file to leave out although it changes the motion: {', '.join(LEAVE_OUT)}; "
        "may be repeated.",
    ),
]
Joints = Annotated[
    Texts,
    called(
        "JOINT=VALUE",
        help="Of a robot from a file: hold a hinge at an angle (23deg, 0.4rad) or a slide at a position (40mm, 0.04m); "
        "may be repeated.",
    ),
]
Posture = Annotated[
    Texts,
    called(
        "JOINT=VALUE",
        help="Of a device with joints that move while the arm rests: a joint's value, with the unit in its name, such "
        "as elbow_deg=30 or slide_mm=20 (default: least motion along the straight turn from rest); may be repeated.",
    ),
]
MovingCentre = Annotated[
    bool,
    needs("person"),
    Parameter(
        help="The shoulder's centre moves with the arm of the wearer, and the device's stays with the torso (needs the "
        "extra 'person')."
    ),
]
HandForce = Annotated[
    str | None,
    called(
        "X,Y,Z",
        help="Force of a therapist or an object on the wearer's hand: forward, left and up, N, such as 0,0,-20 "
        "(default: none).",
    ),
]
Muscled = Annotated[bool | None, Parameter(negative="--no-muscles"), needs("person")]
#: A group of options that is one parameter of a command.
group = Parameter(name="*")


@group
@dataclass(frozen=True)
class Pose:
    """The pose of the arm.

    Attributes
    ----------
    flexion : float
        Arm forward, degrees.
    abduction : float
        Arm away from the body, degrees.
    internal_rotation : float
        Arm turned inward about its own axis, degrees.
    """

    flexion: Degrees = 0.0
    abduction: Degrees = 0.0
    internal_rotation: Degrees = 0.0

    @property
    def angles(self) -> tuple[float, float, float]:
        """Flexion, abduction and internal rotation, degrees."""
        return self.flexion, self.abduction, self.internal_rotation

    def words(self, exo: ShoulderExo) -> str:
        """The pose as given, for the head of a report."""
        flexion, abduction, internal = self.angles
        return f"{exo.side} shoulder at flexion {flexion:g}°, abduction {abduction:g}°, internal rotation {internal:g}°"

    def of(self, exo: ShoulderExo) -> Rotation:
        """The pose that the three angles name on the design's side of the body.

        A pose that no human shoulder reaches, and an angle that looks like radians, give a line on standard error.
        """
        with _cautions():
            orientation = exo.pose(*self.angles)
        # Said once is enough: the query would say it again.
        warnings.simplefilter("ignore", OutsideHumanRange)
        return orientation


@group
@dataclass(frozen=True)
class Way:
    """A row of poses.

    Attributes
    ----------
    to : str, optional
        Compute a row of poses, each at rest, from the given pose to these angles: flexion, abduction and internal
        rotation, degrees.
    poses : int
        With --to: number of poses.
    """

    to: Annotated[str | None, called("F,A,I")] = None
    poses: Annotated[int, called("N")] = 10

    def __post_init__(self) -> None:
        if self.to is None:
            refuse("--to was not given", **given(self))

    def angles(self, start: Pose) -> FloatArray:
        """Angles of the poses, degrees, shape (poses, 3)."""
        if not 2 <= self.poses <= _MOST:
            raise InvalidInput(f"expected --poses from 2 to {_MOST}, got {self.poses}")
        return np.linspace(start.angles, triple("--to", str(self.to)), self.poses)


@group
@dataclass(frozen=True)
class Worn:
    """Who wears the device.

    Attributes
    ----------
    person : str, optional
        The wearer: height in m, mass in kg, male or female, such as 1.75,75,male, and the girth of the upper arm in mm
        where it is known: 1.75,75,male,340 (default: as in the design).
    elbow_flexion : float
        Bend of the person's elbow, degrees.
    payload : float
        Mass in the person's hand, kg, not N.
    clothing : float
        Thickness of the person's clothing, mm.
    """

    person: Annotated[str | None, called("HEIGHT,MASS,SEX")] = None
    elbow_flexion: Degrees = 0.0
    payload: Kilograms = 0.0
    clothing: Millimetres = 0.0

    @cached_property
    def size(self) -> Wearer:
        """Size and posture of ``--person``, with what is in the hand."""
        return wearer_of(str(self.person), **self._changes)

    @property
    def _changes(self) -> dict[str, Any]:
        """What is said of the person besides their size, by fields of a wearer."""
        said = {
            "elbow_flexion": math.radians(self.elbow_flexion),
            "payload": self.payload,
            "clothing": 1e-3 * self.clothing,
        }
        return {name: value for name, value in said.items() if value}

    def muscles(self, **more: Any) -> Person:
        """The person of ``--person``, with their muscles, on the side of the body that ``more`` says."""
        return with_muscles(self.size, **more)

    def load(self, design: str, side: str | None, leave_out: Texts = ()) -> ShoulderExo:
        """Load a design, on a person if one is given."""
        return self.on(load(design, side=side, leave_out=leave_out))

    def on(self, exo: ShoulderExo) -> ShoulderExo:
        """A design on the person, or on who wears it, changed as is said."""
        if self.person is not None:
            return exo.worn_by(self.size)
        if not self._changes:
            return exo
        own = own_wearer(exo)
        if own is None:
            given = " and ".join(f"--{name.replace('_', '-')}" for name in self._changes)
            raise InvalidInput(f"the design does not say who wears it: give --person too, with {given}")
        with _cautions():
            return exo.worn_by(replace(own, **self._changes))


@group
@dataclass(frozen=True)
class Someone(Worn):
    """A person, who need not be named.

    Attributes
    ----------
    person : str
        The wearer: height in m, mass in kg, male or female.
    """

    person: Annotated[str | None, called("HEIGHT,MASS,SEX")] = "{:g},{:g},{}".format(*BARE_ARM_PERSON)


def caution(text: str) -> None:
    """A line on standard error about an input that is possible and unlikely."""
    print(f"exo-pin: {text}", file=sys.stderr)


@contextmanager
def _cautions() -> Iterator[None]:
    """Print warnings of unlikely inputs as cautions."""
    with warnings.catch_warnings(record=True) as found:
        warnings.simplefilter("always", OutsideHumanRange)
        yield
    for warning in found:
        caution(str(warning.message))


def triple(option: str, text: str) -> list[float]:
    """Flexion, abduction and internal rotation of a text, degrees."""
    return numbers(text, f"{option} F,A,I as flexion, abduction and internal rotation, degrees", 3)


def limits_of(text: str) -> Limits:
    """Limits of the limbs of ``--limits``."""
    if text.isalpha():
        return text
    low, high = numbers(text, "--limits as design, none, pull, or MIN,MAX in N", 2)
    return (low, high)


def wearer_of(text: str, **posture: Any) -> Wearer:
    """The wearer of ``--person``; a text in another order is refused with the one that may be meant."""
    words = [part.strip() for part in text.split(",")]
    try:
        height, mass, sex, *girth = words
        if girth:
            (posture["arm_girth"],) = (1e-3 * float(each) for each in girth)
        with _cautions():
            return Wearer(float(height), float(mass), sex, **posture)
    except ValueError as error:
        said = (
            error if isinstance(error, InvalidInput) else f"expected HEIGHT,MASS,SEX such as 1.75,75,male, got {text!r}"
        )
        meant = _meant(words)
        if meant is not None:
            said = f"{str(said).partition('; did you mean')[0]} (did you mean {meant}?)"
        raise InvalidInput(f"--person: {said}") from None


def _meant(words: list[str]) -> str | None:
    """A person whom these words would describe in their right order, the sex by its first letters."""
    sizes = sorted(float(word) for word in words if word.replace(".", "", 1).isdecimal())
    sexes = [sex for sex in ("male", "female") for word in words if word and sex.startswith(word.lower())]
    try:
        (height, mass), (sex,) = sizes, sexes
        Wearer(height, mass, sex)
    except ValueError:
        return None
    return f"{height:g},{mass:g},{sex}"


def with_muscles(own: Wearer, **more: Any) -> Person:
    """A wearer with muscles."""
    from ...person import Person  # here, because few queries need one

    if 0.0 < (share := more.get("strength", 1.0)) < 0.01:
        caution(f"a strength of {100.0 * share:g} %: it is given in percent (a share?)")
    return Person.of_wearer(own).with_changes(**more)


def has_muscles() -> bool:
    """Whether the extra with the wearer's muscles is installed; a line on standard error says if it is not."""
    try:
        require_extra("person")
    except MissingExtra as error:
        caution(f"the wearer's own muscles are not counted: {error}")
        return False
    return True


def counts_muscles(asked: bool | None, worn: Worn, never: bool = False) -> bool:
    """Whether the force in the joint leads: as asked, else with ``--person`` but for questions that never have it."""
    if asked is not None:
        return asked
    return worn.person is not None and not never and has_muscles()


def own_wearer(exo: ShoulderExo) -> Wearer | None:
    """Who wears the design, whom ``--person`` may have named; None where it is not known."""
    arm = exo.device.arm
    return None if arm is None else arm.wearer


def metres(offset: tuple[float, float, float] | None) -> list[float] | None:
    """Where ``--offset`` puts the device's centre, m; one that is too small to be meant in mm gives a line."""
    if offset is None:
        return None
    if 0.0 < max(map(abs, offset)) < _SMALL:
        caution(f"an offset of {max(offset, key=abs):g} mm has no effect: --offset takes mm (metres?)")
    return [1e-3 * value for value in offset]


def load_on_hand(text: str | None, exo: ShoulderExo) -> Load | None:
    """The load of ``--hand-force``, where the hand segment ends."""
    if text is None:
        return None
    own = own_wearer(exo)
    if own is None:
        raise InvalidInput("--hand-force needs to know where the hand is: give --person too")
    force = np.array(numbers(text, "--hand-force X,Y,Z in N, forward, left and up", 3))
    bend, forearm = own.elbow_flexion, own.forearm_length
    hand = [forearm * math.sin(bend), 0.0, -own.upper_arm_length - forearm * math.cos(bend)]
    return Load(force, at=hand)


def posture_of(texts: Texts) -> dict[str, float] | None:
    """Values of idle joints that ``--posture`` names, by name."""
    return {name: numbers(text, f"{name}=VALUE", 1)[0] for name, text in assigned(texts).items()} or None


def centre_of(offset: Any, moving: bool, exo: ShoulderExo) -> CentreOffset | CentrePath | None:
    """What ``--offset`` and ``--moving-centre`` say; with both the offset is that at rest."""
    at_rest = metres(offset)
    if not moving:
        return None if at_rest is None else CentreOffset.together(at_rest)
    own = own_wearer(exo)
    if own is None:
        raise InvalidInput("--moving-centre needs to know whose shoulder moves: give --person too")
    return with_muscles(own, side=exo.side).centre_path(at_rest or (0.0, 0.0, 0.0))


def numbers(
    text: str, expected: str, *counts: int, separator: str = ",", shown: str | None = None, finite: bool = False
) -> list[float]:
    """The numbers of a text, as many as one of ``counts`` says, if any are given.

    Raises
    ------
    InvalidInput
        If it has others, or one that is not ``finite`` where all must be; the message says what was ``expected``, and
        the text, or what is ``shown`` for it.
    """
    try:
        values = [float(part) for part in text.split(separator)]
    except ValueError:
        values = []
    if finite and not all(map(math.isfinite, values)):
        values = []
    if not values or (counts and len(values) not in counts):
        raise InvalidInput(f"expected {expected}, got {shown or text!r}")
    return values


def named_numbers(text: str, expected: str, *counts: int, **more: Any) -> tuple[str, list[float]]:
    """Name and numbers of NAME=NUMBERS; arguments and errors are those of :func:`numbers`."""
    name, _, values = text.partition("=")
    return name, numbers(values, expected, *counts, shown=text, **more)


def duration(option: str, value: float) -> float:
    """A duration, s, that may be sampled."""
    seconds = as_positive(option, value)
    if seconds > _LONGEST:
        raise InvalidInput(f"expected {option} of at most {_LONGEST:g} s, got {seconds:g}")
    return seconds


def given(group: Any) -> dict[str, Any]:
    """Options of a group that are not as by default."""
    values = {each.name: (getattr(group, each.name), each.default) for each in fields(group)}
    return {name: value for name, (value, default) in values.items() if value != default}


def refuse(why: str, **options: Any) -> None:
    """Refuse options that mean nothing together with others; those that were not given are None, False or empty."""
    named = {name: value for name, value in options.items() if value is not None and value is not False and value != ()}
    names = [f"--{name.replace('_', '-')}" for name in named]
    if names:
        raise InvalidInput(f"{why}: leave out {', '.join(names)}")
