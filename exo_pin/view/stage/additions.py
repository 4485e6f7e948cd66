"""Additions to a scene: points and surfaces coloured by a value."""

from __future__ import annotations

from abc import ABC, abstractmethod
from typing import Any

import numpy as np
from numpy.typing import ArrayLike

from ...core.errors import InvalidInput
from ...core.validation import FloatArray, as_choice, as_finite, as_positive
from ..colours import hexadecimal, scale_colours
from ..meshcat_viewer import mg
from .stage import Stage

__all__ = ["Additions", "bar"]


class Additions(ABC):
    """Things in a scene besides the mechanism; base of every scene."""

    def __init__(self, stage: Stage) -> None:
        self._stage = stage
        self._bars: dict[str, dict[str, Any]] = {}
        self._items: dict[str, dict[str, str]] = {}

    def points(
        self,
        name: str,
        positions: ArrayLike,
        values: ArrayLike,
        label: str,
        limits: tuple[float, float] | None = None,
        size: float = 0.012,
    ) -> None:
        """Draw points coloured by a value, as of a locus or a workspace.

        Parameters
        ----------
        name : str
            To replace or :meth:`remove` them by.
        positions : array_like
            Shape (k, 3), m, base frame.
        values : array_like
            Shape (k,); NaN is drawn light grey.
        label : str
            What the values are, with their unit, for the legend.
        limits : (float, float), optional
            Ends of the colour scale; those of the values if left out.
        size : float
            Of a point, m.

        Raises
        ------
        InvalidInput
            If shapes do not fit, or no value is finite and no limits are given.
        """
        where = as_finite("positions", positions, (None, 3))
        colours = self._coloured(name, values, len(where), label, limits)
        cloud = mg.PointCloud(where.T.astype(np.float32), colours.T.astype(np.float32), size=as_positive("size", size))
        self._added(name).set_object(cloud)

    def surface(
        self,
        name: str,
        vertices: ArrayLike,
        faces: ArrayLike,
        values: ArrayLike,
        label: str,
        limits: tuple[float, float] | None = None,
        opacity: float = 1.0,
    ) -> None:
        """Draw a mesh of triangles whose vertices are coloured by a value.

        Parameters
        ----------
        name : str
            To replace or :meth:`remove` it by.
        vertices : array_like
            Shape (k, 3), m, base frame.
        faces : array_like
            Shape (t, 3), whole numbers: which vertices make a triangle.
        values, label, limits
            As in :meth:`points`.
        opacity : float
            1 is opaque.
        """
        where = as_finite("vertices", vertices, (None, 3))
        corners = np.asarray(faces)
        if corners.ndim != 2 or corners.shape[1] != 3 or corners.dtype.kind not in "iu":
            raise InvalidInput(f"expected faces to be whole numbers of shape (t, 3), got shape {corners.shape}")
        if corners.size and not (corners.min() >= 0 and corners.max() < len(where)):
            raise InvalidInput(f"expected faces to name vertices 0 to {len(where) - 1}")
        colours = self._coloured(name, values, len(where), label, limits)
        material = mg.MeshLambertMaterial(color=0xFFFFFF, vertexColors=True, opacity=as_positive("opacity", opacity))
        self._added(name).set_object(mg.TriangularMeshGeometry(where, corners, colours), material)

    def remove(self, name: str) -> None:
        """Take away what was added under a name.

        Raises
        ------
        UnknownName
            If there is no addition of that name.
        """
        as_choice("addition", name, {*self._bars, *self._items})
        self._bars.pop(name, None)
        self._items.pop(name, None)
        with self._stage.update():
            self._stage.viewer[f"additions/{name}"].delete()
            self._write_legend()

    def _added(self, name: str) -> Any:
        return self._stage.viewer[f"additions/{name}"]

    def _coloured(
        self, name: str, values: ArrayLike, count: int, label: str, limits: tuple[float, float] | None
    ) -> FloatArray:
        """Colours of values, shape (count, 3), and a bar in the legend."""
        if not name or "/" in name:
            raise InvalidInput(f"expected a name without '/', got {name!r}")
        numbers = np.array(values, dtype=float)
        if numbers.shape != (count,):
            raise InvalidInput(f"expected values of shape ({count},), got {numbers.shape}")
        finite = numbers[np.isfinite(numbers)]
        if limits is None and not finite.size:
            raise InvalidInput("expected a finite value, or limits")
        low, high = (finite.min(), finite.max()) if limits is None else as_finite("limits", limits, (2,))
        self._bars[name] = bar(label, float(low), float(high))
        self._write_legend()
        return scale_colours(numbers, float(low), float(high))

    @abstractmethod
    def _write_legend(self) -> None:
        """Write the legend with bars and items."""


def bar(label: str, low: float, high: float) -> dict[str, Any]:
    """A colour bar of the legend."""
    steps = scale_colours(np.linspace(0.0, 1.0, 9), 0.0, 1.0)
    return {
        "label": label,
        "low": f"{low:.3g}",
        "high": f"{high:.3g}",
        "colours": [hexadecimal(step) for step in steps],
    }
