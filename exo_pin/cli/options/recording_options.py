"""Options of commands that take a recording."""

from __future__ import annotations

import math
from dataclasses import dataclass
from pathlib import Path
from typing import Annotated, Any, Literal

from ...core.errors import InvalidInput
from ...exo.shoulder_exo import ShoulderExo
from ...load_case import Movement, RecordingOptions, read_movement
from ..options import Degrees, Pose, Seconds, Texts, called, caution, given, group, refuse, triple


@group
@dataclass(frozen=True)
class ReadAs:
    """What recordings do not say themselves.

    Attributes
    ----------
    reading : str
        What holds in place of what the recording says, as the message of a doubtful one suggests; as-named takes it as
        it is.
    columns : Path, optional
        TOML file with the names of the recording's columns.
    sensor : tuple of str
        Sensor on the trunk, arm or forearm, by its name in the recording or as a file of its own; may be repeated.
    forward : str, optional
        Axis of the trunk's sensor that points forward: x, y, z, -x, -y or -z.
    still : float
        Time for which the arm hangs still at the start of a recording of sensors, s.
    rate : float, optional
        Samples a second, of a recording that counts them, Hz: a number.
    duration : float, optional
        Duration of a recording whose times are percent, s.
    start : str, optional
        Pose in which the recording begins: flexion, abduction and internal rotation, degrees.
    """

    reading: Annotated[str, called(f"{'|'.join(['NAME', '...'])}")] = ""
    columns: Annotated[Path | None, called("FILE")] = None
    sensor: Annotated[Texts, called("ROLE=NAME")] = ()
    forward: Annotated[str | None, called("AXIS")] = None
    still: Seconds = 0.5
    rate: Annotated[float | None, called("HZ")] = None
    duration: Seconds | None = None
    start: Annotated[str | None, called("F,A,I")] = None

    @property
    def options(self) -> RecordingOptions:
        """The same for :func:`exo_pin.read_movement`."""
        sensors = {}
        for text in self.sensor:
            role, _, name = text.partition("=")
            if not role or not name:
                raise InvalidInput(f"expected --sensor ROLE=NAME, such as trunk=sternum, got {text!r}")
            sensors[role] = name
        start = None if self.start is None else triple("--start", self.start)
        return RecordingOptions(
            self.reading, self.columns, sensors, self.forward, self.still, self.rate, self.duration, start
        )


@group
@dataclass(frozen=True)
class RecordedMotion(ReadAs):
    """A measured movement.

    Attributes
    ----------
    trajectory : Path, optional
        Recording of a movement instead of a pose; exo-pin reaction --help lists what is read.
    static : bool
        With --trajectory: take every pose at rest, without velocity and acceleration.
    smoothing : str
        With --trajectory: smooth the samples by generalised cross-validation (gcv), or take them as they are (none).
    sensor_noise : float, optional
        With --trajectory: noise of the measured angles about each axis, degrees (default: from the data).
    ends : str
        With --trajectory: rest if the arm is at rest at the first and last sample (free: not known).
    """

    trajectory: Annotated[Path | None, called("FILE")] = None
    static: bool = False
    smoothing: Literal["gcv", "none"] = "gcv"
    sensor_noise: Degrees | None = None
    ends: Literal["free", "rest"] = "free"

    def __post_init__(self) -> None:
        if self.trajectory is None:
            refuse("--trajectory was not given", **given(self))

    def __bool__(self) -> bool:
        return self.trajectory is not None

    def movement(self, side: str) -> Movement:
        """The movement of ``--trajectory``."""
        assert self.trajectory is not None
        smoothing = None if self.smoothing == "none" else self.smoothing
        known = None if self.sensor_noise is None else math.radians(self.sensor_noise)
        return read_movement(self.trajectory, side, smoothing, known, self.ends, self.options)

    def asked(self, exo: ShoulderExo, pose: Pose) -> tuple[Any, Any]:
        """Poses and motion: of the recording, else the pose at rest."""
        if not self:
            return pose.of(exo), None
        refuse("a movement has poses of its own", **given(pose))
        moved = self.movement(exo.side)
        for text in moved.cautions:
            caution(text)
        return moved.poses, None if self.static else moved.motion
