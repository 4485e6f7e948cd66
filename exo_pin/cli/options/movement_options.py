"""Options of a measured movement: its file, and how its noise is treated."""

from __future__ import annotations

import argparse
import math

from ...load_case import Movement, read_movement
from .. import add_file, add_flag, add_number

__all__ = ["add_movement", "movement"]


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
