"""Files of ``--out`` and ``--plot``: checked before a command begins its work, and written after it."""

from __future__ import annotations

import argparse
from collections.abc import Callable, Iterable, Mapping
from json import dumps
from pathlib import Path
from typing import Any

from ...core.errors import InvalidInput
from ...core.errors.inputs import require_extra
from ...core.files import (
    is_stream,
    require_ending,
    require_folder,
    require_writable,
    write_columns,
    write_figure,
    write_text,
)
from ...core.results import plain
from .. import PICTURES


def check_outputs(options: argparse.Namespace, extras: Iterable[str]) -> None:
    """Check the endings and folders of what a command shall write, and the extras that it needs.

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
    for extra in extras:
        require_extra(extra)


def write_outputs(
    options: argparse.Namespace,
    json: Callable[[], str] | None,
    columns: Callable[[], Mapping[str, Any]] | None,
    save: Callable[[Path], Any] | None,
    figure: Callable[[], Any] | None,
    page: Callable[[], Any] | None,
) -> None:
    """Write what was asked for; the arguments are those of :func:`exo_pin.cli.deliver`."""
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
        from ...view.plots.plot_style import pyplot

        pyplot().switch_backend("agg")  # to files only, so that no screen is needed
        write_figure(plot, figure())


def joined_json(exo: Any, **answers: Any) -> str:
    """Several answers on a design as one JSON text, each under its name with its own fields; None where none is."""
    return dumps(plain({"mechanism": exo.name, "side": exo.side, **answers}), indent=2)
