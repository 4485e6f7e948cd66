"""``exo-pin calibrate``: joint centres, offsets and mountings from a file of measured poses and limb lengths."""

from __future__ import annotations

import argparse
from typing import Any

import numpy as np

from ...calibration import calibrate
from ...calibration.calibrate_device import JOINTS
from ...calibration.estimation import LOSSES
from ...calibration.length_model import GROUPS
from ...control import read_run
from ...core.errors import InvalidInput
from .. import add_number, add_outputs, add_repeated, deliver
from ..options.option_values import named_numbers
from ..options.query_options import add_design, design


def add_commands(commands: Any) -> None:
    """Register the command."""
    parser = commands.add_parser("calibrate")
    add_design(parser)
    parser.add_argument(
        "measured", metavar="CSV", help="columns of orientations (as of reaction --trajectory), length_1_mm, ..."
    )
    parser.add_argument(
        "--unknowns",
        default=",".join(JOINTS),
        metavar="NAMES",
        help=f"what to find, with commas between, of {', '.join(GROUPS)} (default: {','.join(JOINTS)})",
    )
    add_number(parser, "--length-noise", "MM", "standard deviation of a length, mm (default: found from the data)")
    add_number(
        parser, "--orientation-noise", "DEG", "standard deviation of an orientation about each axis, degrees", 0.0
    )
    add_repeated(
        parser,
        "--tolerance",
        "NAME=SIZE",
        "standard deviation of the design itself, mm or degrees, such as base_points=1; may be repeated",
    )
    parser.add_argument(
        "--loss",
        choices=LOSSES,
        default="linear",
        help="how residuals count; cauchy resists outliers (default linear)",
    )
    add_outputs(parser, ".toml")
    parser.set_defaults(run=_calibrate)


def _calibrate(options: argparse.Namespace) -> int:
    if options.design.endswith(".csv"):
        raise InvalidInput(f"expected the design first: exo-pin calibrate DESIGN {options.design}")
    nominal = design(options)
    run = read_run(options.measured, nominal.side)
    if options.length_noise is not None and not options.length_noise > 0.0:
        raise InvalidInput(f"expected --length-noise in mm, above zero, got {options.length_noise:g}")
    if not options.orientation_noise >= 0.0:
        raise InvalidInput(f"expected --orientation-noise in degrees, zero or more, got {options.orientation_noise:g}")
    noise = None if options.length_noise is None else 1e-3 * options.length_noise
    found = calibrate(
        run.poses,
        run.lengths,
        nominal,
        unknowns=[name.strip() for name in options.unknowns.split(",")],
        length_noise=noise,
        orientation_noise=float(np.radians(options.orientation_noise)),
        tolerances=dict(_tolerance(text) for text in options.tolerance),
        loss=options.loss,
    )
    beside = [name.replace("_", " ") for name in found.model.unknowns if name not in JOINTS]
    note = f"The design holds the joints. Found besides, and no part of it: {', '.join(beside)}." if beside else ""
    deliver(options, f"{found}\n{note}".rstrip(), save=found.exo.save)
    return 0


def _tolerance(text: str) -> tuple[str, float]:
    """Name and SI value of one --tolerance."""
    name, (value,) = named_numbers(text, "--tolerance NAME=SIZE", 1)
    return name, float(np.radians(value)) if name.endswith("mounting") else 1e-3 * value
