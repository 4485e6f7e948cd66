"""The joint at O that carries the arm."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from scipy.spatial.transform import Rotation

from ..conventions import as_side, shoulder_angles
from ..validation import as_finite, as_positive

__all__ = ["Shoulder"]


@dataclass(frozen=True)
class Shoulder:
    """A ball joint at O, and the range it allows.

    Attributes
    ----------
    abduction_centre, half_diagonal : float or None
        The diamond |θx - centre| + |θz| < half_diagonal of Table 5-6 in the shoulder's Y-X-Z angles, rad (θx is
        abduction, θz axial rotation; flexion is free). None where no range is known.
    """

    abduction_centre: float | None = None
    half_diagonal: float | None = None

    def __post_init__(self) -> None:
        if self.abduction_centre is not None:
            object.__setattr__(
                self, "abduction_centre", float(as_finite("abduction_centre", self.abduction_centre, ()))
            )
        if self.half_diagonal is not None:
            object.__setattr__(self, "half_diagonal", as_positive("half_diagonal", self.half_diagonal))

    def allows(self, orientation: Rotation, side: str = "left") -> np.ndarray:
        """Whether the joint reaches an orientation.

        Parameters
        ----------
        orientation : Rotation
            Single or a stack of shape (...).
        side : {"left", "right"}
            Side of the body.

        Returns
        -------
        ndarray of bool
            Shape (...). Without a known range everything is allowed. Of the two Y-X-Z triples that stand for
            one orientation, (θy, θx, θz) and (θy + 180°, 180° - θx, θz + 180°), one within the range suffices.
        """
        angles = shoulder_angles(orientation, as_side(side))
        if self.half_diagonal is None or self.abduction_centre is None:
            return np.ones(angles.shape[:-1], dtype=bool)
        abduction, axial = angles[..., 1], angles[..., 2]
        first = np.abs(abduction - self.abduction_centre) + np.abs(axial)
        turned = np.mod(axial + 2 * np.pi, 2 * np.pi) - np.pi
        second = np.abs(np.pi - abduction - self.abduction_centre) + np.abs(turned)
        return np.minimum(first, second) < self.half_diagonal
