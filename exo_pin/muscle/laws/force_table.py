"""A muscle by a table of its forces, as makers' sheets and test benches give them."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np

from ...core.errors import InvalidInput
from ...core.validation import FloatArray, as_finite, set_fields
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
