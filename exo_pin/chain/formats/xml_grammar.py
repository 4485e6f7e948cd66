"""What elements of a robot's XML may hold: a rule for each kind of element, and the check of one element."""

from __future__ import annotations

import tomllib
from collections.abc import Callable, Iterable, Iterator, Sequence
from dataclasses import dataclass, field
from functools import cache
from pathlib import Path

from ...core.errors import FileFormatError
from ...core.errors.base import echo
from ...core.errors.inputs import hint, nearest
from .xml_elements import Element


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
    refused : dict of str to str
        Children that no chain can hold, with the reason.
    fixed : dict of str to str
        Children with a value that has no effect; any other value is an error.
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
    refused: dict[str, str] = field(default_factory=dict)
    fixed: dict[str, str] = field(default_factory=dict)
    text: bool = False
    picture: bool = False


_TEXT = Rule(text=True)


def checked(
    root: Element, name: str, faulty: Callable[[FileFormatError], None] | None = None
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

    Raises
    ------
    FileFormatError
        If an attribute or a child is unknown, missing, refused, or there twice, or there is text where none is allowed.
        A near miss is named.
    """
    rules = _read_rules(name)
    waiting = [(root, False)]
    while waiting:
        element, pictured = waiting.pop()
        rule = rules.get(element.tag, _TEXT)
        pictured |= rule.picture
        try:
            children = _read_children(element, rule)
        except FileFormatError as error:
            if faulty is None or not pictured:
                raise
            faulty(error)
            continue
        yield element, rule
        waiting += [(child, pictured) for child in reversed(children) if child.tag not in rule.fixed]


@cache
def _read_rules(name: str) -> dict[str, Rule]:
    """Rules by the elements' tags, of a format "urdf" or "sdf"."""
    text = (Path(__file__).parent / name / f"{name}_grammar.toml").read_text(encoding="utf-8")
    return {tag: Rule(**rule) for tag, rule in tomllib.loads(text).items()}


def is_left_out(child: Element, rule: Rule) -> bool:
    """Whether a child is not read: elements with a prefix are of other programs."""
    return ":" in child.tag or child.tag in rule.left_out


def _read_children(element: Element, rule: Rule) -> list[Element]:
    """The children that are read, after a check of the element."""
    for attribute in rule.required:
        if attribute not in element.attributes:
            near = nearest(attribute, element.attributes)
            raise element.error(f"the attribute {attribute!r} is missing{f'; there is {near!r}' if near else ''}")
    known = (*rule.required, *rule.optional, *rule.others)
    for attribute in element.attributes:
        if ":" not in attribute and attribute != "xmlns" and attribute not in known:
            raise _unknown(element, f"attribute {attribute!r}", attribute, known)
    if element.text and not rule.text:
        raise element.error(f"expected no text in <{element.tag}>, got {echo(element.text)}")
    read = (*rule.once, *rule.often, *rule.fixed)
    seen: dict[str, Element] = {}
    found = []
    for child in element.children:
        tag = child.tag
        if tag in rule.refused:
            raise child.error(f"<{tag}> {rule.refused[tag]}")
        if is_left_out(child, rule):
            continue
        if tag not in read:
            raise _unknown(child, f"element <{tag}>", tag, (*read, *rule.left_out))
        if tag in seen and tag not in rule.often:
            if child.says_as(seen[tag]):
                continue
            raise child.error(f"expected one <{tag}>, this is a second one; the first is on line {seen[tag].line}")
        seen.setdefault(tag, child)
        found.append(child)
    for tag in rule.needed:
        if tag not in seen:
            raise element.error(f"<{tag}> is missing")
    return found


def _unknown(element: Element, what: str, name: str, known: Iterable[str]) -> FileFormatError:
    return element.error(f"unknown {what}{hint(name, known)}; there are: {', '.join(known) or 'none'}")
