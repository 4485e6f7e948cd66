"""Assumed masses, for simulators that need some where no source gives them. They are assumed nowhere else."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from ..chain.formats.urdf.urdf_writing import Body
from ..core.errors.checked import checked
from ..core.validation import FloatArray, as_finite
from ..design.limb import LimbBody


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

    Examples
    --------
    >>> from exo_pin.wrist_chain import AssumedMasses
    >>> chain = ep.load("prototype").chain_with_masses(assumed=AssumedMasses(base_half_mass=0.10))
    >>> round(float(sum(inertia.mass for inertia in chain.model.inertias)), 3)  # kg
    1.122
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
        """The half at the torso of a limb of the given neutral length.

        Parameters
        ----------
        length : float
            m.

        Returns
        -------
        LimbBody

        Examples
        --------
        >>> from exo_pin.wrist_chain import AssumedMasses
        >>> half = AssumedMasses(half_share=0.6).base_half(0.4)
        >>> half.mass, round(half.centre, 3)  # kg; m from its joint, half of 0.6 × 0.4
        (0.06, 0.12)
        """
        return LimbBody.rod(self.base_half_mass, self.half_share * length, self.base_half_radius)

    def platform_half(self, length: float) -> LimbBody:
        """The half at the arm of a limb of the given neutral length.

        Parameters
        ----------
        length : float
            m.

        Returns
        -------
        LimbBody

        Examples
        --------
        >>> from exo_pin.wrist_chain import AssumedMasses
        >>> half = AssumedMasses(platform_half_mass=0.04, platform_half_radius=0.012).platform_half(0.3)
        >>> round(1e6 * half.axial_inertia, 3)  # kg mm²; m r²/2 of a solid cylinder
        2.88
        """
        return LimbBody.rod(self.platform_half_mass, self.half_share * length, self.platform_half_radius)

    def cross_body(self) -> Body:
        """A cross or an anchor.

        Returns
        -------
        Body
            Mass, kg, centre of mass, m, and inertia about it, kg m², of a solid ball.

        Examples
        --------
        >>> from exo_pin.wrist_chain import AssumedMasses
        >>> cross = AssumedMasses(cross_mass=0.005, cross_radius=0.01).cross_body()
        >>> round(1e9 * float(cross.inertia[0, 0]), 1)  # g mm²; 2/5 × 5 g × (10 mm)²
        200.0
        """
        return _ball(self.cross_mass, self.cross_radius)

    def platform(self, points: FloatArray) -> Body:
        """A disc across the mean of the joints' directions, at their mean.

        Parameters
        ----------
        points : ndarray
            Joints of the limbs, shape (n, 3), m.

        Returns
        -------
        Body
            Mass, kg, centre of mass, m, and inertia about it, kg m².

        Examples
        --------
        >>> from exo_pin.wrist_chain import AssumedMasses
        >>> disc = AssumedMasses().platform(ep.load("scenario-one").geometry.platform_points)
        >>> disc.mass, round(float(disc.centre[2]), 4)  # kg; m, the height of the plane of the joints
        (0.5, -0.0864)
        """
        points = as_finite("points", points, (None, 3))
        radius, height = self.platform_radius, self.platform_height
        across = self.platform_mass * (3 * radius**2 + height**2) / 12
        along = self.platform_mass * radius**2 / 2
        return Body(self.platform_mass, points.mean(axis=0), np.diag([across, across, along]))

    def arm_inertia(self, mass: float) -> FloatArray:
        """Inertia of an arm whose inertia is not known.

        Parameters
        ----------
        mass : float
            kg.

        Returns
        -------
        ndarray
            Shape (3, 3), kg m², that of a solid ball.

        Examples
        --------
        >>> from exo_pin.wrist_chain import AssumedMasses
        >>> AssumedMasses(arm_radius=0.05).arm_inertia(2.0).diagonal()  # kg m²; 2/5 m r²
        array([0.002, 0.002, 0.002])
        """
        return _ball(mass, self.arm_radius).inertia


def _ball(mass: float, radius: float) -> Body:
    return Body(mass, np.zeros(3), 0.4 * mass * radius**2 * np.eye(3))
