"""A muscle as the actuator of a limb: end fitting, supply pressure, force limits at a limb length."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import ArrayLike

from ..core.errors import InvalidInput, MissingData
from ..core.validation import FloatArray, as_finite, require_type, set_positive
from .laws.static import StaticModel


@dataclass(frozen=True, kw_only=True)
class Muscle:
    """A pneumatic muscle that a limb carries.

    A limb of length l (between its joint centres, the l_i of the mechanism) holds a muscle of length l -
    end_fitting, whose contraction is nominal length less that.

    Parameters
    ----------
    model : StaticModel
        Force law, scaled to the nominal length of this muscle.
    end_fitting : float or None
        Length in m of the limb that is not muscle. The source does not print it; None where it is not known, and
        what needs it raises MissingData.
    supply_pressure : float or None
        Greatest gauge pressure in Pa; None for the upper end of the model's validity range.

    Raises
    ------
    InvalidInput
        If a length or pressure is not finite, negative, or the pressures are in the wrong order.

    Examples
    --------
    >>> from exo_pin.muscle import Muscle, muscle_model
    >>> muscle = Muscle(model=muscle_model("best").scaled(0.25), end_fitting=0.05)
    >>> [round(1e3 * float(length), 1) for length in muscle.length_range()]  # mm, of the limb
    [237.4, 289.7]
    """

    model: StaticModel
    end_fitting: float | None
    supply_pressure: float | None = None

    def __post_init__(self) -> None:
        require_type("model", self.model, StaticModel)
        set_positive(self, "end_fitting", zero=True, optional=True)
        set_positive(self, "supply_pressure", optional=True)

    @property
    def supply(self) -> float:
        """Greatest gauge pressure, Pa."""
        return self.model.validity.pressure[1] if self.supply_pressure is None else float(self.supply_pressure)

    def contraction(self, length: ArrayLike) -> FloatArray:
        """Contraction in m, shape (...), at a limb length in m, shape (...).

        Parameters
        ----------
        length : array_like
            Of the limb, shape (...), m.

        Returns
        -------
        ndarray
            Shape (...), m.

        Raises
        ------
        MissingData
            If the end fitting is not known.
        InvalidInput
            If a length is not finite or the limb is shorter than its fitting.

        Notes
        -----
        Source: thesis (5-4).

        Examples
        --------
        >>> from exo_pin.muscle import Muscle, muscle_model
        >>> muscle = Muscle(model=muscle_model("best").scaled(0.25), end_fitting=0.05)
        >>> round(1e3 * float(muscle.contraction(0.270)), 6)  # mm: 250 and the fitting's 50 less 270
        30.0
        """
        if self.end_fitting is None:
            raise MissingData(("end_fitting",), "the length of a muscle in a limb")
        limb = as_finite("length", length, (), stack=True)
        if (limb <= self.end_fitting).any():
            raise InvalidInput(
                f"expected length above the end fitting of {self.end_fitting:g} m, got {float(limb.min()):g} m"
            )
        return self.model.length + self.end_fitting - limb

    def length_range(self) -> tuple[float, float]:
        """Shortest and longest limb length in m inside the model's range of strain.

        Returns
        -------
        tuple of float
            m.

        Raises
        ------
        MissingData
            If the end fitting is not known.

        Examples
        --------
        >>> from exo_pin.muscle import Muscle, muscle_model
        >>> limbs = [Muscle(model=muscle_model("best").scaled(size), end_fitting=0.05) for size in (0.2, 0.4)]
        >>> strokes = [float(np.diff(limb.length_range())[0]) for limb in limbs]
        >>> round(strokes[1] / strokes[0], 9)  # twice the muscle, twice the stroke
        2.0
        """
        if self.end_fitting is None:
            raise MissingData(("end_fitting",), "the length range of a muscle in a limb")
        low, high = self.model.validity.strain
        longest = self.model.length + self.end_fitting
        return longest - high * self.model.length, longest - low * self.model.length

    def force_limits(self, length: ArrayLike, outside: str = "raise") -> tuple[FloatArray, FloatArray]:
        """Least and greatest pull at a limb length.

        The upper limit is the model's force at the supply pressure, or the capability line there if that is lower.
        The lower limit is 0, as of a vented muscle; it never pushes.

        Parameters
        ----------
        length : array_like
            Shape (...), limb length in m between joint centres.
        outside : {"raise", "mark"}
            What to do about lengths outside the model's validity range.

        Returns
        -------
        lower, upper : ndarray or numpy.ma.MaskedArray
            Shape (...) each, N.

        Raises
        ------
        MissingData
            If the end fitting is not known.
        InvalidInput
            If a length is not finite.
        OutsideValidity
            With "raise", if the strain of a length, or a pressure, is outside the range.

        Examples
        --------
        >>> from exo_pin.muscle import Muscle, muscle_model
        >>> muscle = Muscle(model=muscle_model("best"), end_fitting=0.05)
        >>> [round(float(each), 1) for each in muscle.force_limits(0.31)]  # N, of a limb of 310 mm
        [0.0, 45.9]
        """
        contraction = self.contraction(length)
        p = np.full(np.shape(contraction), self.supply)
        free = self.model.unchecked_force(contraction, p)
        pull = np.clip(free, 0.0, np.maximum(0.0, self.model.validity.capability_line(p)))
        strain = np.asarray(contraction / self.model.length)
        upper = self.model.validity.enforce(self.model.name, pull, strain, p, None, outside)
        return np.zeros_like(upper), upper

    def pressure_for(self, force: ArrayLike, length: ArrayLike, outside: str = "raise") -> FloatArray:
        """Pressure in Pa that makes the muscle pull ``force`` (N) at a limb length (m).

        See :meth:`StaticModel.pressure_for` for the rest.

        Parameters
        ----------
        force : array_like
            Shape (...), N.
        length : array_like
            Of the limb, shape (...), m.
        outside : {"raise", "mark"}
            What to do outside the range of the law.

        Returns
        -------
        ndarray
            Shape (...), gauge, Pa.

        Examples
        --------
        >>> from exo_pin.muscle import Muscle, muscle_model
        >>> muscle = Muscle(model=muscle_model("best").scaled(0.25), end_fitting=0.05)
        >>> round(float(muscle.pressure_for(20.0, 0.26)) / 1e5, 2)  # bar
        2.74
        """
        return self.model.pressure_for(force, self.contraction(length), outside)
