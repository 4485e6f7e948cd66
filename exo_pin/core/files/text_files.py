"""Reading of whole regular files; a pipe or a device is an error, because reading one may wait for ever."""

from __future__ import annotations

import os
import stat
from os import PathLike

from ..errors import FileFormatError
from ..errors.base import echo

_KINDS = (
    (stat.S_ISDIR, "a folder"),
    (stat.S_ISFIFO, "a pipe"),
    (stat.S_ISCHR, "a device"),
    (stat.S_ISBLK, "a device"),
    (stat.S_ISSOCK, "a socket"),
)


def read_file(path: str | PathLike[str]) -> bytes:
    """The bytes of a regular file.

    Raises
    ------
    FileFormatError
        If the path is not a path, names no file, or names a folder, pipe, device or socket; or is ``-``. A file
        redirected to standard input can be read as ``/dev/stdin``.
    """
    if not isinstance(path, (str, PathLike)):
        raise FileFormatError(f"expected the path of a file, got {echo(path)}")
    if path == "-":
        raise FileFormatError("cannot be read: standard input is not read; save it as a file first", path)
    try:
        mode = os.stat(path).st_mode
        if not stat.S_ISREG(mode):
            what = next((name for is_kind, name in _KINDS if is_kind(mode)), "of an unknown kind")
            advice = "; save it as a file first" if stat.S_ISFIFO(mode) or stat.S_ISCHR(mode) else ""
            raise FileFormatError(f"cannot be read: expected a regular file, this is {what}{advice}", path)
        with open(path, "rb") as stream:
            return stream.read()
    except (OSError, ValueError) as error:
        if isinstance(error, FileFormatError):
            raise
        # A ValueError is a path with a zero byte in it.
        raise FileFormatError(f"cannot be read: {error}", path) from error


def read_text(path: str | PathLike[str]) -> str:
    """The text of a regular file in UTF-8, with or without a byte-order mark.

    Raises
    ------
    FileFormatError
        As :func:`read_file`, and if the bytes are not UTF-8.
    """
    try:
        return read_file(path).decode("utf-8-sig")
    except UnicodeDecodeError as error:
        raise FileFormatError(f"cannot be read: expected UTF-8, {error}", path) from error
