"""Options of ``exo-pin reaction`` on what is assumed: which splits, what stiffness, how well the device fits."""

from __future__ import annotations

import argparse
import textwrap
from collections.abc import Sequence
from dataclasses import replace

from scipy.spatial.transform import Rotation

from ...core.errors import ExoPinError, InvalidInput, UnknownName
from ...design import LimbGuide, Shoulder
from ...exo.shoulder_exo import ShoulderExo
from ...reaction import ConstraintBounds, Reaction, Split
from ...reaction.splits.registry import SPLITS
from .centre_options import add_offset
from .query_options import limits

__all__ = ["add_splits", "answers_of", "certificates", "fitted"]

_WIDTH = 100


def add_splits(parser: argparse.ArgumentParser) -> None:
    """Add the options of this module."""
    parser.add_argument(
        "--split",
        choices=tuple(SPLITS),
        help="assumption on the side forces of the limbs (default: elastic where all stiffnesses are known, minimal "
        "with --side-force-limit, else spherical)",
    )
    parser.add_argument(
        "--compare",
        nargs="?",
        const="",
        metavar="SPLIT,...",
        help=f"a table with a column for each of {', '.join(SPLITS)} (default: all that need no stiffness)",
    )
    add_offset(parser)
    parser.add_argument(
        "--shoulder-stiffness",
        type=float,
        metavar="N_PER_M",
        help="for --split elastic: stiffness of the shoulder in every direction, N/m (default: as the design says)",
    )
    parser.add_argument(
        "--guide",
        nargs=2,
        type=float,
        metavar=("EI", "GJ"),
        help="for --split elastic: bending and torsional rigidity of every limb's guide, N m² (default: as designed)",
    )
    parser.add_argument(
        "--certificate",
        action="store_true",
        help="print the assumption behind each number, and what would determine it",
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


def answers_of(
    exo: ShoulderExo, orientation: Rotation, bounds: ConstraintBounds, options: argparse.Namespace
) -> list[Reaction]:
    """One answer a split, in the order given."""
    if options.compare is not None and options.split is not None:
        raise InvalidInput("expected either --split or --compare, got both")
    splits = [chosen_split(exo, bounds, options)] if options.compare is None else _splits(exo, options.compare)
    bounded = _bounded()
    if bounds is not None and not set(bounded) & set(splits):
        raise InvalidInput(f"--side-force-limit belongs to {', '.join(bounded)}: name it in --split or --compare")
    offset = None if options.offset is None else [1e-3 * value for value in options.offset]
    return [
        exo.holding_reaction(
            orientation,
            split=split,
            constraint_bounds=bounds if split in bounded else None,
            centre_offset=offset,
            actuator_bounds=limits(options),
        )
        for split in splits
    ]


def chosen_split(exo: ShoulderExo, bounds: ConstraintBounds, options: argparse.Namespace) -> str:
    """The split of a query with one column: as given, or the one that fits the limbs."""
    if options.split is not None:
        return str(options.split)
    if bounds is not None:
        return _bounded()[0]
    stiff = exo.mechanism.shoulder.stiffness is not None
    return "elastic" if stiff and _fits(SPLITS["elastic"], exo) else "spherical"


def _bounded() -> list[str]:
    """Splits that take bounds of the side forces."""
    return [name for name, law in SPLITS.items() if "constraint_bounds" in law.options]


def certificates(answers: Sequence[Reaction], bounds: ConstraintBounds) -> str:
    """A sentence on every answer, with intervals under the bounds that were given."""
    lines = []
    for answer in answers:
        text = f"{answer.split}: {answer.certificate.under(bounds)}"
        lines.append(textwrap.fill(text, _WIDTH, subsequent_indent="  "))
    return "\n".join(lines)


def _splits(exo: ShoulderExo, wanted: str) -> list[str]:
    if not wanted:
        return [name for name, law in SPLITS.items() if not law.determines_sides and _fits(law, exo)]
    splits = [name.strip() for name in wanted.split(",")]
    for name in splits:
        if name not in SPLITS:
            raise UnknownName("split", name, tuple(SPLITS))
    return list(dict.fromkeys(splits))


def _fits(law: Split, exo: ShoulderExo) -> bool:
    """Whether a design can be split in this way."""
    try:
        law.check(exo.mechanism)
    except ExoPinError:
        return False
    return True
