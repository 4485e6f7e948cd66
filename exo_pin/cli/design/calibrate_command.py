"""``exo-pin calibrate``: joint centres, offsets and mountings from a file of measured poses and limb lengths."""

from __future__ import annotations

import argparse

import numpy as np

from ...calibration import calibrate
from ...calibration.calibrate_device import JOINTS
from ...control import read_run
from ...core.errors import InvalidInput
from .. import deliver
from ..options.option_values import named_numbers
from ..options.query_options import design


def run_calibrate(options: argparse.Namespace) -> int:
    """Answer ``exo-pin calibrate`` and return its exit status."""
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
