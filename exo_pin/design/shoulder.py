"""The shoulder: range and stiffness of the joint at O."""

from __future__ import annotations

from dataclasses import dataclass, replace
from typing import Any

import numpy as np
from scipy.spatial.transform import Rotation

from ..core.conventions import MIRROR, as_side, shoulder_angles
from ..core.errors import InvalidInput
from ..core.errors.checked import checked
from ..core.records import Record
from ..core.validation import FloatArray, as_finite, as_positive, frozen, set_fields, set_positive


def as_stiffness(name: str, value: Any) -> FloatArray:
    """Return a stiffness as a symmetric positive semi-definite matrix, shape (3, 3), N/m; a number means isotropic.

    Raises
    ------
    InvalidInput
        If it is neither a number nor such a matrix.
    """
    if np.ndim(value) == 0:
        return frozen(as_positive(name, value, zero=True) * np.eye(3))
    matrix = as_finite(name, value, (3, 3))
    scale = float(np.abs(matrix).max())
    if np.abs(matrix - matrix.T).max() > 1e-9 * scale:
        raise InvalidInput(f"expected {name} to be symmetric, got {matrix.tolist()}")
    if scale > 0.0 and np.linalg.eigvalsh(matrix)[0] < -1e-9 * scale:
        raise InvalidInput(f"expected {name} without a negative principal stiffness, got {matrix.tolist()}")
    return frozen(0.5 * (matrix + matrix.T))


@checked
@dataclass(frozen=True, eq=False)
class Shoulder(Record):
    """A ball joint at O, and the range it allows.

    Attributes
    ----------
    abduction_centre : float or None
        Middle of the range of motion, rad: |θx - centre| + |θz| < half_diagonal, Table 5-6, in the shoulder's Y-X-Z
        angles (θx is abduction, θz axial rotation; flexion is free). None where no range is known.
    half_diagonal : float or None
        Half width of that range, rad.
    stiffness : ndarray or None
        K_s, shape (3, 3), N/m, base frame: force per displacement of the joint's centre. A number means the
        same in every direction. None where it is not known; no value for a person was found in the literature,
        so sweep it.

    Examples
    --------
    >>> soft, stiff = ep.Shoulder(stiffness=20e3), ep.Shoulder(stiffness=np.diag([40e3, 20e3, 60e3]))
    >>> (1e-3 * np.diag(stiff.stiffness - soft.stiffness)).round()  # N/mm
    array([20.,  0., 40.])
    """

    abduction_centre: float | None = None
    half_diagonal: float | None = None
    stiffness: FloatArray | None = None

    def __post_init__(self) -> None:
        if self.stiffness is not None:
            set_fields(self, stiffness=as_stiffness("stiffness", self.stiffness))
        if self.abduction_centre is not None:
            set_fields(self, abduction_centre=float(as_finite("abduction_centre", self.abduction_centre, ())))
        set_positive(self, "half_diagonal", optional=True)

    def mirrored(self) -> Shoulder:
        """Mirror image in the x-z plane, for the other side of the body.

        Returns
        -------
        Shoulder

        Examples
        --------
        >>> K = np.array([[20e3, 3e3, 0.0], [3e3, 20e3, 0.0], [0.0, 0.0, 30e3]])
        >>> float(ep.Shoulder(stiffness=K).mirrored().stiffness[0, 1])  # N/m, between x and y
        -3000.0
        """
        if self.stiffness is None:
            return self
        return replace(self, stiffness=MIRROR @ self.stiffness @ MIRROR)

    def allows(self, poses: Rotation, side: str = "left") -> np.ndarray:
        """Whether the joint reaches an orientation.

        Parameters
        ----------
        poses : Rotation
            Single or a stack of shape (...).
        side : {"left", "right"}
            Side of the body.

        Returns
        -------
        ndarray of bool
            Shape (...). Without a known range everything is allowed. Of the two Y-X-Z triples that describe
            one orientation, (θy, θx, θz) and (θy + 180°, 180° - θx, θz + 180°), one within the range suffices.

        Notes
        -----
        Source: thesis Table 5-6.

        Examples
        --------
        >>> exo = ep.load("prototype")
        >>> exo.mechanism.shoulder.allows(exo.pose(abduction=[20, 20], internal_rotation=[0, 80])).tolist()
        [True, False]
        """
        angles = shoulder_angles(poses, as_side(side))
        if self.half_diagonal is None or self.abduction_centre is None:
            return np.ones(angles.shape[:-1], dtype=bool)
        abduction, axial = angles[..., 1], angles[..., 2]
        first = np.abs(abduction - self.abduction_centre) + np.abs(axial)
        turned = np.mod(axial + 2 * np.pi, 2 * np.pi) - np.pi
        second = np.abs(np.pi - abduction - self.abduction_centre) + np.abs(turned)
        return np.minimum(first, second) < self.half_diagonal
