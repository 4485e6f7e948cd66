"""The elements of a robot's XML, each with its line and a name for messages."""

from __future__ import annotations

from dataclasses import dataclass, field
from os import PathLike
from pathlib import Path
from xml.parsers import expat

from ...core.errors import FileFormatError
from ...core.files.text_files import read_file

#: Elements within elements that no robot's file has; it bounds the work on a hostile file.
_DEEPEST = 200


@dataclass(eq=False)
class Element:
    """One XML element.

    Attributes
    ----------
    tag : str
        As written, with its prefix if it has one.
    attributes : dict of str to str
        As XML defines their values: entities replaced, tabs and line ends turned into spaces.
    line : int
        Where it starts, from 1.
    place : str
        Its name for messages, for example "joint 'knee': axis".
    children : list of Element
        In the order of the file.
    text : str
        The text directly in it, without blanks at its ends.
    """

    tag: str
    attributes: dict[str, str]
    line: int
    place: str
    children: list[Element] = field(default_factory=list)
    text: str = ""

    def all(self, tag: str) -> list[Element]:
        """Children with this tag."""
        return [child for child in self.children if child.tag == tag]

    def first(self, tag: str) -> Element | None:
        """The first child with this tag."""
        return next((child for child in self.children if child.tag == tag), None)

    def says_as(self, other: Element) -> bool:
        """Whether another element has the same content."""
        if (self.tag, self.attributes, self.text) != (other.tag, other.attributes, other.text):
            return False
        pairs = zip(self.children, other.children, strict=False)
        return len(self.children) == len(other.children) and all(one.says_as(two) for one, two in pairs)

    def error(self, message: str, attribute: str = "") -> FileFormatError:
        """An error that names the element, its attribute and its line."""
        key = f"{self.place} {attribute}" if attribute else self.place
        return FileFormatError(f"line {self.line}: {key}: {message}", None, key)


def read_source(source: str | PathLike[str]) -> tuple[str | bytes, Path | None]:
    """The XML, and the file that it came from; None for XML that is given itself."""
    if isinstance(source, str):
        text = source.lstrip("\ufeff \t\r\n")
        if text.startswith("<"):
            return text, None
    return read_file(source), Path(source)


def parse_xml(source: str | bytes, what: str = "a URDF") -> Element:
    """The root element of an XML document.

    Parameters
    ----------
    source : str or bytes
        Text, whose encoding declaration is ignored, or bytes in the encoding that they declare (UTF-8, UTF-16
        with its byte-order mark, ISO-8859-1, ...).
    what : str
        What the document has to be, for messages.

    Raises
    ------
    FileFormatError
        If it is not well-formed XML in that encoding, has a document type declaration, or is nested too deeply.
    """
    if isinstance(source, str):
        # A lone surrogate becomes bytes that are no UTF-8, which the parser refuses.
        source, encoding = source.removeprefix("\ufeff").encode("utf-8", "surrogatepass"), "utf-8"
    else:
        encoding = None
    parser = expat.ParserCreate(encoding)
    builder = _Builder(parser, what)
    try:
        parser.Parse(source, True)
    except (expat.ExpatError, LookupError, ValueError) as error:
        if isinstance(error, FileFormatError):
            raise
        raise FileFormatError(f"not {what}: its XML is not well-formed: {error}") from error
    assert builder.root is not None
    return builder.root


class _Builder:
    """Makes elements of the parser's events."""

    def __init__(self, parser: expat.XMLParserType, what: str) -> None:
        self._what = what
        self.root: Element | None = None
        self._parser, self._open, self._texts = parser, list[Element](), list[list[str]]()
        parser.StartElementHandler = self._start
        parser.EndElementHandler = self._end
        parser.CharacterDataHandler = self._characters
        parser.StartDoctypeDeclHandler = self._doctype

    def _start(self, tag: str, attributes: dict[str, str]) -> None:
        line = self._parser.CurrentLineNumber
        if len(self._open) >= _DEEPEST:
            raise FileFormatError(f"line {line}: elements are nested more than {_DEEPEST} deep")
        element = Element(tag, attributes, line, self._place(tag, attributes))
        if self._open:
            self._open[-1].children.append(element)
        else:
            self.root = element
        self._open.append(element)
        self._texts.append([])

    def _place(self, tag: str, attributes: dict[str, str]) -> str:
        if not self._open:
            return tag
        name = attributes.get("name")
        own = tag if name is None else f"{tag} {name!r}"
        return own if len(self._open) == 1 else f"{self._open[-1].place}: {own}"

    def _end(self, tag: str) -> None:
        element = self._open.pop()
        element.text = "".join(self._texts.pop()).strip()

    def _characters(self, text: str) -> None:
        if self._open:
            self._texts[-1].append(text)

    def _doctype(self, name: str, *_: object) -> None:
        line = self._parser.CurrentLineNumber
        raise FileFormatError(
            f"line {line}: <!DOCTYPE {name}>: {self._what} has no document type; take the declaration out"
        )
