"""The options of each command, as ``options.toml`` has them."""

from __future__ import annotations

import argparse
import tomllib
from functools import cache
from pathlib import Path
from pkgutil import resolve_name
from typing import Any

PICTURES = (".png", ".svg", ".pdf")
#: Keys of an option that say which kind of value it has, and how it is called in the help.
_KINDS = {"number": float, "count": int, "path": Path, "text": str}
#: Keys that argparse has, too.
_AS_THEY_ARE = ("dest", "nargs", "const", "required", "choices", "default")


@cache
def _table() -> dict[str, Any]:
    return tomllib.loads(Path(__file__).with_name("options.toml").read_text(encoding="utf-8"))


def subcommands(name: str) -> dict[str, str]:
    """Commands within a command, such as ``muscle-force``, and their lines of help."""
    return {each: entry["help"] for each, entry in _table().items() if each.startswith(f"{name}-") and "help" in entry}


def add_options(parser: argparse.ArgumentParser, name: str) -> None:
    """Give the parser of a command its options."""
    table = _table()
    own = table.get(name, {})
    options: dict[str, Any] = {}
    for group in own.get("shared", ()):
        options |= table["shared"][group]
    either = own.get("one_of", ())
    group = parser.add_mutually_exclusive_group(required=True) if either else None
    for option, entry in (options | own.get("options", {})).items():
        to = group if group is not None and option in either else parser
        _add(to, option, {key: _resolved(value) for key, value in entry.items()})
    for option, now in own.get("moved", {}).items():
        parser.add_argument(
            f"--{option.replace('_', '-')}", action=_Moved, const=now, nargs="*", help=argparse.SUPPRESS
        )
    _add_outputs(parser, tuple(own.get("out", ())), own.get("plot", ""), own.get("pages", ""))
    if "pictures" in own:
        parser.set_defaults(endings={"plot": own["pictures"]})
    if "needs" in own:
        parser.set_defaults(extras=own["needs"])


def _resolved(value: Any) -> Any:
    """A value, or what it names in the package: words, or a function that returns them."""
    if isinstance(value, dict):
        return {key: _resolved(each) for key, each in value.items()}
    if not isinstance(value, str) or not value.startswith("@"):
        return value
    found = resolve_name(f"exo_pin.{value[1:]}")
    return found() if callable(found) else found


def _add(parser: argparse._ActionsContainer, name: str, entry: dict[str, Any]) -> None:
    """Add one option."""
    how = {key: entry[key] for key in _AS_THEY_ARE if key in entry}
    for key, kind in _KINDS.items():
        if key in entry:
            called = entry[key]
            how |= {"type": kind, "metavar": tuple(called) if isinstance(called, list) else called}
    if "choices" in how:
        how["choices"] = tuple(how["choices"])
    if isinstance(how.get("default"), tuple):
        how["default"] = _joined(how["default"], ",")
    if "yes_or_no" in entry:
        how["action"] = argparse.BooleanOptionalAction
    elif "repeated" in entry:
        how |= {"action": "append", "default": []}
    elif not {"type", "choices"} & set(how):
        how["action"] = "store_true"
    said = entry["help"].format_map({key: _joined(value, ", ") for key, value in entry.get("names", {}).items()})
    if "default" in entry and "default" not in said:
        said += f" (default {_joined(how['default'], ',')})"
    parser.add_argument(name, **how, help=said)


def _joined(value: Any, between: str) -> str:
    """A word, a number, or several with something between them."""
    several = (value,) if isinstance(value, str | float | int) else value
    return between.join(f"{each:g}" if isinstance(each, float) else str(each) for each in several)


def _add_outputs(parser: argparse.ArgumentParser, endings: tuple[str, ...], plot: str, pages: str) -> None:
    """Add ``--out`` for files with these endings, ``--json`` where one is .json, and ``--plot``."""
    if ".json" in endings:
        parser.add_argument("--json", action="store_true", help="print JSON instead of text")
    if endings:
        parser.add_argument("--out", type=Path, metavar="FILE", help=f"write the data too: {', '.join(endings)}")
    pictures: tuple[str, ...] = (*PICTURES, ".html") if pages else PICTURES
    if plot:
        shown = f"{plot}: {', '.join(PICTURES)}" + (f"; {pages}: .html" if pages else "")
        parser.add_argument("--plot", type=Path, metavar="FILE", help=f"write a picture too, {shown}")
    if endings or plot:
        parser.set_defaults(endings={"out": endings} | ({"plot": pictures} if plot else {}))


class _Moved(argparse.Action):
    """An option of earlier releases: refused, with what is given in its place."""

    def __init__(self, *args: Any, **options: Any) -> None:
        super().__init__(*args, **{**options, "default": argparse.SUPPRESS})

    def __call__(self, parser: argparse.ArgumentParser, _: Any, __: Any, option: str | None = None) -> None:
        parser.error(f"{option} is now {self.const}")
