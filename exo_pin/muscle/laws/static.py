"""Static muscle models: force at rest, its derivatives and its inverses.

Contraction x = L_0 - L is in m, positive when the muscle is shorter than its nominal length L_0; pressure is gauge
pressure in Pa; force is in N, positive when the muscle pulls. Every model was identified on a muscle of one length.
For another nominal length it is read at the same strain x/L_0: **an assumption** (same braid angle, same diameter,
end effects neglected), the one that the virtual-work law (3-5) obeys exactly.
"""

from __future__ import annotations

from abc import ABC, abstractmethod
from collections.abc import Callable
from dataclasses import dataclass, replace
from typing import Any, Self

import numpy as np
from numpy.typing import ArrayLike

from ...core.errors import InvalidInput
from ...core.errors.checked import checked
from ...core.errors.inputs import OutsideValidity
from ...core.validation import FloatArray, as_positive, as_texts, broadcast, require_type, set_fields, set_positive
from .validity import Validity, as_outside

#: Points of the grid on which the inverses look for the interval that holds the answer.
_GRID = 129


def crossing(
    function: Callable[[FloatArray, FloatArray], FloatArray],
    other: FloatArray,
    target: FloatArray,
    interval: tuple[float, float],
    rising: bool,
) -> FloatArray:
    """First place in the interval where ``function(u, other)`` crosses ``target`` in one sense, NaN if none."""
    sign = 1.0 if rising else -1.0
    grid = np.linspace(*interval, _GRID).reshape((-1,) + (1,) * other.ndim)
    gap = sign * (function(grid, other[np.newaxis]) - target)
    enters = (gap[:-1] <= 0) & (gap[1:] >= 0)
    first = np.argmax(enters, axis=0)
    found = np.take_along_axis(enters, first[np.newaxis], axis=0)[0]
    low, high = grid.ravel()[first], grid.ravel()[first + 1]
    # A bracket with an end that is a root already is fine for the solver; where nothing was found the ends only
    # keep the shapes together and the answer is thrown away.
    from scipy.optimize import elementwise  # here, because its import takes long

    result = elementwise.find_root(lambda u, o, t: function(u, o) - t, (low, high), args=(other, target))
    return np.where(found & result.success, result.x, np.nan)


#: One bar in Pa.
BAR = 1e5


@checked
@dataclass(frozen=True, kw_only=True)
class StaticModel(ABC):
    """What every static model answers.

    Parameters
    ----------
    name : str
        Name of the parameter set.
    reference_length : float
        Nominal length, m, of the muscle that the parameters belong to.
    validity : Validity
        Where they hold.
    nominal_length : float or None
        Nominal length, m, of the muscle; None for ``reference_length``.
    source : str
        Where the parameters come from.
    notes : tuple of str
        Remarks: corrected misprints, limits of use.

    Examples
    --------
    >>> law = ep.muscle.muscle_model("best")
    >>> law.scaled(0.25).scale, law.reference_length  # parameters of 0.3 m, for a muscle of 0.25 m
    (1.2, 0.3)
    """

    name: str
    reference_length: float
    validity: Validity
    nominal_length: float | None = None
    source: str = ""
    notes: tuple[str, ...] = ()

    def __post_init__(self) -> None:
        as_texts("notes", self.notes)
        set_positive(self, "reference_length")
        set_positive(self, "nominal_length", optional=True)
        set_fields(self, nominal_length=self.length)
        require_type("validity", self.validity, Validity)

    @abstractmethod
    def _force(self, x: Any, pressure: Any) -> Any:
        """Force in N at contraction x (m, of the reference muscle) and pressure in Pa."""

    @abstractmethod
    def _stiffness(self, x: Any, pressure: Any) -> Any:
        """dF/dx in N/m, of the reference muscle."""

    @abstractmethod
    def _pressure_gain(self, x: Any, pressure: Any) -> Any:
        """Return dF/dP in N/Pa."""

    def contraction_powers(self, pressure: float) -> FloatArray:
        """Coefficients of the force in powers of contraction, from the constant on, shape (k,), N m^-i.

        Parameters
        ----------
        pressure : float
            Pa.

        Returns
        -------
        ndarray

        Raises
        ------
        InvalidInput
            If the law has none.

        Examples
        --------
        >>> law = ep.muscle.muscle_model("best").scaled(0.25)
        >>> found = np.polynomial.polynomial.polyval(0.02, law.contraction_powers(3e5))
        >>> bool(abs(found - law.force(0.02, 3e5)) < 1e-9)
        True
        """
        return self._powers(pressure)

    def _powers(self, pressure: float) -> FloatArray:
        """Return what :meth:`contraction_powers` does, where the law is a polynomial."""
        raise InvalidInput(
            f"expected a force law that is a polynomial in contraction, got {self.name!r}, which is not; fit one to "
            "its forces with exo_pin.muscle.identify_static"
        )

    @property
    def length(self) -> float:
        """Nominal length in m of the muscle."""
        return self.reference_length if self.nominal_length is None else self.nominal_length

    @property
    def scale(self) -> float:
        """Reference length over nominal length: what multiplies a contraction to keep its strain."""
        return self.reference_length / self.length

    def scaled(self, nominal_length: float) -> Self:
        """Return the same muscle at another nominal length in m, by equal strain (an assumption of the module).

        Parameters
        ----------
        nominal_length : float
            Of the muscle at no contraction, m.

        Returns
        -------
        StaticModel
            Of the same class, with the parameters of ``reference_length``.

        Examples
        --------
        >>> law = ep.muscle.muscle_model("best")
        >>> longer = law.scaled(0.6)  # twice the length: the same pull at twice the contraction
        >>> round(float(longer.force(0.08, 3e5) - law.force(0.04, 3e5)), 9)
        0.0
        """
        return replace(self, nominal_length=as_positive("nominal_length", nominal_length))

    def unchecked_force(self, x: Any, pressure: Any) -> Any:
        """Force in N at x in m and a pressure in Pa, unchecked, for solvers that call it many times."""
        return self._force(x * self.scale, pressure)

    def _ask(self, function: Callable[[Any, Any], Any], contraction: Any, pressure: Any, outside: str) -> FloatArray:
        x, p = broadcast(contraction=contraction, pressure=pressure)
        x = x * self.scale
        strain = x / self.reference_length
        return self.validity.enforce(self.name, function(x, p), strain, p, self._force(x, p), outside)

    def force(self, contraction: ArrayLike, pressure: ArrayLike, outside: str = "raise") -> FloatArray:
        """Return the static force.

        Parameters
        ----------
        contraction, pressure : array_like
            Shapes that broadcast to (...): m, positive when shorter; Pa, gauge.
        outside : {"raise", "mark"}
            What to do about states outside the validity range.

        Returns
        -------
        ndarray or numpy.ma.MaskedArray
            Shape (...), N, positive pulls; masked outside the range with "mark".

        Raises
        ------
        InvalidInput
            If an argument is not finite or the shapes do not broadcast.
        OutsideValidity
            With "raise", if a state is outside.

        Examples
        --------
        >>> law = ep.muscle.muscle_model("best")
        >>> law.force(np.array([0.02, 0.04, 0.06]), 3e5).round(1)  # N at 3 bar, contracted by 20, 40 and 60 mm
        array([45.3, 29. , 15.6])
        """
        return self._ask(self._force, contraction, pressure, outside)

    def stiffness(self, contraction: ArrayLike, pressure: ArrayLike, outside: str = "raise") -> FloatArray:
        """Return dF/dx in N/m, shape (...).

        Negative where the muscle pulls less the shorter it is, which holds a hung weight stably; the spring
        stiffness in the usual sense is -dF/dx. Errors as in :meth:`force`.

        Parameters
        ----------
        contraction, pressure, outside
            As for :meth:`force`: m, positive when shorter; Pa, gauge.

        Returns
        -------
        numpy.ndarray
            Shape (...), N/m, per m of contraction.

        Examples
        --------
        >>> round(-1e-3 * float(ep.muscle.muscle_model("best").stiffness(0.03, 2e5)), 2)  # N/mm, of it as a spring
        0.54
        """
        return self._ask(lambda x, p: self._stiffness(x, p) * self.scale, contraction, pressure, outside)

    def pressure_gain(self, contraction: ArrayLike, pressure: ArrayLike, outside: str = "raise") -> FloatArray:
        """Return dF/dP in N/Pa, shape (...), positive where air makes it pull harder; see :meth:`force`.

        Parameters
        ----------
        contraction, pressure, outside
            As for :meth:`force`: m, positive when shorter; Pa, gauge.

        Returns
        -------
        numpy.ndarray
            Shape (...), N/Pa, of pull per gauge pressure.

        Examples
        --------
        >>> law = ep.muscle.muscle_model("tang-optimised")
        >>> round(1e5 * float(law.pressure_gain(0.03, 2e5)), 1)  # N per bar
        18.1
        """
        return self._ask(self._pressure_gain, contraction, pressure, outside)

    def _reached(self, answer: FloatArray, force: FloatArray, at: FloatArray, place: str, outside: str) -> None:
        missing = np.isnan(answer)
        if as_outside(outside) == "raise" and missing.any():
            index = tuple(np.argwhere(missing)[0])
            reason = f"expected a force that it reaches, got {force[index]:.6g} N at a {place.format(at[index])}"
            raise OutsideValidity(self.name, reason, missing.sum(), index)

    def pressure_for(self, force: ArrayLike, contraction: ArrayLike, outside: str = "raise") -> FloatArray:
        """Pressure at which the muscle pulls a given force.

        The lowest pressure from 0 to the upper end of the validity range at which the force rises through the
        given one. Errors as in :meth:`force`.

        Parameters
        ----------
        force, contraction : array_like
            Shapes that broadcast to (...): N, positive pulls; m, positive when shorter.
        outside : {"raise", "mark"}
            What to do about states outside the validity range, and about forces that no pressure gives.

        Returns
        -------
        ndarray or numpy.ma.MaskedArray
            Shape (...), Pa. With "mark", masked outside the range; ``.data`` is NaN where there is no answer.

        Examples
        --------
        >>> law = ep.muscle.muscle_model("tang-optimised")
        >>> pressure = law.pressure_for(20.0, 0.03)  # Pa, for 20 N at 30 mm
        >>> round(float(law.force(0.03, pressure)), 9)
        20.0
        """
        f, x = broadcast(force=force, contraction=contraction)
        x = x * self.scale
        p = crossing(lambda u, o: self._force(o, u), x, f, (0.0, self.validity.pressure[1]), rising=True)
        self._reached(p, f, x / self.scale, "contraction of {:.6g} m", outside)
        return self.validity.enforce(self.name, p, x / self.reference_length, p, f, outside)

    def contraction_for(self, force: ArrayLike, pressure: ArrayLike, outside: str = "raise") -> FloatArray:
        """Contraction at which the muscle pulls a given force at a given pressure.

        The smallest contraction from 0 to the upper end of the validity range at which the force falls through the
        given one, so a hung weight rests there stably (dF/dx < 0). Errors as in :meth:`force`.

        Parameters
        ----------
        force, pressure : array_like
            Shapes that broadcast to (...): N, positive pulls; Pa, gauge.
        outside : {"raise", "mark"}
            As in :meth:`pressure_for`.

        Returns
        -------
        ndarray or numpy.ma.MaskedArray
            Shape (...), m. With "mark", masked outside the range; ``.data`` is NaN where there is no answer.

        Notes
        -----
        Source: thesis (3-23).

        Examples
        --------
        >>> law = ep.muscle.muscle_model("best")
        >>> round(1e3 * float(law.contraction_for(20.0, 3e5)), 1)  # mm, with a weight of 20 N at 3 bar
        53.4
        """
        f, p = broadcast(force=force, pressure=pressure)
        low, high = self.validity.strain
        interval = min(0.0, low) * self.reference_length, high * self.reference_length
        x = crossing(self._force, p, f, interval, rising=False)
        self._reached(x, f, p, "pressure of {:.6g} Pa", outside)
        return self.validity.enforce(self.name, x / self.scale, x / self.reference_length, p, f, outside)

    def capability(self, pressure: ArrayLike, outside: str = "raise") -> FloatArray:
        """Force capability: the largest weight that the muscle lifts at a pressure, Section 3.2.1.

        The model's force at the least contraction of the validity range, or the capability line if that is lower.

        Parameters
        ----------
        pressure : array_like
            Shape (...), Pa, gauge.
        outside : {"raise", "mark"}
            What to do about pressures outside the validity range. Errors as in :meth:`force`.

        Returns
        -------
        ndarray or numpy.ma.MaskedArray
            Shape (...), N, zero or more.

        Examples
        --------
        >>> ep.muscle.muscle_model("best").capability([2e5, 3e5, 4e5]).round(1)  # N that it lifts at 2, 3 and 4 bar
        array([30.3, 52.3, 73.2])
        """
        (p,) = broadcast(pressure=pressure)
        strain = np.full(p.shape, self.validity.strain[0])
        force = self._force(strain * self.reference_length, p)
        most = np.maximum(0.0, np.minimum(force, self.validity.capability_line(p)))
        return self.validity.enforce(self.name, most, strain, p, None, outside)
