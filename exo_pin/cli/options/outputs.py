"""Where results go: text on the screen or JSON, ``--out`` for data and ``--plot`` for a picture.

A command says which endings it can write. All of it is checked before the command begins its work
(:func:`check_outputs`), and written in one place (:func:`deliver`).
"""

from __future__ import annotations

import argparse
from collections.abc import Callable, Mapping
from pathlib import Path
from typing import Any

from ...core.errors import InvalidInput
from ...core.errors.extras import require_extra
from ...core.files import (
    is_stream,
    require_ending,
    require_folder,
    require_writable,
    write_columns,
    write_figure,
    write_text,
)

__all__ = ["PICTURES", "add_moved", "add_outputs", "check_outputs", "deliver", "needs"]

PICTURES = (".png", ".svg", ".pdf")


def add_outputs(parser: argparse.ArgumentParser, *endings: str, plot: str = "", pages: str = "") -> None:
    """Add ``--out`` for files with these endings, ``--json`` where one is .json, and ``--plot``.

    Parameters
    ----------
    parser : argparse.ArgumentParser
        Of the command.
    *endings : str
        What the command can write as data.
    plot : str
        What its picture shows; none if empty.
    pages : str
        What it can write as a page (.html) besides.
    """
    pictures: tuple[str, ...] = (*PICTURES, ".html") if pages else PICTURES
    if ".json" in endings:
        parser.add_argument("--json", action="store_true", help="print JSON instead of text")
    if endings:
        parser.add_argument("--out", type=Path, metavar="FILE", help=f"write the data too: {', '.join(endings)}")
    if plot:
        shown = f"{plot}: {', '.join(PICTURES)}" + (f"; {pages}: .html" if pages else "")
        parser.add_argument("--plot", type=Path, metavar="FILE", help=f"write a picture too, {shown}")
    parser.set_defaults(endings={"out": endings} | ({"plot": pictures} if plot else {}))


def needs(parser: argparse.ArgumentParser, **extras: str) -> None:
    """Say which extra each option needs; ``always`` is for the whole command."""
    parser.set_defaults(extras=extras)


def add_moved(parser: argparse.ArgumentParser, **moved: str) -> None:
    """Refuse options of earlier releases, each with what is given in its place."""
    for name, now in moved.items():
        parser.add_argument(f"--{name.replace('_', '-')}", action=_Moved, const=now, nargs="*", help=argparse.SUPPRESS)


class _Moved(argparse.Action):
    def __init__(self, *args: Any, **options: Any) -> None:
        super().__init__(*args, **{**options, "default": argparse.SUPPRESS})

    def __call__(self, parser: argparse.ArgumentParser, _: Any, __: Any, option: str | None = None) -> None:
        parser.error(f"{option} is now {self.const}")


def check_outputs(options: argparse.Namespace) -> None:
    """Check endings, folders and extras of what a command shall write.

    Raises
    ------
    InvalidInput
        If a file has an ending that the command cannot write, or cannot be written where it shall be.
    MissingExtra
        If an extra is needed that is not installed.
    """
    for name, endings in getattr(options, "endings", {}).items():
        path = getattr(options, name, None)
        if path is None:
            continue
        if name == "out" and "plot" in options and path.suffix.lower() in PICTURES and not is_stream(path):
            raise InvalidInput(f"expected --out to end in {', '.join(endings)}; a picture is --plot {path}")
        require_ending(f"--{name}", path, endings)
        require_writable(path)
        if name == "plot" and path.suffix.lower() != ".html":
            require_extra("plot")
    if getattr(options, "folder", None) is not None:
        require_folder(options.folder)
    for name, extra in getattr(options, "extras", {}).items():
        if name == "always" or getattr(options, name, None):
            require_extra(extra)


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
    out, plot = getattr(options, "out", None), getattr(options, "plot", None)
    if out is not None:
        if json is not None and (out.suffix.lower() == ".json" or (columns is None and save is None)):
            write_text(out, json() + "\n")
        elif columns is not None:
            write_columns(out, columns())
        elif save is not None:
            save(out)
    if plot is not None and page is not None and plot.suffix.lower() == ".html":
        page().save(plot)
    elif plot is not None and figure is not None:
        from ...view.plots.force_plots import use_file_backend

        use_file_backend()
        write_figure(plot, figure(), dpi=120)
    for path in (out, plot):
        if path is not None and not plain:
            print(path)
