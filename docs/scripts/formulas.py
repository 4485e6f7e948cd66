"""The tables of docs/evidence/formulas.md: what the thesis numbers, and the code that computes it.

The site is built with them, and ``python docs/scripts/formulas.py`` prints them. They join three sources:

- ``docs/scripts/formulas.toml``: the labels of the thesis and what each one is;
- the docstrings of the package: a line ``Source: thesis (D-27), (D-30).`` in what computes a formula;
- the ledger: whether the printed numbers are reproduced.
"""

from __future__ import annotations

import ast
import re
import sys
import textwrap
import tomllib
from collections import Counter
from collections.abc import Iterable, Iterator
from pathlib import Path
from typing import NamedTuple

from exo_pin.thesis import Row, ledger

ROOT = Path(__file__).resolve().parents[2]
LABEL = re.compile(r"\((?:[2-5]|[A-D])-\d+\)|(?:Table|Figure) (?:[2-5]|[A-D])-\d+[a-c]?")

_SOURCE = re.compile(r"^\s*Source: thesis (.*)$", re.MULTILINE)
_RANGE = re.compile(r"\(([A-D\d])-(\d+)\) to \(\1-(\d+)\)")
_TABLES = re.compile(r"Tables ((?:[A-D\d]-\d+[a-c]?(?:, | and )?)+)")
#: Why a figure has no row, and what such figures are.
_WITHOUT_NUMBERS = {"a picture": "pictures", "a plot without printed data": "plots without printed data"}
_KEYS = {"about", "data", "note", "not_computed"}


class Item(NamedTuple):
    """One thing that the thesis numbers."""

    label: str
    about: str
    data: tuple[str, ...] = ()
    note: str = ""
    not_computed: str = ""

    @property
    def chapter(self) -> str:
        """The heading that it stands under."""
        part = re.search(r"[A-D\d](?=-)", self.label)
        assert part
        return f"{'Chapter' if part[0].isdigit() else 'Appendix'} {part[0]}"


class Carrier(NamedTuple):
    """A function, class or module whose docstring carries labels."""

    path: str
    name: str

    @property
    def dotted(self) -> str:
        """Its name inside the package."""
        return ".".join([*Path(self.path).with_suffix("").parts[1:], *([self.name] if self.name else [])])


def items() -> list[Item]:
    """What the thesis numbers, in its order: equations, tables, figures."""
    with (ROOT / "docs" / "scripts" / "formulas.toml").open("rb") as file:
        content = tomllib.load(file)
    found = []
    for kind in ("equations", "tables", "figures"):
        for label, entry in content.pop(kind).items():
            if not LABEL.fullmatch(label) or set(entry) - _KEYS or "about" not in entry:
                raise ValueError(f"formulas.toml: expected a label with {sorted(_KEYS)}, got {label!r} = {entry!r}")
            found.append(Item(label, **{**entry, "data": tuple(entry.get("data", ()))}))
    if content:
        raise ValueError(f"formulas.toml: unknown tables {sorted(content)}")
    return found


def labels_of(docstring: str) -> list[str]:
    """Labels in the ``Source: thesis`` lines of a docstring.

    Raises
    ------
    ValueError
        If such a line holds anything but labels, commas and a full stop.
    """
    found: list[str] = []
    for line in _SOURCE.findall(docstring):
        own = LABEL.findall(line)
        if not own or line.rstrip() != ", ".join(own) + ".":
            raise ValueError(f'expected a line such as "Source: thesis (D-27), (D-30).", got "Source: thesis {line}"')
        found += own
    return found


def carriers() -> dict[str, list[Carrier]]:
    """Label to the code that carries it, from the source files: nothing is imported."""
    found: dict[str, list[Carrier]] = {}
    for path in sorted((ROOT / "exo_pin").rglob("*.py")):
        shown = path.relative_to(ROOT).as_posix()
        for name, docstring in _docstrings(ast.parse(path.read_text(encoding="utf-8"))):
            for label in labels_of(docstring):
                found.setdefault(label, []).append(Carrier(shown, name))
    return found


def _docstrings(tree: ast.Module) -> Iterator[tuple[str, str]]:
    """Qualified name and docstring of a module, its classes, functions and methods."""
    left: list[tuple[str, ast.Module | ast.ClassDef | ast.FunctionDef]] = [("", tree)]
    while left:
        name, node = left.pop()
        yield name, ast.get_docstring(node) or ""
        children = (child for child in node.body if isinstance(child, ast.ClassDef | ast.FunctionDef))
        left += [(f"{name}.{child.name}".lstrip("."), child) for child in children]


def labels_in(source: str) -> set[str]:
    """Labels that a row of the ledger is about, from its source such as "(4-3) to (4-6)" or "Tables 3-4 and B-1"."""
    found = set(LABEL.findall(source))
    for part, first, last in _RANGE.findall(source):
        found |= {f"({part}-{k})" for k in range(int(first), int(last) + 1)}
    for names in _TABLES.findall(source):
        found |= {f"Table {name}" for name in re.findall(r"[A-D\d]-\d+[a-c]?", names)}
    return found


def verdicts(rows: Iterable[Row]) -> dict[str, Counter[str]]:
    """Label to the ledger's verdicts on it, with their numbers."""
    found: dict[str, Counter[str]] = {}
    for row in rows:
        for label in labels_in(row.source):
            found.setdefault(label, Counter())[row.verdict] += 1
    return found


def page(rows: Iterable[Row]) -> str:
    """The tables as Markdown; ``rows`` are those of the ledger."""
    code, verdict = carriers(), verdicts(rows)
    chapters: dict[str, list[Item]] = {}
    for item in items():
        chapters.setdefault(item.chapter, []).append(item)
    lines = [_pictures(one for each in chapters.values() for one in each)]
    for chapter in sorted(chapters, key=lambda one: (one.startswith("Appendix"), one)):
        lines += [f"## {chapter}\n", "| label | what it is | code | ledger | misprint or change |", "| --- " * 5 + "|"]
        listed = (one for one in chapters[chapter] if one.not_computed not in _WITHOUT_NUMBERS)
        for item in sorted(listed, key=lambda one: "(TF".index(one.label[0])):
            cells = [item.label, item.about, _code(item, sorted(code.get(item.label, [])))]
            cells += [_verdict(verdict.get(item.label, Counter())), item.note]
            lines.append("| " + " | ".join(cell.replace("|", "\\|") for cell in cells) + " |")
        lines.append("")
    return "\n".join(lines)


def _pictures(all_of_it: Iterable[Item]) -> str:
    """Labels of the figures that have no numbers to compute, in a sentence for each reason."""
    found: dict[str, list[str]] = {}
    for item in all_of_it:
        if item.not_computed in _WITHOUT_NUMBERS:
            found.setdefault(item.not_computed, []).append(item.label.removeprefix("Figure "))
    lines = [
        f"Figures that are {_WITHOUT_NUMBERS[why]}: {', '.join(sorted(labels, key=_in_order))}."
        for why, labels in found.items()
    ]
    return textwrap.fill(" ".join(lines), 120) + "\n"


def _in_order(label: str) -> tuple[str, int]:
    """Key by which 2-9 comes before 2-10."""
    part, _, number = label.partition("-")
    return part, int(number)


def _code(item: Item, code: list[Carrier]) -> str:
    """Links to the code and the data, or why there is none."""
    if item.not_computed:
        return f"not computed: {item.not_computed}"
    links = [f"[`{carrier.dotted}`](../../{carrier.path})" for carrier in code]
    return ", ".join(links + [f"[{Path(path).name}](../../{path})" for path in item.data])


def _verdict(count: Counter[str]) -> str:
    """The one verdict, or how often each of several."""
    if len(count) == 1:
        return next(iter(count))
    return "; ".join(f"{number} {verdict}" for verdict, number in count.most_common())


if __name__ == "__main__":
    sys.stdout.write(page(ledger()))
