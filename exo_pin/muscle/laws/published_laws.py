"""Laws that are no polynomial: a fluidic muscle by its maker's measurements, and tables as makers give them."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np

from ...core.errors import InvalidInput
from ...core.validation import FloatArray, as_finite, as_positive, set_fields
from .static import StaticModel


@dataclass(frozen=True, kw_only=True)
class ForceTable(StaticModel):
    """Force by a table over strain and pressure, straight between its entries (bilinear), so that none is exceeded.

    Stiffness and gain of pressure are those of the cell; on its border they are those of the cell above. The validity
    lies within the table.

    Parameters
    ----------
    strains : sequence of float
        n ≥ 2 rising strains.
    pressures : sequence of float
        m ≥ 2 rising gauge pressures, Pa.
    forces : sequence of sequence of float
        Shape (n, m), N: a row for each strain.

    Raises
    ------
    InvalidInput
        If strains or pressures do not rise, the shapes do not agree, or the validity goes beyond the table.

    Examples
    --------
    >>> from exo_pin.muscle import ForceTable, Validity
    >>> limits = Validity(strain=(0.0, 0.2), pressure=(1e5, 3e5))
    >>> rows = [[20.0, 60.0], [0.0, 30.0]]  # N, at strains of 0 and 20 %
    >>> law = ForceTable(
    ...     name="sheet", reference_length=0.3, validity=limits, strains=[0, 0.2], pressures=[1e5, 3e5], forces=rows
    ... )
    >>> float(law.force(0.03, 2e5))  # N, at 10 % and 2 bar: the mean of the four
    27.5
    """

    strains: Sequence[float]
    pressures: Sequence[float]
    forces: Sequence[Sequence[float]]

    def __post_init__(self) -> None:
        super().__post_init__()
        strains = as_finite("strains", self.strains, (None,))
        pressures = as_finite("pressures", self.pressures, (None,))
        for name, axis in (("strains", strains), ("pressures", pressures)):
            if len(axis) < 2 or (np.diff(axis) <= 0.0).any():
                raise InvalidInput(f"expected at least two {name} that rise, got {axis.tolist()}")
        forces = as_finite("forces", self.forces, (len(strains), len(pressures)))
        for name, axis, (low, high) in (
            ("strain", strains, self.validity.strain),
            ("pressure", pressures, self.validity.pressure),
        ):
            if low < axis[0] or high > axis[-1]:
                raise InvalidInput(
                    f"expected a validity within the table, whose {name} goes from {axis[0]:g} to {axis[-1]:g}, "
                    f"got {low:g} to {high:g}"
                )
        rows = tuple(tuple(row) for row in forces.tolist())
        set_fields(self, strains=tuple(strains.tolist()), pressures=tuple(pressures.tolist()), forces=rows)

    def _cell(self, x: Any, pressure: Any) -> tuple[FloatArray, FloatArray, FloatArray]:
        """Force, N, and its derivatives by strain and by pressure."""
        strain, p = np.broadcast_arrays(np.asarray(x) / self.reference_length, np.asarray(pressure, dtype=float))
        strains, pressures, forces = map(np.asarray, (self.strains, self.pressures, self.forces))
        i = np.clip(np.searchsorted(strains, strain, "right") - 1, 0, len(strains) - 2)
        j = np.clip(np.searchsorted(pressures, p, "right") - 1, 0, len(pressures) - 2)
        wide, high = strains[i + 1] - strains[i], pressures[j + 1] - pressures[j]
        first, other = forces[i, j], forces[i, j + 1]
        by_strain, by_pressure = (forces[i + 1, j] - first) / wide, (other - first) / high
        by_both = (forces[i + 1, j + 1] - forces[i + 1, j] - other + first) / (wide * high)
        ds, dp = strain - strains[i], p - pressures[j]
        force = first + by_strain * ds + by_pressure * dp + by_both * ds * dp
        return force, by_strain + by_both * dp, by_pressure + by_both * ds

    def _force(self, x: Any, pressure: Any) -> Any:
        return self._cell(x, pressure)[0]

    def _stiffness(self, x: Any, pressure: Any) -> Any:
        return self._cell(x, pressure)[1] / self.reference_length

    def _pressure_gain(self, x: Any, pressure: Any) -> Any:
        return self._cell(x, pressure)[2]


#: Constants of the law, Pa, N and no unit, in the order of the docstring.
_P_0, _P_T, _RISE, _SHIFT, _P_F, _GIVE = 254.3e3, 192e3, 2.0265, 0.461, 1.23e3, 0.331e-3
#: The tangent's argument stays below this.
_MOST = 0.5 * np.pi - 1e-6
#: Halvings of the interval that holds the force: 500 N to 1e-13.
_HALVINGS = 52


@dataclass(frozen=True, kw_only=True)
class FestoLaw(StaticModel):
    """Force of a fluidic muscle of 10 mm, by the formula of the Agile and Adaptive Robotics Laboratory.

    P = 254.3 kPa + 192 kPa tan(2.0265 (ε/(ε_max - 0.331e-3 F) - 0.461)) + 1.23 kPa/N F, with F in N and ε the strain;
    their term for the sense of motion, ±15.6 kPa in all, is left out. The force is what solves it; where the pressure
    is too low for a pull it goes on straight below zero.

    Parameters
    ----------
    largest_strain : float
        ε_max, the strain of the muscle without load at its greatest pressure.

    Notes
    -----
    Source: github.com/Agile-and-Adaptive-Robotics/Bipedal_Robot, festo2.m and the laboratory's fit.

    Examples
    --------
    >>> from exo_pin.muscle import FestoLaw, Validity
    >>> limits = Validity(strain=(0.0, 0.16), pressure=(0.0, 6.2e5))
    >>> law = FestoLaw(name="mine", reference_length=0.189, validity=limits, largest_strain=0.1667)
    >>> round(float(law.force(0.05 * 0.189, 343195.0)), 2)  # N, at a strain of 5 % and 343 kPa
    100.0
    """

    largest_strain: float

    def __post_init__(self) -> None:
        super().__post_init__()
        if as_positive("largest_strain", self.largest_strain) >= 0.4:
            raise InvalidInput(f"expected largest_strain as a share, below 0.4, got {self.largest_strain:g}")

    def _parts(self, strain: Any, force: Any) -> tuple[Any, Any, Any]:
        """Pressure, Pa, and its derivatives by force and by strain."""
        room = self.largest_strain - _GIVE * force
        angle = _RISE * (strain / room - _SHIFT)
        steep = _P_T * _RISE / np.cos(angle) ** 2
        pressure = _P_0 + _P_T * np.tan(angle) + _P_F * force
        return pressure, _P_F + steep * _GIVE * strain / room**2, steep / room

    def _force(self, x: Any, pressure: Any) -> Any:
        strain, p = np.broadcast_arrays(np.asarray(x) / self.reference_length, np.asarray(pressure, dtype=float))
        # Within these strains the tangent is on its branch; beyond, the law has no more to say than at the edge.
        inside = np.clip(strain, -self.largest_strain, self.largest_strain * (_SHIFT + _MOST / _RISE))
        least, slope, bend = self._parts(inside, 0.0)
        low = np.zeros(inside.shape)
        room = np.where(inside > 0.0, inside / (_SHIFT + _MOST / _RISE), 0.05 * self.largest_strain)
        high = (self.largest_strain - room) / _GIVE
        for _ in range(_HALVINGS):
            middle = 0.5 * (low + high)
            above = self._parts(inside, middle)[0] > p
            low, high = np.where(above, low, middle), np.where(above, middle, high)
        pull = 0.5 * (low + high)
        return np.where(p > least, pull, (p - least) / slope) - bend / slope * (strain - inside)

    def _slopes(self, x: Any, pressure: Any) -> tuple[Any, Any]:
        strain = np.asarray(x) / self.reference_length
        return self._parts(strain, np.maximum(0.0, self._force(x, pressure)))[1:]

    def _stiffness(self, x: Any, pressure: Any) -> Any:
        by_force, by_strain = self._slopes(x, pressure)
        return -by_strain / by_force / self.reference_length

    def _pressure_gain(self, x: Any, pressure: Any) -> Any:
        return 1.0 / self._slopes(x, pressure)[0]
