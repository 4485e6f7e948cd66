"""Dynamic muscle model (3-22): the static force less damping and Coulomb friction, as a set-valued law.

With x the contraction, v its rate and P the pressure, the force on the load is

    F = F_static(x, P) - P (D_1 v² + D_2 v) - F_c,

where F_c is the bound of the friction law times sign(v) while the muscle moves, and **any** force between minus and
plus the bound while it rests. A hung mass m obeys m dv/dt = F - m g; the printed (3-27) and (3-31) lost their -m g.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

import numpy as np
import scipy
from numpy.typing import ArrayLike

from ...core.conventions import GRAVITY
from ...core.errors import InvalidInput, OutsideValidity
from ...core.errors.checked import checked
from ...core.validation import FloatArray, as_positive, as_texts, broadcast, broadcast_real, require_types
from .friction import Damping, FrictionLaw
from .static import StaticModel
from .validity import BoolArray, as_outside

#: Standard gravity of the source, m/s².
G = float(-GRAVITY[2])

#: Points of the grid that looks for a rest, 0.02 mm apart on a 300 mm muscle; its ends are then refined.
_GRID = 4001


@checked
@dataclass(frozen=True, kw_only=True)
class DynamicModel:
    """A static force law with friction and damping.

    Parameters
    ----------
    name : str
        Name of the parameter set.
    static : StaticModel
        Of its reference length: how friction and damping scale with length is not known, so a scaled one is
        refused.
    friction : FrictionLaw
        Coulomb friction.
    damping : Damping
        Viscous friction and drag.
    source : str
        Where the parameters come from.
    notes : tuple of str
        Remarks: corrected misprints, limits of use.

    Raises
    ------
    InvalidInput
        If a part has a wrong type or the static model is scaled.

    Examples
    --------
    >>> from exo_pin.muscle import dynamic_model
    >>> law = dynamic_model("tang-3-31")
    >>> law.static.name, type(law.friction).__name__
    ('tang-3-25', 'LoadDependentFriction')
    """

    name: str
    static: StaticModel
    friction: FrictionLaw
    damping: Damping
    source: str = ""
    notes: tuple[str, ...] = ()

    def __post_init__(self) -> None:
        as_texts("notes", self.notes)
        require_types(self, static=StaticModel, friction=FrictionLaw, damping=Damping)
        if self.static.scale != 1.0:
            raise InvalidInput(
                f"expected a static model of its own {self.static.reference_length:g} m, got one scaled "
                f"to {self.static.length:g} m: no scaling of friction and damping is known"
            )

    def limits(self) -> list[str]:
        """Names of the conditions under which friction and damping oppose the motion, in :meth:`margins`' order.

        Returns
        -------
        list of str

        Examples
        --------
        >>> from exo_pin.muscle import dynamic_model
        >>> dynamic_model("tang-3-31").limits()
        ['friction factor 1 (N/Pa, Pa or N)', 'friction factor 2 (N/Pa, Pa or N)', 'damping D_1 v + D_2 (N s/(m Pa))']
        """
        factors = self.friction.factors(0.0, 0.0, 0.0)
        names = [f"friction factor {i + 1} (N/Pa, Pa or N)" for i in range(len(factors))]
        return [*names, "damping D_1 v + D_2 (N s/(m Pa))"]

    def margins(self, x: Any, velocity: Any, pressure: Any, mass: float) -> tuple[Any, ...]:
        """Quantities that must be zero or more for friction and damping to oppose the motion (m, m/s, Pa, kg).

        Parameters
        ----------
        x : float or ndarray
            Contraction, m.
        velocity : float or ndarray
            m/s.
        pressure : float or ndarray
            Gauge, Pa.
        mass : float
            Hung, kg.

        Returns
        -------
        tuple
            One a condition, in the order of :meth:`limits`.

        Examples
        --------
        >>> from exo_pin.muscle import dynamic_model
        >>> [bool(margin > 0.0) for margin in dynamic_model("tang-3-31").margins(0.03, 0.05, 2.5e5, 1.3)]
        [True, True, True]
        """
        return (*self.friction.factors(x, pressure, mass), self.damping.rate(velocity))

    def contains(self, contraction: FloatArray, velocity: FloatArray, pressure: FloatArray, mass: float) -> BoolArray:
        """Whether each state is inside the range of the static law and of friction and damping.

        Parameters
        ----------
        contraction, velocity, pressure : ndarray
            Shape (...), m, m/s, Pa.
        mass : float
            Hung mass, kg.

        Returns
        -------
        ndarray of bool
            Shape (...).

        Examples
        --------
        >>> from exo_pin.muscle import dynamic_model
        >>> law = dynamic_model("tang-3-31")
        >>> law.contains(np.array([0.03, 0.2]), np.zeros(2), np.full(2, 2.5e5), 1.0)  # not by 200 mm
        array([ True, False])
        """
        given = {"contraction": contraction, "velocity": velocity, "pressure": pressure}
        contraction, velocity, pressure = broadcast_real(**given)
        strain = contraction / self.static.reference_length
        force = self.static.unchecked_force(contraction, pressure)
        inside = self.static.validity.contains(strain, pressure, force)
        for margin in self.margins(contraction, velocity, pressure, mass):
            inside = inside & (np.asarray(margin) >= 0)
        return inside

    def explain(self, contraction: float, velocity: float, pressure: float, mass: float) -> str:
        """Text that names the bound a state violates; empty if it violates none.

        Parameters
        ----------
        contraction : float
            m.
        velocity : float
            m/s.
        pressure : float
            Gauge, Pa.
        mass : float
            Hung, kg.

        Returns
        -------
        str

        Examples
        --------
        >>> from exo_pin.muscle import dynamic_model
        >>> dynamic_model("tang-3-31").explain(0.03, 0.0, 9e5, 1.0)
        'expected pressure at most 406900 Pa, got 900000 Pa'
        """
        force = float(self.static.unchecked_force(contraction, pressure))
        reason = self.static.validity.explain(contraction / self.static.reference_length, pressure, force)
        if reason:
            return reason
        for name, value in zip(self.limits(), self.margins(contraction, velocity, pressure, mass), strict=True):
            if value < 0:
                return f"expected {name} to be zero or more, where it opposes the motion, got {float(value):.4g}"
        return ""

    def force(
        self, contraction: ArrayLike, velocity: ArrayLike, pressure: ArrayLike, mass: float, outside: str = "raise"
    ) -> tuple[FloatArray, FloatArray]:
        """Least and greatest force on the load: equal while moving, the whole friction band at rest.

        Parameters
        ----------
        contraction, velocity, pressure : array_like
            Shape (...), m, m/s (shortening positive), Pa; they broadcast.
        mass : float
            Hung mass in kg, for the load-dependent part of the friction.
        outside : {"raise", "mark"}
            What to do about states outside the range. Marked values use the formulas as printed, which may push.

        Returns
        -------
        lower, upper : ndarray or numpy.ma.MaskedArray
            Shape (...), N.

        Raises
        ------
        InvalidInput
            If an argument is not finite or the shapes do not broadcast.
        OutsideValidity
            With "raise", if a state is outside.

        Notes
        -----
        Source: thesis (3-11), (3-22).

        Examples
        --------
        >>> from exo_pin.muscle import dynamic_model
        >>> law = dynamic_model("tang-3-31")
        >>> low, high = law.force(0.03, 0.0, 2.5e5, 1.3)
        >>> round(float(low), 1), round(float(high), 1)  # N: the static force less and with friction
        (22.7, 33.2)
        """
        load = as_positive("mass", mass)
        choice = as_outside(outside)
        x, v, p = broadcast(contraction=contraction, velocity=velocity, pressure=pressure)
        inside = self.contains(x, v, p, load)
        if choice == "raise" and not inside.all():
            index = tuple(np.argwhere(~inside)[0])
            reason = self.explain(float(x[index]), float(v[index]), float(p[index]), load)
            raise OutsideValidity(self.name, reason, (~inside).sum(), index)
        smooth = self.static.unchecked_force(x, p) - self.damping.printed(v, p)
        bound = self.friction.printed(x, p, load)
        lower = smooth - np.where(v < 0, -bound, bound)
        upper = smooth - np.where(v > 0, bound, -bound)
        if choice == "mark":
            return np.ma.MaskedArray(lower, mask=~inside), np.ma.MaskedArray(upper, mask=~inside)
        return lower, upper

    def rest_band(self, mass: float, pressure: float) -> tuple[float, float]:
        """Least and greatest contraction in m at which friction holds a hung mass (kg) at rest at a pressure (Pa).

        Its ends are within the stroke, 0 to the upper end of the range of strain. A band narrower than 0.02 mm may
        be missed.

        Parameters
        ----------
        mass : float
            Hung, kg.
        pressure : float
            Gauge, Pa.

        Returns
        -------
        tuple of float
            m.

        Raises
        ------
        OutsideValidity
            If the muscle cannot hold the mass inside its range of strain.

        Examples
        --------
        >>> from exo_pin.muscle import dynamic_model
        >>> low, high = dynamic_model("tang-3-31").rest_band(1.5, 2e5)
        >>> round(1e3 * low, 1), round(1e3 * high, 1)  # mm: where it stays depends on how it came there
        (34.4, 41.9)
        """
        load, p = as_positive("mass", mass), as_positive("pressure", pressure)
        span = np.linspace(0.0, self.static.validity.strain[1] * self.static.reference_length, _GRID)

        def excess(x: float) -> float:
            return abs(float(self.static.unchecked_force(x, p)) - load * G) - self.friction.bound(x, p, load)

        held = np.array([excess(float(x)) for x in span]) <= 0
        if not held.any():
            raise OutsideValidity(
                self.name, f"expected a mass that it holds within its stroke, got {load:g} kg at {p:g} Pa"
            )
        first, last = int(np.argmax(held)), len(span) - 1 - int(np.argmax(held[::-1]))
        low, high = float(span[first]), float(span[last])
        if first > 0:
            low = float(scipy.optimize.brentq(excess, span[first - 1], low, xtol=1e-14))
        if last < len(span) - 1:
            high = float(scipy.optimize.brentq(excess, high, span[last + 1], xtol=1e-14))
        return low, high
