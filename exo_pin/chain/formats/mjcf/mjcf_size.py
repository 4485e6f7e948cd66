"""The size of what MuJoCo makes of an MJCF file, estimated before it is made: a short file may ask for any memory.

Elements in ``<replicate>`` are copied, ``<composite>`` and ``<flexcomp>`` make bodies by number, and ``<texture>``,
``<hfield>`` and ``nuser_*`` have sizes as numbers. None of it is needed for a robot of the size that a chain computes.
"""

from __future__ import annotations

import math
from pathlib import Path

from ....core.files.text_files import read_file
from ..rounding.rounded_numbers import geometry_words
from ..xml_elements import parse_xml

#: Largest size, bytes: 1e5 elements of about a kilobyte.
_LARGEST = 1e8
_ELEMENT = 1e3
_COPIED = ("replicate", "composite", "flexcomp")
_CELLS = {"texture": ("width", "height"), "hfield": ("nrow", "ncol")}


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
