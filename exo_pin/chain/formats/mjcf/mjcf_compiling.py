"""Compiling MJCF with MuJoCo: the compiled model, the names of its objects, and the errors that name its file.

The size of what MuJoCo makes of an MJCF file, estimated before it is made: a short file may ask for any memory.

Elements in ``<replicate>`` are copied, ``<composite>`` and ``<flexcomp>`` make bodies by number, and ``<texture>``,
``<hfield>`` and ``nuser_*`` have sizes as numbers. None of it is needed for a robot of the size that a chain computes.
"""

from __future__ import annotations

import math
import os
import threading
from collections.abc import Iterator
from contextlib import contextmanager
from dataclasses import dataclass, field
from os import PathLike
from pathlib import Path
from typing import Any

from ....core.errors import FileFormatError, InvalidInput
from ....core.errors.base import shown, warn
from ....core.files.atomic import read_file
from ....core.optional_packages import optional
from ....core.records import OneProcess
from ..digits import geometry_words
from ..xml_elements import parse_xml

#: Largest size, bytes: 1e5 elements of about a kilobyte.
_LARGEST = 1e8
_ELEMENT = 1e3
_COPIED = ("replicate", "composite", "flexcomp")
_CELLS = {"texture": ("width", "height"), "hfield": ("nrow", "ncol")}


#: MuJoCo has one handler of warnings in a process.
_HANDLER = threading.Lock()


def outline(source: str | bytes, folder: Path | None) -> tuple[str, tuple[str, ...], tuple[str, ...]]:
    """Tag of the outermost element, the numbers of the geometry as written, and meshes with a reference pose.

    MuJoCo moves the corners of such a mesh, and its compiled model no longer says how.

    Parameters
    ----------
    source : str or bytes
        The XML.
    folder : Path or None
        Where the files are that it includes; None for XML that was given as text, which includes none.

    Raises
    ------
    FileFormatError
        If it is not well-formed XML, has a document type declaration, or asks for more than 1e8 bytes.
    """
    root = parse_xml(source, "an MJCF")
    words, moved = list(geometry_words(root)), list[str]()
    size, seen, waiting = 0.0, set[Path](), [(root, 1.0)]
    while waiting:
        element, copies = waiting.pop()
        tag, given = element.tag, element.attributes
        count = _product(given.get("count", "")) if tag in _COPIED else 1.0
        if tag == "mesh" and not given.keys().isdisjoint(("refpos", "refquat")):
            moved.append(given.get("name") or Path(given.get("file", "")).stem)
        cells = math.prod(_product(given.get(name, "")) for name in _CELLS[tag]) if tag in _CELLS else 0.0
        users = [_product(value) for name, value in given.items() if tag == "size" and name.startswith("nuser_")]
        size += copies * (_ELEMENT * count + cells + _ELEMENT * sum(users))
        if not size <= _LARGEST:
            raise element.error(f"makes more than {_LARGEST:.0e} bytes of elements: make them fewer")
        waiting += [(child, copies * count) for child in element.children]
        if tag == "include" and folder is not None and "file" in given:
            path = folder / given["file"]
            # MuJoCo's own errors are about files that are not there, or are included again.
            if path not in seen and path.is_file():
                seen.add(path)
                included = parse_xml(read_file(path), "an MJCF")
                words += geometry_words(included)
                waiting.append((included, copies))
    return root.tag, tuple(words), tuple(moved)


def _product(text: str) -> float:
    """Product of the whole numbers in a text; 1 for what is no number, which MuJoCo refuses."""
    try:
        return math.prod(max(abs(float(word)), 1.0) for word in text.split())
    except ValueError:
        return 1.0


def _renew_lock() -> None:
    """A child of a fork has no thread that could give the lock back."""
    global _HANDLER
    _HANDLER = threading.Lock()


if hasattr(os, "register_at_fork"):
    os.register_at_fork(after_in_child=_renew_lock)


@dataclass(frozen=True, eq=False)
class Compiled(OneProcess):
    """A file as MuJoCo compiled it.

    Attributes
    ----------
    model : mujoco.MjModel
        The compiled model.
    mujoco : module
        The package ``mujoco``.
    path : str or None
        The file; None for XML that was given as text.
    messages : list of str
        MuJoCo's warnings so far.
    words : tuple of str
        Numbers of the geometry as written.
    moved : tuple of str
        Meshes with a reference pose.
    """

    model: Any
    mujoco: Any
    path: str | None
    messages: list[str] = field(default_factory=list)
    words: tuple[str, ...] = ()
    moved: tuple[str, ...] = ()

    def error(self, message: str) -> FileFormatError:
        """An error that names the file."""
        return FileFormatError(message, self.path)

    def warn(self) -> None:
        """Pass MuJoCo's warnings on to the caller of the caller's caller."""
        for text in dict.fromkeys(self.messages):
            warn(shown(f"{self.path or 'MJCF'}: MuJoCo: {text}"), RuntimeWarning)

    def name(self, kind: str, index: int) -> str:
        """MuJoCo's name of an object, empty where it has none; ``kind`` as in mjtObj, for example "BODY"."""
        try:
            return self.mujoco.mj_id2name(self.model, getattr(self.mujoco.mjtObj, f"mjOBJ_{kind}"), index) or ""
        except UnicodeDecodeError as error:
            raise self.error(f"the name of {kind.lower()} number {index} is not UTF-8 text") from error

    def called(self, kind: str, index: int) -> str:
        """An object's name for a message, or its number."""
        return repr(self.name(kind, index)) if self.name(kind, index) else f"number {index} (unnamed)"

    def kind(self, enumeration: str, value: Any) -> str:
        """A number of an enumeration in lower case, for example "hinge" for mjJNT_HINGE of "mjtJoint"."""
        return str(getattr(self.mujoco, enumeration)(int(value)).name.partition("_")[2].lower())

    def disabled(self, flag: str) -> bool:
        """Whether a flag of ``<option><flag .../></option>`` is disabled; as in mjtDisableBit, e.g. "GRAVITY"."""
        return bool(self.model.opt.disableflags & int(getattr(self.mujoco.mjtDisableBit, f"mjDSBL_{flag}")))


def compile_mjcf(source: str | PathLike[str]) -> Compiled:
    """Let MuJoCo compile a file, or XML given as text.

    Raises
    ------
    FileFormatError
        If there is no such file, MuJoCo cannot compile it, or it is a URDF.
    MissingExtra
        If MuJoCo is not installed, or has a version that is not read.
    InvalidInput
        If the source is neither a path nor text.
    """
    mujoco = optional("robots", "mujoco")
    if not isinstance(source, (str, PathLike)):
        raise InvalidInput(f"expected the path of an MJCF file, or the XML itself, got {source!r}")
    if isinstance(source, str):
        source = source.removeprefix("\ufeff")
    is_text = isinstance(source, str) and source.lstrip().startswith("<")
    path = None if is_text else os.fsdecode(source)
    if path is not None and not os.path.isfile(path):
        raise FileFormatError("there is no such file", path)
    try:
        text, folder = (str(source), None) if path is None else (read_file(path), Path(path).parent)
        tag, words, moved = outline(text, folder)
    except FileFormatError as error:
        raise FileFormatError(str(error), path) from None
    if tag == "robot":
        raise FileFormatError("this is a URDF: load it with ClosedChain.from_urdf", path)
    load = mujoco.MjModel.from_xml_string if path is None else mujoco.MjModel.from_xml_path
    messages: list[str] = []
    try:
        with mujoco_warnings(mujoco, messages):
            model = load(source if path is None else path)
    except (ValueError, RuntimeError, mujoco.FatalError, mujoco.UnexpectedError) as error:
        # MuJoCo's text may have any characters of the file, and Python would print it as the cause.
        raise FileFormatError(f"MuJoCo cannot read it: {error}", path) from None
    return Compiled(model, mujoco, path, messages, words, moved)


@contextmanager
def mujoco_warnings(mujoco: Any, messages: list[str]) -> Iterator[None]:
    """Collect MuJoCo's warnings; without a handler it writes them to a file in the working directory."""
    with _HANDLER:
        before = mujoco.get_mju_user_warning()
        mujoco.set_mju_user_warning(messages.append)
        try:
            yield
        finally:
            mujoco.set_mju_user_warning(before)
