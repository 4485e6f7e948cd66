"""Documents: what ``to_json`` and ``--json`` write, each with a versioned schema that msgspec makes from its record.

A record's fields and properties have types, which msgspec makes a schema of, and a docstring, from which descriptions
and units come. Arrays are numbers within lists as deep as the array; a number that is not finite is null. A version
counts up when a name goes or changes its meaning; a name that is added is no new version.
"""

from __future__ import annotations

import builtins
import dataclasses
import re
import sys
import types
from collections.abc import Mapping, Sequence
from functools import cache, cached_property
from typing import Annotated, Any, Literal, NamedTuple, Union, get_args, get_origin, get_type_hints

import numpy as np
from scipy.spatial.transform import Rotation

from .errors import FileFormatError, UnknownName
from .errors.base import echo

_PREFIX = "exo_pin."
#: Versions above the first.
VERSIONS = {"parts": 2}
#: What a description says of the unit: after a comma, a blank or "in ", before a stop of the sentence or a word.
_UNIT = re.compile(
    r"(?:^|[ ,(])(N m s/rad|N m/rad|N s/m|kg m²|N m|N/m|N s|m/s²|m/s|rad/s²|rad/s|m/rad|1/m|°/s|mm/°|°/mm|mm|percent"
    r"|degrees(?! of freedom)|dimensionless|share|°|%|rad|Pa|bar|kg|N|m|s|W|J|Hz)"
    r"(?=$|[.,:;)]| each| of | in | about | and | or | for | that | where )"
)
#: Units that names end in.
_SUFFIXES = {
    "deg_s": "°/s", "deg": "°", "mm": "mm", "m": "m", "kg": "kg", "N": "N", "kPa": "kPa", "percent": "%", "W": "W",
    "rad": "rad", "s": "s", "Nm": "N m",
}  # fmt: skip
_SUFFIX = re.compile(rf"(?<!_per)_({'|'.join(_SUFFIXES)})$")
#: Where the unit stands, if it is that of each number.
_ELSEWHERE = re.compile(r"own unit|ends? in|in ``unit``|by name")
_SHAPE = re.compile(r"[Ss]hape \([^)]*\)")
_WORDS = {"percent": "%", "degrees": "°", "dimensionless": "1", "share": "1"}
_FLAT = {"Numbers": ["number", "null"], "Flags": ["boolean"], "Texts": ["string"]}


class _Member(NamedTuple):
    """A member of a document: its type, what it is, its unit ("" of what has none), and whether it is always there."""

    hint: Any
    text: str
    unit: str
    required: bool


class _Reference(type):
    """Of types that stand for a definition of the schema."""


@cache
def _reference(name: str) -> type:
    return _Reference(name, (), {})


def name_of(kind: type) -> str:
    """The name of the documents of a record: ``joint_contact`` of ``JointContact``."""
    return re.sub(r"(?<=[a-z])(?=[A-Z])", "_", kind.__name__).lower()


def identifier(name: str) -> str:
    """What a document says it is: its name and version."""
    return f"{_PREFIX}{name}/{VERSIONS.get(name, 1)}"


def checked_identifier(document: Any, names: Sequence[str]) -> str:
    """The name of a document's schema.

    Raises
    ------
    FileFormatError
        If it says nothing, or is of another version than the one that is written today.
    UnknownName
        If there is no such schema.
    """
    said = document.get("schema") if isinstance(document, Mapping) else None
    found = re.fullmatch(rf"{re.escape(_PREFIX)}(\w+)/(\d+)", said) if isinstance(said, str) else None
    if found is None:
        raise FileFormatError(f'expected a document with "schema": "{_PREFIX}NAME/VERSION", got {echo(said)}')
    name, version = found[1], int(found[2])
    if name not in names:
        raise UnknownName("schema", name, names)
    if said != identifier(name):
        age = "an older" if version < VERSIONS.get(name, 1) else "a newer"
        raise FileFormatError(f"expected {identifier(name)}, got {said}, which {age} version of exo_pin has written")
    return name


@cache
def members(kind: type) -> dict[str, _Member]:
    """Members of the documents of a record, in the order in which they are described."""
    if (described := getattr(kind, "_document", None)) is not None:
        return members(described)
    hints = _hints(kind)
    hidden: frozenset[str] = getattr(kind, "_hidden", frozenset())
    named = (
        {each.name: each.default is dataclasses.MISSING for each in dataclasses.fields(kind)}
        if not _is_named(kind)
        else dict.fromkeys(getattr(kind, "_fields", ()), True)
    )
    own = {
        name: (hints[name], required)
        for name, required in named.items()
        if name not in hidden and not name.startswith("_")
    }
    texts = _attributes(kind)
    for name in getattr(kind, "_derived", ()):
        made = next(vars(base)[name] for base in kind.__mro__ if name in vars(base))
        function = made.func if isinstance(made, cached_property) else made.fget
        own[name] = (_hints(function).get("return", Any), True)
        texts[name] = " ".join((function.__doc__ or "").split("\n\n")[0].split()), 0, 1
    found, of_result = {}, hasattr(kind, "as_dict")
    for name, (hint, required) in own.items():
        text, *place = texts.get(name, ("", 0, 1))
        ends = _SUFFIX.search(name)
        unit = _SUFFIXES[ends[1]] if ends else unit_in(text, *place)
        # What may be numbers and else has the unit that is named, and none besides.
        has_unit = _are_numbers(hint) or (unit != "1" and any(map(_are_numbers, get_args(hint))))
        unit = unit if has_unit else ""
        found[name] = _Member(hint, text, unit, required and not of_result)
    for extra in getattr(kind, "_described", ()):
        found |= {name: each._replace(required=False) for name, each in members(extra).items()}
    if of_result:
        found["verdict"] = _Member(str, "The answer in a sentence.", "", False)
        found["cautions"] = _Member(list[str], "What to mind, a sentence each.", "", False)
    return found


def document(kind: type, body: Mapping[str, Any], name: str | None = None) -> dict[str, Any]:
    """A document of a record: what it says it is, units of the members that it has, and these."""
    return {"schema": identifier(name or name_of(kind)), "units": _present(units_of(kind), body), **body}


def _present(units: Mapping[str, Any], body: Any) -> dict[str, Any]:
    """Units of members that are there."""
    found: dict[str, Any] = {}
    for name, unit in units.items():
        value = body.get(name) if isinstance(body, Mapping) else getattr(body, name, None)
        if value is not None:
            # Of lists and mappings of records those of every record.
            kept = _present(unit, value) if isinstance(unit, Mapping) else {}
            found[name] = kept or unit
    return found


@dataclasses.dataclass(frozen=True)
class OnDesign:
    """Base of records with several answers on a design.

    Attributes
    ----------
    mechanism : str
        Name of the design.
    side : str
        Side of the body.
    """

    mechanism: str
    side: str


def joined(kind: type, exo: Any, **answers: Any) -> dict[str, Any]:
    """A document of several answers on a design."""
    return document(kind, {"mechanism": exo.name, "side": exo.side, **answers})


def unit_in(text: str, place: int = 0, count: int = 1) -> str:
    """The units that a description names, the first two: "N, N m"; "1" where it names none, "" where others say it.

    Where it describes several members, and names as many units, each has the one at its place: "s, m, m or rad".
    """
    if _ELSEWHERE.search(text):
        return ""
    text, groups, end = _SHAPE.sub("", text), [list[str]()], 0
    for each in _UNIT.finditer(text):
        if groups[-1] and not re.search(r"\bor\b", text[end : each.start(1)]):
            groups.append([])
        groups[-1].append(_WORDS.get(each[1], each[1]))
        end = each.end(1)
    chosen = groups[place] if len(groups) == count else [unit for group in groups for unit in group]
    found = list(dict.fromkeys(chosen))[:2]
    return "1" if found[:1] in ([], ["1"]) else ", ".join(found)


@cache
def units_of(kind: type) -> Mapping[str, Any]:
    """Unit of each member that has one, by name, as the members are nested."""
    found: dict[str, Any] = {}
    for name, member in members(kind).items():
        inner = [each for each in _records(member.hint) if each is not kind]
        nested = {key: value for each in inner for key, value in units_of(each).items()}
        if member.unit or nested:
            found[name] = nested or member.unit
    return types.MappingProxyType(found)


def schema_of(kind: type, name: str | None = None) -> dict[str, Any]:
    """JSON schema (2020-12) of the documents of a record."""
    import msgspec  # here, because few commands need it

    title = f"{kind.__name__.strip('_').removesuffix('Document')}Document"
    structs = [_struct(kind, title, is_root=True), *(_struct(each, each.__name__) for each in reachable(kind))]
    _, definitions = msgspec.json.schema_components(structs, schema_hook=_hook, ref_template="#/$defs/{name}")
    definitions |= _array_schemas()
    root = definitions[title]
    said = identifier(name or name_of(kind))
    root["properties"] = {"schema": {"const": said}} | root["properties"]
    root["required"] = ["schema", *root.get("required", [])]
    about = {"$schema": "https://json-schema.org/draft/2020-12/schema", "$id": said}
    return {**about, "$ref": f"#/$defs/{title}", "$defs": definitions}


def _array_schemas() -> dict[str, Any]:
    definitions: dict[str, Any] = {}
    for array, flat in _FLAT.items():
        nested = {"type": "array", "items": {"$ref": f"#/$defs/{array}"}}
        definitions[array] = {"anyOf": [{"type": flat}, nested], "description": "in lists as deep as the array"}
    quaternions = {"quaternions_xyzw": {"$ref": "#/$defs/Numbers"}}
    definitions["Rotation"] = {"type": "object", "properties": quaternions, "required": list(quaternions)}
    return definitions


def input_schemas(*kinds: type) -> dict[str, Any]:
    """JSON schemas of records as questions state them, by their names, without members that would be records."""
    import msgspec

    structs = [_struct(kind, kind.__name__) for kind in kinds]
    _, definitions = msgspec.json.schema_components(structs, schema_hook=_hook, ref_template="#/$defs/{name}")
    for kind in kinds:
        members_of = definitions[kind.__name__]["properties"]
        for each in dataclasses.fields(kind):
            if _records(_hints(kind)[each.name]):
                del members_of[each.name]
            elif each.default is not dataclasses.MISSING:
                _state_default(members_of[each.name], each.default)
    return dict(definitions) | _array_schemas()


def _state_default(member: dict[str, Any], default: Any) -> None:
    """Say the default of a record, which has null only where that is it."""
    if default is not None and "anyOf" in member:
        member["anyOf"] = [each for each in member["anyOf"] if each != {"type": "null"}]
    member["default"] = list(default) if isinstance(default, tuple) else default


def _struct(kind: type, title: str, is_root: bool = False) -> Any:
    import msgspec

    fields: list[Any] = []
    if is_root:
        fields += [("units", dict[str, Any]), ("device", dict[str, Any], None), ("provenance", dict[str, Any], None)]
    for name, member in members(kind).items():
        unit = {"unit": member.unit} if member.unit else {}
        said = re.sub(r"\bNone\b", "null", member.text)
        described = msgspec.Meta(description=said or None, extra_json_schema=unit or None)
        own = _json_type(member.hint)
        own = own if member.required or own is Any else own | None
        fields.append((name, Annotated[own, described], *(() if member.required else (None,))))
    made = msgspec.defstruct(title, sorted(fields, key=len), forbid_unknown_fields=True, kw_only=True)
    made.__doc__ = " ".join((kind.__doc__ or "").split("\n\n")[0].split())
    return made


def _hook(kind: type) -> dict[str, Any]:
    each = [{"$ref": f"#/$defs/{name}"} for name in kind.__name__.split("|")]
    return {"anyOf": each} if len(each) > 1 else each[0]


def _json_type(hint: Any) -> Any:
    """The type of a value as :func:`exo_pin.core.results.plain` writes it."""
    origin, inner = get_origin(hint), get_args(hint)
    if hint is np.ndarray or origin is np.ndarray:
        kinds = {"b": "Flags", "U": "Texts", "O": "Texts"}
        dtype = get_args(inner[1])[0] if inner and get_args(inner[1]) else float
        return _reference(kinds.get(np.dtype(dtype).kind if isinstance(dtype, type) else "f", "Numbers"))
    if hint is Rotation:
        return _reference("Rotation")
    if hint in (float, np.float64):
        return float | None
    if origin in (Union, types.UnionType):
        each = [_json_type(own) for own in inner]
        if Any in each:
            return Any
        names = "|".join(own.__name__ for own in each if isinstance(own, _Reference))
        others = [own for own in each if not isinstance(own, _Reference)]
        return Union[(*others, *([_reference(names)] if names else []))]
    if origin is tuple or origin is list or (isinstance(origin, type) and issubclass(origin, Sequence)):
        each = list(dict.fromkeys(_json_type(own) for own in inner if own is not Ellipsis))
        return list[_json_type(Union[tuple(own for own in inner if own is not Ellipsis)])] if each else list  # type: ignore[misc]  # noqa: UP007
    if isinstance(origin, type) and issubclass(origin, Mapping):
        return dict[str, _json_type(inner[1])]  # type: ignore[misc]
    if _is_record(hint):
        return _reference(hint.__name__)
    return hint if hint in (int, str, bool, type(None)) or origin is Literal else Any


def _is_record(hint: Any) -> bool:
    return isinstance(hint, type) and (dataclasses.is_dataclass(hint) or _is_named(hint))


def _is_named(hint: type) -> bool:
    return issubclass(hint, tuple) and hasattr(hint, "_fields")


def _are_numbers(hint: Any) -> bool:
    """Whether values of a type are numbers."""
    own = _json_type(hint)
    every = [own, *get_args(own)]
    every += [item for each in every for item in get_args(each)]
    return any(each in (float, _reference("Numbers")) for each in every)


def _records(hint: Any) -> list[type]:
    """Records within a type."""
    return [hint] if _is_record(hint) else [each for own in get_args(hint) for each in _records(own)]


def reachable(kind: type) -> list[type]:
    """Records within a record, however deep."""
    found: list[type] = []
    left = [kind]
    while left:
        inner = [each for member in members(left.pop(0)).values() for each in _records(member.hint)]
        left += [each for each in dict.fromkeys(inner) if each not in found]
        found += [each for each in dict.fromkeys(inner) if each not in found]
    return found


class _Names(dict[str, Any]):
    """Names of a module; what it has for type checkers alone is anything."""

    def __missing__(self, name: str) -> Any:
        if hasattr(builtins, name):
            raise KeyError(name)
        return Any


def _hints(owner: Any) -> dict[str, Any]:
    spaces = [vars(sys.modules[base.__module__]) for base in reversed(getattr(owner, "__mro__", ()))]
    if not spaces:
        spaces = [owner.__globals__]
    names = _Names({name: value for space in spaces for name, value in space.items()})
    return get_type_hints(owner, localns=names)


def _attributes(kind: type) -> dict[str, tuple[str, int, int]]:
    """Descriptions of attributes in the docstring of a record and its bases, in a line each; for which of how many."""
    from docstring_parser import parse_from_object  # here, because few answers need it

    found: dict[str, tuple[str, int, int]] = {}
    for base in reversed(kind.__mro__):
        if (dataclasses.is_dataclass(base) or _is_named(base)) and base.__doc__:
            for each in parse_from_object(base).params:
                text = " ".join((each.description or "").split())
                names = each.arg_name.split(",")
                found |= {name.strip(): (text, place, len(names)) for place, name in enumerate(names)}
    return found
