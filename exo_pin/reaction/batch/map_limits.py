"""Limits that compiled code checks: the same in all poses of a map, or depending on the lengths by laws of muscles."""

from __future__ import annotations

from typing import Any

import numpy as np

from ...core.validation import as_pair, as_real
from ...design import Mechanism
from ..constraints.actuator_limits import closed_length_limits, have_powers, pull_laws
from ..constraints.given_limits import FORMS, Limits, are_actuators, as_limb_limits, two_ends
from ..holding.hold_check import estimated_limbs
from .limit_kernels import UNLIMITED, CompiledLimits


def have_one_form(limits: Limits, mechanism: Mechanism) -> bool:
    """Whether limits are words, or numbers that hold in every pose, and laws that they need are polynomials."""
    given = as_pair("limits", limits)
    if isinstance(given, str):
        return given == "none" or have_powers(mechanism)
    alike = ((), (mechanism.limb_count,))
    return (
        not are_actuators(given)
        and all(as_real("limits", end).shape in alike for end in two_ends(given, FORMS))
        and have_powers(mechanism)
    )


def compiled_limits(limits: Limits, mechanism: Mechanism) -> CompiledLimits:
    """Limits of a map, of which :func:`have_one_form` is true.

    Parameters
    ----------
    limits : Limits
        As in :meth:`exo_pin.ShoulderExo.reaction`.
    mechanism : Mechanism
        The design.

    Returns
    -------
    CompiledLimits
        :data:`UNLIMITED` where nothing is limited.

    Raises
    ------
    InvalidInput
        If the limits are no limits.
    """
    given: Any = as_pair("limits", limits)
    probe = as_limb_limits(given, mechanism, (1,), lambda: np.full((1, mechanism.limb_count), np.nan))
    ends = closed_length_limits(mechanism)
    if not probe.asked or not (probe.bound_forces or np.isfinite(ends[0]).any()):
        return UNLIMITED
    # The probe cannot tell a least tension that the law does not give anywhere.
    lower = np.fmax(probe.lower[0], [limb.effort_range[0] for limb in mechanism.limbs])
    upper, below, above = (part[0].copy() for part in (probe.upper, probe.open_below, probe.open_above))
    laws = pull_laws(mechanism)
    if not isinstance(given, str):
        least, most = (np.asarray(end, dtype=np.float64) for end in given)
        lower, laws = np.fmax(lower, least), laws._replace(ceiling=np.minimum(laws.ceiling, most))
        # Limits that exclude each other.
        above &= lower <= upper
    shortest, longest = ends[0].copy(), ends[1].copy()
    return CompiledLimits(lower, upper, below, above, shortest, longest, estimated_limbs(mechanism), laws)
