"""Files of ``--out`` and ``--plot``: checked before a command begins its work, and written after it."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from functools import partial
from json import dumps
from pathlib import Path
from typing import Any

from cyclopts import Parameter

from ..core.errors import InvalidInput
from ..core.errors.inputs import require_extra
from ..core.files import is_stream, require_ending, require_writable, write_columns, write_figure, write_text
from ..core.results import plain

PICTURES = (".png", ".svg", ".pdf")


def writes(*endings: str, picture: bool = True) -> Parameter:
    """``--out`` of files with these endings; ``picture`` tells that the command has ``--plot``, too."""
    check = partial(check_file, "--out", endings, picture)
    return Parameter(metavar="FILE", help=f"Also write the data: {', '.join(endings)}.", validator=check)


def draws(what: str, *more: str) -> Parameter:
    """``--plot`` of a picture, and of what the endings ``more`` name."""
    endings = (*PICTURES, *more)
    said = f"Also draw a picture to this file, {what}: {', '.join(endings)}."
    return Parameter(metavar="FILE", help=said, validator=partial(check_file, "--plot", endings, False))


def check_file(option: str, endings: tuple[str, ...], picture: bool, _: Any, path: Path | None) -> None:
    """Check the ending and the folder of a file that a command shall write, and that pictures can be drawn."""
    if path is None:
        return
    if picture and path.suffix.lower() in PICTURES and not is_stream(path):
        raise InvalidInput(f"expected {option} to end in {', '.join(endings)}; a picture is --plot {path}")
    require_ending(option, path, endings)
    require_writable(path)
    if option == "--plot" and set(PICTURES) & set(endings) and path.suffix.lower() != ".html":
        require_extra("plot")


def deliver(
    text: object,
    answer: Any = None,
    *,
    out: Path | None = None,
    plot: Path | None = None,
    json: bool = False,
    as_json: Callable[[], str] | None = None,
    columns: Callable[[], Mapping[str, Any]] | None = None,
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
        An answer with ``to_json``, ``columns`` and ``plot``, for those of the callables below that are left out.
    out, plot, json : optional
        The options of these names.
    as_json, columns : callable, optional
        Make what ``--json`` prints and a .json file holds, and what a .csv or .npz file holds.
    save : callable, optional
        Writes a file of another ending, or of all where there are no ``columns``.
    figure, page : callable, optional
        Make the picture, and the page.
    """
    as_json, figure = as_json or getattr(answer, "to_json", None), figure or getattr(answer, "plot", None)
    columns = columns or (None if save else getattr(answer, "columns", None))
    try:
        print(as_json() if json and as_json is not None else text, flush=True)
    finally:
        # Also where a reader such as ``head`` has closed the pipe: a search of an hour is not lost for that.
        if out is not None:
            if as_json is not None and (out.suffix.lower() == ".json" or (columns is None and save is None)):
                write_text(out, as_json() + "\n")
            elif columns is not None:
                write_columns(out, columns())
            elif save is not None:
                save(out)
        if plot is not None and page is not None and plot.suffix.lower() == ".html":
            page().save(plot)
        elif plot is not None and figure is not None:
            from ..view.plots.plot_style import pyplot

            pyplot().switch_backend("agg")  # to files only, so that no screen is needed
            write_figure(plot, figure())
    for path in (out, plot):
        if path is not None and not json:
            print(path)


def joined_json(exo: Any, **answers: Any) -> str:
    """Several answers on a design as one JSON text, each under its name with its own fields; None where none is."""
    return dumps(plain({"mechanism": exo.name, "side": exo.side, **answers}), indent=2)
