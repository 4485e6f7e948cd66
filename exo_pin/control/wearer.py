"""What a wearer does to the arm: moments about O, ready to be given to :class:`exo_pin.Plant`.

Each is a function of time in s and :class:`.ArmState` that returns a moment in N m, base frame. Any other function will
do, and several add up. Stiffness, damping and reflexes differ by orders of magnitude between people, and no number of a
shoulder is taken for known here: values and their source are the call's.

    plant = ep.Plant(exo, wearer=[control.Passive(3.0, 0.4, source="..."), control.Tremor(0.3, 5.0, (0, 1, 0))])

A flaccid arm is one without any: its weight and inertia alone.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from typing import Any, ClassVar

import numpy as np
from numpy.typing import ArrayLike
from scipy.spatial.transform import Rotation

from ..core.errors import InvalidInput
from ..core.errors.checked import checked
from ..core.validation import (
    FloatArray,
    as_finite,
    as_single_rotation,
    require_type,
    set_fields,
    set_positive,
)
from ..load_case import Load
from .plant.any_device.arm_actions import ArmState, check_span, load_at_shoulder, require_known

__all__ = ["Intent", "Passive", "Push", "Spasticity", "Tremor"]


def _direction(axis: ArrayLike, what: str) -> tuple[float, ...]:
    """An axis of length 1."""
    given = as_finite("axis", axis, (3,))
    if not given.any():
        raise InvalidInput(f"expected an axis {what}, got zeros")
    return tuple((given / np.linalg.norm(given)).tolist())


def _turn(to: FloatArray, of: FloatArray) -> FloatArray:
    """Rotation vector from an orientation to another, base frame."""
    return np.asarray(Rotation.from_matrix(to @ of.T).as_rotvec())


@checked
@dataclass(frozen=True, eq=False)
class Passive:
    """Passive stiffness and damping of a shoulder: a spring to a pose at rest, and a damper.

    M = K log(R_0 Rᵀ) - D ω, each about the arm's axes where three numbers are given.

    Parameters
    ----------
    stiffness, damping : float or array_like
        K and D, N m/rad and N m s/rad: one number, or three about the axes of {O_B}.
    rest : Rotation, optional
        R_0; the arm hanging if left out.
    source : str
        Where the numbers are from.

    Raises
    ------
    MissingData
        If a number or the source is not given: no passive moments of a shoulder are taken for known.

    Examples
    --------
    >>> from exo_pin.control import ArmState, Passive
    >>> tissue = Passive(2.0, 0.3, source="an assumption for this example")
    >>> arm = ArmState(ep.shoulder_rotation(30, 0, 0, degrees=True).as_matrix(), np.zeros(3))
    >>> float(np.linalg.norm(tissue(0.0, arm)).round(3))  # N m: 2 N m/rad times 30°
    1.047
    """

    stiffness: ArrayLike | None = None
    damping: ArrayLike | None = None
    rest: Rotation | None = None
    source: str = ""

    def __post_init__(self) -> None:
        values = {"stiffness": self.stiffness, "damping": self.damping}
        require_known(self.source, values, "passive moments of the shoulder")
        for name, value in values.items():
            numbers = as_finite(name, value, (), stack=True)  # type: ignore[arg-type]
            if numbers.shape not in ((), (3,)) or (numbers < 0.0).any():
                raise InvalidInput(f"expected {name} as one or three numbers of zero or more, got {value!r}")
            set_fields(self, **{name: np.broadcast_to(numbers, (3,)).copy()})
        rest = Rotation.identity() if self.rest is None else as_single_rotation("rest", self.rest)
        set_fields(self, rest=rest)
        object.__setattr__(self, "_rest", rest.as_matrix())

    def __call__(self, t: float, arm: ArmState) -> FloatArray:
        """Moment at a time; see the class."""
        R = arm.matrix
        rest: Any = self._rest  # type: ignore[attr-defined]
        turn, turning = R.T @ _turn(rest, R), R.T @ arm.angular_velocity
        return np.asarray(R @ (self.stiffness * turn - self.damping * turning))  # type: ignore[operator]


@checked
@dataclass(frozen=True)
class Intent:
    """A person who wants the arm to follow a reference, with some strength and some delay.

    M = K log(R_r Rᵀ) + D (ω_r - ω), R_r the reference a delay ago, at most the strength.

    Parameters
    ----------
    reference : callable
        ``reference(t)`` has ``orientation`` and ``angular_velocity``.
    strength : float
        Greatest moment, N m.
    stiffness, damping : float
        K and D of the effort, N m/rad and N m s/rad.
    delay : float
        s.

    Raises
    ------
    InvalidInput
        If a number is out of its range.

    Examples
    --------
    >>> from exo_pin.control import ArmState, Intent, flexion
    >>> weak = Intent(flexion(), strength=2.0, stiffness=20.0, damping=1.0, delay=0.2)
    >>> late = ArmState(np.eye(3), np.zeros(3))
    >>> float(np.linalg.norm(weak(3.0, late)).round(6))  # N m: no more, however far the reference is
    2.0
    """

    reference: Callable[[float], Any]
    strength: float
    stiffness: float
    damping: float
    delay: float = 0.0

    def __post_init__(self) -> None:
        require_type("reference", self.reference, Callable, "a function of time")
        set_positive(self, "strength", "stiffness", "damping", "delay", zero=True)

    def __call__(self, t: float, arm: ArmState) -> FloatArray:
        """Moment at a time; see the class."""
        wanted = self.reference(max(t - self.delay, 0.0))
        turn = _turn(wanted.orientation.as_matrix(), arm.matrix)
        # Within the delay the person has not seen the reference move.
        turning = wanted.angular_velocity if t >= self.delay else 0.0
        moment = self.stiffness * turn + self.damping * (turning - arm.angular_velocity)
        size = float(np.linalg.norm(moment))
        return np.asarray(moment * min(1.0, self.strength / size) if size > 0.0 else moment)


@checked
@dataclass(frozen=True)
class Tremor:
    """A moment that swings about an axis.

    Parameters
    ----------
    amplitude : float
        N m.
    frequency : float
        Hz.
    axis : array_like
        Shape (3,), base frame.
    phase : float
        At time zero, rad.

    Examples
    --------
    >>> from exo_pin.control import ArmState, Tremor
    >>> shaking = Tremor(0.3, 5.0, (0.0, 1.0, 0.0))
    >>> float(shaking(0.05, ArmState(np.eye(3), np.zeros(3)))[1])  # N m, a quarter of a period after zero
    0.3
    """

    amplitude: float
    frequency: float
    axis: tuple[float, float, float]
    phase: float = 0.0

    def __post_init__(self) -> None:
        set_positive(self, "amplitude", "frequency", zero=True)
        set_fields(self, axis=_direction(self.axis, "of the tremor"), phase=float(as_finite("phase", self.phase, ())))

    def __call__(self, t: float, arm: ArmState) -> FloatArray:
        """Moment at a time; see the class."""
        return self.amplitude * np.sin(2.0 * np.pi * self.frequency * t + self.phase) * np.array(self.axis)


@checked
@dataclass(frozen=True)
class Spasticity:
    """Muscles that resist a fast stretch: beyond a threshold they brake the more, the faster it is.

    M = -c (|ω| - ω_0) ω/|ω| for |ω| > ω_0, at most the limit; with an axis, of the turn about it, one way, alone.

    Parameters
    ----------
    threshold : float
        ω_0, rad/s.
    gain : float
        c, N m s/rad.
    limit : float
        Greatest moment, N m.
    axis : array_like, optional
        Shape (3,), base frame: the turn that stretches.
    source : str
        Where the numbers are from.

    Raises
    ------
    MissingData
        If a number or the source is not given.

    Examples
    --------
    >>> from exo_pin.control import ArmState, Spasticity
    >>> stiff = Spasticity(0.5, 4.0, 10.0, source="an assumption for this example")
    >>> [float(stiff(0.0, ArmState(np.eye(3), np.array([0.0, w, 0.0])))[1] + 0.0) for w in (0.4, 1.5, 9.0)]  # N m
    [0.0, -4.0, -10.0]
    """

    threshold: float | None = None
    gain: float | None = None
    limit: float | None = None
    axis: tuple[float, float, float] | None = None
    source: str = ""

    def __post_init__(self) -> None:
        values = {"threshold": self.threshold, "gain": self.gain, "limit": self.limit}
        require_known(self.source, values, "spasticity")
        set_positive(self, "threshold", "gain", "limit", zero=True)
        if self.axis is not None:
            set_fields(self, axis=_direction(self.axis, "that the turn stretches about"))

    def __call__(self, t: float, arm: ArmState) -> FloatArray:
        """Moment at a time; see the class."""
        assert self.threshold is not None
        assert self.gain is not None
        assert self.limit is not None
        turning = arm.angular_velocity
        if self.axis is not None:
            axis = np.array(self.axis)
            turning = max(float(axis @ turning), 0.0) * axis
        speed = float(np.linalg.norm(turning))
        if speed <= self.threshold:
            return np.zeros(3)
        return np.asarray(-min(self.gain * (speed - self.threshold), self.limit) / speed * turning)


@checked
@dataclass(frozen=True, eq=False)
class Push:
    """A load on the arm for a time: a push of somebody, a blow, a weight that leans.

    Parameters
    ----------
    load : Load
        One force and couple.
    start, end : float
        s.

    Raises
    ------
    InvalidInput
        If the load is a stack, or ends before it begins.

    Examples
    --------
    >>> from exo_pin.control import ArmState, Push
    >>> shove = Push(ep.Load([20.0, 0.0, 0.0], at=(0.0, 0.0, -0.3)), start=0.1, end=0.2)
    >>> force, moment = shove(0.15, ArmState(np.eye(3), np.zeros(3)))
    >>> moment + 0.0  # N m about O
    array([ 0., -6.,  0.])
    """

    #: It comes from outside, and the wearer's own muscles bear it.
    external: ClassVar[bool] = True
    load: Load
    start: float = 0.0
    end: float = np.inf

    def __post_init__(self) -> None:
        require_type("load", self.load, Load, "a Load")
        parts = (self.load.force, self.load.moment, self.load.at)
        if any(np.asarray(part).shape != (3,) for part in parts):
            raise InvalidInput("expected one load, not a stack: force, moment and at of shape (3,)")
        check_span(self)

    def __call__(self, t: float, arm: ArmState) -> tuple[FloatArray, FloatArray]:
        """Force at O and moment about it at a time; see the class."""
        if not self.start <= t < self.end:
            return np.zeros(3), np.zeros(3)
        return load_at_shoulder(self.load, arm.matrix)
