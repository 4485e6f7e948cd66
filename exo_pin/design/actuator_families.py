"""Families of actuators with their data: which lengths a limb can have with one of them.

* A **pneumatic muscle** contracts by at most a quarter of its nominal length; it cannot be longer than at rest.
* A **cable** is wound on a drum, so its stroke has no end; clamp and exit pulley take a least free length.
* A **linear actuator** of one stage is, retracted, as long as its stroke and its dead length (motor, gear, rod ends)
  together, and extended longer by the stroke.

The least fittings, free length and dead length are **assumed** sizes of small devices; a
:class:`exo_pin.Stroke` has those of a product.
"""

from __future__ import annotations

import numpy as np

from ..core.errors import InvalidInput
from ..core.validation import as_choice, as_positive
from .actuator import ACTUATOR_FAMILIES
from .limb import Stroke

#: Greatest contraction of a pneumatic muscle as a share of its nominal length: the 75 % of Table 5-6.
CONTRACTION = 0.25
#: What a limb has at least besides its actuator's stroke, m: end fittings of a muscle, free length of a cable, dead
#: length of a linear actuator. Assumed.
LEAST_LENGTH = {"pneumatic muscle": 0.040, "cable": 0.030, "linear": 0.100}
#: The shortest length of an actuator without these as a share of its longest.
_SHARES = {"pneumatic muscle": 1.0 - CONTRACTION, "cable": 0.0, "linear": 0.5}


def family_limits(family: str) -> tuple[float, float]:
    """How the shortest joint-to-joint length of a limb follows from its longest: shortest >= share * longest + length.

    Parameters
    ----------
    family : {"pneumatic muscle", "cable", "linear"}
        The family.

    Returns
    -------
    share, length : float
        Dimensionless and m.

    Raises
    ------
    UnknownName
        If there is no such family.
    """
    share = _SHARES[as_choice("actuator family", family, ACTUATOR_FAMILIES)]
    return share, (1.0 - share) * LEAST_LENGTH[family]


def fitting_stroke(family: str, shortest: float, longest: float, travel_limit: float | None = None) -> Stroke:
    """The actuator of a family with the stroke that a limb needs, if the family has one (:func:`family_limits`).

    Parameters
    ----------
    family : {"pneumatic muscle", "cable", "linear"}
        The family.
    shortest, longest : float
        Joint-to-joint lengths that the limb must take, m.
    travel_limit : float, optional
        Greatest travel, m (:class:`exo_pin.Actuator`).

    Returns
    -------
    Stroke
        Whose longest length is ``longest``. A muscle gets the largest nominal length, with the whole of its
        contraction; a cable the full length down to its free length; a linear actuator just the stroke that is needed.
    """
    travel = np.inf if travel_limit is None else travel_limit
    least = LEAST_LENGTH[family]
    if family == "pneumatic muscle":
        muscle = longest - least
        return Stroke(muscle, max(1.0 - CONTRACTION, 1.0 - travel / muscle), 1.0, least)
    if family == "cable":
        return Stroke(longest, max(least, longest - travel, 1e-6) / longest, 1.0, 0.0)
    travel = longest - shortest
    body = least + 2.0 * travel
    return Stroke(body, (least + travel) / body, 1.0, longest - body if longest - body > 1e-12 else 0.0)


def stroke_of_length(
    family: str, nominal_length: float, end_fitting: float | None = None, travel_limit: float | None = None
) -> Stroke:
    """The stroke of an actuator of a family that is so long.

    Parameters
    ----------
    family : {"pneumatic muscle", "cable", "linear"}
        The family.
    nominal_length : float
        Of a muscle at rest, of a cable that is let out, of a linear actuator that is extended, m.
    end_fitting : float, optional
        What the joint-to-joint length has on top of it, m; if left out that of :data:`LEAST_LENGTH` for a muscle and
        nothing for the others, whose least lengths are part of the actuator.
    travel_limit : float, optional
        Greatest travel, m (:class:`exo_pin.Actuator`): the actuator is then no shorter than its length less this.

    Raises
    ------
    InvalidInput
        If the actuator is shorter than its free length or its dead length.
    """
    length = as_positive("nominal_length", nominal_length)
    share, shortest = family_limits(family)
    least = 0.0 if travel_limit is None else 1.0 - as_positive("travel_limit", travel_limit) / length
    if family == "pneumatic muscle":
        fitting = LEAST_LENGTH[family] if end_fitting is None else end_fitting
        return Stroke(length, max(1.0 - CONTRACTION, least), 1.0, fitting)
    shortest += share * length
    if shortest > length:
        raise InvalidInput(
            f"expected a {family} longer than {1e3 * LEAST_LENGTH[family]:.0f} mm, got {1e3 * length:.0f} mm"
        )
    return Stroke(length, max(shortest / length, least), 1.0, 0.0 if end_fitting is None else end_fitting)
