"""The guide of a limb: its bending and torsional stiffness."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from ..core.errors import InvalidInput
from ..core.fields import set_positive
from ..core.validation import as_positive

__all__ = ["LimbGuide"]


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
    largest_bending_moment, largest_torque : float or None
        What the guide bears, N m; None where it is not known. Beyond it an answer by stiffness has the status
        "guide_overloaded".
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

    @classmethod
    def tube(cls, outer_radius: float, inner_radius: float, youngs_modulus: float, shear_modulus: float) -> LimbGuide:
        """A round tube that is locked against twist.

        Parameters
        ----------
        outer_radius, inner_radius : float
            m; the inner one may be zero.
        youngs_modulus, shear_modulus : float
            Pa.
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
