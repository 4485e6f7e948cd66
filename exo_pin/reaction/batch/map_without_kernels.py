"""Maps of questions that the kernels do not answer: the general way, with the same answer."""

from __future__ import annotations

from collections.abc import Iterable
from typing import Any

import numpy as np

from ...design import Mechanism
from ...load_case.case import Case
from ..answer import QUERY_STATUS
from ..assumptions import Assumptions
from ..constraints.actuator_limits import limits_motion
from ..constraints.limb_limits import are_actuators
from ..result import Reaction
from ..splits.minimal import Minimal
from ..splits.split import Spherical
from ..splits.standalone import Standalone

#: Those with kernels of their own.
_COMPILED = (Spherical, Minimal, Standalone)
_CODES = {name: code for code, name in enumerate(QUERY_STATUS)}


def has_closed_form(mechanism: Mechanism, case: Case, assumptions: Assumptions) -> bool:
    """Whether the kernels answer a question: massless limbs about the shoulder's own centre, no socket, no weights."""
    if any(limb.mass > 0.0 for limb in mechanism.limbs) or (case.motion is not None and limits_motion(mechanism)):
        return False
    if assumptions.constraint_bounds == "actuator" and are_actuators(assumptions.limits):
        # Whether these limits have one sign depends on the lengths.
        return False
    plain = case.centre_offset is None and assumptions.cone is None and assumptions.weights is None
    return plain and type(assumptions.law) in _COMPILED


def fields_of(answer: Reaction, names: Iterable[str]) -> dict[str, Any]:
    """Fields of the map of an answer that keeps the quantities of these names."""
    kept: dict[str, Any] = dict.fromkeys(
        ("shoulder_force", "actuator_forces", "constraint_forces", "margin", "magnitude")
    )
    kept |= {"status_codes": None, "unknown": None}
    for name in names:
        if name == "status":
            kept["status_codes"] = np.vectorize(_CODES.__getitem__, otypes=[np.int8])(answer.status)
            kept["unknown"] = answer.unknown
        else:
            kept[name] = getattr(answer, name)
    return kept | {"split": answer.split, "trivial": answer.trivial}
