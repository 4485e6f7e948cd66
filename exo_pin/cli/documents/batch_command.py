"""``exo-pin batch``: questions in JSON lines, answers in JSON lines."""

from __future__ import annotations

import inspect
import json
import sys
import warnings
from collections.abc import Callable, Mapping
from contextlib import nullcontext
from dataclasses import dataclass
from functools import lru_cache
from pathlib import Path
from typing import Annotated, Any, NoReturn

from scipy.spatial.transform import Rotation

from ...core.errors import ExoPinError, InvalidInput, UnknownName
from ...core.errors.base import echo
from ...core.progress import track
from ...core.results import plain
from ...core.schema import checked_identifier, document
from ...core.validation import as_choice, require_type
from ...design import Wearer
from ...device.protocol import described
from ...exo.loading import load
from ...exo.shoulder_exo import ShoulderExo
from ...load_case import Load, Motion
from ...reaction.assumptions import Within
from ..options import Progress, called
from ..search_commands import workspace_document

#: Questions, which are methods of a ShoulderExo.
QUESTIONS = (
    "reaction", "joint_contact", "workspace", "uncertainty", "remedy", "inverse_kinematics", "singularity", "accuracy",
    "check",
)  # fmt: skip
#: What a line has besides the arguments of its question.
_OWN = ("schema", "id", "question", "design", "side", "worn_by")
_NOT_HERE = ("self", "progress", "executor", "within")
_EXPECTED = (ExoPinError, OSError, TypeError, ValueError, OverflowError, RecursionError)


@dataclass(frozen=True)
class BatchError:
    """Why a question has no answer.

    Attributes
    ----------
    kind : str
        Name of the error.
    message : str
        What is wrong, and what was expected.
    """

    kind: str
    message: str


@dataclass(frozen=True)
class BatchAnswer:
    """A line that ``exo-pin batch`` prints, one for each question.

    Attributes
    ----------
    line : int
        Line of the question, from 1.
    id : object
        As in the question.
    question : str or None
        As in the question.
    answer : dict or None
        A document of its own schema.
    error : BatchError or None
        In place of the answer.
    warnings : list of str
        What was doubted on the way.
    """

    line: int
    id: Any
    question: str | None
    answer: dict[str, Any] | None
    error: BatchError | None
    warnings: list[str]


def batch(
    questions: Annotated[Path | None, called("FILE.jsonl")] = None,
    /,
    *,
    progress: Progress = False,
) -> int:
    """Answer questions in JSON lines, an answer a line; a line that is wrong is an error line, and the rest goes on.

    The exit status is 1 if any line failed.

    Parameters
    ----------
    questions : Path, optional
        A file with a question a line (default: the standard input).

    Examples
    --------
    exo-pin batch examples/questions.jsonl

    Notes
    -----
    members of a line, whose names are those of the Python call exo_pin.load(design, side).QUESTION(poses, ...):
      question       reaction, joint_contact, workspace, uncertainty, remedy, inverse_kinematics, singularity, accuracy
                     or check
      design, side   as in exo_pin.load (default: the design of exo-pin reaction)
      worn_by        whose arm it is, such as {"height": 1.75, "mass": 75, "sex": "male"}
      id             anything; the answer has it, too
      poses          {"flexion": 60, "abduction": [0, 30]}, degrees, or {"quaternions_xyzw": [0, 0, 0, 1]}; of workspace
                     also a step in degrees
      load, motion, person, criteria    objects with the names of exo_pin.Load, Motion, Person, Criteria
      and the other arguments of the question, such as split, limits, centre_offset
    such as
      {"question": "reaction", "design": "four-cables", "poses": {"flexion": 60}, "load": {"force": [0, 0, -20]}}
    The answer of a line has its schema: exo-pin schema batch_answer
    """
    failed = False
    with nullcontext(sys.stdin.buffer) if questions is None else questions.open("rb") as lines:
        for number, line in track(enumerate(lines, 1), "batch", progress):
            if line.strip():
                found = answered(line, number)
                failed |= found["error"] is not None
                print(json.dumps(found, ensure_ascii=False, allow_nan=False), flush=True)
    return int(failed)


def answered(line: bytes | str, number: int) -> dict[str, Any]:
    """The answer of a line, plain."""
    asked: Any = None
    body, error = None, None
    with warnings.catch_warnings(record=True) as doubts:
        warnings.simplefilter("always")
        try:
            asked = json.loads(line, parse_constant=_refuse)
            body = _answer(_object("a line", asked))
        except _EXPECTED as problem:
            error = BatchError(type(problem).__name__, " ".join(str(problem).split()))
    said = asked if isinstance(asked, dict) else {}
    question = said.get("question")
    known = {"line": number, "id": said.get("id"), "question": question if isinstance(question, str) else None}
    texts = [" ".join(str(doubt.message).split()) for doubt in doubts]
    return dict(plain(document(BatchAnswer, known | {"answer": body, "error": error, "warnings": texts})))


def _answer(asked: Mapping[str, Any]) -> dict[str, Any]:
    if "schema" in asked:
        checked_identifier(asked, ["batch_question"])
    name = as_choice("question", asked.get("question"), QUESTIONS)
    worn = asked.get("worn_by")
    exo = _loaded(asked.get("design", "four-cables"), asked.get("side"), None if worn is None else json.dumps(worn))
    method = getattr(exo, name)
    given = {key: value for key, value in asked.items() if key not in _OWN}
    allowed = [each for each in inspect.signature(method).parameters if each not in _NOT_HERE]
    allowed += list(Within.__annotations__) if "within" in inspect.signature(method).parameters else []
    for key in given:
        if key not in allowed:
            raise UnknownName(f"argument of {name}", key, (*allowed, *_OWN))
    found = method(**{key: _argument(exo, key, value) for key, value in given.items()})
    body = workspace_document(found) if name == "workspace" else found.document()
    return {**body, "device": described(exo.device)} if exo.has_arm else body


@lru_cache(maxsize=32)
def _loaded(design: str, side: Any, worn: str | None) -> ShoulderExo:
    require_type("design", design, str, "the name of a design or a file")
    exo = load(design, side=side)
    return exo if worn is None else exo.worn_by(_made(Wearer, "worn_by", json.loads(worn)))


def _argument(exo: ShoulderExo, name: str, value: Any) -> Any:
    """An argument of a method from plain data."""
    if name == "poses" and isinstance(value, dict):
        if "quaternions_xyzw" in value:
            return Rotation.from_quat(value["quaternions_xyzw"])
        return _made(exo.pose, name, value)
    if name == "person":
        from ...person import Person  # here, because few lines need it

        return _made(Person, name, {"side": exo.side, **_object(name, value)})
    if name == "criteria" and isinstance(value, dict):
        from ...workspace import Criteria

        return _made(Criteria, name, value)
    kinds: dict[str, Callable[..., Any]] = {"load": Load, "motion": Motion}
    return _made(kinds[name], name, value) if name in kinds and value is not None else value


def _made(make: Callable[..., Any], name: str, value: Any) -> Any:
    """What a callable makes of an object, whose names are checked."""
    known = list(inspect.signature(make).parameters)
    for key in _object(name, value):
        if key not in known:
            raise UnknownName(f"member of {name}", key, known)
    return make(**value)


def _object(name: str, value: Any) -> dict[str, Any]:
    if not isinstance(value, dict):
        raise InvalidInput(f"expected {name} to be a JSON object, got {echo(value)}")
    return value


def _refuse(constant: str) -> NoReturn:
    raise InvalidInput(f"expected JSON, got {constant}")
