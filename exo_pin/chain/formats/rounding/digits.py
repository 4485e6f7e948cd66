"""How well a file knows its robot's geometry: by the digits of its numbers.

A CAD export has 4 to 8 decimals everywhere. Loops whose rows agree in the exact mechanism then agree within the
rounding only, and would lock it. Such a file has a tolerance of half a unit of its last decimal, or of a right angle's
that it rounds further, 1.5708. It counts where it makes a difference: where rows of the loops agree within it, and not
exactly, or where the loops close within it and not otherwise.

Which rows agree is measured: the robot is built again from numbers that would have been written with the same digits,
and a singular value that the digits explain is zero (:mod:`exo_pin.chain.kinematics.structural_rank`). Where the
tolerance, which is for the worst chain, decides otherwise, the smaller one is taken that explains what was measured.
"""

from __future__ import annotations

from collections.abc import Callable, Iterable
from dataclasses import replace

import pinocchio as pin

from ....core.errors import ExoPinError, LoopNotClosed
from ....core.validation import FloatArray
from ...kinematics.closing import close, reference_configuration
from ...kinematics.structural_rank import Agreement, agreeing_rows, measured_agreement
from ...structure.chain_state import ChainState
from ...structure.description import Closures
from .rounded_numbers import Redrawn, rounding_of

#: Number of geometries with the same digits.
_REDRAWN = 16


def with_digits(
    model: pin.Model, closures: Closures, words: Iterable[str], again: Callable[[Redrawn], tuple[pin.Model, Closures]]
) -> Closures:
    """The closures with the tolerance of the digits of their geometry, if it makes a difference.

    Parameters
    ----------
    model : pinocchio.Model
        The tree.
    closures : Closures
        Its loops, with a tolerance only if a file states it.
    words : iterable of str
        The numbers of the geometry as written.
    again : callable
        Builds tree and loops from a geometry with the same digits.
    """
    tolerance = rounding_of(words)
    if closures.tolerance or not tolerance or not closures.rows:
        return closures
    rounded = replace(closures, tolerance=tolerance)
    state = ChainState(model, rounded)
    q = _closed(state)
    if q is None:
        return closures
    worst, known = agreeing_rows(state, q), f"digits: places are known to {tolerance:.0e} m and rad"
    measured = (
        None
        if worst == (0, 0.0)
        else _measured(ChainState(model, closures), q, lambda seed: again(Redrawn(seed, tolerance)), state.tolerance)
    )
    if worst != (0, 0.0) and measured is None:
        said = f"{known}, which leaves open whether rows of the loops agree: read as they stand"
        return replace(closures, left_out=(*closures.left_out, said))
    finer = (
        rounded if measured is None else replace(closures, tolerance=min(measured.tolerance or tolerance, tolerance))
    )
    if measured is not None and measured.rows:
        if worst is None or worst[0] != measured.rows:
            rounded = finer
        reason = f"of the loops' rows {measured.rows} agree with others to {measured.size:.0e}"
    elif _closed(ChainState(model, closures)) is None:
        reason = "the loops close no better"
        rounded = finer
    else:
        return closures
    return replace(rounded, left_out=(*closures.left_out, f"{known}, and {reason}"))


def _measured(
    state: ChainState, q: FloatArray, again: Callable[[int], tuple[pin.Model, Closures]], tolerance: float
) -> Agreement | None:
    """Which rows agree by the digits; None where that is not clear, or other digits make another chain."""
    try:
        others = [ChainState(*again(seed)) for seed in range(_REDRAWN)]
    except ExoPinError:
        return None
    if any((other.nv, other.row_count) != (state.nv, state.row_count) for other in others):
        return None
    return measured_agreement(state, others, q, tolerance)


def _closed(state: ChainState) -> FloatArray | None:
    """A closed configuration, None if there is none near the file's."""
    try:
        return close(state, reference_configuration(state))
    except LoopNotClosed:
        return None
