"""The command ``exo-pin``: parse, call, print. One module a group of commands, with a function ``run_...`` for each.

They stand in ``commands.toml`` and their options in ``options.toml``. A command's module is imported when it is called,
so that help comes at once: ``exo-pin --help`` and ``--version`` need neither physics nor the package's reader of TOML.
"""

from __future__ import annotations

import argparse
import contextlib
import os
import re
import signal
import sys
import textwrap
import tomllib
import warnings
from collections.abc import Callable, Mapping, Sequence
from functools import cache
from importlib import import_module
from pathlib import Path
from pkgutil import resolve_name
from typing import Any, NamedTuple, NoReturn

from .. import __version__
from .terminal import make_output_printable

#: A shell adds this to the number of the signal that has ended a program.
_SIGNALLED = 128
#: Columns of a description in a help text.
_WIDTH = 79
PICTURES = (".png", ".svg", ".pdf")
#: Keys of an option that say which kind of value it has, and how it is called in the help.
_KINDS = {"number": float, "count": int, "path": Path, "text": str}
#: Keys that argparse has, too.
_AS_THEY_ARE = ("dest", "nargs", "const", "required", "choices", "default")
#: Options that name a file to write.
_FILES = ("out", "plot")


def _read(name: str) -> dict[str, Any]:
    return tomllib.loads((Path(__file__).parent / "options" / name).read_text(encoding="utf-8"))


class Command(NamedTuple):
    """A command: its module in :mod:`exo_pin.cli`, and the texts of its help."""

    module: str
    help: str
    description: str
    examples: list[str]
    notes: str = ""


COMMANDS = {name: Command(**entry) for name, entry in _read("commands.toml").items()}


def main(arguments: Sequence[str] | None = None) -> int:
    """Run the command line.

    Parameters
    ----------
    arguments : sequence of str, optional
        Without the program's name; those of the process if left out.

    Returns
    -------
    int
        Exit status: 0; 1 for a design that a check finds inconsistent, and for an export of which something is in no
        file; 2 for wrong input and for what cannot be read or written; 130 after Ctrl-C; 141 if the reader of the
        answer has ended (``exo-pin ... | head -1``). The last two are what a shell reports of programs that these
        signals end.
    """
    if arguments is None:
        warnings.showwarning = _show_warning
        make_output_printable()
    try:
        try:
            given = _help_first(sys.argv[1:] if arguments is None else list(arguments))
            options = _parser(given).parse_args(given)
            if any(getattr(options, name, None) is not None for name in (*_FILES, "folder")) or _extras(options):
                import_module(".options.query_options", __name__).check_outputs(options, _extras(options))
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
            for text in (str(error), *getattr(error, "__notes__", ())):
                print(f"exo-pin: {' '.join(text.split())}", file=sys.stderr)
        return 2


def _extras(options: argparse.Namespace) -> list[str]:
    """Extras that a command needs with these options."""
    given = getattr(options, "extras", {})
    return [extra for name, extra in given.items() if name == "always" or getattr(options, name, None)]


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
    called = COMMANDS.get(name)
    if called is not None:
        module = import_module(f".{called.module}", __name__)
        own = commands.add_parser(name, help=called.help)
        _describe(own, called)
        parsers = {name: own}
        if inner := _subcommands(name):
            add = own.add_subparsers(required=True, metavar="COMMAND").add_parser
            parsers = {word: add(word.removeprefix(f"{name}-"), help=text) for word, text in inner.items()}
        for word, each in parsers.items():
            _add_options(each, word)
            each.set_defaults(run=getattr(module, f"run_{word.replace('-', '_')}"))
        parser.prog = own.prog  # an option that the command lacks is reported by the parser above it
    for other, command in COMMANDS.items():
        if other != name:
            commands.add_parser(other, help=command.help)
    return parser


@cache
def _table() -> dict[str, Any]:
    return _read("options.toml")


def _subcommands(name: str) -> dict[str, str]:
    """Commands within a command, such as ``muscle-force``, and their lines of help."""
    return {each: entry["help"] for each, entry in _table().items() if each.startswith(f"{name}-") and "help" in entry}


def _add_options(parser: argparse.ArgumentParser, name: str) -> None:
    """Give the parser of a command its options."""
    table = _table()
    own = table.get(name, {})
    options: dict[str, Any] = {}
    for group in own.get("shared", ()):
        options |= table["shared"][group]
    either = own.get("one_of", ())
    group = parser.add_mutually_exclusive_group(required=True) if either else None
    for option, entry in (options | own.get("options", {})).items():
        to = group if group is not None and option in either else parser
        _add(to, option, {key: _resolved(value) for key, value in entry.items()})
    _add_outputs(parser, tuple(own.get("out", ())), own.get("plot", ""), own.get("pages", ""))
    if "pictures" in own:
        parser.set_defaults(endings={"plot": own["pictures"]})
    if "needs" in own:
        parser.set_defaults(extras=own["needs"])


def _resolved(value: Any) -> Any:
    """A value, or what it names in the package: words, or a function that returns them."""
    if isinstance(value, dict):
        return {key: _resolved(each) for key, each in value.items()}
    if not isinstance(value, str) or not value.startswith("@"):
        return value
    found = resolve_name(f"exo_pin.{value[1:]}")
    return found() if callable(found) else found


def _add(parser: argparse._ActionsContainer, name: str, entry: dict[str, Any]) -> None:
    """Add one option."""
    how = {key: entry[key] for key in _AS_THEY_ARE if key in entry}
    for key, kind in _KINDS.items():
        if key in entry:
            called = entry[key]
            how |= {"type": kind, "metavar": tuple(called) if isinstance(called, list) else called}
    if "choices" in how:
        how["choices"] = tuple(how["choices"])
    if isinstance(how.get("default"), tuple):
        how["default"] = _joined(how["default"], ",")
    if "yes_or_no" in entry:
        how["action"] = argparse.BooleanOptionalAction
    elif "repeated" in entry:
        how |= {"action": "append", "default": []}
    elif not {"type", "choices"} & set(how):
        how["action"] = "store_true"
    said = entry["help"].format_map({key: _joined(value, ", ") for key, value in entry.get("names", {}).items()})
    if "default" in entry and "default" not in said:
        said += f" (default {_joined(how['default'], ',')})"
    parser.add_argument(name, **how, help=said)


def _joined(value: Any, between: str) -> str:
    """A word, a number, or several with something between them."""
    several = (value,) if isinstance(value, str | float | int) else value
    return between.join(f"{each:g}" if isinstance(each, float) else str(each) for each in several)


def _add_outputs(parser: argparse.ArgumentParser, endings: tuple[str, ...], plot: str, pages: str) -> None:
    """Add ``--out`` for files with these endings, ``--json`` where one is .json, and ``--plot``."""
    if ".json" in endings:
        parser.add_argument("--json", action="store_true", help="print JSON instead of text")
    if endings:
        parser.add_argument("--out", type=Path, metavar="FILE", help=f"also write the data: {', '.join(endings)}")
    if plot:
        shown = f"{plot}: {', '.join(PICTURES)}" + (f"; {pages}: .html" if pages else "")
        parser.add_argument("--plot", type=Path, metavar="FILE", help=f"also draw a picture to this file, {shown}")
    if endings or plot:
        parser.set_defaults(
            endings={"out": endings} | ({"plot": (*PICTURES, ".html") if pages else PICTURES} if plot else {})
        )


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
    files = [path for name in _FILES if (path := getattr(options, name, None)) is not None]
    try:
        print(json() if plain and json is not None else text, flush=True)
    finally:
        # Also where a reader such as ``head`` has closed the pipe: a search of an hour is not lost for that.
        if files:
            import_module(".options.query_options", __name__).write_outputs(options, json, columns, save, figure, page)
    for path in files if not plain else ():
        print(path)
