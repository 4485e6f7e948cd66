"""Lengths of the limbs, or coordinates of the drives, in poses; and contraction ratios of muscles (5-4)."""

from __future__ import annotations

from typing import Any

import numpy as np
from numpy.typing import ArrayLike
from scipy.spatial.transform import Rotation

from ...core.errors import MissingData
from ...core.validation import FloatArray, as_finite, as_rotation, require_type
from ...design import Mechanism


def contractions_of(given: Any) -> Any:
    """Contractions of a plant as they are given, or those of a design."""
    return given if hasattr(given, "ratios") else Contractions(given)


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
        require_type("mechanism", mechanism, Mechanism, "a Mechanism")
        spans, lacking = [], []
        for i, limb in enumerate(mechanism.limbs, 1):
            stroke, tackle = limb.stroke, None if limb.actuator is None else limb.actuator.tackle
            if stroke is None or stroke.end_fitting is None:
                lacking.append(f"stroke with end_fitting of limb {i}")
            elif tackle is None:
                spans.append((stroke.nominal_length + stroke.end_fitting, stroke.nominal_length))
            else:
                longest = stroke.nominal_length * stroke.longest + stroke.end_fitting
                spans.append((longest, tackle.ratio * tackle.muscle_length))
        if lacking:
            raise MissingData(lacking, "a contraction ratio", mechanism.name)
        self._uncontracted, self.nominal = np.array(spans).T
        self.fittings = self._uncontracted - self.nominal
        self._base = np.array(mechanism.geometry.base_points)
        self._platform = np.array(mechanism.geometry.platform_points)

    def lengths(self, poses: Rotation) -> FloatArray:
        """Limb lengths, shape (..., n), m, of poses of shape (...).

        Parameters
        ----------
        poses : Rotation
            Shape (...).

        Returns
        -------
        ndarray
            Shape (..., n), m.
        """
        matrices = as_rotation("poses", poses).as_matrix()
        turned = self._platform @ np.swapaxes(matrices, -1, -2)
        return np.asarray(np.linalg.norm(turned - self._base, axis=-1))

    def ratios(self, lengths: ArrayLike) -> FloatArray:
        """Contraction ratios, shape (..., n), of limb lengths in m; below zero where a muscle would be stretched.

        Parameters
        ----------
        lengths : array_like
            Shape (..., n), m.

        Returns
        -------
        ndarray
            Shape (..., n).
        """
        given = as_finite("lengths", lengths, (len(self.nominal),), stack=True)
        return np.asarray((self._uncontracted - given) / self.nominal)
