"""Range of validity of a muscle model: strain, pressure, capability limit, no push."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import NDArray

from ...core.errors import InvalidInput, OutsideValidity
from ...core.errors.checked import checked
from ...core.validation import FloatArray, as_choice, as_finite, as_real, broadcast_real, broadcast_to, set_fields

BoolArray = NDArray[np.bool_]

#: Slack on every bound, relative to the bound, so that a bound itself is inside after a change of units.
_SLACK = 1e-9


def as_outside(outside: str) -> str:
    """Return ``outside`` if it is "raise" or "mark", else raise UnknownName."""
    return as_choice("choice for outside", outside, ("mark", "raise"))


def _interval(name: str, value: Any) -> tuple[float, float]:
    low, high = (float(side) for side in as_finite(name, value, (2,)))
    if low >= high:
        raise InvalidInput(f"expected {name} to be (lower, upper) with lower below upper, got ({low:g}, {high:g})")
    return low, high


def _within(unit: str, value: Any, low: Any, high: Any) -> tuple[Any, Any]:
    """Whether values are above the lower bound, and below the upper one."""
    # Forces are compared with an absolute slack of nN too, because their bound may be zero.
    least = 1.0 if unit == " N" else 0.0
    below, above = (_SLACK * np.maximum(least, np.abs(bound)) for bound in (low, high))
    return value >= low - below, value <= high + above


@checked
@dataclass(frozen=True, kw_only=True)
class Validity:
    """The states in which a static model was identified.

    Parameters
    ----------
    strain : (float, float)
        Contraction over nominal length, least and greatest.
    pressure : (float, float)
        Gauge pressure in Pa, least and greatest.
    capability : (float, float) or None
        Slope in N/Pa and intercept in N of the greatest force that the muscle lifts at a pressure, the thick line
        of Tables 3-3a and 3-3b (Section 3.2.1); None if the data show no such limit.
    basis : str
        Where the numbers come from.

    Raises
    ------
    InvalidInput
        If a bound is not finite, an interval is empty, or the pressure is below zero.

    Examples
    --------
    >>> from exo_pin.muscle import muscle_model
    >>> limits = muscle_model("best").validity
    >>> [round(each, 3) for each in limits.strain], [round(1e-5 * each, 2) for each in limits.pressure]  # bar
    ([0.041, 0.25], [1.22, 4.07])
    """

    strain: tuple[float, float]
    pressure: tuple[float, float]
    capability: tuple[float, float] | None = None
    basis: str = ""

    def __post_init__(self) -> None:
        set_fields(self, strain=_interval("strain", self.strain), pressure=_interval("pressure", self.pressure))
        if self.pressure[0] < 0:
            raise InvalidInput(f"expected pressure bounds to be zero or more, got {self.pressure[0]:g} Pa")
        if self.capability is not None:
            set_fields(self, capability=tuple(as_finite("capability", self.capability, (2,)).tolist()))

    def capability_line(self, pressure: FloatArray) -> FloatArray:
        """Force in N on the capability line at a pressure in Pa, +inf where there is no line.

        Parameters
        ----------
        pressure : ndarray
            Gauge, shape (...), Pa.

        Returns
        -------
        ndarray
            Shape (...), N.

        Examples
        --------
        >>> from exo_pin.muscle import Validity
        >>> limits = Validity(strain=(0.0, 0.3), pressure=(1e5, 4e5), capability=(1e-4, -5.0))
        >>> limits.capability_line(np.array([1e5, 2e5]))  # N: 10 N/bar less 5 N
        array([ 5., 15.])
        """
        pressure = as_real("pressure", pressure)
        if self.capability is None:
            return np.full(pressure.shape, np.inf)
        return np.asarray(self.capability[0] * pressure + self.capability[1])

    def _bounds(self, strain: Any, pressure: Any, force: Any | None) -> list[tuple[str, str, Any, Any, Any]]:
        """Name, unit, values, and least and greatest of what is bounded."""
        rows: list[tuple[str, str, Any, Any, Any]] = [
            ("strain", "", strain, *self.strain),
            ("pressure", " Pa", pressure, *self.pressure),
        ]
        if force is not None:
            rows.append(("force (a muscle cannot push)", " N", force, 0.0, np.inf))
            rows.append(("force (capability limit)", " N", force, -np.inf, self.capability_line(pressure)))
        return rows

    def contains(self, strain: FloatArray, pressure: FloatArray, force: FloatArray | None = None) -> BoolArray:
        """Whether each state is inside; without ``force`` only strain and pressure are checked.

        Parameters
        ----------
        strain, pressure, force : ndarray
            Shape (...), dimensionless, Pa and N. NaN counts as outside.

        Returns
        -------
        ndarray of bool
            Shape (...).

        Examples
        --------
        >>> from exo_pin.muscle import Validity
        >>> limits = Validity(strain=(0.0, 0.3), pressure=(1e5, 4e5), capability=(1e-4, -5.0))
        >>> limits.contains(np.array([0.1, 0.4, 0.1]), np.full(3, 2e5), np.array([10.0, 10.0, 20.0]))  # strain; force
        array([ True, False, False])
        """
        given: dict[str, Any] = {"strain": strain, "pressure": pressure} | ({} if force is None else {"force": force})
        strain, pressure, *forces = broadcast_real(**given)
        inside = np.ones(strain.shape, dtype=bool)
        for _, *bounded in self._bounds(strain, pressure, forces[0] if forces else None):
            inside &= np.logical_and(*_within(*bounded))
        return inside

    def strains_at(self, pressure: float) -> tuple[float, float]:
        """Least and greatest strain that are inside at a pressure, with what :meth:`contains` leaves to rounding.

        Parameters
        ----------
        pressure : float
            Gauge, Pa.

        Returns
        -------
        tuple of float
            (inf, -inf) at a pressure that is outside.

        Examples
        --------
        >>> from exo_pin.muscle import Validity
        >>> limits = Validity(strain=(0.1, 0.3), pressure=(1e5, 4e5))
        >>> [round(each, 6) for each in limits.strains_at(2e5)], limits.strains_at(5e5)
        ([0.1, 0.3], (inf, -inf))
        """
        low, high = self.strain
        if not self.contains(np.array(low), np.array(pressure)):
            return np.inf, -np.inf
        return low - _SLACK * abs(low), high + _SLACK * abs(high)

    def explain(self, strain: float, pressure: float, force: float | None = None) -> str:
        """Text that names the bound a state violates, with numbers; empty if it violates none.

        Parameters
        ----------
        strain : float
            Contraction over nominal length.
        pressure : float
            Gauge, Pa.
        force : float, optional
            N.

        Returns
        -------
        str

        Examples
        --------
        >>> from exo_pin.muscle import Validity
        >>> Validity(strain=(0.0, 0.3), pressure=(1e5, 4e5)).explain(0.1, 5e5)
        'expected pressure at most 400000 Pa, got 500000 Pa'
        """
        for name, unit, value, low, high in self._bounds(strain, pressure, force):
            for holds, side, bound in zip(_within(unit, value, low, high), ("least", "most"), (low, high), strict=True):
                if not holds:
                    return f"expected {name} at {side} {float(bound):.6g}{unit}, got {value:.6g}{unit}"
        return ""

    def enforce(
        self,
        model: str,
        values: FloatArray,
        strain: FloatArray,
        pressure: FloatArray,
        force: FloatArray | None,
        outside: str,
    ) -> FloatArray:
        """Return ``values``, or raise, or mark those whose state is outside.

        Parameters
        ----------
        model : str
            Name of the model, for the message.
        values : ndarray
            Shape (...), force of the model, N.
        strain, pressure, force : ndarray
            Shape (...), the states; see :meth:`contains`.
        outside : {"raise", "mark"}
            What to do about states outside.

        Returns
        -------
        ndarray or numpy.ma.MaskedArray
            With "mark" a masked array: ``.mask`` is True outside and ``.data`` keeps the extrapolated value.

        Raises
        ------
        OutsideValidity
            With "raise", if a state is outside.

        Examples
        --------
        >>> from exo_pin.muscle import Validity
        >>> limits = Validity(strain=(0.0, 0.3), pressure=(1e5, 4e5))
        >>> states = np.array([0.1, 0.5]), np.full(2, 2e5)
        >>> limits.enforce("mine", np.array([8.0, 1.0]), *states, None, "mark").mask  # a strain of 0.5 is outside
        array([False,  True])
        """
        choice = as_outside(outside)
        inside = broadcast_to("states", self.contains(strain, pressure, force), np.shape(values))
        if choice == "mark":
            return np.ma.MaskedArray(values, mask=~inside)
        if not inside.all():
            index = tuple(np.argwhere(~inside)[0])
            given = [array for array in (strain, pressure, force) if array is not None]
            state = (float(np.broadcast_to(array, inside.shape)[index]) for array in given)
            raise OutsideValidity(model, self.explain(*state), (~inside).sum(), index)
        return values
