"""Limits that compiled code checks: the same in all poses of a map, or depending on the lengths by laws of muscles."""

from __future__ import annotations

from typing import Any

import numpy as np

from ...core.validation import as_pair
from ...design import Mechanism
from ..constraints.actuator_limits import closed_length_limits, pull_laws
from ..constraints.given_limits import Limits, as_limb_limits
from ..holding.hold_check import estimated_limbs
from .limit_kernels import UNLIMITED, CompiledLimits


def have_one_form(limits: Limits, limb_count: int) -> bool:
    """Whether limits are words, or numbers that hold in every pose."""
    given = as_pair("limits", limits)
    if isinstance(given, tuple) and len(given) == 2:
        return all(np.shape(end) in ((), (limb_count,)) and not hasattr(end, "force_limits") for end in given)
    return isinstance(given, str)


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
    if isinstance(given, tuple):
        least, most = (np.asarray(end, dtype=np.float64) for end in given)
        lower, laws = np.fmax(lower, least), laws._replace(ceiling=np.minimum(laws.ceiling, most))
        # Limits that exclude each other.
        above &= lower <= upper
    shortest, longest = ends[0].copy(), ends[1].copy()
    return CompiledLimits(lower, upper, below, above, shortest, longest, estimated_limbs(mechanism), laws)
