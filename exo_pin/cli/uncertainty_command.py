"""``exo-pin uncertainty``: what a shoulder force depends on, and the worst offset of the device."""

from __future__ import annotations

import argparse

from ..design.parameters.names import assigned
from . import deliver
from .options.option_values import numbers, refuse
from .options.query_options import design, limits, movement, offset, pose


def run_uncertainty(options: argparse.Namespace) -> int:
    """Answer ``exo-pin uncertainty`` and return its exit status."""
    exo, motion = design(options), None
    if options.trajectory is None:
        poses = pose(options, exo)
    else:
        refuse(options, "a movement has poses of its own", "flexion", "abduction", "internal_rotation")
        moved = movement(options, exo.side)
        poses, motion = moved.poses, None if options.static else moved.motion
    stated = {name: numbers(text, f"{name}=SIZE", 1)[0] for name, text in assigned(options.uncertain).items()}
    answer = exo.uncertainty(
        poses, motion, split=options.split, centre_offset=offset(options), limits=limits(options), uncertainties=stated
    )
    head = f"{exo.device.title or exo.name}\n{exo.side} shoulder, split {options.split}"
    deliver(options, f"{head}\n\n{answer}", json=answer.to_json, columns=answer.columns, figure=answer.plot)
    return 0
