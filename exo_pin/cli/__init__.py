"""The command ``exo-pin``: parse, call, print. One module a group of commands, with a function ``run_...`` for each.

Their options stand in ``options.toml``. Modules are imported when their command is called, so that help and wrong
commands are answered at once.
"""

from __future__ import annotations

import argparse
import contextlib
import os
import re
import signal
import sys
import textwrap
import warnings
from collections.abc import Callable, Mapping, Sequence
from importlib import import_module
from pathlib import Path
from typing import Any, NoReturn

from .. import __version__
from .options.command_list import COMMANDS, RENAMED, Command
from .options.option_table import add_options, subcommands

__all__ = ["deliver", "joined_json", "main"]

#: A shell adds this to the number of the signal that has ended a program.
_SIGNALLED = 128
#: Columns of a description in a help text.
_WIDTH = 79
#: Options that name a file to write.
_FILES = ("out", "plot")


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
    if arguments is None:
        warnings.showwarning = _show_warning
    try:
        try:
            given = _help_first(sys.argv[1:] if arguments is None else list(arguments))
            options = _parser(given).parse_args(given)
            if any(getattr(options, name, None) is not None for name in (*_FILES, "folder")) or _extras(options):
                import_module(".options.outputs", __name__).check_outputs(options, _extras(options))
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
    except Exception as error:
        from ..core.errors import ExoPinError  # here, because --help needs no NumPy

        if not isinstance(error, (ExoPinError, OSError)):
            raise
        _drop_output()
        with contextlib.suppress(OSError):
            print(f"exo-pin: {' '.join(str(error).split())}", file=sys.stderr)
        return 2


def _extras(options: argparse.Namespace) -> list[str]:
    """Extras that a command needs with these options."""
    return [
        extra
        for name, extra in getattr(options, "extras", {}).items()
        if name == "always" or getattr(options, name, None)
    ]


def _show_warning(message: Warning | str, *_: Any, **__: Any) -> None:
    """Print a warning as one line, without the place in the code where it was raised."""
    with contextlib.suppress(OSError):
        print(f"exo-pin: {' '.join(str(message).split())}", file=sys.stderr)


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
    """A parser that answers a wrong command with one line, and takes values such as -5 and -10,20 after an option."""

    def __init__(self, *args: Any, **options: Any) -> None:
        super().__init__(*args, **options)
        # argparse takes a word that begins with a minus for an option unless this matches it.
        self._negative_number_matcher = re.compile(r"^-\.?\d[\d.eE+,:-]*$")

    def error(self, message: str) -> NoReturn:
        from ..core.errors.base import shown  # here: help needs no errors

        self.exit(2, f"exo-pin: {shown(message)} (see {self.prog} --help)\n")


def _help_first(arguments: list[str]) -> list[str]:
    """A command with --help anywhere prints help, also as the value of an option that still lacks one."""
    if not {"-h", "--help"} & set(arguments):
        return arguments
    words = [*arguments, "--help"]
    return [*words[: next(k for k, word in enumerate(words) if word.startswith("-"))], "--help"]


def _describe(parser: argparse.ArgumentParser, command: Command) -> None:
    """Add what a command answers, and examples, to its help."""
    parser.formatter_class = argparse.RawDescriptionHelpFormatter
    parser.description = textwrap.fill(command.description, _WIDTH)
    examples = "".join(f"  {line}\n" for line in command.examples)
    parser.epilog = f"examples:\n{examples}" + (f"\n{command.notes}" if command.notes else "")


def _parser(arguments: Sequence[str]) -> argparse.ArgumentParser:
    """The parser, with the options of the command that is called and only the names of the others."""
    parser = _Parser(
        prog="exo-pin",
        description="What force does a parallel shoulder exoskeleton put on the shoulder joint?",
        epilog="Begin with: exo-pin reaction four-cables --flexion 60. "
        "Each command has examples: exo-pin COMMAND --help.",
    )
    parser.add_argument("--version", action="version", version=__version__)
    commands = parser.add_subparsers(required=True, metavar="COMMAND")
    name = next((argument for argument in arguments if not argument.startswith("-")), "")
    if name in RENAMED:
        parser.error(f"{name} is now {RENAMED[name]}")
    called = COMMANDS.get(name)
    if called is not None:
        module = import_module(f".{called.module}", __name__)
        own = commands.add_parser(name, help=called.help)
        _describe(own, called)
        parsers = {name: own}
        if inner := subcommands(name):
            add = own.add_subparsers(required=True, metavar="COMMAND").add_parser
            parsers = {word: add(word.removeprefix(f"{name}-"), help=text) for word, text in inner.items()}
        for word, each in parsers.items():
            add_options(each, word)
            each.set_defaults(run=getattr(module, f"run_{word.replace('-', '_')}"))
    for other, command in COMMANDS.items():
        if other != name:
            commands.add_parser(other, help=command.help)
    return parser


def joined_json(exo: Any, **answers: Any) -> str:
    """Several answers on a design as one JSON text, each under its name with its own fields; None where none is."""
    from json import dumps

    from ..core.results import plain

    return dumps(plain({"mechanism": exo.name, "side": exo.side, **answers}), indent=2)


def deliver(
    options: argparse.Namespace,
    text: object,
    *,
    json: Callable[[], str] | None = None,
    columns: Callable[[], Mapping[str, Any]] | None = None,
    save: Callable[[Path], Any] | None = None,
    figure: Callable[[], Any] | None = None,
    page: Callable[[], Any] | None = None,
) -> None:
    """Print an answer and write the files that were asked for.

    Parameters
    ----------
    options : argparse.Namespace
        Of the command.
    text : object
        What a person reads.
    json, columns : callable, optional
        Make what ``--json`` prints and a .json file holds, and what a .csv or .npz file holds.
    save : callable, optional
        Writes a file of another ending, or of all where there are no ``columns``.
    figure, page : callable, optional
        Make the picture, and the page.
    """
    plain = getattr(options, "json", False)
    print(json() if plain and json is not None else text)
    files = [path for name in _FILES if (path := getattr(options, name, None)) is not None]
    if files:
        import_module(".options.outputs", __name__).write_outputs(options, json, columns, save, figure, page)
    for path in files if not plain else ():
        print(path)
