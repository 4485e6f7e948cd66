"""Options on where the device's centre lies, seen from the shoulder's."""

from __future__ import annotations

import argparse
import math

from ...core.errors import InvalidInput
from ...load_case import CentreOffset
from ...load_case.centre_path import CentrePath
from .query_options import caution, person_numbers

__all__ = ["add_moving_centre", "add_offset", "caution_offset", "centre_offset", "offset_mm"]

#: An offset, mm, below which it is likely that metres were given.
_SMALL = 0.2


def add_offset(parser: argparse.ArgumentParser) -> None:
    """Add how far the device's centre is off the shoulder's."""
    parser.add_argument(
        "--offset",
        nargs=3,
        type=float,
        metavar=("X_MM", "Y_MM", "Z_MM"),
        help="where the device's centre lies, seen from the shoulder's: forward, left and up, mm (default 0 0 0)",
    )


def add_moving_centre(parser: argparse.ArgumentParser) -> None:
    """Add that the shoulder's centre moves and the device's does not."""
    parser.add_argument(
        "--moving-centre",
        action="store_true",
        help="the shoulder's centre moves with the arm of --person, and the device's stays with the torso (needs the "
        "extra 'person')",
    )


def offset_mm(options: argparse.Namespace) -> tuple[float, ...]:
    """The offset as given."""
    return tuple(options.offset)


def caution_offset(options: argparse.Namespace) -> None:
    """Say when an offset is too small to be meant in millimetres."""
    if options.offset is not None and 0.0 < max(abs(value) for value in options.offset) < _SMALL:
        caution(f"an offset of {max(options.offset, key=abs):g} mm has no effect: --offset takes mm (metres?)")


def centre_offset(options: argparse.Namespace, side: str) -> CentreOffset | CentrePath | None:
    """What ``--offset`` and ``--moving-centre`` say; with both the offset is that at rest."""
    caution_offset(options)
    at_rest = [1e-3 * value for value in options.offset or (0.0, 0.0, 0.0)]
    if not options.moving_centre:
        return None if options.offset is None else CentreOffset.together(at_rest)
    if options.person is None:
        raise InvalidInput("--moving-centre needs to know whose shoulder moves: give --person too")
    from ...person import Person  # here, because few queries need one

    height, mass, sex = person_numbers(options.person)
    bend = math.radians(options.elbow_flexion)
    return Person(height, mass, sex, elbow_flexion=bend, payload=options.payload, side=side).centre_path(at_rest)
