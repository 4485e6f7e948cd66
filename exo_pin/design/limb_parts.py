"""Parts of a limb: its bodies, its guide and the actuator's stroke."""

from __future__ import annotations

from dataclasses import dataclass, replace
from typing import Literal

import numpy as np

from ..core.errors import InvalidInput
from ..core.validation import as_finite, as_inertia, as_positive, set_fields, set_positive

LimbKind = Literal["UPU", "SPS"]


@dataclass(frozen=True)
class LimbBody:
    """One of the two telescoping halves of a limb, a body of revolution about the limb's line.

    Attributes
    ----------
    mass : float
        kg, above zero.
    centre : float
        Distance from the half's own universal joint to its centre of mass, along the limb, m.
    transverse_inertia : float
        About an axis across the limb through the centre of mass, kg m².
    axial_inertia : float
        About the limb's own axis, kg m².

    Examples
    --------
    >>> half = ep.LimbBody(mass=0.4, centre=0.12, transverse_inertia=2e-3, axial_inertia=5e-5)
    >>> round(half.transverse_inertia + half.mass * half.centre**2, 5)  # kg m², about its joint
    0.00776
    """

    mass: float
    centre: float
    transverse_inertia: float
    axial_inertia: float

    def __post_init__(self) -> None:
        set_positive(self, "mass")
        set_fields(self, centre=float(as_finite("centre", self.centre, ())))
        set_positive(self, "transverse_inertia", "axial_inertia", zero=True)
        across, along = self.transverse_inertia, self.axial_inertia
        as_inertia("limb inertia", np.diag([across, across, along]))

    @classmethod
    def rod(cls, mass: float, length: float, radius: float) -> LimbBody:
        """A uniform solid cylinder that starts at the joint.

        Parameters
        ----------
        mass : float
            kg.
        length, radius : float
            m.

        Returns
        -------
        LimbBody

        Examples
        --------
        >>> body = ep.LimbBody.rod(mass=0.2, length=0.3, radius=0.01)
        >>> round(body.transverse_inertia, 6)  # kg m², m (3 r² + l²)/12
        0.001505
        """
        mass, length = as_positive("mass", mass), as_positive("length", length)
        radius = as_positive("radius", radius)
        return cls(mass, length / 2, mass * (3 * radius**2 + length**2) / 12, mass * radius**2 / 2)


@dataclass(frozen=True)
class Stroke:
    """Which joint-to-joint lengths a limb's actuator can take.

    Attributes
    ----------
    nominal_length : float
        Of the actuator (a muscle at rest), m.
    shortest : float
        Least usable length over the nominal one.
    longest : float
        Greatest usable length over the nominal one.
    end_fitting : float or None
        What the joint-to-joint length has on top of the actuator's, m; None where it is not known.

    Notes
    -----
    Source: thesis Table 5-6.

    Examples
    --------
    >>> stroke = ep.Stroke(nominal_length=0.3, shortest=0.75, longest=0.96, end_fitting=0.05)
    >>> cable = ep.Limb("SPS", stroke=stroke, actuator=ep.Actuator("cable", pull_limit=100.0))
    >>> exo = ep.load("prototype").replace(limbs=[cable] * 3)
    >>> str(exo.reaction(exo.pose(30, 30)).status)  # limb 2 would have to be 363 mm long
    'out_of_stroke'
    """

    nominal_length: float
    shortest: float
    longest: float
    end_fitting: float | None = None

    def __post_init__(self) -> None:
        set_positive(self, "nominal_length", "shortest", "longest")
        if self.shortest > self.longest:
            raise InvalidInput(f"expected shortest <= longest, got {self.shortest:g} and {self.longest:g}")
        set_positive(self, "end_fitting", zero=True, optional=True)


@dataclass(frozen=True)
class LimbGuide:
    """Elasticity of a telescopic limb across its line: a beam of constant section between two universal joints.

    A bare pneumatic muscle or a cable has none, and is given no guide. A guide without a torsional lock has
    ``torsional_rigidity`` zero, and then carries no side force either, wherever its line misses O.

    Attributes
    ----------
    bending_rigidity : float
        EI, N m², the same in every plane through the limb.
    torsional_rigidity : float
        GJ, N m².
    joint_stiffness : float
        Of each universal joint against displacement across the limb, N/m; infinite if left out.
    joint_twist_stiffness : float
        Of each universal joint against the couple across both of its axes, N m/rad; infinite if left out.
    largest_bending_moment : float or None
        Greatest bending moment that the guide carries, N m; None where it is not known. Beyond it an answer by
        stiffness has the status "guide_overloaded".
    largest_torque : float or None
        Greatest torque about the limb's axis that the guide carries, N m; None where it is not known.

    Examples
    --------
    >>> tube = ep.LimbGuide(bending_rigidity=65.0, torsional_rigidity=50.0)  # N m²
    >>> exo = ep.load("prototype").replace(limbs=[ep.Limb(guide=tube)] * 3, shoulder=ep.Shoulder(stiffness=20e3))
    >>> answer = exo.reaction(exo.pose(30, 30), split="elastic", centre_offset=[0.0, 0.0, 0.01], limits="none")
    >>> (1e3 * answer.centre_displacement).round(2)  # mm that the shoulder gives way
    array([1.28, 2.15, 1.36])
    """

    bending_rigidity: float
    torsional_rigidity: float
    joint_stiffness: float = float("inf")
    joint_twist_stiffness: float = float("inf")
    largest_bending_moment: float | None = None
    largest_torque: float | None = None

    def __post_init__(self) -> None:
        set_positive(self, "bending_rigidity", "torsional_rigidity", zero=True)
        for name in ("joint_stiffness", "joint_twist_stiffness"):
            value = getattr(self, name)
            if not (isinstance(value, float) and np.isposinf(value)):
                set_positive(self, name)
        set_positive(self, "largest_bending_moment", "largest_torque", optional=True)

    def times(self, factor: float) -> LimbGuide:
        """A guide of other rigidities, with the same joints.

        Parameters
        ----------
        factor : float
            Of EI and GJ.

        Returns
        -------
        LimbGuide

        Examples
        --------
        >>> ep.LimbGuide(bending_rigidity=60.0, torsional_rigidity=40.0).times(1.5).torsional_rigidity  # N m²
        60.0
        """
        rigidities = factor * self.bending_rigidity, factor * self.torsional_rigidity
        return replace(self, bending_rigidity=rigidities[0], torsional_rigidity=rigidities[1])

    @classmethod
    def tube(cls, outer_radius: float, inner_radius: float, youngs_modulus: float, shear_modulus: float) -> LimbGuide:
        """A round tube that is locked against twist.

        Parameters
        ----------
        outer_radius, inner_radius : float
            m; the inner one may be zero.
        youngs_modulus, shear_modulus : float
            Pa.

        Returns
        -------
        LimbGuide

        Raises
        ------
        InvalidInput
            If the inner radius is not below the outer one, or a number is not positive.

        Examples
        --------
        >>> tube = ep.LimbGuide.tube(0.008, 0.006, youngs_modulus=70e9, shear_modulus=26e9)
        >>> round(tube.bending_rigidity, 1), round(tube.torsional_rigidity, 1)  # N m²; E, G times π (R⁴ - r⁴)/4, /2
        (153.9, 114.4)
        """
        outer = as_positive("outer_radius", outer_radius)
        inner = as_positive("inner_radius", inner_radius, zero=True)
        if inner >= outer:
            raise InvalidInput(f"expected inner_radius below outer_radius, got {inner:g} and {outer:g}")
        area_moment = np.pi * (outer**4 - inner**4) / 4
        return cls(
            as_positive("youngs_modulus", youngs_modulus) * area_moment,
            as_positive("shear_modulus", shear_modulus) * 2 * area_moment,
        )
