"""A person's build as a short table for reading."""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np

from .limb.muscle_table import MUSCLES

if TYPE_CHECKING:
    from .wearer import Person

__all__ = ["MUSCLE_GROUPS", "build_table"]

#: Muscles that are named together.
MUSCLE_GROUPS = {
    "deltoid": ("DELT1", "DELT2", "DELT3"),
    "rotator cuff": ("SUPSP", "INFSP", "SUBSC", "TMIN"),
    "pectoralis major": ("PECM1", "PECM2", "PECM3"),
    "latissimus and teres major": ("LAT1", "LAT2", "LAT3", "TMAJ"),
    "biceps and coracobrachialis": ("BIClong", "BICshort", "CORB"),
    "triceps": ("TRIlong", "TRIlat", "TRImed"),
}


def build_table(person: Person) -> str:
    """Lengths, masses and strengths of a person.

    Parameters
    ----------
    person : Person
        Whose.

    Returns
    -------
    str
        Strengths are sums of the peak isometric forces of a group, N.
    """
    arm, forces = person.arm, person.muscle_table.force
    place = 1e3 * float(np.linalg.norm(arm.centre_of_mass))
    load = f" with {person.payload:g} kg in the hand" if person.payload else ""
    strengths = [
        f"{name} {sum(forces[MUSCLES.index(muscle)] for muscle in group):.0f}" for name, group in MUSCLE_GROUPS.items()
    ]
    return "\n".join(
        [
            f"{person.height:g} m, {person.mass:g} kg, {person.sex}, {person.side} arm, elbow at "
            f"{np.degrees(person.elbow_flexion):.0f}°",
            f"upper arm {-1e3 * person.elbow_centre[2]:.0f} mm; arm {arm.mass:.2f} kg{load}, its centre of mass "
            f"{place:.0f} mm from the shoulder",
            f"strength, N: {', '.join(strengths[:3])},",
            f"  {', '.join(strengths[3:])}",
        ]
    )
