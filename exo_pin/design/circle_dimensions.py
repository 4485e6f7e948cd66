"""Circles on which the universal joints of a wrist lie."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from ..core.conventions import MIRROR, Side, as_side
from ..core.errors import InvalidInput
from ..core.records import Record
from ..core.validation import FloatArray, as_finite, set_fields, set_positive


@dataclass(frozen=True, eq=False)
class CircleDimensions(Record):
    """The dimensions of (4-2): joints on two circles whose axes pass through O.

    Attributes
    ----------
    r_A : float
        Radius of the circle of the joints on the torso, m.
    r_B : float
        Radius of the circle of the joints on the arm, m.
    h_A : float
        Distance of the plane of the joints on the torso from O, m.
    h_B : float
        Distance of the plane of the joints on the arm from O, m: the height of the cuff.
    alpha_A : ndarray
        Shape (n,), angles of the joints on the torso, rad.
    alpha_B : ndarray
        Shape (n,), angles of the joints on the arm, rad.
    side : {"left", "right"}
        Side of the body; the right one is the mirror image in the x-z plane.

    Examples
    --------
    >>> from exo_pin.design import CircleDimensions
    >>> angles = np.radians([90.0, 210.0, 330.0])
    >>> circles = CircleDimensions(0.13, 0.10, 0.02, 0.15, angles, angles)
    >>> circles.platform_points[:, 2]  # m, the plane of the joints on the arm
    array([-0.15, -0.15, -0.15])
    """

    r_A: float
    r_B: float
    h_A: float
    h_B: float
    alpha_A: FloatArray
    alpha_B: FloatArray
    side: Side = "left"

    def __post_init__(self) -> None:
        set_positive(self, "r_A", "r_B")
        set_fields(self, h_A=float(as_finite("h_A", self.h_A, ())), h_B=float(as_finite("h_B", self.h_B, ())))
        for name in ("alpha_A", "alpha_B"):
            angles = as_finite(name, getattr(self, name), (None,))
            if np.abs(angles).max(initial=0.0) > 2 * np.pi + 1e-9:
                raise InvalidInput(f"expected {name} in rad within ±2π, got {angles} (degrees?)")
            set_fields(self, **{name: angles})
        if self.alpha_A.shape != self.alpha_B.shape:
            raise InvalidInput(
                f"expected alpha_A and alpha_B of one length, got {self.alpha_A.shape} and {self.alpha_B.shape}"
            )
        set_fields(self, side=as_side(self.side))

    @property
    def base_points(self) -> FloatArray:
        """Shape (n, 3), m, base frame: A_i of (4-2)."""
        height = np.full_like(self.alpha_A, -self.h_A)
        points = np.stack([self.r_A * np.cos(self.alpha_A), height, self.r_A * np.sin(self.alpha_A)], axis=-1)
        return points if self.side == "left" else points @ MIRROR

    @property
    def platform_points(self) -> FloatArray:
        """Shape (n, 3), m, arm frame: B_i of (4-2)."""
        height = np.full_like(self.alpha_B, -self.h_B)
        points = np.stack([self.r_B * np.cos(self.alpha_B), self.r_B * np.sin(self.alpha_B), height], axis=-1)
        return points if self.side == "left" else points @ MIRROR
