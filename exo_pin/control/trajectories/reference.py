"""What a controller follows: ``reference(t)`` gives orientation, angular velocity and angular acceleration."""

from __future__ import annotations

from abc import ABC, abstractmethod
from typing import NamedTuple, Protocol, runtime_checkable

import numpy as np
from numpy.typing import ArrayLike
from scipy.spatial.transform import Rotation

from ...core.errors import InvalidInput
from ...core.records import Record
from ...core.validation import FloatArray, as_finite, as_positive, frozen
from ...load_case import MeasurementNoise, Motion, Movement

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
