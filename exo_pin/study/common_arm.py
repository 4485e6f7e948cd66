"""One wearer, one payload and one side for all designs of a comparison."""

from __future__ import annotations

from collections.abc import Sequence
from typing import TYPE_CHECKING

import numpy as np

from ..core.errors import MissingData
from ..core.tables import enumerated
from ..design import Arm, Wearer

if TYPE_CHECKING:
    from ..exo.shoulder_exo import ShoulderExo

__all__: list[str] = []

#: Mass of an arm beside that of its wearer's segments, kg, that is rounding of a design's file.
_ROUNDED = 0.02
#: An elbow that is less bent, degrees, is called straight.
_STRAIGHT = 0.05


def on_one_arm(designs: Sequence[ShoulderExo], person: Arm | Wearer | None) -> tuple[list[ShoulderExo], str]:
    """The designs on the arm of one person and on the side of the first, and a sentence that says whose arm it is.

    What a device itself moves stays its own.

    Parameters
    ----------
    designs : sequence of ShoulderExo
        At least one.
    person : Arm or Wearer, optional
        A left arm, or whose it is; that of the first design that has one if left out.

    Raises
    ------
    MissingData
        If nobody wears any design, and one moves nothing of its own either.
    """
    side = designs[0].side
    alike = [each if each.side == side else each.mirrored() for each in designs]
    turned = [each.name for each in designs if each.side != side]
    mirrored = f" {enumerated(turned)}: mirrored to the {side} shoulder." if turned else ""
    if person is not None:
        worn = [each.worn_by(person) for each in alike]
        return worn, f"All worn by {_words(_own(worn[0]))} (as asked).{mirrored}"
    owner = next((k for k, each in enumerate(alike) if _own(each) is not None), None)
    if owner is None:
        bare = [each.name for each in alike if each.arm is None]
        if bare:
            advice = "give a person who wears them all (--person 1.75,75,male, or person=)"
            raise MissingData(["arm of a person"], "a comparison", enumerated(bare), advice)
        return alike, (
            "Nobody wears these designs: each carries its own moving parts alone, without the arm of a person "
            f"(--person, or person=, puts one on all).{mirrored}"
        )
    own = _own(alike[owner])
    assert own is not None
    left = own if side == "left" else own.mirrored()
    worn = [each if k == owner else each.worn_by(left) for k, each in enumerate(alike)]
    whose = "the first design's" if owner == 0 else f"that of {alike[owner].name}: no design before it has a person"
    return worn, f"All worn by {_words(own)} ({whose}).{mirrored}"


def _own(exo: ShoulderExo) -> Arm | None:
    """The person's part of what moves."""
    return None if exo.arm is None else exo.arm.person


def _words(arm: Arm | None) -> str:
    """Whose arm it is, what it carries and how it is bent."""
    assert arm is not None
    wearer = arm.wearer
    if wearer is None:
        return f"an arm of {arm.mass:.3g} kg of a person whose size is not known"
    kind = {"male": "man", "female": "woman"}[wearer.sex]
    bend = float(np.degrees(wearer.elbow_flexion))
    elbow = "elbow straight" if abs(bend) < _STRAIGHT else f"elbow bent by {bend:.3g}°"
    besides = arm.mass - Arm.of_wearer(wearer).mass
    payload = wearer.payload + (besides if besides > _ROUNDED else 0.0)
    return f"a {kind} of {wearer.height:.4g} m, {wearer.mass:.3g} kg, {elbow}, payload {payload:.3g} kg"
