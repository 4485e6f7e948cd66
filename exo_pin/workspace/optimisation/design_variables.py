"""Dimensions of a device that an optimiser may choose: of a wrist those of joints and strokes, of another its links.

Their names are those of sweeps (:mod:`exo_pin.design.parameters.names`, :mod:`exo_pin.device.dimensions`). A limb of a
wrist whose ``nominal_length`` is no variable gets the stroke of its family that fits best.
"""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any

import numpy as np
from numpy.typing import NDArray

from ...core.errors import InvalidInput
from ...core.records import Record
from ...core.validation import FloatArray
from ...design import Mechanism
from ...design.holding_frame import with_cuff_by_geometry
from ...design.parameters.names import bounds_of
from ...device.protocol import Device
from ...device.wrist_device import as_device

#: By how much a design may miss a bound, m and rad: bounds are given in rounded figures.
_ROUNDED = 1e-6


class DesignVariables(Record):
    """Variables with their bounds, and the design that belongs to a point of the unit cube.

    Parameters
    ----------
    design : Device or Mechanism
        The design to start from.
    bounds : mapping of str to (float, float)
        By name; see the module's description.
    by_geometry : bool
        Whether the moving part of the device is that of each design's own cuff
        (:func:`exo_pin.design.holding_frame.estimated_cuff`), in place of what the design moves.

    Raises
    ------
    UnknownName
        If a name is none of these.
    InvalidInput
        If a bound is not finite or the lower one is not below the upper, or a circle's dimension is varied in a design
        whose joints are not on circles, or an end fitting of a limb without its length.
    """

    def __init__(self, design: Device | Mechanism, bounds: Mapping[str, Any], by_geometry: bool = False) -> None:
        if not isinstance(bounds, Mapping) or not bounds:
            raise InvalidInput("expected variables as a mapping of names to (lowest, highest)")
        self.device: Device = as_device(design)
        self.by_geometry = by_geometry
        self.parameters = self.device.parameters(bounds)
        self.names = tuple(named.si_name for named in self.parameters)
        if len(set(self.names)) < len(self.names):
            raise InvalidInput(f"expected each variable once, got {', '.join(bounds)}")
        pairs = zip(self.parameters, bounds.values(), strict=True)
        self.bounds = np.array([bounds_of(named, given) for named, given in pairs])
        self._whole = np.isclose(self.bounds[:, 1] - self.bounds[:, 0], 2.0 * np.pi)
        self._whole &= [named.kind == "angle" for named in self.parameters]
        self.of_design()  # raises for what is no dimension
        #: By limb: whether the variables set its stroke, so that none is fitted, shape (n,).
        self.sets_stroke = self._are_named("nominal_length")
        idle = np.flatnonzero(self._are_named("end_fitting") & ~self.sets_stroke)
        if idle.size:
            limb = idle[0] + 1
            raise InvalidInput(f"expected nominal_length[{limb}] beside end_fitting: its stroke is fitted otherwise")

    def _are_named(self, key: str) -> NDArray[np.bool_]:
        """Limbs that have this parameter, of their own or of all limbs, among the variables, shape (n,)."""
        limbs = [named.limb for named in self.parameters if named.key == key]
        return np.array([None in limbs or i + 1 in limbs for i in range(self.device.limb_count)])

    @property
    def count(self) -> int:
        """Number of variables."""
        return len(self.names)

    def values(self, point: FloatArray) -> dict[str, float]:
        """Values by name of a point, shape (k,).

        Bounds are met by a cosine, low + (high - low) (1 - cos π x)/2, which is smooth where a search would otherwise
        bounce off a wall, and good designs lie at many walls. A full circle goes on where it ends.
        """
        inside = 0.5 - 0.5 * np.cos(np.pi * point)
        values = self.bounds[:, 0] + inside * (self.bounds[:, 1] - self.bounds[:, 0])
        turned = self.bounds[:, 0] + np.mod(point, 1.0) * 2.0 * np.pi
        return dict(zip(self.names, np.where(self._whole, turned, values).tolist(), strict=True))

    def point(self, values: Mapping[str, float]) -> FloatArray:
        """The point that belongs to values within the bounds, shape (k,)."""
        chosen = np.array([values[name] for name in self.names])
        share = (chosen - self.bounds[:, 0]) / (self.bounds[:, 1] - self.bounds[:, 0])
        return np.where(self._whole, share, np.arccos(np.clip(1.0 - 2.0 * share, -1.0, 1.0)) / np.pi)

    def of_design(self) -> dict[str, float]:
        """Values of the design to start from, by name, moved into the bounds; their middle where it has none."""
        values = {}
        for named, (low, high) in zip(self.parameters, self.bounds, strict=True):
            value = self.device.value_of(named)
            values[named.si_name] = float(np.clip(0.5 * (low + high) if value is None else value, low, high))
        return values

    def require_design_inside(self) -> None:
        """Refuse a start outside its bounds: a search would begin elsewhere.

        Raises
        ------
        InvalidInput
            If a value of the design is outside.
        """
        for named, (low, high) in zip(self.parameters, self.bounds, strict=True):
            value = self.device.value_of(named)
            if value is not None and not low - _ROUNDED <= value <= high + _ROUNDED:
                raise InvalidInput(
                    f"expected bounds that hold the design that is refined: its {named.si_name} is {value:g}, outside "
                    f"{low:g} to {high:g} (m, rad)"
                )

    def design(self, values: Mapping[str, float]) -> Any:
        """The device with these values."""
        made = self.device.with_values({named: values[named.si_name] for named in self.parameters})
        return with_cuff_by_geometry(made) if self.by_geometry else made  # type: ignore[arg-type]
