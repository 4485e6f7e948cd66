"""Motion of the arm, load on it and offset of the device."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Literal

import numpy as np
from numpy.typing import ArrayLike

from ..core.errors import InvalidInput
from ..core.fields import set_fields
from ..core.records import Record
from ..core.validation import FloatArray, as_choice, as_finite

#: No arm turns faster (rad/s) or is accelerated more (rad/s²): beyond it a number is a slip.
FASTEST = 1e6
#: Largest load, N or N m, that is not a slip.
_STRONGEST = 1e9


@dataclass(frozen=True, eq=False)
class Motion(Record):
    """Angular velocity and acceleration of the arm, base frame.

    Attributes
    ----------
    angular_velocity : ndarray
        ω, shape (..., 3), rad/s.
    angular_acceleration : ndarray
        η, shape (..., 3), rad/s².
    cautions : tuple of str
        Doubts about ω and η of a measured movement.
    """

    angular_velocity: FloatArray
    angular_acceleration: FloatArray
    cautions: tuple[str, ...] = ()

    def __post_init__(self) -> None:
        for name in ("angular_velocity", "angular_acceleration"):
            value = as_finite(name, getattr(self, name), (3,), stack=True)
            if np.abs(value).max(initial=0.0) > FASTEST:
                raise InvalidInput(f"expected {name} in rad/s or rad/s² below {FASTEST:g}, got {np.abs(value).max():g}")
            set_fields(self, **{name: value})


@dataclass(frozen=True, eq=False)
class Load(Record):
    """A force and a couple on the arm, besides its weight.

    Attributes
    ----------
    force : ndarray
        Shape (..., 3), N.
    moment : ndarray
        Shape (..., 3), N m, a pure couple.
    at : ndarray
        Shape (..., 3), m, the point of the arm where the force acts, always in the arm frame {O_B}.
    frame : {"base", "arm"}
        Axes in which ``force`` and ``moment`` are given.
    """

    force: FloatArray
    moment: FloatArray | ArrayLike = 0.0
    at: FloatArray | ArrayLike = (0.0, 0.0, 0.0)
    frame: Literal["base", "arm"] = "base"

    def __post_init__(self) -> None:
        is_zero = isinstance(self.moment, (int, float)) and self.moment == 0
        moment = np.zeros(3) if is_zero else self.moment
        for name, value in (("force", self.force), ("moment", moment), ("at", self.at)):
            array = as_finite(name, value, (3,), stack=True)
            if np.abs(array).max(initial=0.0) > _STRONGEST:
                raise InvalidInput(f"expected {name} below {_STRONGEST:g}, got {np.abs(array).max():g}")
            set_fields(self, **{name: array})
        if np.abs(np.asarray(self.at)).max(initial=0.0) > 5.0:
            raise InvalidInput(f"expected at in m, got {self.at} (millimetres?)")
        as_choice("frame", self.frame, ("base", "arm"))


@dataclass(frozen=True, eq=False)
class CentreOffset(Record):
    """Offset of the device's centre from the anatomical centre of the shoulder.

    Attributes
    ----------
    base : ndarray
        Of the centre that base ring and torso hold, shape (..., 3), m, base frame. A stack lets the anatomical
        centre move with the pose: a shoulder that moves by d shifts the base by -d (:meth:`of_moving_shoulder`).
    cuff : ndarray
        Of the centre that platform and arm carry, shape (..., 3), m, arm frame {O_B}.
    """

    base: FloatArray
    cuff: FloatArray

    def __post_init__(self) -> None:
        for name in ("base", "cuff"):
            offset = as_finite(name, getattr(self, name), (3,), stack=True)
            if np.abs(offset).max(initial=0.0) > 0.2:
                raise InvalidInput(f"expected {name} offset in m, within 0.2 m, got {offset} (millimetres?)")
            set_fields(self, **{name: offset})

    @classmethod
    def together(cls, offset: ArrayLike) -> CentreOffset:
        """Base and cuff shifted alike: the device fits at rest, {O_B} = {O_A}, and misfits as the arm turns.

        Parameters
        ----------
        offset : array_like
            Shape (..., 3), m.
        """
        return cls(offset, offset)  # type: ignore[arg-type]

    @classmethod
    def of_moving_shoulder(cls, displacement: ArrayLike, offset: ArrayLike = (0.0, 0.0, 0.0)) -> CentreOffset:
        """Offset of a device whose wearer's shoulder centre moves with the pose.

        Parameters
        ----------
        displacement : array_like
            Shape (..., 3), m, base frame: where the centre has moved to, from its place at rest.
        offset : array_like
            Shape (3,), m, of the device at rest, base and cuff together.
        """
        moved = as_finite("displacement", displacement, (3,), stack=True)
        own = as_finite("offset", offset, (3,))
        return cls(own - moved, own)
