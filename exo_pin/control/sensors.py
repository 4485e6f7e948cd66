"""What is wrong with the sensors of a plant: a list of errors, each of one channel of :class:`.Measurement`.

Each sample is read with bias and noise and rounded to the resolution; while the channel is lost nothing is read. The
controller gets the newest reading that is as old as the delay.

    plant.simulate(controller, 1.0, start, sensor=control.Sensors([
        control.SensorError("pressures", noise=500.0, resolution=100.0),
        control.SensorError("drive_positions", limb=2, lost=((0.4, 0.6),)),
    ]))
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np
from scipy.spatial.transform import Rotation

from ..core.errors import InvalidInput, UnknownName
from ..core.errors.base import echo
from ..core.errors.checked import checked
from ..core.validation import ReadOnly, as_count, as_finite, as_real, require_type, set_fields, set_positive
from .plant.state import Measurement

__all__ = ["SensorError", "Sensors"]

#: What can be spoiled.
CHANNELS = (
    "orientation", "angular_velocity", "pressures", "supply_pressure", "lengths", "contraction_ratios",
    "drive_positions", "drive_speeds",
)  # fmt: skip
_SAME = 1e-9


def as_intervals(lost: Any) -> tuple[tuple[float, float], ...]:
    """Times from and to which something is lost, s."""
    given = as_real("lost", lost if np.size(lost) else np.zeros((0, 2)))
    if given.ndim != 2 or given.shape[1] != 2 or not (given[:, 0] < given[:, 1]).all():
        raise InvalidInput(f"expected lost as intervals (from, to) in s, got {echo(lost)}")
    return tuple((start, end) for start, end in given.tolist())


@checked
@dataclass(frozen=True, eq=False)
class SensorError(ReadOnly):
    """What is wrong with a channel, in its unit; of an orientation rotation vectors in the base frame, rad.

    Parameters
    ----------
    channel : str
        "orientation", "angular_velocity", "pressures", "supply_pressure", "lengths", "contraction_ratios",
        "drive_positions" or "drive_speeds".
    noise : float
        Standard deviation of a sample.
    bias : float or array_like
        Added to every sample.
    resolution : float
        Step to which readings are rounded; zero for none.
    delay : float
        Age of a reading when the controller gets it, s.
    lost : tuple of (float, float)
        Intervals from, to, s, in which nothing is read.
    limb : int, optional
        Of one drive alone, from zero on; all entries of the channel if left out.
    seed : int
        Of the noise.

    Raises
    ------
    UnknownName
        If there is no such channel.
    InvalidInput
        If a number is out of its range.

    Examples
    --------
    >>> from exo_pin.control import SensorError
    >>> SensorError("drive_positions", resolution=1e-5, delay=0.002).delay  # s
    0.002
    """

    channel: str
    noise: float = 0.0
    bias: Any = 0.0
    resolution: float = 0.0
    delay: float = 0.0
    lost: tuple[tuple[float, float], ...] = ()
    limb: int | None = None
    seed: int = 0

    def __post_init__(self) -> None:
        if self.channel not in CHANNELS:
            raise UnknownName("channel", self.channel, CHANNELS)
        set_positive(self, "noise", "resolution", "delay", zero=True)
        bias = as_finite("bias", self.bias, (), stack=True)
        if bias.ndim > 1:
            raise InvalidInput(f"expected bias as a number or a list of them, got shape {bias.shape}")
        set_fields(self, seed=as_count("seed", self.seed), bias=tuple(bias.tolist()) if bias.ndim else float(bias))
        if self.limb is not None:
            set_fields(self, limb=as_count("limb", self.limb))
        set_fields(self, lost=as_intervals(self.lost))

    def _read(self, value: Any, sample: int) -> Any:
        """A reading of a true value; the noise is drawn by the number of the sample."""
        turned = isinstance(value, Rotation)
        true = np.zeros(3) if turned else np.asarray(value, dtype=np.float64)
        if self.limb is not None and not (true.ndim == 1 and self.limb < len(true) and not turned):
            raise InvalidInput(f"expected limb as one of the entries of {self.channel}, got {self.limb}")
        draw = np.random.default_rng([self.seed, CHANNELS.index(self.channel), sample])
        # Of the other entries :meth:`Sensors.__call__` keeps the true values.
        read = true + np.asarray(self.bias) + self.noise * draw.standard_normal(true.shape)
        if turned:
            read = (Rotation.from_rotvec(read) * value).as_rotvec()
        if self.resolution > 0.0:
            read = self.resolution * np.round(read / self.resolution)
        if turned:
            return Rotation.from_rotvec(read)
        return float(read) if read.ndim == 0 else read


class Sensors:
    """All errors of a plant's sensors, as ``sensor`` of :meth:`exo_pin.Plant.simulate`; see the module.

    Parameters
    ----------
    errors : SensorError or sequence of SensorError
        As a list or tuple. Those of one channel act one after the other. ``Measurement.lost`` is true where the
        orientation is.

    Examples
    --------
    >>> from exo_pin import control
    >>> exo, seen = ep.load("four-cables"), []
    >>> plant = ep.Plant(exo)
    >>> late = control.Sensors(control.SensorError("drive_positions", delay=0.02))
    >>> controller = lambda t, measured: seen.append(measured.drive_positions[0]) or np.full(4, 0.2)
    >>> run = plant.simulate(controller, 0.1, plant.held(exo.pose(30), np.full(4, 40.0)), sensor=late)
    >>> bool(seen[5] == run.drive_positions[3, 0])  # two samples of 10 ms ago
    True
    """

    def __init__(self, errors: SensorError | Sequence[SensorError]) -> None:
        given = (errors,) if isinstance(errors, SensorError) else errors
        if not isinstance(given, list | tuple):
            raise InvalidInput(f"expected errors as a SensorError or a list of them, got {echo(errors)}")
        self.errors = tuple(given)
        for each in self.errors:
            require_type("errors", each, SensorError, "SensorError records")
        #: Samples so far, and readings (time, value) of each error that may still be asked.
        self.memory: tuple[int, tuple[tuple[tuple[float, Any], ...], ...]] = (0, ((),) * len(self.errors))

    def recall(self, memory: tuple[int, tuple[tuple[tuple[float, Any], ...], ...]]) -> None:
        """Go on from a ``memory``.

        Parameters
        ----------
        memory : tuple
            Of the same sensors, at an earlier time.

        Examples
        --------
        >>> from exo_pin.control import SensorError, Sensors
        >>> sensors = Sensors(SensorError("lengths", noise=1e-3))
        >>> sensors.recall((0, ((),)))
        """
        self.memory = memory

    def __call__(self, t: float, measurement: Measurement) -> Measurement:
        """The measurement at a sample, with its errors."""
        (sample, kept), after, lost = self.memory, [], measurement.lost
        for own, past in zip(self.errors, kept, strict=True):
            value = getattr(measurement, own.channel)
            gone = any(start <= t + _SAME < end for start, end in own.lost)
            # What is lost before the first sample is as it was there.
            readings = past if gone and past else (*past, (t, own._read(value, sample)))
            due = [k for k, (when, _) in enumerate(readings) if when <= t - own.delay + _SAME]
            readings = readings[due[-1] if due else 0 :]
            after.append(readings)
            read = readings[0][1]
            if own.limb is not None:
                read = np.where(np.arange(len(value)) == own.limb, read, value)
            measurement = measurement._replace(**{own.channel: read})
            # Old is a reading that was due while nothing was read, whenever it is asked.
            late = any(start <= t - own.delay + _SAME < end for start, end in own.lost)
            lost = lost or (own.channel == "orientation" and late)
        self.memory = sample + 1, tuple(after)
        return measurement._replace(lost=lost)
