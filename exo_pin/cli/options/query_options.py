"""Options of several commands: design, poses, person, limits, and where the device sits."""

from __future__ import annotations

import argparse
import math
import sys
import warnings
from collections.abc import Iterator
from contextlib import contextmanager
from typing import TYPE_CHECKING, Any

import numpy as np
from scipy.spatial.transform import Rotation

from ...core.errors import InvalidInput, OutsideHumanRange
from ...core.validation import FloatArray
from ...design import DEFAULT_PRESET, Arm
from ...exo.shoulder_exo import ShoulderExo, load
from ...load_case import Movement, read_movement
from ...reaction import Limits
from .. import add_file, add_flag, add_number
from .option_values import numbers

if TYPE_CHECKING:
    from ...person import Person

#: Most poses on a way.
_MOST = 1000
#: An offset, mm, below which it is likely that metres were given.
_SMALL = 0.2

_ANGLES = (
    ("flexion", "arm forward"),
    ("abduction", "arm away from the body"),
    ("internal-rotation", "arm turned inward about its own axis"),
)


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


def add_design(parser: argparse.ArgumentParser) -> None:
    """Add the design's name or file, and the side of the body."""
    parser.add_argument(
        "design",
        nargs="?",
        default=DEFAULT_PRESET,
        metavar="DESIGN",
        help="name of a design from 'exo-pin presets', a .toml file, or a robot as .urdf, .xml (MJCF) or .sdf "
        f"(default: {DEFAULT_PRESET}, which holds most daily poses)",
    )
    parser.add_argument("--side", choices=("left", "right"), help="side of the body (default: as in the design)")


def add_pose(parser: argparse.ArgumentParser) -> None:
    """Add the three clinical angles."""
    for name, text in _ANGLES:
        parser.add_argument(f"--{name}", type=float, default=0.0, metavar="DEG", help=f"{text}, degrees (default 0)")


def add_way(parser: argparse.ArgumentParser) -> None:
    """Add a second pose, and how many lie on the way to it."""
    parser.add_argument(
        "--to",
        metavar="F,A,I",
        help="poses, at rest in each, from the given one to these angles: flexion, abduction and internal rotation, "
        "degrees",
    )
    parser.add_argument("--poses", type=int, default=10, metavar="N", help="with --to: number of poses (default 10)")


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


def add_person(parser: argparse.ArgumentParser, meaning: str = _WEARER) -> None:
    """Add who wears the device."""
    parser.add_argument("--person", metavar="HEIGHT,MASS,SEX", help=meaning)
    add_number(parser, "--elbow-flexion", "DEG", "bend of the person's elbow, degrees", 0.0)
    add_number(parser, "--payload", "KG", "mass in the person's hand, kg, not N", 0.0)


def add_offset(parser: argparse.ArgumentParser) -> None:
    """Add how far the device's centre is off the shoulder's."""
    parser.add_argument(
        "--offset",
        nargs=3,
        type=float,
        metavar=("X_MM", "Y_MM", "Z_MM"),
        help="where the device's centre lies, seen from the shoulder's: forward, left and up, mm (default 0 0 0)",
    )


def add_limits(parser: argparse.ArgumentParser) -> None:
    """Add the limits of the limbs' forces."""
    parser.add_argument(
        "--limits",
        metavar="WORD|MIN,MAX",
        default="design",
        help="limits of the limbs: design (what its actuators can do; default), none (plain equilibrium), pull (limbs "
        "only pull besides), or least and greatest limb force besides, N, tension positive, such as 0,200",
    )


def limits(options: argparse.Namespace) -> Limits:
    """Limits of the limbs."""
    text = str(options.limits)
    if text.isalpha():
        return text
    low, high = numbers(text, "--limits as design, none, pull, or MIN,MAX in N", 2)
    return (low, high)


def design(options: argparse.Namespace) -> ShoulderExo:
    """Load the design, on a person if one is given."""
    exo = load(options.design, side=options.side)
    if getattr(options, "person", None) is not None:
        return exo.worn_by(person_arm(options))
    if getattr(options, "payload", 0.0) or getattr(options, "elbow_flexion", 0.0):
        raise InvalidInput("--payload and --elbow-flexion belong to a person's arm: give --person too")
    return exo


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


def person_arm(options: argparse.Namespace) -> Arm:
    """The arm of ``--person``, with what is in the hand."""
    height, mass, sex = person_numbers(options.person)
    bend, load = options.elbow_flexion, options.payload
    with _cautions():
        return Arm.from_anthropometry(height, mass, sex, elbow_flexion=bend, payload=load, degrees=True)


def wearer(options: argparse.Namespace, **more: Any) -> Person:
    """The person of ``--person``, with their muscles, on the side of the body that ``more`` says."""
    from ...person import Person  # here, because few queries need one

    height, mass, sex = person_numbers(options.person)
    bend, load = options.elbow_flexion, options.payload
    return Person(height, mass, sex, elbow_flexion=bend, payload=load, degrees=True, **more)


def offset(options: argparse.Namespace) -> list[float] | None:
    """Where ``--offset`` puts the device's centre, m."""
    return None if options.offset is None else [1e-3 * value for value in options.offset]


def caution_offset(options: argparse.Namespace) -> None:
    """Say when an offset is too small to be meant in millimetres."""
    if options.offset is not None and 0.0 < max(abs(value) for value in options.offset) < _SMALL:
        caution(f"an offset of {max(options.offset, key=abs):g} mm has no effect: --offset takes mm (metres?)")


def add_movement(parser: argparse.ArgumentParser) -> None:
    """Add the file and what is known of the samples."""
    add_file(parser, "--trajectory", "CSV file of a movement instead of a pose; its columns are listed below")
    add_flag(parser, "--static", "with --trajectory: leave velocity and acceleration out")
    parser.add_argument(
        "--smoothing",
        choices=("gcv", "none"),
        default="gcv",
        help="with --trajectory: smooth the samples by generalised cross-validation (gcv, default), or do not (none)",
    )
    add_number(
        parser,
        "--sensor-noise",
        "DEG",
        "with --trajectory: noise of the measured angles about each axis, degrees (default: from the data)",
    )
    parser.add_argument(
        "--ends",
        choices=("free", "rest"),
        default="free",
        help="of a measured movement: rest if the arm is at rest at its first and last sample; default free",
    )


def movement(options: argparse.Namespace, side: str) -> Movement:
    """The movement of ``--trajectory``."""
    smoothing = None if options.smoothing == "none" else options.smoothing
    known = None if options.sensor_noise is None else math.radians(options.sensor_noise)
    return read_movement(options.trajectory, side, smoothing, known, options.ends)
