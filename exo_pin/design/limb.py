"""A limb: its joints, and what it is made of."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace
from typing import Literal

from ..core.errors import InvalidInput
from ..core.errors.checked import checked
from ..core.validation import as_choice, as_unit_vector, require_type, set_fields, set_positive
from .actuator import Actuator
from .limb_parts import LimbBody, LimbGuide, Stroke

LimbKind = Literal["UPU", "SPS"]


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
        kinds = {
            "base_body": LimbBody,
            "platform_body": LimbBody,
            "stroke": Stroke,
            "guide": LimbGuide,
            "actuator": Actuator,
        }
        for name, kind in kinds.items():
            require_type(name, getattr(self, name), kind | None)
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
        if self.kind != "SPS" or self.mass == 0.0:
            return self
        base, platform = (half and replace(half, axial_inertia=0.0) for half in (self.base_body, self.platform_body))
        return replace(self, base_body=base, platform_body=platform)


def limbs_for(limbs: Sequence[Limb] | None, count: int) -> tuple[Limb, ...]:
    """One limb a joint pair; massless UPU limbs where none are given."""
    if limbs is None or (isinstance(limbs, Sequence) and len(limbs) == 0):
        return (Limb(),) * count
    if not isinstance(limbs, Sequence):
        raise InvalidInput(f"expected limbs to be a sequence of Limb records, got {type(limbs).__name__}")
    for limb in limbs:
        if not isinstance(limb, Limb):
            raise InvalidInput(f"expected limbs to be Limb records, got {type(limb).__name__}")
    if len(limbs) != count:
        raise InvalidInput(f"expected {count} limbs, one per joint pair of the geometry, got {len(limbs)}")
    return tuple(limbs)
