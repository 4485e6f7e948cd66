"""The OpenAPI description of the service, from the records and docstrings of the package."""

from __future__ import annotations

import inspect
import json
import re
from pkgutil import resolve_name
from typing import Any

from docstring_parser import parse_from_object

from .. import __version__
from ..core.schema import input_schemas, schema_of
from ..design import DEFAULT_PRESET, Wearer, presets
from ..exo.questions import ANSWERS, FILES, OWN, QUESTIONS, arguments_of
from ..exo.shoulder_exo import ShoulderExo
from ..load_case import Load, Motion
from ..reaction import SPLITS
from ..reaction.assumptions import Weights
from ..workspace import Criteria
from .problems import JSON, MEDIA, PAGES

_NUMBERS = {"anyOf": [{"type": "number"}, {"type": "array", "items": {"type": "number"}}]}
_ANGLE = {**_NUMBERS, "description": "degrees, positive as named; lists are of one length"}
_LINES = {"type": "array", "items": {"type": "number"}, "minItems": 4, "maxItems": 4}
#: Arguments whose plain form is another than that of Python.
_PLAIN: dict[str, Any] = {
    "poses": {
        "anyOf": [
            {
                "type": "object",
                "properties": dict.fromkeys(("flexion", "abduction", "internal_rotation"), _ANGLE),
                "additionalProperties": False,
            },
            {
                "type": "object",
                "properties": {"quaternions_xyzw": {"anyOf": [_LINES, {"type": "array", "items": _LINES}]}},
                "required": ["quaternions_xyzw"],
                "additionalProperties": False,
            },
        ],
        "description": "Poses of the arm against the trunk: clinical angles, or rotations of {O_B} to {O_A}.",
    },
    "split": {"type": "string", "enum": list(SPLITS)},
    **{name: {"$ref": f"#/components/schemas/{kind}"} for name, kind in {
        "load": "Load", "motion": "Motion", "person": "Person", "criteria": "Criteria", "weights": "Weights",
        "options": "ContactOptions"}.items()},
}  # fmt: skip
_DESIGN = {
    "anyOf": [
        {"type": "string", "enum": presets()},
        {
            "type": "object",
            "properties": {key: {"type": "string", "description": f"text of {name}"} for key, name in FILES.items()},
            "additionalProperties": False,
            "oneOf": [{"required": ["toml"]}, {"required": ["urdf"]}],
        },
    ],
    "default": DEFAULT_PRESET,
    "description": "A preset, or the texts of the files of a design.",
}
_STATUSES = {
    400: "The body is no JSON.", 401: "The token is missing or wrong.", 403: "Host or Origin is not allowed.",
    408: "The request did not arrive in time.", 413: "The body is too large.", 415: "The body is not said to be JSON.",
    422: "A name or a value is wrong, or the answer would take more time or memory than there is.",
    500: "A fault of exo_pin.", 501: "A package of an extra is missing.", 503: "Too many questions wait.",
}  # fmt: skip


def openapi() -> dict[str, Any]:
    """The description: an address a question, its arguments, the schema of its answer, and of problems."""
    from ..person import ContactOptions, Person  # here, because its import takes long

    schemas: dict[str, Any] = {}
    roots = {}
    for name, path in {**ANSWERS, "problem": "service.problems:Problem"}.items():
        found = schema_of(resolve_name(f"exo_pin.{path}"), name)
        roots[name] = {"$ref": found["$ref"]}
        schemas |= found["$defs"]
    schemas |= input_schemas(Load, Motion, Criteria, Weights, ContactOptions, Wearer, Person)
    for name in ("Wearer", "Person"):
        in_degrees = {"type": "boolean", "default": False, "description": "Whether the angles are in degrees."}
        schemas[name]["properties"]["degrees"] = in_degrees
    paths = {f"/{name}": {"post": _asked(name, roots)} for name in QUESTIONS}
    for address, what in {"/health": "Whether it is there.", "/metrics": "Counts and times, for Prometheus."}.items():
        paths[address] = {"get": {"summary": what, "responses": {"200": {"description": what}}}}
    about = {"title": "exo_pin", "version": __version__, "license": {"name": "BSD-2-Clause"}}
    whole = {
        "openapi": "3.1.0",
        "info": about | {"summary": "The force that a parallel shoulder exoskeleton puts on the shoulder joint"},
        "paths": paths,
        "security": [{}, {"token": []}],
        "components": {
            "schemas": schemas,
            "securitySchemes": {"token": {"type": "http", "scheme": "bearer"}},
        },
    }
    made: dict[str, Any] = json.loads(json.dumps(whole).replace("#/$defs/", "#/components/schemas/"))
    return made


def _asked(name: str, roots: dict[str, Any]) -> dict[str, Any]:
    """One address: what is asked, and what is answered."""
    said = parse_from_object(getattr(ShoulderExo, name))
    answers = [roots[each] for each in QUESTIONS[name]]
    body = {"allOf": [roots["batch_answer"]], "properties": {"answer": {"anyOf": answers}}}
    problems = {
        str(status): {"description": text, "content": {MEDIA: {"schema": roots["problem"]}}}
        for status, text in _STATUSES.items()
    }
    content: dict[str, Any] = {JSON: {"schema": body}}
    if name == "report":
        content |= {media: {"schema": {"type": "string"}} for media in PAGES}
    answer = {"description": "The answer.", "content": content}
    return {
        "operationId": name,
        "summary": " ".join((said.short_description or "").split()),
        "requestBody": {"required": True, "content": {"application/json": {"schema": _question(name)}}},
        "responses": {"200": answer, **problems},
    }


def _question(name: str) -> dict[str, Any]:
    """The schema of a question, from the signature and docstring of its method."""
    method = getattr(ShoulderExo, name)
    texts: dict[str, str] = {}
    for each in parse_from_object(method).params:
        text = re.sub(r":\w+:`~?[\w.]*?(\w+)`", r"\1", " ".join((each.description or "").split()))
        texts |= {key.strip(): text for key in each.arg_name.split(",")}
    own: dict[str, Any] = {
        "id": {"description": "anything; the answer has it, too"},
        "question": {"const": name},
        "design": _DESIGN,
        "side": {"enum": ["left", "right"], "description": "Side of the body; that of the design if left out."},
        "worn_by": {"$ref": "#/components/schemas/Wearer"},
    }
    assert set(own) < set(OWN)
    signature = inspect.signature(method).parameters
    members, needed = dict(own), []
    for key in arguments_of(name):
        members[key] = {"description": texts.get(key, "")} | _PLAIN.get(key, {})
        if key == "poses" and name == "workspace":
            members[key] = {"anyOf": [{"type": "number"}, _PLAIN["poses"]], "description": texts[key]}
        if key in signature and signature[key].default is inspect.Parameter.empty:
            needed.append(key)
    return {"type": "object", "properties": members, "required": needed, "additionalProperties": False}
