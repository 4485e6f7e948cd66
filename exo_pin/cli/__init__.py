"""The command ``exo-pin``: parse, call, print. One module a group of commands, each with ``add_commands``."""

from __future__ import annotations

import argparse
import sys
from collections.abc import Sequence
from typing import NoReturn

from .. import __version__
from ..errors import ExoPinError
from . import designs, dynamics, kinematics, mobility, muscles, reactions, source, studies, view

__all__ = ["main"]

_GROUPS = (reactions, studies, kinematics, designs, mobility, dynamics, muscles, view, source)


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
    except (ExoPinError, OSError) as error:
        print(f"exo-pin: {' '.join(str(error).split())}", file=sys.stderr)
        return 2


class _Parser(argparse.ArgumentParser):
    """A parser that answers a wrong command with one line."""

    def error(self, message: str) -> NoReturn:
        self.exit(2, f"exo-pin: {message} ({self.prog} --help tells more)\n")


def _parser() -> argparse.ArgumentParser:
    parser = _Parser(
        prog="exo-pin", description="What force does a parallel shoulder exoskeleton put on the shoulder joint?"
    )
    parser.add_argument("--version", action="version", version=__version__)
    commands = parser.add_subparsers(required=True, metavar="COMMAND")
    for group in _GROUPS:
        group.add_commands(commands)
    return parser
