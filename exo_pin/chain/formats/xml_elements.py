"""The elements of a robot's XML, each with its line and a name for messages.

Numbers in the XML of a robot: a strict reading, and how far a printed number may be from the one that was meant.

What elements of a robot's XML may hold: a rule for each kind of element, and the check of one element.
"""

from __future__ import annotations

import math
import re
import tomllib
from collections.abc import Callable, Iterator, Sequence
from dataclasses import dataclass, field
from decimal import Decimal
from functools import cache
from os import PathLike
from pathlib import Path
from xml.parsers import expat

import numpy as np
from numpy.typing import ArrayLike

from ...core.errors import FileFormatError
from ...core.errors.base import echo
from ...core.errors.inputs import hint, nearest
from ...core.files.atomic import read_file
from ...core.validation import FloatArray

#: Elements within elements that no robot's file has; it bounds the work on a hostile file.
_DEEPEST = 200


#: Entries of an inertia by their names.
MOMENTS = {"ixx": (0, 0), "ixy": (0, 1), "ixz": (0, 2), "iyy": (1, 1), "iyz": (1, 2), "izz": (2, 2)}
#: A position, angles or a direction that is left out.
NOTHING = (0.0, 0.0, 0.0)
#: What C and Python both read, and read alike: no hexadecimal, no underscores, no digits but 0 to 9, no "nan", "inf".
_DECIMAL = re.compile(r"[+-]?(?:[0-9]+\.?[0-9]*|\.[0-9]+)(?:[eE][+-]?[0-9]+)?")
_BLANKS = " \t\r\n"


@dataclass
class Element:
    """One XML element; one with the same content elsewhere is equal.

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
    line: int = field(compare=False)
    place: str = field(compare=False)
    children: list[Element] = field(default_factory=list)
    text: str = ""

    def all(self, tag: str) -> list[Element]:
        """Children with this tag."""
        return [child for child in self.children if child.tag == tag]

    def first(self, tag: str) -> Element | None:
        """The first child with this tag."""
        return next((child for child in self.children if child.tag == tag), None)

    def error(self, message: str, attribute: str = "") -> FileFormatError:
        """An error that names the element, its attribute and its line."""
        key = f"{self.place} {attribute}" if attribute else self.place
        return FileFormatError(f"line {self.line}: {key}: {message}", None, key)

    def at_line(self, message: str) -> FileFormatError:
        """An error that names the line, for a message that names the element."""
        return FileFormatError(f"line {self.line}: {message}", None, self.place)


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
    root, around, texts = list[Element](), list[Element](), list[list[str]]()

    def start(tag: str, attributes: dict[str, str]) -> None:
        line, name = parser.CurrentLineNumber, attributes.get("name")
        if len(around) >= _DEEPEST:
            raise FileFormatError(f"line {line}: elements are nested more than {_DEEPEST} deep")
        place = tag if name is None or not around else f"{tag} {name!r}"
        if len(around) > 1:
            place = f"{around[-1].place}: {place}"
        element = Element(tag, attributes, line, place)
        (around[-1].children if around else root).append(element)
        around.append(element)
        texts.append([])

    def end(tag: str) -> None:
        around.pop().text = "".join(texts.pop()).strip()

    def characters(text: str) -> None:
        if texts:
            texts[-1].append(text)

    def doctype(name: str, *_: object) -> None:
        place = f"line {parser.CurrentLineNumber}: <!DOCTYPE {name}>"
        raise FileFormatError(f"{place}: {what} has no document type; take the declaration out")

    parser.StartElementHandler, parser.EndElementHandler = start, end
    parser.CharacterDataHandler, parser.StartDoctypeDeclHandler = characters, doctype
    try:
        parser.Parse(source, True)
    except (expat.ExpatError, LookupError, ValueError) as error:
        if isinstance(error, FileFormatError):
            raise
        mended = _mended(source)
        if mended != source:
            return parse_xml(mended if encoding is None else mended.decode("utf-8", "surrogatepass"), what)
        is_bare = re.search(rb"<\w[^<>]*\s[\w:]+=[^\s\"'<>]", source) is not None
        quotes = " (XML needs quotes about the values of attributes)" if is_bare else ""
        raise FileFormatError(f"not {what}: its XML is not well-formed{quotes}: {error}") from error
    return root[0]


def _mended(source: bytes) -> bytes:
    """A document without its comments, and with its declaration at the start.

    TinyXML, by which Gazebo, MuJoCo and urdfdom read, takes comments with ``--`` in them, and a declaration anywhere.
    """

    def kept(match: re.Match[bytes]) -> bytes:
        # Lines keep their numbers.
        return match[0] if match[0].startswith(b"<![") else b"\n" * match[0].count(b"\n")

    bare = re.sub(rb"<!\[CDATA\[.*?\]\]>|<!--.*?-->", kept, source, flags=re.DOTALL)
    found = re.search(rb"<\?xml\s.*?\?>", bare)
    return bare if found is None or found.start() == 0 else found[0] + bare[: found.start()] + bare[found.end() :]


def numbers(element: Element, attribute: str, count: int) -> list[float]:
    """The numbers of an attribute, of which there have to be ``count``.

    Raises
    ------
    FileFormatError
        If there are more or fewer, or one is not a finite decimal number.
    """
    return numbers_of(element, element.attributes[attribute], count, attribute)


def flag(element: Element) -> bool:
    """The value of a truth element.

    Raises
    ------
    FileFormatError
        If it is neither true nor false.
    """
    if element.text.lower() in ("true", "1"):
        return True
    if element.text.lower() in ("false", "0"):
        return False
    raise element.error(f"expected true or false, got {echo(element.text)}")


def numbers_of(element: Element, text: str, count: int, attribute: str = "") -> list[float]:
    """The numbers of a text in an element, of which there have to be ``count``; the attribute is for messages.

    Raises
    ------
    FileFormatError
        As for :func:`numbers`.
    """
    words = re.split(f"[{_BLANKS}]+", text.strip(_BLANKS))
    words = [] if words == [""] else words
    if len(words) != count:
        expected = "a number" if count == 1 else f"{count} numbers"
        raise element.error(f"expected {expected}, got {echo(text)}", attribute)
    return [_finite(element, attribute, word) for word in words]


def number(element: Element, attribute: str, default: float | None = None) -> float:
    """The number of an attribute; the default where it is absent and a default is given."""
    if attribute not in element.attributes:
        if default is None:
            raise element.error(f"the attribute {attribute!r} is missing")
        return default
    return numbers(element, attribute, 1)[0]


def vector(element: Element | None, attribute: str, default: tuple[float, ...]) -> FloatArray:
    """The numbers of an attribute as an array; the default where the element or the attribute is absent."""
    if element is None or attribute not in element.attributes:
        return np.array(default)
    return np.array(numbers(element, attribute, len(default)))


def as_numbers(values: ArrayLike) -> str:
    """Numbers with blanks between them, so that they read back bit for bit (but for the sign of zero)."""
    return " ".join(repr(float(value) + 0.0) for value in np.ravel(values))


def half_unit(text: str) -> float:
    """Half a unit of the last digit of a printed number: how far the number before printing may be from it.

    A number without a point and an exponent, and any zero, counts as exact.
    """
    word = text.strip(_BLANKS)
    is_exact = float(word) == 0.0 or word.lstrip("+-").rstrip(".").isdigit()
    return 0.0 if is_exact else 0.5 * 10.0 ** int(Decimal(word).as_tuple().exponent)


def _finite(element: Element, attribute: str, word: str) -> float:
    if not _DECIMAL.fullmatch(word):
        hint = ""
        if "," in word:
            hint = " (decimals come after a point, numbers are separated by blanks)"
        elif "$" in word:
            hint = " (expand the file with xacro first)"
        raise element.error(f"expected a decimal number, got {echo(word)}{hint}", attribute)
    value = float(word)
    if not math.isfinite(value):
        raise element.error(f"expected a finite number, got {echo(word)}", attribute)
    return value


@dataclass(frozen=True)
class Rule:
    """Attributes and children of an element.

    Attributes
    ----------
    required, optional, others : sequence of str
        Attributes; the others are of other programs and pass unread.
    once, often : sequence of str
        Children that are read, once or any number of times.
    needed : sequence of str
        Children that have to be there.
    left_out : sequence of str
        Children that are not read.
    named : dict of str to str
        Children that are left out by name if they have an effect: the name in ``leave_out``.
    text : bool
        Whether it has text instead of children.
    picture : bool
        Whether it and what is in it are drawn or collide, and have no effect on the motion.
    """

    required: Sequence[str] = ()
    optional: Sequence[str] = ()
    others: Sequence[str] = ()
    once: Sequence[str] = ()
    often: Sequence[str] = ()
    needed: Sequence[str] = ()
    left_out: Sequence[str] = ()
    named: dict[str, str] = field(default_factory=dict)
    text: bool = False
    picture: bool = False


_TEXT = Rule(text=True)


def checked(
    root: Element,
    name: str,
    faulty: Callable[[FileFormatError], None] | None = None,
    strange: Callable[[str, str], None] | None = None,
) -> Iterator[tuple[Element, Rule]]:
    """All elements that are read, parents first, each checked, with its rule; one without a rule holds a text.

    Parameters
    ----------
    root : Element
        The document.
    name : {"urdf", "sdf"}
        The format.
    faulty : callable, optional
        Is given the error of a picture, which then is not read; without it the error is raised.
    strange : callable, optional
        Is given what is of no known name nor near to one, and is not read: the name, and where; without it that is an
        error.

    Raises
    ------
    FileFormatError
        If an attribute or a child is unknown, missing, or there twice, or there is text where none is allowed.
        A near miss is named.
    """
    rules = _read_rules(name)
    waiting = [(root, False)]
    while waiting:
        element, pictured = waiting.pop()
        rule = rules.get(element.tag, _TEXT)
        pictured |= rule.picture
        try:
            children = _read_children(element, rule, strange)
        except FileFormatError as error:
            if faulty is None or not pictured:
                raise
            faulty(error)
            continue
        yield element, rule
        waiting += [(child, pictured) for child in reversed(children)]


@cache
def _read_rules(name: str) -> dict[str, Rule]:
    """Rules by the elements' tags, of a format "urdf" or "sdf"."""
    text = (Path(__file__).parent / name / f"{name}_grammar.toml").read_text(encoding="utf-8")
    return {tag: Rule(**rule) for tag, rule in tomllib.loads(text).items()}


def is_left_out(child: Element, rule: Rule) -> bool:
    """Whether a child is not read: elements with a prefix are of other programs."""
    return ":" in child.tag or child.tag in rule.left_out or child.tag in rule.named


def _read_children(element: Element, rule: Rule, strange: Callable[[str, str], None] | None = None) -> list[Element]:
    """The children that are read, after a check of the element."""

    def unknown(at: Element, what: str, name: str, known: Sequence[str]) -> None:
        if strange is None or nearest(name, known):
            raise at.error(f"unknown {what}{hint(name, known)}; there are: {', '.join(known) or 'none'}")
        strange(name, f"{what} in <{element.tag}>")

    for attribute in rule.required:
        if attribute not in element.attributes:
            near = nearest(attribute, element.attributes)
            raise element.error(f"the attribute {attribute!r} is missing{f'; there is {near!r}' if near else ''}")
    known = (*rule.required, *rule.optional, *rule.others)
    for attribute in element.attributes:
        if ":" not in attribute and attribute != "xmlns" and attribute not in known:
            unknown(element, f"attribute {attribute!r}", attribute, known)
    if element.text and not rule.text:
        if strange is None:
            raise element.error(f"expected no text in <{element.tag}>, got {echo(element.text)}")
        strange("text", f"text in <{element.tag}>")
    read = (*rule.once, *rule.often)
    seen: dict[str, Element] = {}
    found = []
    for child in element.children:
        tag = child.tag
        if is_left_out(child, rule):
            continue
        if tag not in read:
            unknown(child, f"element <{tag}>", tag, (*read, *rule.left_out, *rule.named))
            continue
        if tag in seen and tag not in rule.often:
            if child == seen[tag]:
                continue
            raise child.error(f"expected one <{tag}>, this is a second one; the first is on line {seen[tag].line}")
        seen.setdefault(tag, child)
        found.append(child)
    for tag in rule.needed:
        if tag not in seen:
            raise element.error(f"<{tag}> is missing")
    return found
