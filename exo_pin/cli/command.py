"""From the words of a command to its files: parser and help, made by cyclopts from a function; printing and writing."""

from __future__ import annotations

import io
import re
from collections.abc import Callable, Iterable, Mapping, Sequence
from dataclasses import make_dataclass
from functools import partial
from json import dumps
from pathlib import Path
from typing import Annotated, Any

from cyclopts import App, CycloptsError, Parameter
from cyclopts.help import DefaultFormatter, PanelSpec
from docstring_parser import parse_from_object
from docstring_parser.common import Docstring
from rich import box
from rich.console import Console

from ..core.errors import ExoPinError, InvalidInput
from ..core.errors.base import shown
from ..core.files import (
    is_stream,
    require_ending,
    require_notes,
    require_writable,
    write_columns,
    write_figure,
    write_text,
)
from ..core.optional_packages import optional, require_extra
from ..core.results import plain
from ..core.validation import as_choice
from ..device.protocol import described
from . import COMMANDS, width

PICTURES = (".png", ".svg", ".pdf")
#: Several numbers of which the first is negative: a value, and no option.
_NEGATIVE = re.compile(r"^-\.?\d[\d.eE+,:-]*$")
#: What was asked, as it was typed: of a parameter that is no option.
Words = Annotated[Sequence[str], Parameter(parse=False)]


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
        function, bound, unread = app.parse_args(_joined(words), print_error=False, exit_on_error=False)
    except CycloptsError as error:
        if isinstance(error.__cause__, ExoPinError):
            raise error.__cause__ from None
        text = str(error).replace("into float", "into a number").replace("into int", "into a whole number")
        raise InvalidInput(f"{shown(' '.join(text.split()))} (see {app.name[0]} --help)") from None
    return int(function(*bound.args, **bound.kwargs, **dict.fromkeys(unread, words)) or 0)


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
    written = io.StringIO()
    console = Console(file=written, width=width())
    command(name).help_print([], console=console)
    lines = [line.rstrip() for line in written.getvalue().rstrip().splitlines()]
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
    if value is None or value is False or value in ((), ""):
        return None
    return f"{value:g}" if isinstance(value, float) else str(value)


def writes(
    *endings: str, json: bool = True, plot: str = "", also: Sequence[str] = ()
) -> Callable[[Callable[..., Any]], Callable[..., Any]]:
    """Give a command options of its own for what it prints and writes, as its parameter ``files``.

    Parameters
    ----------
    *endings : str
        Of the files that ``--out`` writes.
    json : bool
        Whether there is ``--json``.
    plot : str
        What ``--plot`` draws; there is no such option if it is empty.
    also : sequence of str
        Endings of ``--plot`` besides those of pictures.
    """
    fields: list[Any] = []
    if json:
        fields.append(("json", Annotated[bool, Parameter(help="Print JSON instead of text.")], False))
    fields.append(("out", _file("--out", "Also write the data", endings, bool(plot)), None))
    if plot:
        fields.append(("plot", _file("--plot", f"Also draw a picture to this file, {plot}", (*PICTURES, *also)), None))
    # The parser takes classes of the module types, which is that of classes made without one, for Python's own.
    own = {"__module__": __name__}
    made = Parameter(name="*")(make_dataclass("OwnFiles", fields, bases=(Files,), namespace=own, frozen=True))

    def with_files(function: Callable[..., Any]) -> Callable[..., Any]:
        function.__annotations__["files"] = made
        function.__kwdefaults__ = {**(function.__kwdefaults__ or {}), "files": made()}
        return function

    return with_files


def _file(option: str, said: str, endings: tuple[str, ...], picture: bool = False) -> Any:
    """The type of an option that names a file; ``picture`` tells that a picture is another option's."""
    check = partial(check_file, option, endings, picture)
    return Annotated[Path | None, Parameter(metavar="FILE", help=f"{said}: {', '.join(endings)}.", validator=check)]


def check_file(option: str, endings: tuple[str, ...], picture: bool, _: Any, path: Path | None) -> None:
    """Check the ending and the folder of a file that a command shall write, and that pictures can be drawn."""
    if path is None:
        return
    if picture and path.suffix.lower() in PICTURES and not is_stream(path):
        raise InvalidInput(f"expected {option} to end in {', '.join(endings)}; a picture is --plot {path}")
    require_ending(option, path, endings)
    require_writable(path)
    if path.suffix.lower() == ".csv" and not is_stream(path):
        require_notes(path)
    if path.suffix.lower() == ".xlsx":
        optional("study", "openpyxl")
    if option == "--plot" and set(PICTURES) & set(endings) and path.suffix.lower() != ".html":
        require_extra("plot")


class Files:
    """What a command prints, and the files that it writes."""

    json: bool = False
    out: Path | None = None
    plot: Path | None = None

    def deliver(
        self,
        text: object,
        answer: Any = None,
        *,
        data: Callable[[], Mapping[str, Any]] | None = None,
        exo: Any = None,
        columns: Callable[[], Mapping[str, Any]] | None = None,
        notes: Callable[[], Mapping[str, Any]] | None = None,
        save: Callable[[Path], Any] | None = None,
        figure: Callable[[], Any] | None = None,
        page: Callable[[], Any] | None = None,
    ) -> None:
        """Print an answer and write the files that were asked for.

        Parameters
        ----------
        text : object
            What a person reads.
        answer : object, optional
            An answer with ``document``, ``columns``, ``notes`` and ``plot``, for those of the callables below that are
            left out.
        data, columns, notes : callable, optional
            Make the document that ``--json`` prints and a .json file holds, what a .csv, .xlsx or .npz file holds, and
            what is to be known about such a table.
        exo : ShoulderExo, optional
            The device, which documents and notes describe.
        save : callable, optional
            Writes a file where there are no ``columns``.
        figure, page : callable, optional
            Make the picture, and the page.
        """
        out, plot = self.out, self.plot
        data, figure = data or getattr(answer, "document", None), figure or getattr(answer, "plot", None)
        columns = columns or (None if save else getattr(answer, "columns", None))
        written: tuple[Path | None, ...] = (out, plot)

        def about() -> dict[str, Any]:
            return {} if exo is None or not exo.has_arm else {"device": described(exo.device)}

        def as_json() -> str:
            return dumps(plain({**(data() if data else {}), **about()}), indent=2, ensure_ascii=False)

        try:
            print(as_json() if self.json and data is not None else text, flush=True)
        finally:
            # Also where a reader such as ``head`` has closed the pipe: a search of an hour is not lost for that.
            if out is not None:
                if data is not None and (out.suffix.lower() == ".json" or (columns is None and save is None)):
                    write_text(out, as_json() + "\n")
                elif columns is not None:
                    said = notes() if notes else getattr(answer, "notes", None)
                    written = (*write_columns(out, columns(), said and plain({**said, **about()})), plot)
                elif save is not None:
                    save(out)
            if plot is not None and page is not None and plot.suffix.lower() == ".html":
                page().save(plot)
            elif plot is not None and figure is not None:
                from ..view.plots.plot_style import pyplot

                pyplot().switch_backend("agg")  # to files only, so that no screen is needed
                write_figure(plot, figure())
        for path in written:
            if path is not None and not self.json:
                print(path)
