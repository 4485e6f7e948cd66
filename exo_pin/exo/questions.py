"""Questions as plain data, such as JSON, and their answers as documents: one code for files, services and streams.

The members of a question have the names of the Python call ``exo_pin.load(design, side).QUESTION(poses, ...)``.
"""

from __future__ import annotations

import inspect
import json
import warnings
from collections.abc import Callable, Mapping
from dataclasses import dataclass
from functools import lru_cache
from pathlib import Path
from tempfile import TemporaryDirectory
from typing import Any, NoReturn

import numpy as np
from scipy.spatial.transform import Rotation

from ..core.conventions import as_side
from ..core.errors import ExoPinError, FileFormatError, InvalidInput, UnknownName
from ..core.errors.base import echo
from ..core.files.atomic import write_text
from ..core.results import plain
from ..core.schema import checked_identifier, document
from ..core.validation import as_choice, as_finite, require_type
from ..design import DEFAULT_PRESET, Wearer, presets
from ..device.protocol import described
from ..load_case import Load, Motion
from ..reaction.assumptions import Weights, Within
from ..workspace.summary import workspace_document
from .loading import load, load_design
from .shoulder_exo import ShoulderExo

#: Methods of a ShoulderExo, and the documents of their answers by the names of their schemas.
QUESTIONS = {
    "reaction": ("reaction",),
    "joint_contact": ("joint_contact",),
    "workspace": ("workspace_summary",),
    "uncertainty": ("force_uncertainty",),
    "remedy": ("remedy",),
    "inverse_kinematics": ("limb_state", "drive_positions"),
    "singularity": ("singularity", "device_singularity"),
    "accuracy": ("pose_accuracy",),
    "check": ("report",),
    "report": ("design_report",),
}
#: Module and record of each of these.
ANSWERS = {
    "reaction": "reaction.result:Reaction",
    "joint_contact": "person.contact.result:JointContact",
    "workspace_summary": "workspace.summary:WorkspaceSummary",
    "force_uncertainty": "uncertainty.force_uncertainty:ForceUncertainty",
    "remedy": "reaction.holding.remedy:Remedy",
    "limb_state": "wrist.kinematics.inverse:LimbState",
    "drive_positions": "device.device_singularity:DrivePositions",
    "singularity": "wrist.singularities.measures:Singularity",
    "device_singularity": "device.device_singularity:DeviceSingularity",
    "pose_accuracy": "device.accuracy.pose_accuracy:PoseAccuracy",
    "report": "consistency.report:Report",
    "design_report": "report.record:DesignReport",
    "batch_answer": "exo.questions:BatchAnswer",
}
#: What a question has besides the arguments of its method.
OWN = ("schema", "id", "question", "design", "side", "worn_by")
#: Files whose texts a question may hold, by the names of its members.
FILES = {"toml": "design.toml", "urdf": "robot.urdf", "closures": "robot.closures.toml", "device": "robot.device.toml"}
_NOT_HERE = ("self", "progress", "executor", "within", "file", "cone")
#: Length that a unit quaternion may be off.
_UNIT = 1e-3
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
    """The answer of a question: what ``exo-pin batch`` prints, one a line, and ``exo-pin serve`` answers.

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


def answered(line: bytes | str, number: int) -> dict[str, Any]:
    """The answer of a line of JSON, plain; what is wrong with it stands in its ``error``."""
    asked: Any = None
    body, error = None, None
    texts: list[str] = []
    try:
        asked = parsed(line)
        body, texts = doubted(lambda: answer(asked))
    except _EXPECTED as problem:
        error = BatchError(type(problem).__name__, " ".join(str(problem).split()))
        texts = getattr(problem, "_doubts", [])
    return answer_document(asked, number, body, error, texts)


def answer_document(
    asked: Any, number: int, body: Mapping[str, Any] | None, error: BatchError | None, texts: list[str]
) -> dict[str, Any]:
    """The document of an answer or an error."""
    said = asked if isinstance(asked, dict) else {}
    question = said.get("question")
    known = {"line": number, "id": said.get("id"), "question": question if isinstance(question, str) else None}
    return dict(plain(document(BatchAnswer, known | {"answer": body, "error": error, "warnings": texts})))


def doubted(ask: Callable[[], Any]) -> tuple[Any, list[str]]:
    """What a call returns, and what it warns of; the latter also stands in the error that it raises."""
    with warnings.catch_warnings(record=True) as doubts:
        warnings.simplefilter("always")
        try:
            found = ask()
        except Exception as problem:
            problem._doubts = _texts(doubts)  # type: ignore[attr-defined]
            raise
    return found, _texts(doubts)


def _texts(doubts: list[warnings.WarningMessage]) -> list[str]:
    return [" ".join(str(doubt.message).split()) for doubt in doubts]


def parsed(line: bytes | str) -> Any:
    """The value of a JSON text, without NaN and infinity."""
    return json.loads(line, parse_constant=_refuse)


def answer(asked: Any, files: bool = True) -> dict[str, Any]:
    """The answer of a question, as a document.

    Parameters
    ----------
    asked : mapping
        The question.
    files : bool
        Whether a design may be the path of a file here; otherwise it is the name of a preset, or stands in the
        question.

    Raises
    ------
    ExoPinError
        If a name or a value is wrong, as the method of that name raises it.
    """
    name, exo, arguments = understood(asked, files)
    return answer_of(name, exo, getattr(exo, name)(**arguments))


def answer_of(name: str, exo: ShoulderExo, found: Any) -> dict[str, Any]:
    """The document of what a method has returned."""
    body: dict[str, Any] = workspace_document(found) if name == "workspace" else found.document()
    return {**body, "device": described(exo.device)} if exo.has_arm else body


def understood(asked: Any, files: bool = True) -> tuple[str, ShoulderExo, dict[str, Any]]:
    """Method, design and arguments of a question, as :func:`answer` takes it."""
    asked = _object("a question", asked)
    if "schema" in asked:
        checked_identifier(asked, ["batch_question"])
    name = as_choice("question", asked.get("question"), QUESTIONS)
    design, worn = asked.get("design", DEFAULT_PRESET), asked.get("worn_by")
    if not files and isinstance(design, str):
        as_choice("design", design, presets())
    side = asked.get("side")
    require_type("side", side, (str, type(None)), "left or right")
    exo = _loaded(json.dumps(design), side, None if worn is None else json.dumps(worn))
    given = {key: value for key, value in asked.items() if key not in OWN}
    allowed = arguments_of(name)
    for key in given:
        if key not in allowed:
            raise UnknownName(f"argument of {name}", key, (*allowed, *OWN))
    _complete("the question", getattr(exo, name), given)
    if name != "workspace" and "poses" in given:
        _object("poses", given["poses"])  # a workspace takes a step in degrees, too
    return name, exo, {key: _argument(exo, key, value) for key, value in given.items()}


def arguments_of(name: str) -> list[str]:
    """Arguments of a method that a question may have."""
    known = inspect.signature(getattr(ShoulderExo, name)).parameters
    names = [*known, *(Within.__annotations__ if "within" in known else ())]
    return [each for each in names if each not in _NOT_HERE]


@lru_cache(maxsize=32)
def _loaded(design: str, side: Any, worn: str | None) -> ShoulderExo:
    given = json.loads(design)
    exo = _stated(given, side) if isinstance(given, dict) else _of_name(given, side)
    return exo if worn is None else exo.worn_by(_made(Wearer, "worn_by", json.loads(worn)))


def _of_name(design: Any, side: Any) -> ShoulderExo:
    require_type("design", design, str, "the name of a design, a file, or an object with the texts of its files")
    return load(design, side=side)


def _stated(design: dict[str, Any], side: Any) -> ShoulderExo:
    """A design whose files stand in the question."""
    for key, text in design.items():
        as_choice("member of design", key, FILES)
        require_type(f"design.{key}", text, str, "the text of a file")
    if len({"toml", "urdf"} & set(design)) != 1 or ("toml" in design and len(design) > 1):
        raise InvalidInput(f"expected design with toml alone, or with urdf, got {', '.join(design) or 'nothing'}")
    with TemporaryDirectory() as folder:
        for key, text in design.items():
            write_text(Path(folder, FILES[key]), text)
        try:
            if "urdf" in design:
                return load(Path(folder, FILES["urdf"]), side=side)
            # Not load, which follows a file that points to another one.
            exo = load_design(Path(folder, FILES["toml"]))
            return exo if side is None or as_side(side) == exo.side else exo.mirrored()
        except FileFormatError as error:
            raise FileFormatError(str(error).replace(f"{folder}/", "")) from error


def _argument(exo: ShoulderExo, name: str, value: Any) -> Any:
    """An argument of a method from plain data."""
    if name == "poses" and isinstance(value, dict):
        return _rotation(value) if "quaternions_xyzw" in value else _made(exo.pose, name, value)
    if name == "person":
        from ..person import Person  # here, because few questions need it

        return _made(Person, name, {"side": exo.side, **_object(name, value)})
    if name == "criteria" and isinstance(value, dict):
        from ..workspace import Criteria

        return _made(Criteria, name, value)
    kinds: dict[str, Callable[..., Any]] = {"load": Load, "motion": Motion, "weights": Weights}
    if name == "options" and value is not None:
        from ..person import ContactOptions

        kinds[name] = ContactOptions
    return _made(kinds[name], name, value) if name in kinds and value is not None else value


def _rotation(value: dict[str, Any]) -> Rotation:
    if len(value) > 1:
        raise InvalidInput(f"expected quaternions_xyzw alone, got {', '.join(value)}")
    given = as_finite("quaternions_xyzw", value["quaternions_xyzw"], (4,), stack=True)
    size = np.linalg.norm(given, axis=-1)
    if np.abs(size - 1.0).max(initial=0.0) > _UNIT:
        raise InvalidInput(f"expected unit quaternions, got one of length {size.flat[np.abs(size - 1.0).argmax()]:g}")
    return Rotation.from_quat(given)


def _made(make: Callable[..., Any], name: str, value: Any) -> Any:
    """What a callable makes of an object, whose names are checked."""
    known = list(inspect.signature(make).parameters)
    for key in _object(name, value):
        if key not in known:
            raise UnknownName(f"member of {name}", key, known)
    return make(**_complete(name, make, value))


def _complete(name: str, call: Callable[..., Any], arguments: dict[str, Any]) -> dict[str, Any]:
    """Arguments by name, of which none is missing."""
    for key, each in inspect.signature(call).parameters.items():
        named = each.kind in (each.POSITIONAL_OR_KEYWORD, each.KEYWORD_ONLY)
        if named and each.default is each.empty and key not in arguments:
            raise InvalidInput(f"expected {key} in {name}")
    return arguments


def _object(name: str, value: Any) -> dict[str, Any]:
    if not isinstance(value, dict):
        raise InvalidInput(f"expected {name} to be a JSON object, got {echo(value)}")
    return value


def _refuse(constant: str) -> NoReturn:
    raise InvalidInput(f"expected JSON, got {constant}")
