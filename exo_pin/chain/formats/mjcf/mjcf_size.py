"""The size of what MuJoCo makes of an MJCF file, estimated before it is made: a short file may ask for any memory.

Elements in ``<replicate>`` are copied, ``<composite>`` and ``<flexcomp>`` make bodies by number, and ``<texture>``,
``<hfield>`` and ``nuser_*`` have sizes as numbers. None of it is needed for a robot of the size that a chain computes.
"""

from __future__ import annotations

import math
from pathlib import Path
from xml.parsers import expat

from ....core.errors import FileFormatError
from ....core.files.text_files import read_file

__all__ = ["root_tag"]

#: Largest size, bytes: 1e5 elements of about a kilobyte.
_LARGEST = 1e8
_ELEMENT = 1e3
_COPIED = ("replicate", "composite", "flexcomp")
_CELLS = {"texture": ("width", "height"), "hfield": ("nrow", "ncol")}


def root_tag(source: str | bytes, folder: Path | None) -> str:
    """Tag of the outermost element.

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
    return _Scan(folder).run(source)


class _Scan:
    """Size of one file and of those that it includes."""

    def __init__(self, folder: Path | None) -> None:
        self._folder, self._seen = folder, set[Path]()
        self._root, self._size, self._copies = "", 0.0, [1.0]

    def run(self, source: str | bytes) -> str:
        parser = expat.ParserCreate("utf-8" if isinstance(source, str) else None)
        parser.StartElementHandler = self._start
        parser.EndElementHandler = lambda _: self._copies.pop()
        parser.StartDoctypeDeclHandler = self._doctype
        try:
            parser.Parse(source.encode("utf-8", "surrogatepass") if isinstance(source, str) else source, True)
        except (expat.ExpatError, LookupError) as error:
            raise FileFormatError(f"MuJoCo cannot read it: its XML is not well-formed: {error}") from error
        return self._root

    def _start(self, tag: str, attributes: dict[str, str]) -> None:
        self._root = self._root or tag
        count = _product(attributes.get("count", "")) if tag in _COPIED else 1.0
        cells = [_product(attributes.get(name, "")) for name in _CELLS.get(tag, ())]
        users = [_product(value) for name, value in attributes.items() if tag == "size" and name.startswith("nuser_")]
        self._size += self._copies[-1] * (_ELEMENT * count + math.prod(cells) + _ELEMENT * sum(users))
        if not self._size <= _LARGEST:
            raise FileFormatError(f"<{tag}> makes more than {_LARGEST:.0e} bytes of elements: make them fewer")
        self._copies.append(self._copies[-1] * count)
        if tag == "include" and self._folder is not None and "file" in attributes:
            path = self._folder / attributes["file"]
            # MuJoCo's own errors are about files that are not there, or are included again.
            if path not in self._seen and path.is_file():
                self._seen.add(path)
                self.run(read_file(path))

    def _doctype(self, name: str, *_: object) -> None:
        raise FileFormatError(f"<!DOCTYPE {name}>: an MJCF has no document type; take the declaration out")


def _product(text: str) -> float:
    """Product of the whole numbers in a text; 1 for what is no number, which MuJoCo refuses."""
    try:
        return math.prod(max(abs(float(word)), 1.0) for word in text.split())
    except ValueError:
        return 1.0
