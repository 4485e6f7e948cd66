"""The parser of the command line: cyclopts makes options, checks and help from the function of a command."""

from __future__ import annotations

import io
import re
from collections.abc import Iterable
from typing import Any

from cyclopts import App, CycloptsError, Parameter
from cyclopts.help import DefaultFormatter, PanelSpec
from docstring_parser import parse_from_object
from docstring_parser.common import Docstring
from rich import box
from rich.console import Console

from ..core.errors import ExoPinError, InvalidInput
from ..core.errors.base import shown
from ..core.validation import as_choice
from . import COMMANDS, width

#: Several numbers of which the first is negative: a value, and no option.
_NEGATIVE = re.compile(r"^-\.?\d[\d.eE+,:-]*$")


def answer(name: str, words: list[str]) -> int:
    """Run a command, or print its help, and return the exit status.

    Raises
    ------
    InvalidInput
        If there is no such command, or its words are not as its function declares.
    """
    app = command(as_choice("command", name, COMMANDS))
    if {"-h", "--help"} & set(words):
        print(help_text(name))
        return 0
    try:
        function, bound, _ = app.parse_args(_joined(words), print_error=False, exit_on_error=False)
    except CycloptsError as error:
        if isinstance(error.__cause__, ExoPinError):
            raise error.__cause__ from None
        text = str(error).replace("into float", "into a number").replace("into int", "into a whole number")
        raise InvalidInput(f"{shown(' '.join(text.split()))} (see {app.name[0]} --help)") from None
    return int(function(*bound.args, **bound.kwargs) or 0)


def command(name: str) -> App:
    """The parser of a command."""
    function = COMMANDS[name].load(name)
    app = App(
        name=f"exo-pin {name}",
        help="\n\n".join(_paragraphs(parse_from_object(function))),
        help_format="markdown",
        help_flags=(),
        version_flags=(),
        help_formatter=DefaultFormatter(panel_spec=PanelSpec(box=box.SIMPLE, padding=(0, 0))),
        default_parameter=Parameter(
            negative_bool=(), negative_iterable=(), allow_repeating=True, show_default=shown_default
        ),
    )
    app.default(function)
    return app


def help_text(name: str) -> str:
    """The help of a command: what it answers, its options, and the examples and notes of its docstring."""
    console = Console(file=io.StringIO(), width=width())
    command(name).help_print([], console=console)
    lines = [line.rstrip() for line in console.file.getvalue().rstrip().splitlines()]
    text = "\n".join([*lines, "", "examples:", *(f"  {line}" for line in examples(name))])
    return "\n\n".join([text, *([notes(name)] if notes(name) else [])])


def examples(name: str) -> list[str]:
    """The commands under Examples in the docstring of a command."""
    said = parse_from_object(COMMANDS[name].load(name))
    return [line for each in said.examples for line in (each.description or "").splitlines() if line]


def notes(name: str) -> str:
    """What else a docstring says, as it stands."""
    said = parse_from_object(COMMANDS[name].load(name))
    return "\n".join(each.description or "" for each in said.meta if each.args[:1] == ["notes"])


def _paragraphs(said: Docstring) -> Iterable[str]:
    """Summary and description, each paragraph as one line, which the terminal breaks."""
    for text in (said.short_description, said.long_description):
        yield from (" ".join(part.split()) for part in (text or "").split("\n\n"))


def _joined(words: list[str]) -> list[str]:
    """``--limits -10,20`` as ``--limits=-10,20``, because what begins with a minus and is no number is an option."""
    joined: list[str] = []
    for word in words:
        if joined and joined[-1].startswith("--") and _NEGATIVE.match(word) and not _is_number(word):
            joined[-1] += f"={word}"
        else:
            joined.append(word)
    return joined


def _is_number(word: str) -> bool:
    try:
        float(word)
    except ValueError:
        return False
    return True


def shown_default(value: Any) -> str | None:
    """A default in the help; what is left out or empty has none."""
    if value is None or value is False or value == ():
        return None
    return f"{value:g}" if isinstance(value, float) else str(value)
