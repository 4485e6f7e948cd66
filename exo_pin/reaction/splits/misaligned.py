"""The reaction query with the device's centre off the shoulder's."""

from __future__ import annotations

import numpy as np

from ...core.errors import SolverFailed
from ...core.validation import FloatArray
from ...design import Mechanism
from ...load_case.pose_stacks import Query, require_massless
from ...wrist.forces.closed_form import STATUS
from ..answer import Answer, Wanted, is_trivial
from ..constraints.side_force_bounds import SideForceBounds
from ..finished import finished
from ..indeterminacy.certificate import is_determined
from ..mechanism_loads import arm_loads
from ..result import Reaction
from .elastic import Displaced, shoulder_stiffness
from .least_shoulder_force import least_force

__all__ = ["misaligned_reaction"]


def misaligned_reaction(
    mechanism: Mechanism,
    query: Query,
    offset: tuple[FloatArray, FloatArray],
    wanted: Wanted,
) -> Reaction:
    """Answer a query in the displaced geometry; see :meth:`exo_pin.ShoulderExo.reaction`.

    Closed form, for massless limbs. Moments are about the anatomical centre. In "standalone" there is no shoulder to
    be off: the device turns about its own centre, and the arm with it.
    """
    require_massless(mechanism)
    base, cuff = offset
    split, bounds = wanted.split, wanted.side_bounds
    if split == "standalone":
        # Without a ball joint the two centres of the device stay together, and only the cuff's seat counts.
        carried = np.einsum("kij,kj->ki", query.matrices, cuff)
        base = carried
    force, moment, _ = arm_loads(mechanism, query)
    state = Displaced(mechanism, query, base, cuff, force, moment)
    answer = Answer(mechanism, query)
    answer.status, answer.margin, answer.determinant = state.status.copy(), state.margin, state.determinant
    rows = np.flatnonzero(state.status < STATUS.index("singular"))
    g, tensions = np.zeros_like(state.f0), np.zeros_like(state.f0)
    if split == "elastic":
        g, answer.displacement = state.elastic_side_forces(shoulder_stiffness(mechanism))
        answer.stiffness = state.side.stiffness
        answer.status[rows[np.isnan(g[rows]).any(axis=1)]] = STATUS.index("not_solved")
    elif split in ("minimal", "standalone"):
        for row in rows.tolist():
            _choose(row, state, answer, split, bounds, g, tensions)
    _fill(state, answer, g, tensions)
    return finished(answer, query, wanted, offset)


def _choose(
    row: int,
    state: Displaced,
    answer: Answer,
    split: str,
    bounds: SideForceBounds,
    g: FloatArray,
    tensions: FloatArray,
) -> None:
    """Side forces, and tensions that balance themselves, of least shoulder force."""
    upu, stress = answer.upu, state.self_stress[row]
    own = stress.shape[1]
    directions = state.side.directions[row].T
    effect = np.hstack([directions @ stress, state.shoulder_of_g[row][:, upu]])
    free = np.full(own, np.inf)
    lower, upper = bounds.at(row, state.f0[row]) if split == "minimal" else (np.full(len(g[row]), -np.inf),) * 2
    if split == "standalone":
        upper = -lower
    low, high = np.concatenate([-free, lower[upu]]), np.concatenate([free, upper[upu]])
    if split == "standalone":
        answer.judge_standalone(row, effect)
    else:
        answer.trivial[row] = is_trivial(effect, low, high)
    if answer.status[row] >= STATUS.index("singular"):
        return
    try:
        solved = least_force(state.shoulder[row], effect, low, high).variables
    except SolverFailed:
        answer.status[row] = STATUS.index("not_solved")
        return
    g[row, upu] = solved[own:]
    tensions[row] = stress @ solved[:own]


def _fill(state: Displaced, answer: Answer, g: FloatArray, tensions: FloatArray) -> None:
    """Write all rows that have an answer."""
    good = answer.status < STATUS.index("singular")
    f = state.f0 + np.einsum("kij,kj->ki", state.f_of_g, g) + tensions
    directions = np.swapaxes(state.side.directions, 1, 2)
    shoulder = state.shoulder + np.einsum("kij,kj->ki", state.shoulder_of_g, g)
    shoulder += np.einsum("kij,kj->ki", directions, tensions)
    wrenches = state.limb_wrenches(f, g)
    for target, source in (
        (answer.f, f),
        (answer.g, g),
        (answer.shoulder, shoulder),
        (answer.spherical, state.shoulder),
        (answer.on_arm, wrenches),
        (answer.on_torso, -wrenches),
    ):
        target[good] = source[good]
    upu, n = answer.upu, answer.f.shape[1]
    own = state.self_stress.shape[2]
    for row in np.flatnonzero(good).tolist():
        of_f = np.hstack([state.self_stress[row], state.f_of_g[row][:, upu]])
        of_g = np.zeros((n, own + upu.size))
        of_g[upu, own + np.arange(upu.size)] = 1.0
        shoulder_change = np.hstack([directions[row] @ state.self_stress[row], state.shoulder_of_g[row][:, upu]])
        answer.undetermined[row], answer.redundant[row] = own + upu.size, upu.size
        answer.f_unique[row], answer.g_unique[row] = is_determined(of_f), is_determined(of_g)
        answer.shoulder_unique[row] = is_determined(shoulder_change)
        # Arm and torso are a closed system: what limbs and shoulder together put on the torso is fixed by the arm.
        answer.torso_unique[row] = True
