"""Assumed masses, for simulators that need some where no source gives them. They are assumed nowhere else."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from ..chain.formats.urdf.urdf_document import Body
from ..core.errors.checked import checked
from ..core.validation import FloatArray
from ..design.limb_parts import LimbBody


@checked
@dataclass(frozen=True)
class AssumedMasses:
    """Assumed masses of a limb's parts and of a platform. A pneumatic muscle with its fittings is about that heavy.

    Attributes
    ----------
    base_half_mass, platform_half_mass : float
        Of the two telescoping halves, kg.
    half_share : float
        Length of each half as a fraction of the limb's neutral length.
    base_half_radius, platform_half_radius : float
        m.
    cross_mass, cross_radius : float
        Of a universal joint's cross, and of the anchor at the torso, solid balls, kg and m.
    platform_mass, platform_radius, platform_height : float
        Of a platform where the source gives no arm: a disc at the mean of the joints, kg and m.
    arm_radius : float
        Of the solid ball that has the inertia of an arm whose inertia is not known, m.
    """

    base_half_mass: float = 0.06
    platform_half_mass: float = 0.04
    half_share: float = 0.6
    base_half_radius: float = 0.008
    platform_half_radius: float = 0.012
    cross_mass: float = 0.005
    cross_radius: float = 0.01
    platform_mass: float = 0.5
    platform_radius: float = 0.1
    platform_height: float = 0.01
    arm_radius: float = 0.05

    @property
    def statement(self) -> str:
        """Statement of the assumption for files that contain it."""
        return (
            "Masses of limb halves, crosses and anchors, and of arm parts that the source does not give, are assumed: "
            f"base half {self.base_half_mass:g} kg, platform half {self.platform_half_mass:g} kg, "
            f"cross and anchor {self.cross_mass:g} kg, platform {self.platform_mass:g} kg."
        )

    def base_half(self, length: float) -> LimbBody:
        """The half at the torso of a limb of the given neutral length."""
        return LimbBody.rod(self.base_half_mass, self.half_share * length, self.base_half_radius)

    def platform_half(self, length: float) -> LimbBody:
        """The half at the arm of a limb of the given neutral length."""
        return LimbBody.rod(self.platform_half_mass, self.half_share * length, self.platform_half_radius)

    def cross_body(self) -> Body:
        """A cross or an anchor."""
        return _ball(self.cross_mass, self.cross_radius)

    def platform(self, points: FloatArray) -> Body:
        """A disc across the mean of the joints' directions, at their mean."""
        radius, height = self.platform_radius, self.platform_height
        across = self.platform_mass * (3 * radius**2 + height**2) / 12
        along = self.platform_mass * radius**2 / 2
        return Body(self.platform_mass, points.mean(axis=0), np.diag([across, across, along]))

    def arm_inertia(self, mass: float) -> FloatArray:
        """Inertia of an arm whose inertia is not known."""
        return _ball(mass, self.arm_radius).inertia


def _ball(mass: float, radius: float) -> Body:
    return Body(mass, np.zeros(3), 0.4 * mass * radius**2 * np.eye(3))
