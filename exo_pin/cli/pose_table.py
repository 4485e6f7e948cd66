"""Forces in poses on the way from one pose to another, as a table: ``exo-pin reaction --to``."""

from __future__ import annotations

import argparse
import textwrap

import numpy as np

from ..core.errors import InvalidInput
from ..core.validation import FloatArray
from ..exo.shoulder_exo import ShoulderExo
from ..reaction import ConstraintBounds, Reaction
from .options.option_values import numbers
from .options.query_options import limits, offset, pose_angles
from .reaction_report import moving_mass

__all__ = ["report_way"]

#: Most rows of a table.
_MOST = 1000
#: Options that are for a single pose.
_OF_ONE_POSE = ("approach", "certificate", "compare", "json", "muscles", "out", "table", "trajectory")


def report_way(exo: ShoulderExo, split: str, bounds: ConstraintBounds, options: argparse.Namespace) -> Reaction:
    """Compute and print the forces; return them."""
    given = [f"--{name}" for name in _OF_ONE_POSE if getattr(options, name) not in (None, False)]
    if given:
        raise InvalidInput(f"--to prints a table of poses: leave out {', '.join(given)}")
    if not 2 <= options.poses <= _MOST:
        raise InvalidInput(f"expected --poses from 2 to {_MOST}, got {options.poses}")
    end = numbers(options.to, "--to F,A,I as 3 numbers with commas between, degrees", 3)
    angles = np.linspace(pose_angles(options), end, options.poses)
    answer = exo.reaction(
        exo.pose(*angles.T),
        split=split,
        constraint_bounds=bounds,
        centre_offset=offset(options),
        limits=limits(options),
    )
    print(f"{exo.mechanism.title or exo.name}\n{exo.side} shoulder, {options.poses} poses; {moving_mass(exo)}\n")
    print(textwrap.fill(answer.verdict, 100))
    print(f"\n{_table(angles, answer)}\n")
    if (answer.has_answer & ~answer.can_hold).any():
        print("In a pose that is not held, the forces are those that the limbs would have to supply.")
    print(textwrap.fill(str(answer.certificate), 100))
    return answer


def _table(angles: FloatArray, answer: Reaction) -> str:
    held = np.where(answer.can_hold, "yes", np.where(answer.unknown, "not known", "no"))
    columns = dict(zip(("flexion, °", "abduction, °", "internal, °"), _written(angles.T, 1), strict=True))
    columns["|F_s|, N"] = _written(answer.magnitude[None], 1)[0]
    if answer.percent_body_weight is not None:
        columns["% of weight"] = _written(answer.percent_body_weight[None], 1)[0]
    tensions = _written(answer.actuator_forces.T, 1)
    columns |= {f"limb {i}, N": column for i, column in enumerate(tensions, start=1)}
    columns["held"] = held.tolist()
    widths = [max(len(name), *map(len, column)) for name, column in columns.items()]
    rows = [tuple(columns), *zip(*columns.values(), strict=True)]
    return "\n".join("  ".join(f"{cell:>{w}}" for cell, w in zip(row, widths, strict=True)) for row in rows)


def _written(columns: FloatArray, digits: int) -> list[list[str]]:
    """Numbers as texts, a dash for NaN, without a minus before zero."""
    rounded = np.round(columns, digits) + 0.0
    return [["-" if np.isnan(value) else f"{value:.{digits}f}" for value in column] for column in rounded]
