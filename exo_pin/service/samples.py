"""Messages of a live stream: its opening, its samples, and what their numbers and times show of lost and late ones."""

from __future__ import annotations

import math
from typing import Any, NamedTuple

import msgspec
import numpy as np

from ..core.errors import InvalidInput
from ..core.validation import FloatArray, as_finite

#: By how much the clocks of sender and receiver may drift against each other, s/s.
_DRIFT = 2e-4


class SampledSensors(msgspec.Struct, forbid_unknown_fields=True, frozen=True):
    """Sensors on trunk and arm, strapped on anyhow, as in a recording (:mod:`exo_pin.load_case.recordings.bodies`).

    Attributes
    ----------
    forward : str
        Axis of the trunk's sensor that points forward: x, y, z, -x, -y or -z.
    still : float
        Time for which the arm hangs still at the start, s.
    """

    forward: str
    still: float = 0.5


class Opening(msgspec.Struct, forbid_unknown_fields=True, frozen=True):
    """The first message of a stream.

    Attributes
    ----------
    open : dict
        What is asked of every sample: a question without poses.
    rate : float or None
        Samples a second, Hz; without ``seq`` in the samples lost ones are found by it.
    sensors : SampledSensors or None
        If the samples are of sensors; otherwise they are poses of the arm against the trunk.
    reading : str
        What holds in place of what the samples are called, as a doubt suggests ("w-first", "inverse", ...); "as-named"
        if the stream is right although no arm seems to move like this.
    token : str or None
        Of the service.
    """

    open: dict[str, Any]
    rate: float | None = None
    sensors: SampledSensors | None = None
    reading: str = ""
    token: str | None = None


Quaternion = tuple[float, float, float, float]


class Sample(msgspec.Struct, forbid_unknown_fields=True, frozen=True):
    """A sample: one orientation, in the order that its name says, or three angles.

    Attributes
    ----------
    t : float
        Time by the sender's clock, s.
    seq : int or None
        Number, counted up by one.
    quaternion_xyzw, quaternion_wxyz : tuple of float or None
        Of the arm against the trunk, {O_B} to {O_A}.
    flexion, abduction, internal_rotation : float or None
        Clinical angles in place of it, degrees; one that is left out is 0.
    arm_xyzw, arm_wxyz, trunk_xyzw, trunk_wxyz : tuple of float or None
        Of sensors, to the ground, whose z is up.
    """

    t: float
    seq: int | None = None
    quaternion_xyzw: Quaternion | None = None
    quaternion_wxyz: Quaternion | None = None
    flexion: float | None = None
    abduction: float | None = None
    internal_rotation: float | None = None
    arm_xyzw: Quaternion | None = None
    arm_wxyz: Quaternion | None = None
    trunk_xyzw: Quaternion | None = None
    trunk_wxyz: Quaternion | None = None

    @property
    def angles(self) -> tuple[float, float, float] | None:
        """Clinical angles, degrees; None where the sample has none."""
        given = (self.flexion, self.abduction, self.internal_rotation)
        return None if given == (None, None, None) else (given[0] or 0.0, given[1] or 0.0, given[2] or 0.0)

    def quaternion(self, role: str) -> FloatArray | None:
        """A quaternion as x, y, z, w, shape (4,): of "quaternion", "arm" or "trunk"; None where there is none.

        Raises
        ------
        InvalidInput
            If it is given in both orders, or is not of unit length.
        """
        last, first = getattr(self, f"{role}_xyzw"), getattr(self, f"{role}_wxyz")
        if last is not None and first is not None:
            raise InvalidInput(f"expected {role}_xyzw or {role}_wxyz, got both")
        given = last if first is None else (*first[1:], first[0])
        if given is None:
            return None
        found = as_finite(role, given, (4,))
        if abs(float(np.linalg.norm(found)) - 1.0) > 0.02:
            raise InvalidInput(f"expected {role} as a unit quaternion, got one of length {np.linalg.norm(found):.3g}")
        return found / np.linalg.norm(found)


class Arrival(NamedTuple):
    """A sample as it has come.

    Attributes
    ----------
    seq : int or None
        Its number: as given, else counted by time and rate.
    is_late : bool
        Whether a newer one has come before, or the same; it gets no answer.
    lost : tuple of int or None
        First and last number of those that are missing before it.
    delay : float
        How much longer it has been on its way than the quickest one, s.
    """

    seq: int | None
    is_late: bool
    lost: tuple[int, int] | None
    delay: float


class Stream:
    """What numbers and times of samples show of those that are lost and late.

    Parameters
    ----------
    rate : float, optional
        Samples a second, Hz.

    Examples
    --------
    >>> from exo_pin.service.samples import Sample, Stream
    >>> stream = Stream(rate=100.0)
    >>> [stream.take(Sample(t=0.01 * k, seq=k), 5.0 + 0.01 * k).lost for k in (0, 1, 4)]
    [None, None, (2, 3)]
    """

    def __init__(self, rate: float | None = None) -> None:
        if rate is not None and not 0.0 < rate <= 1e5:
            raise InvalidInput(f"expected a rate of samples, Hz, got {rate:g}")
        self._rate = rate
        self._first: float | None = None
        self._newest: tuple[int | None, float] = (None, -math.inf)
        self._quickest, self._at = math.inf, math.inf

    def take(self, sample: Sample, arrived: float) -> Arrival:
        """Say of a sample what it shows, at the time of the receiver's clock at which it has come, s."""
        if not math.isfinite(sample.t):
            raise InvalidInput("expected t as a time, s")
        self._first = sample.t if self._first is None else self._first
        seq = sample.seq
        if seq is None and self._rate is not None:
            seq = round((sample.t - self._first) * self._rate)
        # The quickest way is forgotten as slowly as clocks drift.
        took, aged = arrived - sample.t, self._quickest + _DRIFT * max(arrived - self._at, 0.0)
        self._quickest, self._at = min(aged, took), arrived
        delay, (before, then) = took - self._quickest, self._newest
        is_late, lost = sample.t <= then, None
        if before is not None and seq is not None:
            is_late = seq <= before
            lost = (before + 1, seq - 1) if seq > before + 1 else None
        if not is_late:
            self._newest = (seq, sample.t)
        return Arrival(seq, is_late, lost, delay)
