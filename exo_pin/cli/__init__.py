"""The command ``exo-pin``: parse, call, print. One module a group of commands, each with ``add_commands``."""

from __future__ import annotations

import argparse
import contextlib
import os
import signal
import sys
from collections.abc import Sequence
from typing import NoReturn

from .. import __version__
from ..core.errors import ExoPinError
from . import (
    design_commands,
    forces_command,
    kinematics_commands,
    mobility_command,
    muscle_commands,
    reaction_command,
    sweep_command,
    thesis_command,
    view_command,
)

__all__ = ["main"]

_GROUPS = (
    reaction_command,
    sweep_command,
    kinematics_commands,
    design_commands,
    mobility_command,
    forces_command,
    muscle_commands,
    view_command,
    thesis_command,
)

#: A shell adds this to the number of the signal that has ended a program.
_SIGNALLED = 128


def main(arguments: Sequence[str] | None = None) -> int:
    """Run the command line.

    Parameters
    ----------
    arguments : sequence of str, optional
        Without the program's name; those of the process if left out.

    Returns
    -------
    int
        Exit status: 0; 1 for a design that a check finds inconsistent; 2 for wrong input and for what cannot be read
        or written; 130 after Ctrl-C; 141 if the reader of the answer has ended (``exo-pin ... | head -1``). The last
        two are what a shell reports of programs that these signals end.
    """
    try:
        try:
            options = _parser().parse_args(arguments)
            return int(options.run(options))
        finally:
            # Here, because an error at the end of the program could not be reported any more.
            if sys.stdout is not None:
                sys.stdout.flush()
    except KeyboardInterrupt:
        return _SIGNALLED + signal.SIGINT
    except BrokenPipeError:
        _drop_output()
        return _SIGNALLED + signal.SIGPIPE
    except (ExoPinError, OSError) as error:
        _drop_output()
        with contextlib.suppress(OSError):
            print(f"exo-pin: {' '.join(str(error).split())}", file=sys.stderr)
        return 2


def _drop_output() -> None:
    """Give up what has not been printed if it cannot be: Python would try again, and fail, at its end."""
    try:
        if sys.stdout is not None:
            sys.stdout.flush()
    except OSError:
        nowhere = os.open(os.devnull, os.O_WRONLY)
        os.dup2(nowhere, sys.stdout.fileno())
        os.close(nowhere)


class _Parser(argparse.ArgumentParser):
    """A parser that answers a wrong command with one line."""

    def error(self, message: str) -> NoReturn:
        self.exit(2, f"exo-pin: {message} (see {self.prog} --help)\n")


def _parser() -> argparse.ArgumentParser:
    parser = _Parser(
        prog="exo-pin", description="What force does a parallel shoulder exoskeleton put on the shoulder joint?"
    )
    parser.add_argument("--version", action="version", version=__version__)
    commands = parser.add_subparsers(required=True, metavar="COMMAND")
    for group in _GROUPS:
        group.add_commands(commands)
    return parser
