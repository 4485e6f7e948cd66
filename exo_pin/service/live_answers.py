"""Answers of a live stream, in the process that computes: a pose a sample, at rest, and whether arms move like this."""

from __future__ import annotations

from collections import deque
from collections.abc import Callable
from dataclasses import dataclass
from typing import Any

import msgspec
import numpy as np
from scipy.spatial.transform import Rotation

from ..core.conventions import shoulder_rotation
from ..core.errors import ExoPinError, InvalidInput
from ..core.schema import document
from ..core.validation import FloatArray, as_choice
from ..exo.questions import doubted, understood
from ..load_case.recordings.bodies import Bodies
from ..load_case.recordings.plausibility import AS_NAMED, Reading, doubt, of_orientations
from .problems import LOG, encoded, problem
from .samples import Opening, Sample

#: Questions that a stream may ask.
STREAMED = ("reaction", "joint_contact")
#: Samples among which the movement is looked at, how often, and the fewest.
_WINDOW, _EVERY, _FEWEST = 1000, 100, 50
#: By how many places numbers x, y, z, w are read on where they are in another order.
_OTHER = {"w-first": -1, "w-last": 1}
#: Samples of the still arm that count, and most that are kept; longest time of it, s.
_STILL, _MOST_STILL, _LONGEST = 40, 20_000, 60.0


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
        self._arguments.pop("poses")
        self._sensors, self._reading = opening.sensors, opening.reading
        if self._sensors is not None and not 0.0 < self._sensors.still <= _LONGEST:
            raise InvalidInput(f"expected still of up to {_LONGEST:g} s, got {self._sensors.still:g}")
        self._still: list[tuple[float, FloatArray, FloatArray]] = []
        self._seen: deque[tuple[float, FloatArray]] = deque(maxlen=_WINDOW)
        self._count, self._order = 0, ""
        self._doubt: str | None = None

    def answer(self, sample: Sample) -> dict[str, Any]:
        """What a sample's pose gives, by the names of :class:`LiveAnswer`."""
        pose = self._pose(sample)
        if pose is None:
            assert self._sensors is not None
            verdict = f"Hold the arm still, hanging, for {self._sensors.still:g} s: it shows how the sensors sit."
            return _empty(verdict, "calibrating")
        self._order = "w-first" if sample.quaternion_xyzw else "w-last" if sample.quaternion_wxyz else ""
        if self._reading:
            pose = self._readings(pose)[as_choice("reading", self._reading, self._readings(pose))]()
        else:
            self._look_at(sample.t, pose)
        found, cautions = doubted(lambda: getattr(self.exo, self.name)(pose, **self._arguments))
        body = _of_reaction(found) if self.name == "reaction" else _of_contact(found)
        return body | {
            "verdict": found.verdict,
            "status": str(found.status),
            "magnitude": found.magnitude,
            "cautions": [*found.cautions, *cautions],
            "doubt": self._doubt,
        }

    def _pose(self, sample: Sample) -> Rotation | None:
        if self._sensors is not None:
            return self._pose_of_sensors(sample)
        quaternion, angles = sample.quaternion("quaternion"), sample.angles
        if quaternion is not None and angles is None:
            return Rotation.from_quat(quaternion)
        if quaternion is None and angles is not None:
            return shoulder_rotation(*angles, self.exo.side, degrees=True)
        raise InvalidInput("expected quaternion_xyzw, quaternion_wxyz or angles in a sample")

    def _pose_of_sensors(self, sample: Sample) -> Rotation | None:
        """The arm against the trunk, as of a record of the still samples and this one; None while it is still."""
        arm, trunk = sample.quaternion("arm"), sample.quaternion("trunk")
        if arm is None or trunk is None:
            raise InvalidInput("expected orientations of the sensors arm and trunk in a sample")
        assert self._sensors is not None
        row = (sample.t, trunk, arm)
        if not self._still or sample.t - self._still[0][0] <= self._sensors.still:
            if len(self._still) == _MOST_STILL:
                raise InvalidInput(
                    f"{_MOST_STILL} samples came within still, {self._sensors.still:g} s: t stands still"
                )
            self._still.append(row)
            return None
        step = max(1, len(self._still) // _STILL)
        times, trunks, arms = (np.array(each) for each in zip(*self._still[::step], row, strict=True))
        bodies = Bodies(arms, trunks, None, False, "the stream")
        last = self._sensors.still
        return bodies.poses(times, np.arange(len(times)), self.exo.side, self._sensors.forward, last).poses[-1]

    def _readings(self, poses: Rotation) -> dict[str, Callable[[], Rotation]]:
        """What samples may be in place of what they are called, by the names of recordings' readings."""
        found = {AS_NAMED: lambda: poses, **of_orientations(poses, self.exo.side)}
        if self._order:
            # The same four numbers in the other order.
            numbers = np.roll(poses.as_quat(), _OTHER[self._order], axis=-1)
            found[self._order] = lambda: Rotation.from_quat(numbers)
        return found

    def _look_at(self, time: float, pose: Rotation) -> None:
        """Look every second or so whether an arm moves like the last samples."""
        self._seen.append((time, pose.as_quat()))
        self._count += 1
        if self._count % _EVERY or len(self._seen) < _FEWEST:
            return
        times, quaternions = (np.array(each) for each in zip(*self._seen, strict=True))
        poses = Rotation.from_quat(quaternions)
        others = {name: (lambda make=make: Reading(make(), times)) for name, make in self._readings(poses).items()}
        del others[AS_NAMED]
        found = doubt(Reading(poses, times), self.exo.side, others)
        self._doubt = None if found is None else found.text


def _empty(verdict: str, status: str) -> dict[str, Any]:
    none = dict.fromkeys(("can_hold", "shoulder_force", "joint_force", "magnitude", "doubt"))
    return {**none, "verdict": verdict, "status": status, "actuator_forces": [], "cautions": []}


def _of_reaction(found: Any) -> dict[str, Any]:
    can_hold = None if found.unknown else bool(found.can_hold)
    forces = {"shoulder_force": found.shoulder_force, "actuator_forces": found.actuator_forces}
    return {**forces, "can_hold": can_hold, "joint_force": None}


def _of_contact(found: Any) -> dict[str, Any]:
    forces = {"joint_force": found.force, "actuator_forces": found.device_forces}
    return {**forces, "can_hold": None, "shoulder_force": None}


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
