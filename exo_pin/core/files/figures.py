"""Files of matplotlib's figures."""

from __future__ import annotations

import io
import os
from os import PathLike
from typing import Any

from ..errors import InvalidInput
from .atomic import write_bytes
from .targets import is_stream


def write_figure(path: str | PathLike[str], figure: Any, dpi: float = 200.0) -> None:
    """Write a figure as :func:`exo_pin.core.files.write_bytes` does: whole or not at all.

    Parameters
    ----------
    path : path-like
        Its ending is the format (.png, .svg, .pdf, ...). A pipe, a device or a path without ending gets a PNG.
    figure : matplotlib.figure.Figure
        What to write.
    dpi : float
        Dots per inch.

    Raises
    ------
    InvalidInput
        If matplotlib has no such format.
    FileNotWritten
        If the file cannot be written.
    """
    ending = "" if is_stream(path) else os.path.splitext(os.fspath(path))[1].lower()
    picture = io.BytesIO()
    try:
        figure.savefig(picture, format=ending.removeprefix(".") or "png", dpi=dpi)
    except ValueError as error:
        raise InvalidInput(f"cannot write {os.fspath(path)!r}: {error}") from error
    write_bytes(path, picture.getvalue())
