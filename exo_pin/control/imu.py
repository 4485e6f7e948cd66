"""The inertial sensor on the arm, between plant and controller, and what it adds to the truth.

A reading is R_GS, from the sensor's own frame S to the ground G. The calibration block of Figure 5-9,
:class:`exo_pin.wrist.velocity.sensors.OrientationChain`, makes the pose of the arm of it: R_TS' = R_GTᵀ R_GS R_SS'. A
simulated reading is R_GS = R_d R_GT R R_SS'ᵀ R_n of the true pose R. R_d is the drift, a turn of the ground frame that
grows steadily; R_n is the noise, white, a small turn about random axes of the sensor.
"""

from __future__ import annotations

from dataclasses import dataclass, field
from typing import Any, NamedTuple

import numpy as np
from numpy.typing import ArrayLike
from scipy.spatial.transform import Rotation

from ..core.errors.checked import checked
from ..core.validation import (
    FloatArray,
    as_count,
    as_finite,
    as_single_rotation,
    as_unit_vector,
    require_type,
    set_fields,
    set_positive,
)
from ..wrist.velocity.sensors import OrientationChain
from .plant.contractions import contractions_of
from .plant.state import Measurement
from .sensors import as_intervals

#: Drift of the sensor of Section 5.2.1: 1° to 2° in half a minute; the middle, rad/s.
PRINTED_DRIFT = float(np.radians(1.5)) / 30.0


@checked
@dataclass(frozen=True)
class Imu:
    """What the sensor adds to the truth. The same seed gives the same errors.

    Attributes
    ----------
    torso : Rotation
        R_GT, takes {O_A} to the ground; single. The controller has it from a calibration.
    mount : Rotation
        R_SS', takes {O_B} to the sensor's axes, single: how the sensor really sits.
    chain : OrientationChain or None
        What the controller takes for it, from a calibration with its own errors; None for the truth.
    noise : float
        Standard deviation of an orientation about each axis, rad, white from sample to sample.
    velocity_noise : float
        Standard deviation of each component of the angular velocity, rad/s, white.
    drift : float
        Rate at which orientations turn away, rad/s; :data:`PRINTED_DRIFT` for the sensor of the prototype.
    drift_axis : array_like or None
        Axis of the drift in the ground frame, shape (3,); None for the vertical, the one that gravity does not
        correct.
    delay : float
        Age of a reading when the controller gets it, s.
    lost : tuple of (float, float)
        Intervals from, to, s, without readings.
    seed : int
        Of the noise.

    Examples
    --------
    >>> from exo_pin.control import Imu
    >>> exo = ep.load("prototype")
    >>> imu = Imu(mount=ep.shoulder_rotation(0.0, 0.0, 5.0, degrees=True))  # sits turned by 5° on the arm
    >>> pose = imu.calibration.orientation(imu.reading(exo.pose(flexion=30)), imu.torso)
    >>> ep.shoulder_angles(pose, degrees=True).round(6) + 0.0  # a calibration takes that out
    array([30.,  0.,  0.])
    """

    torso: Rotation = field(default_factory=Rotation.identity)
    mount: Rotation = field(default_factory=Rotation.identity)
    chain: OrientationChain | None = None
    noise: float = 0.0
    velocity_noise: float = 0.0
    drift: float = 0.0
    drift_axis: ArrayLike | None = None
    delay: float = 0.0
    lost: tuple[tuple[float, float], ...] = ()
    seed: int = 0

    def __post_init__(self) -> None:
        for name in ("torso", "mount"):
            as_single_rotation(name, getattr(self, name))
        require_type("chain", self.chain, OrientationChain | None, "an OrientationChain")
        set_positive(self, "noise", "velocity_noise", "delay", zero=True)
        set_fields(
            self,
            seed=as_count("seed", self.seed),
            drift=float(as_finite("drift", self.drift, ())),
            lost=as_intervals(self.lost),
        )
        axis = (0.0, 0.0, 1.0) if self.drift_axis is None else self.drift_axis
        object.__setattr__(self, "drift_axis", tuple(as_unit_vector("drift_axis", axis).tolist()))

    @property
    def calibration(self) -> OrientationChain:
        """What the controller makes poses with; its torso's reading is R_GT itself."""
        return OrientationChain(self.mount, Rotation.identity()) if self.chain is None else self.chain

    def reading(self, pose: Rotation) -> Rotation:
        """R_GS of a pose without errors, single or a stack.

        Parameters
        ----------
        pose : Rotation
            Of the arm, {O_B} to {O_A}; shape (...).

        Returns
        -------
        Rotation
            Shape (...).

        Examples
        --------
        >>> from exo_pin.control import Imu
        >>> exo = ep.load("prototype")
        >>> torso = ep.shoulder_rotation(10.0, 0.0, 0.0, degrees=True)
        >>> reading = Imu(torso=torso).reading(exo.pose(flexion=30))
        >>> round(float(np.rad2deg(reading.magnitude())), 6)  # degrees in the ground frame: the torso leans, too
        40.0
        """
        return self.torso * pose * self.mount.inv()

    def is_lost(self, time: float) -> bool:
        """Whether there is no reading at a time, s.

        Parameters
        ----------
        time : float
            s.

        Returns
        -------
        bool

        Examples
        --------
        >>> from exo_pin.control import Imu
        >>> [Imu(lost=((1.0, 1.5),)).is_lost(time) for time in (0.9, 1.2)]  # s
        [False, True]
        """
        return any(start <= time < end for start, end in self.lost)


class ImuReading(NamedTuple):
    """What the controller gets.

    Attributes
    ----------
    orientation : Rotation
        {O_B} to {O_A}, single, as calibrated.
    angular_velocity : ndarray
        Shape (3,), rad/s, base frame.
    lost : bool
        Whether this is an old reading, because there is none now.
    """

    orientation: Rotation
    angular_velocity: FloatArray
    lost: bool


@checked
class ImuSensor:
    """The sensor in the loop: from time and exact measurement to the one that the controller gets.

    A delayed reading lies between samples on the shortest turn.

    Parameters
    ----------
    imu : Imu
        The sensor and its errors.
    mechanism : Mechanism, or contractions of a plant
        Whose lengths follow from the pose; strokes and end fittings known.

    Examples
    --------
    >>> from exo_pin.control import Imu, ImuSensor
    >>> exo = ep.load("prototype")
    >>> sensor = ImuSensor(Imu(drift=np.deg2rad(0.05)), exo.mechanism)
    >>> seen = sensor.read(30.0, exo.pose(flexion=30), np.zeros(3)).orientation
    >>> round(float(np.rad2deg((seen * exo.pose(flexion=30).inv()).magnitude())), 6)  # degrees off, after half a minute
    1.5
    """

    def __init__(self, imu: Imu, mechanism: Any) -> None:
        require_type("imu", imu, Imu, "an Imu")
        self.imu = imu
        self._contractions = contractions_of(mechanism)
        self.reset()

    def __call__(self, t: float, measurement: Measurement) -> Measurement:
        """The measurement at a sample: pose as read and calibrated, and lengths that follow from it (Figure 5-8)."""
        reading = self.read(t, measurement.orientation, np.asarray(measurement.angular_velocity))
        lengths = self._contractions.lengths(reading.orientation)
        ratios = self._contractions.ratios(lengths)
        return measurement._replace(**reading._asdict(), lengths=lengths, contraction_ratios=ratios)

    def reset(self) -> None:
        """Start again, with the same noise.

        Examples
        --------
        >>> from exo_pin.control import Imu, ImuSensor
        >>> exo = ep.load("prototype")
        >>> sensor = ImuSensor(Imu(noise=0.01, seed=5), exo.mechanism)
        >>> first = sensor.read(0.0, exo.pose(flexion=10), np.zeros(3)).orientation
        >>> sensor.reset()
        >>> float((sensor.read(0.0, exo.pose(flexion=10), np.zeros(3)).orientation.inv() * first).magnitude())  # rad
        0.0
        """
        self._samples = 0
        self._past: list[tuple[float, Rotation, FloatArray]] = []
        self._last: ImuReading | None = None

    @property
    def memory(self) -> tuple[int, tuple[tuple[float, Rotation, FloatArray], ...], ImuReading | None]:
        """What later readings depend on: samples so far, which the noise counts, poses not read yet, last reading."""
        return self._samples, tuple(self._past), self._last

    def recall(self, memory: tuple[int, tuple[tuple[float, Rotation, FloatArray], ...], ImuReading | None]) -> None:
        """Go on from a :attr:`memory`.

        Parameters
        ----------
        memory : tuple
            Of the same sensor, at an earlier time.

        Examples
        --------
        >>> from exo_pin.control import Imu, ImuSensor
        >>> exo = ep.load("prototype")
        >>> sensor, other = (ImuSensor(Imu(noise=0.01, seed=5), exo.mechanism) for _ in range(2))
        >>> first = sensor.read(0.0, exo.pose(), np.zeros(3))
        >>> other.recall(sensor.memory)
        >>> pair = [each.read(0.01, exo.pose(), np.zeros(3)).orientation for each in (sensor, other)]
        >>> float((pair[0].inv() * pair[1]).magnitude())  # rad
        0.0
        """
        self._samples, past, self._last = memory
        self._past = list(past)

    def read(self, time: float, pose: Rotation, angular_velocity: FloatArray) -> ImuReading:
        """The reading at a time.

        Parameters
        ----------
        time : float
            s, later than that of the call before.
        pose : Rotation
            The true pose, single.
        angular_velocity : ndarray
            The true one, shape (3,), rad/s, base frame.

        Returns
        -------
        ImuReading
            While the sensor is lost, the last one before; if there is none, that of the start.

        Examples
        --------
        >>> from exo_pin.control import Imu, ImuSensor
        >>> exo = ep.load("prototype")
        >>> sensor = ImuSensor(Imu(lost=((0.5, 2.0),)), exo.mechanism)
        >>> readings = [sensor.read(t, exo.pose(flexion=30.0 * t), np.zeros(3)) for t in (0.4, 1.0)]
        >>> readings[1].lost, round(float(np.rad2deg(readings[1].orientation.magnitude())), 6)  # degrees, of 0.4 s
        (True, 12.0)
        """
        imu = self.imu
        when = float(time) - imu.delay
        self._past.append((time, pose, np.asarray(angular_velocity, dtype=float)))
        # Each sample has its own numbers, so that a loss does not change the noise of later ones.
        turn, rate = np.random.default_rng([self.imu.seed, self._samples]).standard_normal((2, 3))
        self._samples += 1
        if self._last is not None and imu.is_lost(when):
            self._last = ImuReading(self._last.orientation, self._last.angular_velocity, True)
            return self._last
        past, velocity = self._at(when)
        drift = Rotation.from_rotvec(imu.drift * max(when, 0.0) * np.asarray(imu.drift_axis))
        true = imu.reading(past)
        reading = drift * true * Rotation.from_rotvec(imu.noise * turn)
        # The gyroscope measures in its own axes.
        in_sensor = true.inv().apply(imu.torso.apply(velocity)) + imu.velocity_noise * rate
        orientation = imu.calibration.orientation(reading, imu.torso)
        in_torso = (orientation * imu.calibration.arm_mount.inv()).apply(in_sensor)
        self._last = ImuReading(orientation, in_torso, imu.is_lost(when))
        return self._last

    def _at(self, when: float) -> tuple[Rotation, FloatArray]:
        """Pose and angular velocity at a time gone by; before the first sample those of the first."""
        while len(self._past) > 1 and self._past[1][0] <= when:
            self._past.pop(0)
        (before, pose, velocity), *later = self._past
        if not later or when <= before:
            return pose, velocity
        after, next_pose, next_velocity = later[0]
        share = (when - before) / (after - before)
        step = (next_pose * pose.inv()).as_rotvec()
        return Rotation.from_rotvec(share * step) * pose, velocity + share * (next_velocity - velocity)
