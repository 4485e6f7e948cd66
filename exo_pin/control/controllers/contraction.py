"""Contraction ratios (5-4): of a pose, and wanted over time from orientations or from limb lengths.

    ratio_i = (l_0i - (l_i - e_i)) / l_0i

with l_0i the nominal length of the muscle and e_i its end fittings, which (5-4) leaves out: it is only right if l_i
there means the muscle and not the limb. For a cable that muscles pull over a tackle l_0i is the ratio of the tackle
times the nominal length of the muscle, and l_0i + e_i the longest length of the limb; for winches and linear actuators
l_0i is the nominal length of the stroke.

Source: thesis (5-4).
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import ArrayLike
from scipy.spatial.transform import Rotation

from ...core.errors import InvalidInput, MissingData
from ...core.validation import FloatArray, as_finite, as_rotation
from ...design import Mechanism
from ..plant.drives.drive import contraction_span

__all__ = ["Contractions", "WantedByLengths", "WantedByOrientation"]


class Contractions:
    """Contraction ratios of the muscles of a design.

    Parameters
    ----------
    mechanism : Mechanism
        Every limb with a stroke and its end fitting.

    Attributes
    ----------
    nominal, fittings : ndarray
        l_0 and e, shape (n,), m.

    Raises
    ------
    MissingData
        If a stroke or an end fitting is not known.
    """

    def __init__(self, mechanism: Mechanism) -> None:
        if not isinstance(mechanism, Mechanism):
            raise InvalidInput(f"expected mechanism to be a Mechanism, got {type(mechanism).__name__}")
        strokes = [limb.stroke for limb in mechanism.limbs]
        lacking = [i for i, stroke in enumerate(strokes, 1) if stroke is None or stroke.end_fitting is None]
        if lacking:
            names = [f"stroke with end_fitting of limb {i}" for i in lacking]
            raise MissingData(names, "a contraction ratio", mechanism.name)
        self._base = np.array(mechanism.geometry.base_points)
        self._platform = np.array(mechanism.geometry.platform_points)
        spans = [contraction_span(limb) for limb in mechanism.limbs]
        self.nominal = np.array([span for _, span in spans])
        self.fittings = np.array([start - span for start, span in spans])

    def lengths(self, orientation: Rotation) -> FloatArray:
        """Limb lengths, shape (..., n), m, of poses of shape (...)."""
        matrices = as_rotation("orientation", orientation).as_matrix()
        turned = self._platform @ np.swapaxes(matrices, -1, -2)
        return np.asarray(np.linalg.norm(turned - self._base, axis=-1))

    def ratios(self, lengths: ArrayLike) -> FloatArray:
        """Contraction ratios, shape (..., n), of limb lengths in m; below zero where a muscle would be stretched."""
        l = as_finite("lengths", lengths, (len(self.nominal),), stack=True)  # noqa: E741
        return np.asarray((self.nominal + self.fittings - l) / self.nominal)


@dataclass(frozen=True)
class WantedByOrientation:
    """Ratios of a reference of orientations, by inverse kinematics.

    Attributes
    ----------
    contractions : Contractions
        Of the design.
    reference : callable
        ``reference(t)`` has an ``orientation``, as :class:`exo_pin.control.Reference`.
    """

    contractions: Contractions
    reference: Callable[[float], Any]

    def __call__(self, t: float) -> FloatArray:
        """Shape (n,), at a time in s."""
        return self.contractions.ratios(self.contractions.lengths(self.reference(t).orientation))


@dataclass(frozen=True)
class WantedByLengths:
    """Ratios of a reference of limb lengths.

    Three lengths may fit several orientations, and four or more may fit none: such a reference says what the muscles
    shall do, not the arm.

    Attributes
    ----------
    contractions : Contractions
        Of the design.
    lengths : callable
        ``lengths(t)``, shape (n,), m.
    """

    contractions: Contractions
    lengths: Callable[[float], ArrayLike]

    def __call__(self, t: float) -> FloatArray:
        """Shape (n,), at a time in s."""
        return self.contractions.ratios(self.lengths(t))
