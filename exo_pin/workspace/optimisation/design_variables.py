"""Dimensions of a design that an optimiser may choose: those :mod:`exo_pin.design.parameters` of joints and strokes.

A limb whose ``nominal_length`` is no variable gets the stroke of its family that fits best.
"""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any

import numpy as np

from ...core.errors import InvalidInput
from ...core.records import Record
from ...core.validation import FloatArray
from ...design import Mechanism
from ...design.parameters.changes import check_parameters, value_of, with_values
from ...design.parameters.names import DesignParameter, bounds_of, parameter
from .stroke_fitting import FitOptions

__all__ = ["DesignVariables"]


class DesignVariables(Record):
    """Variables with their bounds, and the design that belongs to a point of the unit cube.

    Parameters
    ----------
    mechanism : Mechanism
        The design to start from.
    bounds : mapping of str to (float, float)
        By name; see the module's description.

    Raises
    ------
    UnknownName
        If a name is none of these.
    InvalidInput
        If a bound is not finite or the lower one is not below the upper, or a circle's dimension is varied in a design
        whose joints are not on circles.
    """

    def __init__(self, mechanism: Mechanism, bounds: Mapping[str, Any]) -> None:
        if not isinstance(bounds, Mapping) or not bounds:
            raise InvalidInput("expected variables as a mapping of names to (lowest, highest)")
        self.mechanism = mechanism
        self.parameters = tuple(map(parameter, bounds))
        self.names = tuple(named.si_name for named in self.parameters)
        if len(set(self.names)) < len(self.names):
            raise InvalidInput(f"expected each variable once, got {', '.join(bounds)}")
        pairs = zip(self.parameters, bounds.values(), strict=True)
        self.bounds = np.array([bounds_of(named, given) for named, given in pairs])
        self._whole = np.isclose(self.bounds[:, 1] - self.bounds[:, 0], 2.0 * np.pi)
        self._whole &= [named.kind == "angle" for named in self.parameters]
        check_parameters(mechanism, self.parameters)
        self.of_design()  # raises for what is no dimension
        #: By limb: whether the variables set its stroke, so that none is fitted, shape (n,).
        self.sets_stroke = np.array([self._named("nominal_length", i) is not None for i in range(mechanism.limb_count)])

    def _named(self, key: str, limb: int) -> str | None:
        """The variable that is a parameter of a limb, counted from 0; that of the limb alone before that of all."""
        found = [(named.limb or 0, named.si_name) for named in self.parameters if named.key == key]
        return dict(found).get(limb + 1, dict(found).get(0))

    def refuse_idle(self) -> None:
        """Raise InvalidInput if an end fitting changes nothing, for designs whose strokes are not fitted."""
        for i in np.flatnonzero(~self.sets_stroke).tolist():
            name = self._named("end_fitting", i)
            if name is not None:
                raise InvalidInput(f"expected nominal_length[{i + 1}] beside {name}, or strokes that are fitted")

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
            value = value_of(self.mechanism, named)
            values[named.si_name] = float(np.clip(0.5 * (low + high) if value is None else value, low, high))
        return values

    def design(self, values: Mapping[str, float]) -> Mechanism:
        """The mechanism with these values."""
        return with_values(self.mechanism, self._chosen(values))

    def _chosen(self, values: Mapping[str, float]) -> dict[DesignParameter, float]:
        """Values by parameter. An end fitting alone is no part of a design: the fit of its stroke takes it."""
        chosen = {named: values[named.si_name] for named in self.parameters if named.key != "end_fitting"}
        for i in np.flatnonzero(self.sets_stroke).tolist():
            name = self._named("end_fitting", i)
            if name is not None:
                chosen[parameter(f"end_fitting[{i + 1}]")] = values[name]
        return chosen

    def fit_options(self, values: Mapping[str, float]) -> FitOptions:
        """How the strokes of the limbs are fitted whose lengths are no variables."""
        return FitOptions(self.sets_stroke, self.end_fittings(values))

    def end_fittings(self, values: Mapping[str, float]) -> tuple[float | None, ...]:
        """End fittings among the values, m, one a limb; None where the family's own counts."""
        names = (self._named("end_fitting", i) for i in range(self.mechanism.limb_count))
        return tuple(None if name is None else values[name] for name in names)
