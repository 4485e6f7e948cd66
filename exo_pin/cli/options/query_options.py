"""Options of several commands: design, poses, person, limits, and where the device sits.

Values of options that are written as text: numbers, a name with numbers; and options that exclude each other.

Files of ``--out`` and ``--plot``: checked before a command begins its work, and written after it.
"""

from __future__ import annotations

import argparse
import math
import sys
import warnings
from collections.abc import Callable, Iterable, Iterator, Mapping
from contextlib import contextmanager
from dataclasses import replace
from json import dumps
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np
from scipy.spatial.transform import Rotation

from ...chain import ClosedChain
from ...core.errors import InvalidInput, OutsideHumanRange
from ...core.files import (
    is_stream,
    require_ending,
    require_folder,
    require_writable,
    write_columns,
    write_figure,
    write_text,
)
from ...core.optional_packages import require_extra
from ...core.results import plain
from ...core.validation import FloatArray, as_finite, as_positive
from ...design import Wearer
from ...design.parameters.names import assigned
from ...exo.loading import load
from ...exo.shoulder_exo import ShoulderExo
from ...load_case import CentreOffset, CentrePath, Movement, read_movement
from ...reaction import Limits
from .. import PICTURES

if TYPE_CHECKING:
    from ...person import Person

#: Most poses on a way.
_MOST = 1000
#: An offset, mm, below which it is likely that metres were given.
_SMALL = 0.2


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


def way_angles(options: argparse.Namespace) -> FloatArray:
    """Angles of the poses of ``--to``, degrees, shape (poses, 3)."""
    if not 2 <= options.poses <= _MOST:
        raise InvalidInput(f"expected --poses from 2 to {_MOST}, got {options.poses}")
    return np.linspace(pose_angles(options), triple("--to", options.to), options.poses)


def triple(option: str, text: str) -> list[float]:
    """Flexion, abduction and internal rotation of a text, degrees."""
    return numbers(text, f"{option} F,A,I as flexion, abduction and internal rotation, degrees", 3)


#: What ``--person`` is for most commands.
_WEARER = "the wearer: height in m, mass in kg, male or female, such as 1.75,75,male (default: as in the design)"


def limits(options: argparse.Namespace) -> Limits:
    """Limits of the limbs."""
    text = str(options.limits)
    if text.isalpha():
        return text
    low, high = numbers(text, "--limits as design, none, pull, or MIN,MAX in N", 2)
    return (low, high)


def design(options: argparse.Namespace) -> ShoulderExo:
    """Load the design, on a person if one is given."""
    exo = load(options.design, side=options.side, leave_out=getattr(options, "leave_out", ()))
    if getattr(options, "person", None) is not None:
        return exo.worn_by(person_size(options))
    bend, held = getattr(options, "elbow_flexion", 0.0), getattr(options, "payload", 0.0)
    if not bend and not held:
        return exo
    own = own_wearer(exo)
    if own is None:
        words = "--payload and --elbow-flexion belong to a person's arm, and the design does not say who wears it"
        raise InvalidInput(f"{words}: give --person too")
    with _cautions():
        bent = float(np.radians(bend)) if bend else own.elbow_flexion
        return exo.worn_by(replace(own, elbow_flexion=bent, payload=held or own.payload))


def pose_angles(options: argparse.Namespace) -> tuple[float, float, float]:
    """Flexion, abduction and internal rotation, degrees."""
    return options.flexion, options.abduction, options.internal_rotation


def pose_words(options: argparse.Namespace, exo: ShoulderExo) -> str:
    """The pose as given, for the head of a report."""
    flexion, abduction, internal = pose_angles(options)
    return f"{exo.side} shoulder at flexion {flexion:g}°, abduction {abduction:g}°, internal rotation {internal:g}°"


def pose(options: argparse.Namespace, exo: ShoulderExo) -> Rotation:
    """The pose that the three angles name on the design's side of the body.

    A pose that no human shoulder reaches, and an angle that looks like radians, give a line on standard error.
    """
    with _cautions():
        orientation = exo.pose(*pose_angles(options))
    # Said once is enough: the query would say it again.
    warnings.simplefilter("ignore", OutsideHumanRange)
    return orientation


def person_numbers(text: str) -> tuple[float, float, str]:
    """Height, mass and sex of ``--person``."""
    try:
        height, mass, sex = (part.strip() for part in text.split(","))
        return float(height), float(mass), sex
    except ValueError:
        raise InvalidInput(f"expected --person HEIGHT,MASS,SEX such as 1.75,75,male, got {text!r}") from None


def person_size(options: argparse.Namespace) -> Wearer:
    """Size and posture of ``--person``, with what is in the hand."""
    bend, load = options.elbow_flexion, options.payload
    with _cautions():
        return Wearer(*person_numbers(options.person), elbow_flexion=bend, payload=load, degrees=True)


def wearer(options: argparse.Namespace, **more: Any) -> Person:
    """The person of ``--person``, with their muscles, on the side of the body that ``more`` says."""
    return with_muscles(person_size(options), **more)


def with_muscles(own: Wearer, **more: Any) -> Person:
    """A wearer with muscles."""
    from ...person import Person  # here, because few queries need one

    return Person(own.height, own.mass, own.sex, elbow_flexion=own.elbow_flexion, payload=own.payload, **more)


def own_wearer(exo: ShoulderExo) -> Wearer | None:
    """Who wears the design, whom ``--person`` may have named; None where it is not known."""
    arm = exo.device.arm
    return None if arm is None else arm.wearer


def offset(options: argparse.Namespace) -> list[float] | None:
    """Where ``--offset`` puts the device's centre, m; one that is too small to be meant in mm gives a line."""
    if options.offset is None:
        return None
    if 0.0 < max(abs(value) for value in options.offset) < _SMALL:
        caution(f"an offset of {max(options.offset, key=abs):g} mm has no effect: --offset takes mm (metres?)")
    return [1e-3 * value for value in options.offset]


def posture(options: argparse.Namespace) -> dict[str, float] | None:
    """Values of idle joints that ``--posture`` names, by name."""
    if not options.posture:
        return None
    return {name: numbers(text, f"{name}=VALUE", 1)[0] for name, text in assigned(options.posture).items()}


def centre_offset(options: argparse.Namespace, exo: ShoulderExo) -> CentreOffset | CentrePath | None:
    """What ``--offset`` and ``--moving-centre`` say; with both the offset is that at rest."""
    at_rest = offset(options)
    if not options.moving_centre:
        return None if at_rest is None else CentreOffset.together(at_rest)
    own = own_wearer(exo)
    if own is None:
        raise InvalidInput("--moving-centre needs to know whose shoulder moves: give --person too")
    return with_muscles(own, side=exo.side).centre_path(at_rest or (0.0, 0.0, 0.0))


def movement(options: argparse.Namespace, side: str) -> Movement:
    """The movement of ``--trajectory``."""
    smoothing = None if options.smoothing == "none" else options.smoothing
    known = None if options.sensor_noise is None else math.radians(options.sensor_noise)
    return read_movement(options.trajectory, side, smoothing, known, options.ends)


#: Units of a joint's value, longer endings first, in SI.
_UNITS = {"deg": np.pi / 180.0, "rad": 1.0, "mm": 1e-3, "m": 1.0}


def configuration(options: argparse.Namespace, exo: ShoulderExo) -> FloatArray:
    """The closed configuration, shape (nq,)."""
    chain = exo.chain
    angles = any((options.flexion, options.abduction, options.internal_rotation))
    q = chain.reference_configuration()
    held = list[str]()
    if chain.roles.limbs and "root_joint" in chain.model.names:
        # The arm hangs on the root: put it into the pose.
        root = chain.configuration_slice("root_joint")
        q[root.stop - 4 : root.stop] = pose(options, exo).as_quat()
        held.append("root_joint")
    elif angles and exo.has_arm:
        q = exo.configurations(pose(options, exo))
        if not np.isfinite(q).all():
            raise InvalidInput(f"{exo.name!r} does not reach this pose")
        if options.set:
            raise InvalidInput("expected either a pose of the arm or --set: the joints of a device follow its arm")
        return q
    elif angles:
        raise InvalidInput(f"{exo.name!r} has no arm to put into a pose: --set its joints instead")
    if options.set and not held:
        # The joints are set in the drawn configuration, whose branch the answer is on.
        q = chain.close(q)
    held += [_set(chain, q, text) for text in options.set]
    return chain.close(q, hold=held)


def joint_value(text: str) -> tuple[str, float]:
    """The joint and the number, rad or m, of JOINT=VALUE."""
    joint, value, _ = _parsed(text)
    return joint, value


def _parsed(text: str) -> tuple[str, float, bool]:
    """The joint, its value in SI, and whether that is a length."""
    joint, _, value = text.partition("=")
    unit = next((unit for unit in _UNITS if value.endswith(unit)), None)
    expected = "--set JOINT=VALUE with a unit, such as hip=23deg or rod=40mm"
    (number,) = numbers("" if unit is None else value.removesuffix(unit), expected, 1, shown=text)
    assert unit is not None
    return joint, float(as_finite(f"--set {joint}", number, ())) * _UNITS[unit], unit.endswith("m")


def _set(chain: ClosedChain, q: FloatArray, text: str) -> str:
    """Put JOINT=VALUE into q and return the joint's name."""
    joint, value, is_length = _parsed(text)
    part, moved = chain.configuration_slice(joint), chain.velocity_slice(joint)
    if moved.stop - moved.start != 1:
        raise InvalidInput(f"expected a hinge or a slide, got {joint!r} with {part.stop - part.start} coordinates")
    if bool(chain.metres[moved][0]) != is_length:
        raise InvalidInput(f"expected {joint!r} in {'deg or rad' if is_length else 'mm or m'}, got {text!r}")
    q[part] = value if part.stop - part.start == 1 else (np.cos(value), np.sin(value))
    return joint


#: Longest duration of a simulation or animation with samples at even steps, s; more would fill the memory.
_LONGEST = 1000.0


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


def refuse(options: argparse.Namespace, why: str, *names: str) -> None:
    """Refuse options that mean nothing together with others; those that were not given are None, False or 0."""
    given = [f"--{name.replace('_', '-')}" for name in names if getattr(options, name) not in (None, False, 0.0)]
    if given:
        raise InvalidInput(f"{why}: leave out {', '.join(given)}")


def check_outputs(options: argparse.Namespace, extras: Iterable[str]) -> None:
    """Check the endings and folders of what a command shall write, and the extras that it needs.

    Raises
    ------
    InvalidInput
        If a file has an ending that the command cannot write, or cannot be written where it shall be.
    MissingExtra
        If an extra is needed that is not installed.
    """
    for name, endings in getattr(options, "endings", {}).items():
        path = getattr(options, name, None)
        if path is None:
            continue
        if name == "out" and "plot" in options and path.suffix.lower() in PICTURES and not is_stream(path):
            raise InvalidInput(f"expected --out to end in {', '.join(endings)}; a picture is --plot {path}")
        require_ending(f"--{name}", path, endings)
        require_writable(path)
        if name == "plot" and path.suffix.lower() != ".html":
            require_extra("plot")
    if getattr(options, "folder", None) is not None:
        require_folder(options.folder)
    for extra in extras:
        require_extra(extra)


def write_outputs(
    options: argparse.Namespace,
    json: Callable[[], str] | None,
    columns: Callable[[], Mapping[str, Any]] | None,
    save: Callable[[Path], Any] | None,
    figure: Callable[[], Any] | None,
    page: Callable[[], Any] | None,
) -> None:
    """Write what was asked for; the arguments are those of :func:`exo_pin.cli.deliver`."""
    out, plot = getattr(options, "out", None), getattr(options, "plot", None)
    if out is not None:
        if json is not None and (out.suffix.lower() == ".json" or (columns is None and save is None)):
            write_text(out, json() + "\n")
        elif columns is not None:
            write_columns(out, columns())
        elif save is not None:
            save(out)
    if plot is not None and page is not None and plot.suffix.lower() == ".html":
        page().save(plot)
    elif plot is not None and figure is not None:
        from ...view.plots.plot_style import pyplot

        pyplot().switch_backend("agg")  # to files only, so that no screen is needed
        write_figure(plot, figure())


def joined_json(exo: Any, **answers: Any) -> str:
    """Several answers on a design as one JSON text, each under its name with its own fields; None where none is."""
    return dumps(plain({"mechanism": exo.name, "side": exo.side, **answers}), indent=2)
