"""Whether a file could be written, found out before the work whose result it shall hold."""

from __future__ import annotations

import errno
import os
import tempfile
from collections.abc import Sequence
from os import PathLike

from ..errors import FileNotWritten, InvalidInput
from .targets import find_target


def require_ending(name: str, path: str | PathLike[str], endings: Sequence[str]) -> None:
    """Check that a file's ending is one of those that can be written; a pipe or a device needs none.

    Raises
    ------
    InvalidInput
        If it is another; the message lists them.
    """
    if not find_target(path).is_stream and os.path.splitext(os.fspath(path))[1].lower() not in endings:
        listed = f"{', '.join(endings[:-1])} or {endings[-1]}" if len(endings) > 1 else endings[0]
        raise InvalidInput(f"expected {name} to end in {listed}, got {os.fspath(path)}")


def require_writable(path: str | PathLike[str]) -> None:
    """Check that a file can be written where it shall be, and leave everything as it is.

    Raises
    ------
    InvalidInput
        If the path is a folder.
    FileNotWritten
        If its folder is not there or takes no files, or the file is there and may not be written.
    """
    target = find_target(path)
    if target.is_stream:
        return
    try:
        if target.status is not None and not os.access(target.path, os.W_OK):
            raise PermissionError(errno.EACCES, os.strerror(errno.EACCES))
        _try_folder(os.path.dirname(target.path))
    except OSError as error:
        raise FileNotWritten(path, error) from error


def require_folder(path: str | PathLike[str]) -> None:
    """Check that files can be written to a folder, or that it can be made.

    Raises
    ------
    FileNotWritten
        If not.
    """
    place = os.path.abspath(path)
    try:
        while not os.path.lexists(place) and os.path.dirname(place) != place:
            place = os.path.dirname(place)
        _try_folder(place)
    except OSError as error:
        raise FileNotWritten(path, error) from error


def _try_folder(folder: str) -> None:
    # The system is asked for a file that has no name: permissions, read-only disks and quotas all show.
    with tempfile.TemporaryFile(dir=folder):
        pass
