"""What a controller follows: ``reference(t)`` gives orientation, angular velocity and angular acceleration."""

from __future__ import annotations

from abc import ABC, abstractmethod
from os import PathLike
from typing import Any, NamedTuple, Protocol, runtime_checkable

import numpy as np
import scipy
from numpy.typing import ArrayLike
from scipy.spatial.transform import Rotation

from ...core.errors import InvalidInput
from ...core.errors.checked import checked
from ...core.records import Record
from ...core.validation import FloatArray, as_finite, as_positive, as_rotation, frozen, require_type
from ...load_case import MeasurementNoise, Motion, Movement, RecordingOptions, read_movement
from ...numerics.smoothing.smoothing_splines import continuous_quaternions, motion_of_quaternions

#: A movement with more samples than this is a slip in the rate.
_MOST_SAMPLES = 10_000_000


class ReferenceState(NamedTuple):
    """Where the arm shall be.

    Attributes
    ----------
    orientation : Rotation
        {O_B} to {O_A}, single or a stack of shape (...), as the times.
    angular_velocity, angular_acceleration : ndarray
        ω and η, shape (..., 3), rad/s and rad/s², base frame.

    Examples
    --------
    >>> from exo_pin.control import abduction
    >>> state = abduction()(2.5)
    >>> round(float(np.rad2deg(np.linalg.norm(state.angular_velocity))), 3)  # degrees a second
    18.0
    """

    orientation: Rotation
    angular_velocity: FloatArray
    angular_acceleration: FloatArray

    @property
    def motion(self) -> Motion:
        """ω and η, for :meth:`exo_pin.ShoulderExo.reaction`."""
        return Motion(self.angular_velocity, self.angular_acceleration)


@runtime_checkable
class Reference(Protocol):
    """Anything that can be followed: a callable of time with a duration.

    ``duration`` is in s. ``reference(t)`` takes times of shape (...), s, and returns a :class:`ReferenceState`.

    Examples
    --------
    >>> from exo_pin.control import Reference, abduction
    >>> isinstance(abduction(), Reference), abduction().duration  # s
    (True, 5.0)
    """

    @property
    def duration(self) -> float:
        """From start to end, s."""

    def __call__(self, t: ArrayLike) -> ReferenceState:
        """State at the times t, s."""


class Trajectory(Record, ABC):
    """Base of the trajectories of this room.

    Before time zero the arm rests at the start, after ``duration`` it rests at the end.

    Attributes
    ----------
    duration : float
        s.
    title : str
        What it is.

    Examples
    --------
    >>> from exo_pin.control import flexion
    >>> reference = flexion()
    >>> after = reference(reference.duration + 1.0)
    >>> round(float(np.rad2deg(after.orientation.magnitude())), 6), float(abs(after.angular_velocity).max())  # at rest
    (90.0, 0.0)
    """

    duration: float
    title: str = ""

    def __call__(self, t: ArrayLike) -> ReferenceState:
        """Orientation, ω and η at the times t.

        Parameters
        ----------
        t : array_like
            Shape (...), s.

        Returns
        -------
        ReferenceState
            Stack of shape (...). At a corner of a trajectory ω and η are those on its later side; at ``duration`` those
            on its earlier side.

        Raises
        ------
        InvalidInput
            If a time is not finite.
        """
        times = as_finite("t", t, (), stack=True)
        flat = times.reshape(-1)
        quaternions, velocity, acceleration = self._states(np.clip(flat, 0.0, self.duration))
        outside = (flat < 0.0) | (flat > self.duration)
        velocity[outside] = acceleration[outside] = 0.0
        shape = times.shape
        return ReferenceState(
            Rotation.from_quat(quaternions.reshape(*shape, 4)),
            velocity.reshape(*shape, 3),
            acceleration.reshape(*shape, 3),
        )

    @abstractmethod
    def _states(self, t: FloatArray) -> tuple[FloatArray, FloatArray, FloatArray]:
        """Quaternions (N, 4), ω and η (N, 3), new arrays, for times (N,) from 0 to ``duration``."""

    @property
    def start(self) -> Rotation:
        """First orientation."""
        return self(0.0).orientation

    @property
    def end(self) -> Rotation:
        """Last orientation."""
        return self(self.duration).orientation

    def movement(self, rate: float = 100.0) -> Movement:
        """Samples for :meth:`exo_pin.ShoulderExo.follow`, with ω and η of the trajectory itself, without noise.

        Parameters
        ----------
        rate : float
            Hz. The last sample is at ``duration``; the spacing is at most 1/rate.

        Returns
        -------
        Movement

        Examples
        --------
        >>> from exo_pin import control
        >>> movement = control.flexion().movement(rate=50.0)
        >>> len(movement.times), float(movement.times[-1])  # s
        (251, 5.0)
        """
        count = self.duration * as_positive("rate", rate)
        if count > _MOST_SAMPLES:
            raise InvalidInput(f"expected rate in Hz for at most {_MOST_SAMPLES} samples, got {rate:g}")
        times = np.linspace(0.0, self.duration, max(int(np.ceil(count - 1e-9)), 1) + 1)
        state = self(times)
        nothing = frozen(np.zeros((len(times), 3, 3)))
        ends = frozen(np.zeros(len(times), dtype=bool))
        exact = MeasurementNoise("interpolation", 0.0, 0.0, np.inf, nothing, ends)
        return Movement(frozen(times), state.orientation, state.motion, exact)

    def __repr__(self) -> str:
        return f"<{type(self).__name__}: {self.title or 'trajectory'}, {self.duration:g} s>"


#: Two waypoints farther apart than this, rad, do not determine which way the arm turns between them.
_FARTHEST = np.radians(120.0)
#: Waypoints nearer in time than this, s, are one.
_SHORTEST = 1e-6
#: A curve of quaternions with a length outside this range has swung too far between its waypoints, on the unit sphere.
_LENGTHS = (0.5, 1.5)


@checked
class OrientationSpline(Trajectory):
    """A curve through orientations, with continuous ω and η.

    The unit quaternions, continuous in sign, are interpolated by a spline in four dimensions, which is brought to
    unit length. A rotation of base or arm frame turns these four dimensions, so the curve depends on no choice of
    frame and no Euler angle takes part. From rest to rest the degree is 5, with ω = η = 0 at both ends; ω and η are
    continuous, and so are two more derivatives. Otherwise the degree is 7 (5 with fewer than 12 waypoints, 3 with
    fewer than six) and the ends are free.

    Parameters
    ----------
    times : array_like
        Shape (N,), s, rising. The trajectory starts at time 0, whatever the first of them is.
    poses : Rotation
        Stack of shape (N,), neighbours at most 120° apart.
    rest : bool
        Whether the arm is at rest at both ends. With False at least four orientations are needed.
    title : str
        What it is.

    Raises
    ------
    InvalidInput
        If times do not rise, there are too few waypoints, two are more than 120° apart, or the curve swings so far
        between waypoints that it is none of a movement.

    Examples
    --------
    >>> from exo_pin.control import OrientationSpline
    >>> spline = OrientationSpline([0.0, 1.0, 2.0], ep.load("prototype").pose(flexion=[0, 40, 60]))
    >>> [round(float(np.rad2deg(spline(t).orientation.magnitude())), 6) for t in (1.0, 2.0)]  # degrees
    [40.0, 60.0]
    """

    def __init__(self, times: ArrayLike, poses: Rotation, rest: bool = True, title: str = "") -> None:
        t, poses = as_finite("times", times, (None,)), as_rotation("poses", poses)
        _check_waypoints(t, poses, rest)
        self.title, self.rest = title, bool(rest)
        #: Times of the waypoints, from 0, shape (N,), s.
        self.times = frozen(t - t[0])
        #: The waypoints.
        self.poses = poses
        #: Doubts about the record that it is made of.
        self.cautions: tuple[str, ...] = ()
        self.duration = float(self.times[-1])
        # Scaled to mean spacing 1, so that the spline's conditioning does not depend on the unit of time.
        self._unit = self.duration / (len(t) - 1)
        x, q = self.times / self._unit, continuous_quaternions(poses)
        if rest:
            still = [(1, np.zeros(4)), (2, np.zeros(4))]
            self._curve: Any = scipy.interpolate.make_interp_spline(x, q, k=5, bc_type=(still, still))
        else:
            degree = 7 if len(t) >= 12 else 5 if len(t) >= 6 else 3
            self._curve = scipy.interpolate.make_interp_spline(x, q, k=degree)
        between = np.linspace(x[:-1], x[1:], 9).ravel()
        length = np.linalg.norm(self._curve(between), axis=1)
        if length.min() < _LENGTHS[0] or length.max() > _LENGTHS[1]:
            raise InvalidInput("the curve swings too far between its waypoints: give more of them, or more even times")

    @classmethod
    def of_movement(cls, movement: Movement, title: str = "measured movement") -> OrientationSpline:
        """A reference through the orientations of a movement, smoothed if they were.

        Parameters
        ----------
        movement : Movement
            Samples.
        title : str
            Its name.

        Returns
        -------
        OrientationSpline

        Examples
        --------
        >>> from exo_pin import control
        >>> spline = control.OrientationSpline.of_movement(control.abduction().movement(20.0))
        >>> away = spline(3.3).orientation.inv() * control.abduction()(3.3).orientation
        >>> bool(away.magnitude() < 1e-6)  # rad, between the samples
        True
        """
        require_type("movement", movement, Movement, "a Movement")
        made = cls(movement.times, movement.poses, rest=False, title=title)
        made.cautions = movement.cautions
        return made

    def _states(self, t: FloatArray) -> tuple[FloatArray, FloatArray, FloatArray]:
        x = t / self._unit
        return motion_of_quaternions(np.stack([self._curve(x, order) for order in range(3)]), self._unit)


def _check_waypoints(t: FloatArray, poses: Rotation, rest: bool) -> None:
    fewest = 2 if rest else 4
    if poses.shape != t.shape or len(t) < fewest:
        raise InvalidInput(f"expected one time for each of {fewest} or more orientations, got {t.shape}, {poses.shape}")
    if not (np.diff(t) > _SHORTEST).all():
        raise InvalidInput("expected times in s that rise from waypoint to waypoint")
    steps = (poses[1:] * poses[:-1].inv()).magnitude()
    if steps.max() > _FARTHEST:
        raise InvalidInput(
            f"expected waypoints at most 120 degrees apart, got {np.degrees(steps.max()):.0f} after waypoint "
            f"{int(steps.argmax())}: give one between them"
        )


def read_reference(
    path: str | PathLike[str],
    side: str = "left",
    smoothing: str | None = "gcv",
    sensor_noise: float | None = None,
    reading: RecordingOptions | str | None = None,
) -> OrientationSpline:
    """Read a reference from a recording.

    Parameters
    ----------
    path : path-like
        The recording; it and the other arguments are as in :func:`exo_pin.read_movement`.
    side : {"left", "right"}
        Side of the body that clinical angles are of.
    smoothing : {"gcv", None}
        How to smooth the samples; None interpolates them.
    sensor_noise : float, optional
        Standard deviation of the samples about each axis, rad, if it is known.
    reading : RecordingOptions or str, optional
        What the recording does not say itself.

    Returns
    -------
    OrientationSpline

    Examples
    --------
    >>> from exo_pin import control
    >>> from exo_pin.control import MeasuredRun, read_reference, write_run
    >>> exo, times = ep.load("prototype"), np.linspace(0.0, 2.0, 21)
    >>> poses = exo.pose(flexion=20.0 * times)
    >>> write_run(MeasuredRun(poses, exo.inverse_kinematics(poses).lengths, times), "arm.csv")
    >>> round(float(np.rad2deg(read_reference("arm.csv", smoothing=None)(1.0).orientation.magnitude())), 3)
    20.0
    """
    return OrientationSpline.of_movement(
        read_movement(path, side, smoothing, sensor_noise, reading=reading), f"from {path}"
    )
