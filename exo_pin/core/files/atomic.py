"""Atomic writing: a reader finds the old file or the new one, never half of it.

A regular file is written beside its place under a random name, put on the disk and then moved over the old one. So

- a crash, a full disk or Ctrl-C leave the old file, or no file if there was none; a kill or a loss of power leaves it,
  too, and perhaps a hidden file ``.name.<16 hex digits>`` beside it, which can be deleted;
- the mode of an existing file stays (without the set-user-ID and set-group-ID bits), a new one has 0666 less the umask;
  owner, access lists and other hard links are not carried over;
- a symbolic link stays and its target is replaced;
- a file that may not be written is refused, although its folder would allow to replace it; a folder in which no file
  can be made is refused, although the file in it could be overwritten: overwriting cannot be taken back half-way.

A pipe, a character device or a descriptor such as ``/dev/stdout`` gets the bytes one after the other.

``/dev/stdout``, ``/dev/fd/N`` and ``/proc/self/fd/N`` look like links to a file. They are names of an open descriptor:
the file behind may have no path, or be in use at another position. So links are followed by hand, and a descriptor is
recognised before the kernel would look behind it.

Whether a file could be written is found out before the work whose result it shall hold.

Whole regular files are read here, too; to read a pipe or a device is an error, because it may wait for ever.
"""

from __future__ import annotations

import contextlib
import errno
import io
import os
import re
import secrets
import stat
import sys
import tempfile
from collections.abc import Iterator, Sequence
from os import PathLike
from pathlib import Path
from typing import Any, NamedTuple

from ..errors import FileFormatError, FileNotWritten, InvalidInput
from ..errors.base import echo


def write_text(path: str | PathLike[str], text: str) -> None:
    """Write a text file in UTF-8, its lines as they are, as :func:`write_bytes` does."""
    write_bytes(path, text.encode("utf-8"))


def write_bytes(path: str | PathLike[str], content: bytes) -> None:
    """Write a file so that a reader finds the old one or the new one, never half of it.

    Parameters
    ----------
    path : path-like
        A regular file, which is replaced; a link, whose target is replaced; or a pipe, character device or
        descriptor, to which the bytes are written.
    content : bytes
        All of it.

    Raises
    ------
    InvalidInput
        If the path is a folder, a block device or a socket.
    FileNotWritten
        If the system refuses: no such folder, no permission, disk full, no reader at the other end of a pipe.
    """
    target = find_target(path)
    try:
        if target.descriptor is not None:
            _write_descriptor(target.descriptor, content)
        elif target.status is None or stat.S_ISREG(target.status.st_mode):
            _replace(target, content)
        elif stat.S_ISFIFO(target.status.st_mode) or stat.S_ISCHR(target.status.st_mode):
            with _opened(target.path, os.O_WRONLY | os.O_NOCTTY) as descriptor:
                _write_all(descriptor, content)
        else:
            raise InvalidInput(f"expected a file, pipe or character device to write, got {os.fspath(path)!r}")
    except OSError as error:
        raise FileNotWritten(path, error) from error


def _write_descriptor(descriptor: int, content: bytes) -> None:
    """Write at the position of an open descriptor, behind what has been printed to it."""
    for stream in (sys.stdout, sys.stderr):
        with contextlib.suppress(AttributeError, ValueError):  # none, closed, or not a file
            if stream.fileno() == descriptor:
                stream.flush()
    _write_all(descriptor, content)


@contextlib.contextmanager
def _opened(place: str, flags: int, mode: int = 0o666) -> Iterator[int]:
    descriptor = os.open(place, flags | os.O_CLOEXEC, mode)
    try:
        yield descriptor
    finally:
        os.close(descriptor)


def _write_all(descriptor: int, content: bytes) -> None:
    left = memoryview(content)
    while left:
        left = left[os.write(descriptor, left) :]


def _replace(target: Target, content: bytes) -> None:
    """Write beside a regular file, then move over it."""
    mode = None if target.status is None else stat.S_IMODE(target.status.st_mode) & 0o777
    if mode is not None and not os.access(target.path, os.W_OK, effective_ids=os.access in os.supports_effective_ids):
        raise PermissionError(errno.EACCES, os.strerror(errno.EACCES))
    folder, name = os.path.split(target.path)
    start = os.fsdecode(os.fsencode(name)[:LONGEST_NAME])
    temporary = os.path.join(folder, f".{start}.{secrets.token_hex(8)}")
    try:
        _write_new(temporary, mode, content)
        os.replace(temporary, target.path)
    except FileExistsError:  # of another program
        raise
    except BaseException:
        with contextlib.suppress(OSError):
            os.unlink(temporary)
        raise
    # The new name, too, where the file system can.
    with contextlib.suppress(OSError), _opened(folder, os.O_RDONLY | os.O_DIRECTORY) as descriptor:
        os.fsync(descriptor)


def _write_new(name: str, mode: int | None, content: bytes) -> None:
    """Write a file that does not exist yet and put it on the disk."""
    # The umask is the kernel's to apply: reading it would change it for all threads.
    with _opened(name, os.O_WRONLY | os.O_CREAT | os.O_EXCL, 0o666 if mode is None else mode) as descriptor:
        if mode is not None:
            os.fchmod(descriptor, mode)
        _write_all(descriptor, content)
        os.fsync(descriptor)


def write_files(folder: str | PathLike[str], texts: dict[str, str]) -> list[Path]:
    """Write texts, by name, to a folder, which is made if it is not there; return the paths.

    Raises
    ------
    InvalidInput
        If the folder cannot be made.
    """
    require_folder(folder)
    target = Path(folder)
    try:
        target.mkdir(parents=True, exist_ok=True)
    except OSError as error:
        raise InvalidInput(f"expected a folder to write to, got {str(target)!r}: {error}") from error
    for name, text in texts.items():
        write_text(target / name, text)
    return [target / name for name in texts]


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


#: Bytes of a name that leave room for its endings: file systems allow 255.
LONGEST_NAME = 200
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
        Of the path; None for a file that does not exist.
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
        status = None
        with contextlib.suppress(FileNotFoundError):
            status = os.stat(name)
        if status is not None and stat.S_ISDIR(status.st_mode):
            raise InvalidInput(f"expected a file to write, got the folder {name!r}")
        place, descriptor = _followed(name)
        return Target(place, descriptor, status)
    except OSError as error:
        raise FileNotWritten(name, error) from error


def _followed(name: str) -> tuple[str, int | None]:
    """The path with all links followed, which lead in no circle, and the descriptor of this process that it names."""
    while True:
        folder, last = os.path.realpath(os.path.dirname(name) or os.curdir), os.path.basename(name)
        name, found = os.path.join(folder, last), _DESCRIPTORS.fullmatch(folder)
        if found and last.isdecimal():
            # That of another process is opened like a device: what the kernel finds behind it counts.
            return name, int(last) if int(found[1]) == os.getpid() else None
        if not os.path.islink(name):
            return name, None
        name = os.path.join(folder, os.readlink(name))


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
