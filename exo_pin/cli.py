"""The command ``exo-pin``: parse, call, print."""

from __future__ import annotations

import argparse
import json
import sys
from collections.abc import Sequence
from pathlib import Path

from . import __version__
from .chain import PARTS, write_published_urdf
from .conventions import shoulder_rotation
from .design import Arm, preset, presets
from .errors import ExoPinError, InvalidInput
from .exo import ShoulderExo, load
from .reaction import Reaction, reaction_table
from .thesis import ledger, ledger_table

__all__ = ["main"]


def main(arguments: Sequence[str] | None = None) -> int:
    """Run the command line.

    Parameters
    ----------
    arguments : sequence of str, optional
        Without the program's name; those of the process if left out.

    Returns
    -------
    int
        Exit status: 0, 1 for a design that a check finds inconsistent, 2 for a question that cannot be asked.
    """
    options = _parser().parse_args(arguments)
    try:
        return int(options.run(options))
    except ExoPinError as error:
        print(f"exo-pin: {' '.join(str(error).split())}", file=sys.stderr)
        return 2
    except OSError as error:
        print(f"exo-pin: {error}", file=sys.stderr)
        return 2


def _parser() -> argparse.ArgumentParser:
    parser = argparse.ArgumentParser(
        prog="exo-pin", description="What force does a parallel shoulder exoskeleton put on the shoulder joint?"
    )
    parser.add_argument("--version", action="version", version=__version__)
    commands = parser.add_subparsers(required=True, metavar="COMMAND")

    reaction = commands.add_parser("reaction", help="forces on shoulder, limbs, cuff and torso in a pose")
    _add_design(reaction)
    for name, text in (
        ("flexion", "arm forward"),
        ("abduction", "arm away from the body"),
        ("internal-rotation", "arm turned inward about its own axis"),
    ):
        reaction.add_argument(f"--{name}", type=float, default=0.0, metavar="DEG", help=f"{text}, degrees (default 0)")
    reaction.add_argument("--person", metavar="HEIGHT,MASS,SEX", help="who wears it, such as 1.75,75,male (m, kg)")
    reaction.add_argument("--elbow-flexion", type=float, default=0.0, metavar="DEG", help="of that person, degrees")
    reaction.add_argument("--payload", type=float, default=0.0, metavar="KG", help="in that person's hand, kg")
    reaction.add_argument("--json", action="store_true", help="print JSON instead of a table")
    reaction.set_defaults(run=_reaction)

    check = commands.add_parser("check", help="kinematic consistency of a design")
    _add_design(check)
    check.set_defaults(run=_check)

    listing = commands.add_parser("presets", help="the published mechanisms that come with the package")
    listing.set_defaults(run=_presets)

    urdf = commands.add_parser("urdf", help="write a design as URDF with its closures file")
    _add_design(urdf, "?")
    urdf.add_argument("--out", type=Path, default=Path(), metavar="FOLDER", help="folder to write to (default: here)")
    urdf.add_argument("--part", choices=PARTS, default="whole")
    urdf.add_argument("--published", action="store_true", help="write all published mechanisms, as in urdf/")
    urdf.set_defaults(run=_urdf)

    thesis = commands.add_parser("thesis", help="what the thesis prints beside what is computed")
    thesis.add_argument("--no-notes", action="store_true", help="leave out the column of notes")
    thesis.set_defaults(run=_thesis)
    return parser


def _add_design(parser: argparse.ArgumentParser, count: str = "?") -> None:
    parser.add_argument("design", nargs=count, default="prototype", metavar="PRESET|FILE", help="default: prototype")
    parser.add_argument("--side", choices=("left", "right"), help="side of the body (default: as the design says)")


def _person(text: str, elbow_flexion: float, payload: float) -> Arm:
    parts = [part.strip() for part in text.split(",")]
    try:
        height, mass, sex = parts
        numbers = float(height), float(mass)
    except ValueError:
        raise InvalidInput(f"expected --person HEIGHT,MASS,SEX such as 1.75,75,male, got {text!r}") from None
    return Arm.from_anthropometry(*numbers, sex=sex, elbow_flexion=elbow_flexion, payload=payload, degrees=True)


def _design(options: argparse.Namespace) -> ShoulderExo:
    exo = load(options.design, side=options.side)
    if options.person is not None:
        return exo.worn_by(_person(options.person, options.elbow_flexion, options.payload))
    if options.payload or options.elbow_flexion:
        raise InvalidInput("--payload and --elbow-flexion belong to a person's arm: give --person too")
    return exo


def _reaction(options: argparse.Namespace) -> int:
    exo = _design(options)
    angles = (options.flexion, options.abduction, options.internal_rotation)
    pose = shoulder_rotation(*angles, side=exo.side, degrees=True)
    splits = ["spherical", "minimal"] + ["standalone"] * bool(exo.mechanism.is_upu.sum() >= 3)
    answers = [exo.reaction(pose, split=split) for split in splits]
    if options.json:
        print(_json(exo, angles, answers))
        return 0
    print(
        f"{exo.mechanism.title or exo.name}\n"
        f"{exo.side} shoulder at flexion {angles[0]:g}°, abduction {angles[1]:g}°, internal rotation {angles[2]:g}°; "
        f"{_carried(exo)}\n"
    )
    print(reaction_table(answers))
    return 0


def _carried(exo: ShoulderExo) -> str:
    arm = exo.mechanism.require_arm("weight")
    own = arm.person
    if own is None:
        return f"moving part of the device {arm.mass:.3g} kg, nobody's arm in it"
    return f"arm {own.mass:.3g} kg, moving part of the device {arm.mass - own.mass:.3g} kg"


def _json(exo: ShoulderExo, angles: tuple[float, float, float], answers: Sequence[Reaction]) -> str:
    names = ("flexion_deg", "abduction_deg", "internal_rotation_deg")
    head = {"mechanism": exo.name, "side": exo.side, "pose": dict(zip(names, angles, strict=True))}
    return json.dumps({**head, **{answer.split: json.loads(answer.to_json()) for answer in answers}}, indent=2)


def _check(options: argparse.Namespace) -> int:
    report = load(options.design, side=options.side).check()
    print(report)
    return 0 if report.passed else 1


def _presets(_: argparse.Namespace) -> int:
    width = max(len(name) for name in presets())
    for name in presets():
        print(f"{name:{width}}  {preset(name).title}")
    return 0


def _urdf(options: argparse.Namespace) -> int:
    if options.published:
        written = write_published_urdf(options.out)
    else:
        urdf = load(options.design, side=options.side).to_urdf(options.out, options.part)
        written = [urdf, urdf.with_suffix(".closures.toml")]
    for path in written:
        print(path)
    return 0


def _thesis(options: argparse.Namespace) -> int:
    rows = ledger()
    print(ledger_table(rows, notes=not options.no_notes))
    counts = {
        verdict: sum(row.verdict == verdict for row in rows) for verdict in dict.fromkeys(r.verdict for r in rows)
    }
    print("\n" + ", ".join(f"{count} {verdict}" for verdict, count in counts.items()))
    return 0


if __name__ == "__main__":
    sys.exit(main())
