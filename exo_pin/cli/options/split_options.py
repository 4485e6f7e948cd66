"""Options of ``exo-pin reaction`` for the assumptions: splits, stiffness, offset of the device."""

from __future__ import annotations

import argparse
import textwrap
from collections.abc import Sequence
from dataclasses import replace
from typing import get_args

from scipy.spatial.transform import Rotation

from ...core.errors import InvalidInput, UnknownName
from ...design import LimbGuide, Shoulder
from ...exo.shoulder_exo import ShoulderExo
from ...reaction import ConstraintBounds, Reaction
from ...reaction.query import Split
from .query_options import limits

__all__ = ["add_splits", "answers_of", "certificates", "fitted", "offset_mm"]

_WIDTH = 100


def add_splits(parser: argparse.ArgumentParser) -> None:
    """Add the options of this module."""
    parser.add_argument(
        "--compare",
        metavar="SPLIT,...",
        help=f"columns, of {', '.join(get_args(Split))} (default: all that need no stiffness)",
    )
    parser.add_argument(
        "--offset",
        nargs=3,
        type=float,
        metavar=("X_MM", "Y_MM", "Z_MM"),
        help="of the device's centre from the shoulder's, forward, left and up, mm; base and cuff together",
    )
    parser.add_argument(
        "--shoulder-stiffness", type=float, metavar="N_PER_M", help="for elastic: K_s, the same in every direction"
    )
    parser.add_argument(
        "--guide",
        nargs=2,
        type=float,
        metavar=("EI", "GJ"),
        help="for elastic: bending and torsional rigidity of every limb's guide, N m² (default: as in the design)",
    )
    parser.add_argument(
        "--certificate",
        action="store_true",
        help="print the assumptions behind each number, and the data that would determine it",
    )


def fitted(exo: ShoulderExo, options: argparse.Namespace) -> ShoulderExo:
    """The design with the stiffnesses that the options give."""
    if options.shoulder_stiffness is not None:
        own = exo.mechanism.shoulder
        exo = exo.replace(shoulder=Shoulder(own.abduction_centre, own.half_diagonal, options.shoulder_stiffness))
    if options.guide is not None:
        guide = LimbGuide(*options.guide)
        exo = exo.replace(limbs=tuple(replace(limb, guide=guide) for limb in exo.limbs))
    return exo


def offset_mm(options: argparse.Namespace) -> tuple[float, ...]:
    """The offset as given."""
    return tuple(options.offset)


def answers_of(
    exo: ShoulderExo, orientation: Rotation, bounds: ConstraintBounds, options: argparse.Namespace
) -> list[Reaction]:
    """One result for each split, in the given order."""
    splits = _splits(exo, options.compare)
    if bounds is not None and "minimal" not in splits:
        raise InvalidInput("--side-force-limit belongs to minimal: name it in --compare")
    offset = None if options.offset is None else [1e-3 * value for value in options.offset]
    return [
        exo.reaction(
            orientation,
            split=split,
            constraint_bounds=bounds if split == "minimal" else None,
            centre_offset=offset,
            actuator_bounds=limits(options),
        )
        for split in splits
    ]


def certificates(answers: Sequence[Reaction], bounds: ConstraintBounds) -> str:
    """A sentence on every answer, with intervals under the bounds that were given."""
    lines = []
    for answer in answers:
        text = f"{answer.split}: {answer.certificate.under(bounds)}"
        lines.append(textwrap.fill(text, _WIDTH, subsequent_indent="  "))
    return "\n".join(lines)


def _splits(exo: ShoulderExo, names: str | None) -> list[str]:
    if names is None:
        forces = exo.mechanism.limb_count + int(exo.mechanism.is_upu.sum())
        return ["spherical", "minimal", "standalone"][: 3 if forces >= 6 else 2]
    splits = [name.strip() for name in names.split(",")]
    for name in splits:
        if name not in get_args(Split):
            raise UnknownName("split", name, get_args(Split))
    return list(dict.fromkeys(splits))
