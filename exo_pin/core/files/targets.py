"""Resolution of a path: a descriptor of this process, a pipe or device, or a regular file, with all links followed.

``/dev/stdout``, ``/dev/fd/N`` and ``/proc/self/fd/N`` look like links to a file. They are names of an open descriptor:
the file behind may have no path, or be in use at another position. So links are followed by hand, and a descriptor is
recognised before the kernel would look behind it.

Whether a file could be written is found out before the work whose result it shall hold.
"""

from __future__ import annotations

import errno
import os
import re
import stat
import tempfile
from collections.abc import Sequence
from os import PathLike
from typing import NamedTuple

from ..errors import FileNotWritten, InvalidInput
from ..errors.base import echo

#: Bytes of a name that leave room for its endings: file systems allow 255.
LONGEST_NAME = 200
#: Linux gives up after so many links, too.
_MOST_LINKS = 40
_DESCRIPTORS = re.compile(r"/proc/(\d+)(?:/task/\d+)?/fd")


class Target(NamedTuple):
    """What a path leads to.

    Attributes
    ----------
    path : str
        Absolute, all links followed, also a link to a file that does not exist yet.
    descriptor : int or None
        Number of the descriptor of this process that the path names, if it names one.
    status : os.stat_result or None
        Of the path; None for a descriptor and for a file that does not exist.
    """

    path: str
    descriptor: int | None
    status: os.stat_result | None

    @property
    def is_stream(self) -> bool:
        """Whether it takes bytes one after the other and cannot be replaced: a descriptor, pipe or device."""
        if self.descriptor is not None:
            return True
        return self.status is not None and not (stat.S_ISREG(self.status.st_mode) or stat.S_ISDIR(self.status.st_mode))


def is_stream(path: str | PathLike[str]) -> bool:
    """Whether a path leads to a pipe, a device or an open descriptor such as ``/dev/stdout``.

    Such a path has no ending that could name the format.
    """
    try:
        return find_target(path).is_stream
    except InvalidInput:
        return False


def find_target(path: str | PathLike[str]) -> Target:
    """Follow all links of a path.

    Raises
    ------
    InvalidInput
        If it is no path, or a folder.
    FileNotWritten
        If the links lead round in a circle, or a folder on the way cannot be searched.
    """
    try:
        name = os.fspath(path)
    except TypeError:
        raise InvalidInput(f"expected the path of a file to write, got {echo(path)}") from None
    if not isinstance(name, str) or not name or "\0" in name:
        raise InvalidInput(f"expected the path of a file to write, got {echo(path)}")
    try:
        if os.path.isdir(name):
            raise InvalidInput(f"expected a file to write, got the folder {name!r}")
        place, descriptor = _followed(name)
        return Target(place, descriptor, None if descriptor is not None else _status(place))
    except OSError as error:
        raise FileNotWritten(name, error) from error


def _followed(name: str) -> tuple[str, int | None]:
    """The path with all links followed, and the descriptor of this process that it names."""
    for _ in range(_MOST_LINKS):
        folder = os.path.realpath(os.path.dirname(name) or os.curdir)
        last = os.path.basename(name)
        name = os.path.join(folder, last)
        found = _DESCRIPTORS.fullmatch(folder)
        if found and last.isdecimal():
            # That of another process is opened like a device: what the kernel finds behind it counts.
            return name, int(last) if int(found[1]) == os.getpid() else None
        try:
            name = os.path.join(folder, os.readlink(name))
        except FileNotFoundError:
            return name, None
        except OSError as error:
            if error.errno == errno.EINVAL:  # no link
                return name, None
            raise
    raise OSError(errno.ELOOP, os.strerror(errno.ELOOP))


def _status(place: str) -> os.stat_result | None:
    try:
        return os.stat(place)
    except FileNotFoundError:
        return None


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


def as_file_stem(name: str) -> str:
    """Return ``name`` if it can name a file in a folder, with an ending after it.

    Raises
    ------
    InvalidInput
        If it is empty, begins with a point or a minus, holds a slash or a character that cannot be printed, or is
        longer than :data:`LONGEST_NAME` bytes.
    """
    fits = isinstance(name, str) and name.isprintable() and name == name.strip() and name[:1] not in ("", ".", "-")
    if not fits or not set(name).isdisjoint("/\\") or len(os.fsencode(name)) > LONGEST_NAME:
        raise InvalidInput(f"expected a name that can name a file, got {echo(name)}")
    return name


def require_folder(path: str | PathLike[str]) -> None:
    """Check that files can be written to a folder, or that it can be made.

    Raises
    ------
    InvalidInput
        If it is no path.
    FileNotWritten
        If not.
    """
    try:
        place = os.path.abspath(path)
        if "\0" in place:
            raise TypeError
    except TypeError:
        raise InvalidInput(f"expected the path of a folder, got {echo(path)}") from None
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
