"""Poses of the arm from samples of a live stream, and whether arms move like this."""

from __future__ import annotations

import secrets
from collections import deque
from collections.abc import Callable

import msgspec
import numpy as np
from scipy.spatial.transform import Rotation

from ..core.conventions import shoulder_rotation
from ..core.errors import InvalidInput
from ..core.validation import FloatArray, as_choice
from ..load_case.recordings.bodies import Bodies
from ..load_case.recordings.plausibility import AS_NAMED, Reading, doubt, of_orientations
from .problems import problem
from .samples import Opening, Sample

#: Samples among which the movement is looked at, how often, and the fewest.
_WINDOW, _EVERY, _FEWEST = 1000, 100, 50
#: Which of four numbers are x, y, z, w where they are in another order than was read.
_OTHER = {"w-first": [1, 2, 3, 0], "w-last": [3, 0, 1, 2]}
#: Samples of the still arm that count, and most that are kept; longest time of it, s.
_STILL, _MOST_STILL, _LONGEST = 40, 20_000, 60.0
_AXES = ("x", "y", "z", "-x", "-y", "-z", "+x", "+y", "+z")


def opening_of(message: bytes | str, token: str | None) -> Opening | bytes:
    """The opening of a stream, or a problem document."""
    try:
        found = msgspec.json.decode(message, type=Opening)
    except (msgspec.DecodeError, msgspec.ValidationError, UnicodeError) as error:
        return problem(422, "InvalidInput", f'expected {{"open": ...}} as the first message: {error}')
    if token is not None and not secrets.compare_digest((found.token or "").encode(), token.encode()):
        return problem(401, "Token", "expected the service's token in the first message")
    return found


class SamplePoses:
    """Poses of a stream.

    Parameters
    ----------
    opening : Opening
        What its samples are.
    side : {"left", "right"}
        Of the arm.

    Raises
    ------
    InvalidInput
        If the still time of sensors is not positive, or too long, or their axis or the reading is unknown.
    """

    def __init__(self, opening: Opening, side: str) -> None:
        self.side = side
        #: Why no arm moves like the last samples, and what they may be instead; None without a doubt.
        self.doubt: str | None = None
        self._sensors, self._reading = opening.sensors, opening.reading
        if self._reading:
            as_choice("reading", self._reading, (AS_NAMED, *_OTHER, *of_orientations(Rotation.identity(), side)))
        if self._sensors is not None:
            as_choice("forward", self._sensors.forward, _AXES)
            if not 0.0 < self._sensors.still <= _LONGEST:
                raise InvalidInput(f"expected still of up to {_LONGEST:g} s, got {self._sensors.still:g}")
        self._still: list[tuple[float, FloatArray, FloatArray]] = []
        self._seen: deque[tuple[float, FloatArray]] = deque(maxlen=_WINDOW)
        self._count, self._order = 0, ""

    @property
    def calibrating(self) -> str:
        """What to do while sensors have no poses."""
        still = 0.0 if self._sensors is None else self._sensors.still
        return f"Hold the arm still, hanging, for {still:g} s: it shows how the sensors sit."

    def pose(self, sample: Sample) -> Rotation | None:
        """{O_B} to {O_A}; None while the arm has to be still.

        Raises
        ------
        InvalidInput
            If the sample has no orientation of the kind that the opening says.
        """
        pose = self._named(sample)
        if pose is None:
            return None
        self._order = "w-first" if sample.quaternion_xyzw else "w-last" if sample.quaternion_wxyz else ""
        if self._reading:
            readings = self._readings(pose)
            return readings[as_choice("reading", self._reading, readings)]()
        self._look_at(sample.t, pose)
        return pose

    def _named(self, sample: Sample) -> Rotation | None:
        quaternion, angles = sample.quaternion("quaternion"), sample.angles
        arm, trunk = sample.quaternion("arm"), sample.quaternion("trunk")
        count = sum(each is not None for each in (quaternion, angles, arm, trunk))
        if self._sensors is not None:
            if arm is None or trunk is None or count > 2:
                raise InvalidInput("expected orientations of the sensors arm and trunk in a sample, and nothing else")
            return self._pose_of_sensors(sample.t, arm, trunk)
        if quaternion is not None and count == 1:
            return Rotation.from_quat(quaternion)
        if angles is not None and count == 1:
            return shoulder_rotation(*angles, self.side, degrees=True)
        raise InvalidInput("expected quaternion_xyzw, quaternion_wxyz or angles in a sample, and nothing else")

    def _pose_of_sensors(self, time: float, arm: FloatArray, trunk: FloatArray) -> Rotation | None:
        """The arm against the trunk, as of a record of the still samples and this one; None while it is still."""
        assert self._sensors is not None
        row = (time, trunk, arm)
        if not self._still or time - self._still[0][0] <= self._sensors.still:
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
        return bodies.poses(times, np.arange(len(times)), self.side, self._sensors.forward, last).poses[-1]

    def _readings(self, poses: Rotation) -> dict[str, Callable[[], Rotation]]:
        """What samples may be in place of what they are called, by the names of recordings' readings."""
        found = {AS_NAMED: lambda: poses, **of_orientations(poses, self.side)}
        if self._order:
            # The same four numbers in the other order.
            numbers = poses.as_quat()[..., _OTHER[self._order]]
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
        found = doubt(Reading(poses, times), self.side, others)
        self.doubt = None if found is None else found.text
