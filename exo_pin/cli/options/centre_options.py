"""Options on where the device's centre lies, seen from the shoulder's."""

from __future__ import annotations

import argparse

from ...core.errors import InvalidInput
from ...load_case import CentreOffset
from ...load_case.centre_path import CentrePath
from .query_options import caution_offset, offset, wearer


def centre_offset(options: argparse.Namespace, side: str) -> CentreOffset | CentrePath | None:
    """What ``--offset`` and ``--moving-centre`` say; with both the offset is that at rest."""
    caution_offset(options)
    at_rest = offset(options)
    if not options.moving_centre:
        return None if at_rest is None else CentreOffset.together(at_rest)
    if options.person is None:
        raise InvalidInput("--moving-centre needs to know whose shoulder moves: give --person too")
    return wearer(options, side=side).centre_path(at_rest or (0.0, 0.0, 0.0))
