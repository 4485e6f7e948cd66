"""A device that fits measured lengths."""

from __future__ import annotations

from dataclasses import dataclass
from functools import cached_property
from typing import TYPE_CHECKING

from scipy.spatial.transform import Rotation

from ..core.records import Record
from ..core.validation import FloatArray
from ..load_case import CentreOffset
from .length_model import LengthModel
from .search.twins import distances

if TYPE_CHECKING:
    from ..exo.shoulder_exo import ShoulderExo


@dataclass(frozen=True, eq=False, repr=False)
class FittedDevice(Record):
    """Where the joints of a device are, with what was found beside them.

    Attributes
    ----------
    nominal : ShoulderExo
        The design that it is near.
    model : LengthModel
        Equations and unknowns; ``model.names`` names them.
    values : ndarray
        Shape (p,): the unknowns, as changes from the start (m, rad), in the order of ``model.names``.
    """

    nominal: ShoulderExo
    model: LengthModel
    values: FloatArray

    @cached_property
    def distance(self) -> float:
        """m, from the nominal design: root of the mean square over the joints, seen from the shoulder's centre."""
        return float(distances(self.model, self.values))

    @property
    def joints(self) -> tuple[FloatArray, FloatArray]:
        """Joint centres A_i in {O_A} and B_i in {O_B}, shape (n, 3) each, m, seen from the shoulder's centre."""
        return self.model.joints(self.values)

    @property
    def length_offsets(self) -> FloatArray:
        """o_i, shape (n,), m: joint distance minus measured length."""
        return self.model.length_offsets(self.values)

    @property
    def torso_mounting(self) -> Rotation:
        """Q_T, from the torso's sensor to {O_A}."""
        return self.model.mountings(self.values)[0]

    @property
    def arm_mounting(self) -> Rotation:
        """Q_S, from {O_B} to the arm's sensor."""
        return self.model.mountings(self.values)[1]

    @property
    def centre_offset(self) -> CentreOffset:
        """Where the device's centre is, seen from the shoulder's: ``base_offset`` and ``cuff_offset``, zero if known.

        With joints alone unknown these are seen from the shoulder's centre and hold any offset.
        """
        return CentreOffset(*(self.model.group(name, self.values) for name in ("base_offset", "cuff_offset")))

    @property
    def exo(self) -> ShoulderExo:
        """The calibrated design; use it with :attr:`centre_offset`."""
        values, shape = self.values, self.model.base.shape
        base = self.model.base + self.model.group("base_points", values, shape)
        platform = self.model.platform + self.model.group("platform_points", values, shape)
        return self.nominal.replace(geometry=self.nominal.geometry.replace(base_points=base, platform_points=platform))

    def __repr__(self) -> str:
        return f"<{type(self).__name__} near {self.nominal.name!r}: {1e3 * self.distance:.3g} mm from it>"
