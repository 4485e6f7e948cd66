"""Options on where the device's centre lies, seen from the shoulder's."""

from __future__ import annotations

import argparse
import math

from ...core.errors import InvalidInput
from ...load_case import CentreOffset
from ...load_case.centre_path import CentrePath
from .option_kinds import add_flag
from .query_options import caution_offset, person_numbers

__all__ = ["add_moving_centre", "centre_offset"]


def add_moving_centre(parser: argparse.ArgumentParser) -> None:
    """Add that the shoulder's centre moves and the device's does not."""
    add_flag(
        parser,
        "--moving-centre",
        "the shoulder's centre moves with the arm of --person, and the device's stays with the torso (needs the "
        "extra 'person')",
    )


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
