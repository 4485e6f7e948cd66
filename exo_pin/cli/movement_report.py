"""``exo-pin reaction --trajectory``: forces along a movement."""

from __future__ import annotations

import argparse
import math
import warnings

from ..core.errors import InvalidInput, NoisyMovement
from ..exo.shoulder_exo import ShoulderExo
from ..load_case import read_movement
from ..reaction import ConstraintBounds, MovementReaction, write_movement_reaction
from .options.option_values import require_ending
from .options.query_options import limits, pose_angles
from .reaction_report import moving_mass

__all__ = ["follow"]


def follow(exo: ShoulderExo, split: str, bounds: ConstraintBounds, options: argparse.Namespace) -> MovementReaction:
    """Compute the forces of the movement in ``--trajectory``, print their summary and write them to ``--out``.

    Parameters
    ----------
    exo : ShoulderExo
        The design.
    split : str
        Assumption on the side forces.
    bounds : ConstraintBounds
        Of the side forces.
    options : argparse.Namespace
        Options of the command.
    """
    if any(pose_angles(options)):
        raise InvalidInput("a movement has poses of its own: give no --flexion, --abduction or --internal-rotation")
    if options.approach is not None:
        raise InvalidInput("--approach is for a pose: leave --trajectory out")
    if options.muscles:
        raise InvalidInput("--muscles is for a pose; of a movement: exo.joint_contact(movement.orientations, person)")
    if options.json:
        raise InvalidInput("--json is for a pose; histories go to --out FILE.csv or FILE.npz")
    require_ending("--out", options.out, ".csv", ".npz")
    smoothing = None if options.smoothing == "none" else options.smoothing
    known = None if options.sensor_noise is None else math.radians(options.sensor_noise)
    movement = read_movement(options.trajectory, exo.side, smoothing, known, options.ends)
    query = {"static": options.static, "split": split, "constraint_bounds": bounds, "progress": options.progress}
    with warnings.catch_warnings():
        # The answer's cautions say the same.
        warnings.simplefilter("ignore", NoisyMovement)
        answer = exo.follow(movement, limits=limits(options), **query)
    print(exo.mechanism.title or exo.name)
    print(f"{exo.side} shoulder, {len(movement.times)} samples; {moving_mass(exo)}\n")
    print(answer)
    if options.out is not None:
        write_movement_reaction(answer, options.out, exo.side, exo.name)
        print(options.out)
    return answer
