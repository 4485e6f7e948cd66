"""Samples of a live stream for the page: the newest pose, and what was lost, late, or doubted of the others."""

from __future__ import annotations

import json
import time
from collections import deque

import msgspec
from scipy.spatial.transform import Rotation

from ..core.errors import ExoPinError
from ..service.problems import problem
from ..service.sample_poses import SamplePoses, opening_of
from ..service.samples import Sample, Stream

#: Without a sample for so many seconds the pose is an old one.
_OLD = 1.0


class LiveSamples:
    """The stream of a page, in the messages of ``exo-pin serve``; it asks nothing itself.

    Parameters
    ----------
    token : str
        What its opening has to know.
    side : {"left", "right"}
        Of the arm.
    """

    def __init__(self, token: str, side: str) -> None:
        self._token, self._side = token, side
        self._poses: SamplePoses | None = None
        self._arrivals: deque[float] = deque(maxlen=1000)
        self._pose: Rotation | None = None
        self._refusal = ""

    def take(self, message: bytes | str) -> bytes | None:
        """Take an opening or a sample; what is returned is for its sender."""
        try:
            if self._poses is None or '"open"' in (message if isinstance(message, str) else message.decode()):
                return self._open(message)
            self._sample(message, time.monotonic())
        except (msgspec.DecodeError, msgspec.ValidationError, UnicodeError, ExoPinError) as error:
            self._refusal = f"No sample: {error}"
            return problem(422, type(error).__name__, self._refusal)
        return None

    def _open(self, message: bytes | str) -> bytes:
        opening = opening_of(message, self._token)
        if isinstance(opening, bytes):
            return opening
        if opening.open:
            return problem(422, "InvalidInput", 'the page has device and person: expected {"open": {}, ...}')
        self._stream, self._poses = Stream(opening.rate), SamplePoses(opening, self._side)
        self._arrivals.clear()
        self._lost = self._late = 0
        self._gap, self._delay, self._refusal = "", 0.0, ""
        return json.dumps({"opened": "pose", "side": self._side}).encode()

    def _sample(self, message: bytes | str, arrived: float) -> None:
        assert self._poses is not None
        sample = msgspec.json.decode(message, type=Sample)
        found = self._stream.take(sample, arrived)
        self._arrivals.append(arrived)
        self._delay = found.delay
        if found.lost is not None:
            first, last = found.lost
            self._lost += last - first + 1
            self._gap = f"{first}" if first == last else f"{first} to {last}"
        if found.is_late:
            self._late += 1
            return
        self._pose = self._poses.pose(sample)
        self._refusal = "" if self._pose is not None else self._poses.calibrating

    def newest(self) -> Rotation | None:
        """The newest pose, {O_B} to {O_A}, once; None where none has come since the last call."""
        found, self._pose = self._pose, None
        return found

    @property
    def words(self) -> str:
        """How the stream is, in a line or two."""
        if self._poses is None or not self._arrivals:
            return self._refusal or "Waiting for samples."
        now = time.monotonic()
        silent = now - self._arrivals[-1]
        if silent > _OLD:
            return f"No sample for {silent:.0f} s: the pose is the last one."
        rate = sum(1 for each in self._arrivals if now - each <= 1.0)
        gap = f" (the last: {self._gap})" if self._gap else ""
        texts = [
            f"{rate} samples in the last second, {1e3 * self._delay:.0f} ms behind the quickest; "
            f"{self._lost} lost{gap}, {self._late} late.",
            self._refusal,
            self._poses.doubt or "",
        ]
        return "\n".join(filter(None, texts))
