"""The part of YAML that a robot's file needs: lists and mappings of texts, whole numbers and nothing.

PyYAML's parser gives events, of which the values are made here: a file can make no other type (dates, sets, objects),
and no work beyond its own length. Aliases, which stand for the value of an anchor and may be nested to any size, and
tags are errors; a merge key is a key like others. A plain scalar is a whole number if it looks like one, None if it is
empty, ``~`` or ``null``, and a text otherwise.
"""

from __future__ import annotations

import re
from typing import Any

from ...core.errors import FileFormatError, MissingExtra

__all__ = ["parse_yaml"]

#: Lists and mappings within each other.
_DEEPEST = 32
#: No leading zeros, which are octal in some versions of YAML; within 64 bits.
_INTEGER = re.compile(r"[-+]?(0|[1-9][0-9]{0,17})")
_NOTHING = ("", "~", "null", "Null", "NULL")


def parse_yaml(text: str) -> Any:
    """The value of a YAML text.

    Raises
    ------
    FileFormatError
        If it is not YAML, has an alias, a tag, a second document, a key that is no text or is given twice in a mapping,
        or is nested deeper than 32 levels. The message names the line.
    MissingExtra
        If PyYAML is not installed.
    """
    try:
        import yaml
    except ImportError as error:
        raise MissingExtra("robots", "PyYAML") from error
    # The outermost list has the document as its only item.
    found: list[Any] = []
    open_values: list[Any] = [found]
    keys: list[str | None] = [None]
    try:
        for event in yaml.parse(text, yaml.SafeLoader):
            line = event.start_mark.line + 1
            if isinstance(event, yaml.CollectionEndEvent):
                open_values.pop()
                keys.pop()
            elif isinstance(event, yaml.NodeEvent):
                _refuse(event, line)
                into, key = open_values[-1], keys[-1]
                if isinstance(into, dict) and key is None:
                    keys[-1] = _key(event, into, line)
                    continue
                value = _value(event)
                if isinstance(into, dict):
                    into[key] = value
                    keys[-1] = None
                else:
                    into.append(value)
                if isinstance(event, yaml.CollectionStartEvent):
                    open_values.append(value)
                    keys.append(None)
                    if len(open_values) > _DEEPEST + 1:
                        raise FileFormatError(f"line {line}: nested deeper than {_DEEPEST} levels")
    except FileFormatError:
        raise
    except (yaml.YAMLError, ValueError, OverflowError) as error:  # a number in a directive or an escape that is none
        raise FileFormatError(f"not YAML: {error}") from None
    if len(found) > 1:
        raise FileFormatError("expected one YAML document, there are more")
    return found[0] if found else None


def _refuse(event: Any, line: int) -> None:
    import yaml

    if isinstance(event, yaml.AliasEvent):
        raise FileFormatError(f"line {line}: the alias *{event.anchor} is not read: write the value itself")
    if event.tag is not None:
        raise FileFormatError(f"line {line}: the tag {event.tag} is not read: leave it out")


def _key(event: Any, known: dict[str, Any], line: int) -> str:
    import yaml

    if not isinstance(event, yaml.ScalarEvent):
        raise FileFormatError(f"line {line}: expected a text as a key, got a list or mapping")
    if event.value in known:
        raise FileFormatError(f"line {line}: {event.value!r} is given twice")
    return str(event.value)


def _value(event: Any) -> Any:
    import yaml

    if not isinstance(event, yaml.ScalarEvent):
        return [] if isinstance(event, yaml.SequenceStartEvent) else {}
    if not event.implicit[0]:
        return event.value
    if event.value in _NOTHING:
        return None
    return int(event.value) if _INTEGER.fullmatch(event.value) else event.value
