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

Files of matplotlib's figures.
"""

from __future__ import annotations

import contextlib
import errno
import io
import os
import secrets
import stat
import sys
from collections.abc import Iterator
from os import PathLike
from pathlib import Path
from typing import Any

from ..errors import FileNotWritten, InvalidInput
from .targets import LONGEST_NAME, Target, find_target, is_stream, require_folder


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
    _sync_folder(folder)


def _write_new(name: str, mode: int | None, content: bytes) -> None:
    """Write a file that does not exist yet and put it on the disk."""
    # The umask is the kernel's to apply: reading it would change it for all threads.
    with _opened(name, os.O_WRONLY | os.O_CREAT | os.O_EXCL, 0o666 if mode is None else mode) as descriptor:
        if mode is not None:
            os.fchmod(descriptor, mode)
        _write_all(descriptor, content)
        os.fsync(descriptor)


def _sync_folder(folder: str) -> None:
    """Put the new name on the disk, too, where the file system can."""
    with contextlib.suppress(OSError), _opened(folder, os.O_RDONLY | os.O_DIRECTORY) as descriptor:
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
