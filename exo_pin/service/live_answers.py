"""Answers of a live stream, in the process that computes: one a sample, at rest in its pose."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

import msgspec

from ..core.errors import ExoPinError, InvalidInput
from ..core.schema import document
from ..core.validation import FloatArray, as_choice
from ..exo.questions import doubted, understood
from .problems import LOG, encoded, problem
from .sample_poses import SamplePoses
from .samples import Opening, Sample

#: Questions that a stream may ask.
STREAMED = ("reaction", "joint_contact")


@dataclass(frozen=True)
class LiveAnswer:
    """The answer of one sample of a live stream: forces at rest in its pose.

    Attributes
    ----------
    seq : int or None
        Number of the sample.
    t : float
        Its time, s.
    verdict : str
        The answer in a sentence.
    can_hold : bool or None
        Whether the device holds the pose; null where it is not known or not asked.
    status : str
        Of the pose, as in the answer of a single question; "calibrating" while the sensors' arm has to be still.
    shoulder_force : ndarray or None
        F_s of the device alone on the arm, N, base frame.
    joint_force : ndarray or None
        Force of the scapula on the humerus with the wearer's own muscles, N, base frame; of ``joint_contact``.
    magnitude : float or None
        Of the force that was asked, N.
    actuator_forces : ndarray
        Of limbs or drives, N; N m in a hinge.
    cautions : list of str
        What to mind of this answer.
    doubt : str or None
        Why no arm moves like the last samples, and what the stream may be instead.
    lost : list of list of int
        Samples that have not come since the last answer, first and last number of each gap.
    late : list of int
        Samples that came after newer ones, which have no answer.
    delay : float
        How much longer this sample was on its way than the quickest one, s.
    skipped : int
        Number of samples since the last answer that have none, because newer ones had come.
    dropped : int
        Number of answers since the last one that were not sent, because the reader was slow.
    """

    seq: int | None
    t: float
    verdict: str
    can_hold: bool | None
    status: str
    shoulder_force: FloatArray | None
    joint_force: FloatArray | None
    magnitude: float | None
    actuator_forces: FloatArray
    cautions: list[str]
    doubt: str | None
    lost: list[list[int]]
    late: list[int]
    delay: float
    skipped: int
    dropped: int


class LiveSession:
    """A stream's question, and its last samples.

    Parameters
    ----------
    opening : Opening
        What is asked.

    Raises
    ------
    ExoPinError
        If the question is wrong.
    """

    def __init__(self, opening: Opening) -> None:
        as_choice("question", opening.open.get("question", "reaction"), STREAMED)
        if "poses" in opening.open:
            raise InvalidInput("expected a question without poses: the samples are the poses")
        asked = {"question": "reaction", **opening.open, "poses": {"flexion": 0.0}}
        self.name, self.exo, self._arguments = understood(asked, files=False)
        getattr(self.exo, self.name)(**self._arguments)  # a question that is wrong of every pose opens no stream
        self._arguments.pop("poses")
        self._poses = SamplePoses(opening, self.exo.side)

    def answer(self, sample: Sample) -> dict[str, Any]:
        """What a sample's pose gives, by the names of :class:`LiveAnswer`."""
        pose = self._poses.pose(sample)
        body: dict[str, Any] = dict.fromkeys(("can_hold", "shoulder_force", "joint_force", "magnitude", "doubt"))
        if pose is None:
            none = {"verdict": self._poses.calibrating, "status": "calibrating"}
            return body | none | {"actuator_forces": [], "cautions": []}
        found, cautions = doubted(lambda: getattr(self.exo, self.name)(pose, **self._arguments))
        if self.name == "reaction":
            body["can_hold"] = None if found.unknown else bool(found.can_hold)
            body |= {"shoulder_force": found.shoulder_force, "actuator_forces": found.actuator_forces}
        else:
            body |= {"joint_force": found.force, "actuator_forces": found.device_forces}
        return body | {
            "verdict": found.verdict,
            "status": str(found.status),
            "magnitude": found.magnitude,
            "cautions": [*found.cautions, *cautions],
            "doubt": self._poses.doubt,
        }


class Request(msgspec.Struct):
    """What a stream sends to its process: an opening or a sample, with its number and delay."""

    session: str
    opening: Opening | None = None
    sample: Sample | None = None
    seq: int | None = None
    delay: float = 0.0


_SESSIONS: dict[str, LiveSession] = {}


def respond(body: bytes) -> tuple[int, bytes]:
    """Status and JSON of the answer of a :class:`Request`; one with neither opening nor sample ends the stream."""
    asked = msgspec.json.decode(body, type=Request)
    try:
        if asked.opening is not None:
            session = _SESSIONS[asked.session] = LiveSession(asked.opening)
            return 200, encoded({"opened": session.name, "design": session.exo.name, "side": session.exo.side})
        if asked.sample is None:
            _SESSIONS.pop(asked.session, None)
            return 200, b"{}"
        if asked.session not in _SESSIONS:
            return 410, problem(410, "Closed", "the process of this stream has ended: open it again")
        found = _SESSIONS[asked.session].answer(asked.sample)
        about = {"seq": asked.seq, "t": asked.sample.t, "delay": asked.delay}
        return 200, encoded(document(LiveAnswer, found | about))
    except ExoPinError as error:
        return 422, problem(422, type(error).__name__, str(error), getattr(error, "_doubts", []))
    except Exception:
        LOG.exception("a sample had no answer")
        return 500, problem(500, "InternalFault", "a fault of exo_pin, which its log describes")
