"""Weights of the objective among many sets of forces."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from scipy.spatial.transform import Rotation

from ...core.validation import FloatArray, require_type, set_positive
from ..constraints.glenoid_cone import GlenoidCone, known_orientation


@dataclass(frozen=True)
class Weights:
    """Objective of the split "minimal": a weighted sum of squares of F_s and of the tensions.

        compression (F_s · out)² + shear (|F_s|² - (F_s · out)²) + tension Σ f_i²

    Attributes
    ----------
    shear, compression : float
        Weights of F_s across and along the axis out of the socket, above zero, so that the best F_s is unique.
    tension : float
        Weight of the limb forces, zero or more. Above zero the best f is unique too; 0.01 weighs 1 N of shoulder
        force as 10 N of tension. At zero, of several best sets of forces that of least norm is taken.
    glenoid : GlenoidCone or None
        Defines the axes; only its orientation counts here. Not needed where shear and compression weigh the same.

    Raises
    ------
    InvalidInput
        If a weight is not positive.
    MissingData
        If shear and compression weigh differently and no orientation says which is which.

    Examples
    --------
    >>> exo = ep.load("four-linear-actuators")
    >>> case = ep.Case(exo.pose(60, 30))
    >>> kind = [ep.Assumptions("minimal", weights=each) for each in (None, ep.Weights(tension=1.0))]
    >>> plain, weighted = (ep.solve(exo, case, each) for each in kind)
    >>> round(float(weighted.magnitude - plain.magnitude), 1)  # N more, so that the tensions are smaller
    10.1
    """

    shear: float = 1.0
    compression: float = 1.0
    tension: float = 0.0
    glenoid: GlenoidCone | None = None

    def __post_init__(self) -> None:
        set_positive(self, "shear", "compression")
        set_positive(self, "tension", zero=True)
        require_type("glenoid", self.glenoid, GlenoidCone | None)
        if self.shear != self.compression:
            known_orientation((self.glenoid or GlenoidCone()).orientation)

    def root(self, side: str, pose: Rotation) -> FloatArray:
        """Shape (3, 3): its product with F_s, squared, is the cost of F_s in a single pose of the arm.

        Parameters
        ----------
        side : {"left", "right"}
            Side of the body.
        pose : Rotation
            Single.

        Returns
        -------
        ndarray
            Shape (3, 3).

        Examples
        --------
        >>> root = ep.Weights(shear=4.0, compression=4.0).root("left", ep.shoulder_rotation(30, 0, 0, degrees=True))
        >>> float(np.sum((root @ [3.0, 0.0, 4.0]) ** 2))  # 4 × 5²
        100.0
        """
        axes = np.eye(3) if self.shear == self.compression else (self.glenoid or GlenoidCone()).axes(side, pose)
        return np.asarray(np.sqrt([self.compression, self.shear, self.shear])[:, None] * axes)
