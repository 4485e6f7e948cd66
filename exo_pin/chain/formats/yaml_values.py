"""The part of YAML that a robot's file needs: lists and mappings of texts and nothing.

The nodes that PyYAML composes become values: a file can make no other type (numbers, dates, sets, objects), and no
work beyond its own length. Aliases, which stand for the value of an anchor and may be nested to any size, and tags are
errors; a merge key is a key like others. A plain scalar is None if it is empty, ``~`` or ``null``, else a text.
"""

from __future__ import annotations

from typing import Any

from ...core.errors import FileFormatError, MissingExtra

#: Lists and mappings within each other.
_DEEPEST = 32
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
    depth = 0
    try:
        # Before nodes are composed, which calls itself once a level.
        for event in yaml.parse(text, yaml.BaseLoader):
            line = event.start_mark.line + 1
            if isinstance(event, yaml.AliasEvent):
                raise FileFormatError(f"line {line}: the alias *{event.anchor} is not read: write the value itself")
            if isinstance(event, yaml.NodeEvent) and event.tag is not None:
                raise FileFormatError(f"line {line}: the tag {event.tag} is not read: leave it out")
            depth += isinstance(event, yaml.CollectionStartEvent) - isinstance(event, yaml.CollectionEndEvent)
            if depth > _DEEPEST:
                raise FileFormatError(f"line {line}: nested deeper than {_DEEPEST} levels")
        node = yaml.compose(text, yaml.BaseLoader)
    except FileFormatError:
        raise
    except yaml.composer.ComposerError:
        raise FileFormatError("expected one YAML document, there are more") from None
    except (yaml.YAMLError, ValueError, OverflowError) as error:  # a number in a directive or an escape that is none
        raise FileFormatError(f"not YAML: {error}") from None
    return None if node is None else _value(node)


def _value(node: Any) -> Any:
    if node.id == "scalar":
        return None if node.style is None and node.value in _NOTHING else node.value
    if node.id == "sequence":
        return [_value(item) for item in node.value]
    found: dict[str, Any] = {}
    for key, value in node.value:
        line = key.start_mark.line + 1
        if key.id != "scalar":
            raise FileFormatError(f"line {line}: expected a text as a key, got a list or mapping")
        if key.value in found:
            raise FileFormatError(f"line {line}: {key.value!r} is given twice")
        found[key.value] = _value(value)
    return found
