"""A limb: its joints, and what it is made of."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace
from typing import Literal

import numpy as np

from ..core.errors import InvalidInput
from ..core.errors.checked import checked
from ..core.validation import (
    as_choice,
    as_finite,
    as_inertia,
    as_parts,
    as_positive,
    as_unit_vector,
    require_types,
    set_fields,
    set_positive,
)
from .actuator import Actuator

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


#: A stroke beyond this many nominal lengths is one in percent.
_LARGEST_RATIO = 10.0


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
        if max(self.shortest, self.longest) > _LARGEST_RATIO:
            raise InvalidInput(
                f"expected shortest and longest as ratios of the nominal length, got {self.shortest:g} and "
                f"{self.longest:g} (percent?)"
            )
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
        bending, torsional = factor * self.bending_rigidity, factor * self.torsional_rigidity
        return replace(self, bending_rigidity=bending, torsional_rigidity=torsional)

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


@checked
@dataclass(frozen=True)
class Limb:
    """A limb from the torso to the arm.

    Attributes
    ----------
    kind : {"UPU", "SPS"}
        UPU: a universal joint at each end; can put a side force g_i X_i on the arm. SPS: a spherical joint at
        each end, as a cable or a bare muscle; pulls or pushes along its line only.
    base_body : LimbBody or None
        The half of the limb at the torso; None for a massless half, as in the thesis.
    platform_body : LimbBody or None
        The half of the limb at the arm; None for a massless half.
    stroke : Stroke or None
        What the actuator can do.
    joint_limit : float or None
        Half diagonal of the diamond |ψ_x| + |ψ_y| < limit that limits a universal joint's angles, counted from
        where its two yokes are in line, rad.
    joint_straight : tuple of float or None
        Direction in which the limb leaves a joint whose yokes are in line, in the joint's own frame, shape (3,): from
        A_i to B_i in {A_i} at the base, from B_i to A_i in {B_i} at the cuff. One value serves both. None where it is
        not known, and then ``joint_limit`` cannot be applied. Along Z of (4-15), (0, 0, 1), it is not: the prototype
        at rest would be out of range. The joint at A_1 is straight at rest with ``geometry.base_frames[0].T @ s``, s
        the limb's direction there (:meth:`exo_pin.ShoulderExo.inverse_kinematics`), (0.733, 0.664, 0.148) for the
        prototype; that at B_1 with ``geometry.platform_frames[0].T @ -s``, (-0.417, 0.863, 0.285).
    guide : LimbGuide or None
        Elasticity across the limb's line; None for a bare muscle, which has no stiffness there. Of no effect on
        an SPS limb.
    actuator : Actuator or None
        Whether it can push and how hard it can pull; None where that is not known.

    Examples
    --------
    >>> muscle = ep.Limb("SPS", actuator=ep.Actuator("pneumatic muscle", pull_limit=60.0))
    >>> exo = ep.load("prototype").replace(limbs=[muscle] * 3)
    >>> print(exo.reaction(exo.pose(30, 30)).verdict)
    The device cannot hold this pose: limbs 1 and 3 would have to push with 27 and 17 N.
    """

    kind: LimbKind = "UPU"
    base_body: LimbBody | None = None
    platform_body: LimbBody | None = None
    stroke: Stroke | None = None
    joint_limit: float | None = None
    joint_straight: tuple[float, float, float] | None = None
    guide: LimbGuide | None = None
    actuator: Actuator | None = None

    def __post_init__(self) -> None:
        as_choice("limb kind", self.kind, ("UPU", "SPS"))
        require_types(self, base_body=LimbBody | None, platform_body=LimbBody | None, stroke=Stroke | None)
        require_types(self, guide=LimbGuide | None, actuator=Actuator | None)
        set_positive(self, "joint_limit", optional=True)
        if self.joint_straight is not None:
            direction = as_unit_vector("joint_straight", self.joint_straight)
            set_fields(self, joint_straight=tuple(direction.tolist()))

    @property
    def length_range(self) -> tuple[float, float]:
        """Shortest and longest l_i, m; NaN where the stroke or the end fitting is not known."""
        if self.stroke is None or self.stroke.end_fitting is None:
            return float("nan"), float("nan")
        fitting, nominal = self.stroke.end_fitting, self.stroke.nominal_length
        return fitting + self.stroke.shortest * nominal, fitting + self.stroke.longest * nominal

    @property
    def effort_range(self) -> tuple[float, float]:
        """Least and greatest tension at any length, N; NaN where it is not known, or a law of the muscle gives it."""
        return (float("nan"), float("nan")) if self.actuator is None else self.actuator.effort_range

    @property
    def speed_limit(self) -> float | None:
        """Greatest rate of its length, m/s."""
        return None if self.actuator is None else self.actuator.speed_limit

    @property
    def power_limit(self) -> float | None:
        """Greatest mechanical power, W."""
        return None if self.actuator is None else self.actuator.power_limit

    @property
    def play(self) -> float | None:
        """How far its length may shift while the actuator stands, m."""
        return None if self.actuator is None else self.actuator.play

    @property
    def resolution(self) -> float | None:
        """Least difference of lengths that its sensor tells apart, m."""
        return None if self.actuator is None else self.actuator.resolution

    def missing_limits(self, known_forces: bool) -> list[str]:
        """Limits that are not known, in words; those of the force are left out with ``known_forces``.

        Parameters
        ----------
        known_forces : bool
            Whether the limits of the force are given otherwise.

        Returns
        -------
        list of str
            Empty if all are known.

        Examples
        --------
        >>> ep.Limb("SPS", actuator=ep.Actuator("cable")).missing_limits(known_forces=False)
        ['stroke', 'greatest pull']
        """
        lacking = ["stroke"] if self.stroke is None else ["end fitting"] if self.stroke.end_fitting is None else []
        if known_forces:
            return lacking
        return [*lacking, "actuator"] if self.actuator is None else [*lacking, *self.actuator.missing_limits()]

    def mirrored(self) -> Limb:
        """The limb on the other side of the body: X of the joints' frames points the other way.

        Returns
        -------
        Limb

        Examples
        --------
        >>> ep.Limb(joint_straight=(0.6, 0.8, 0.0)).mirrored().joint_straight
        (-0.6, 0.8, 0.0)
        """
        if self.joint_straight is None:
            return self
        x, y, z = self.joint_straight
        return replace(self, joint_straight=(-x, y, z))

    @property
    def mass(self) -> float:
        """Mass of both halves, kg."""
        return sum(body.mass for body in (self.base_body, self.platform_body) if body is not None)

    def without_spin(self) -> Limb:
        """An SPS limb without inertia about its own line, about which it may spin at any rate; others as they are.

        Returns
        -------
        Limb

        Examples
        --------
        >>> rod = ep.LimbBody.rod(mass=0.2, length=0.3, radius=0.01)
        >>> limb = ep.Limb("SPS", base_body=rod, platform_body=rod)
        >>> spins = [each.base_body.axial_inertia for each in (limb, limb.without_spin())]
        >>> [round(1e6 * spin, 3) for spin in spins]  # kg mm²; m r²/2
        [10.0, 0.0]
        """
        if self.kind != "SPS":
            return self
        base, platform = (half and replace(half, axial_inertia=0.0) for half in (self.base_body, self.platform_body))
        return replace(self, base_body=base, platform_body=platform)


def limbs_for(limbs: Sequence[Limb] | None, count: int) -> tuple[Limb, ...]:
    """One limb a joint pair; massless UPU limbs where none are given."""
    if limbs is None or (isinstance(limbs, Sequence) and len(limbs) == 0):
        return (Limb(),) * count
    limbs = as_parts("limbs", limbs, Limb)
    if len(limbs) != count:
        raise InvalidInput(f"expected {count} limbs, one per joint pair of the geometry, got {len(limbs)}")
    return limbs
