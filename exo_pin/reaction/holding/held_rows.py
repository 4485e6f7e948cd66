"""Moments that efforts can supply beside held idle motions: :mod:`exo_pin.wrist.forces.wrench_feasibility`, more rows.

With d idle motions that must stay in balance, equilibrium has r = 3 + d rows. What efforts between their limits supply
is a sum of segments in r dimensions, whose faces are spanned by r - 1 of them: every set of r - 1 efforts gives a
normal ν, and a load m is supplied if and only if ν · m <= the most that efforts supply along ν, for all of them and
both signs. The moments that are supplied while the idle motions are in balance are a slice of that set. The distance of
m from a face, within the slice, is the slack over the length of the moment part of ν.
"""

from __future__ import annotations

import itertools

import numpy as np

from ...core.validation import FloatArray

#: Part of a unit normal in a row, and of a column along it, that is rounding.
_NONE = 1e-12
#: Part of a normal in the rows of the moments below which a face has the same distance from every moment.
_OF_IDLE = 1e-9


def margin_of_rows(
    rows: FloatArray, load: FloatArray, lower: FloatArray, upper: FloatArray
) -> tuple[float, FloatArray, FloatArray]:
    """Disturbing moment that is held besides, N m, negative where a pose is not held, and the reliefs of both limits.

    Parameters
    ----------
    rows : ndarray
        M_f, shape (r, n): three rows of moments, then those of idle motions.
    load : ndarray
        m, shape (r,).
    lower, upper : ndarray
        Limits of the efforts, shape (n,).

    Returns
    -------
    margin : float
        Infinite where every moment is held.
    low, high : ndarray
        Relaxation of this limit alone that makes the pose feasible, shape (n,); infinite where none does, zero where
        the pose is held.
    """
    r, n = rows.shape
    reliefs = np.zeros((2, n))
    chosen = np.array(list(itertools.combinations(range(n), r - 1)))
    if not len(chosen):
        return np.inf, *reliefs
    size = np.linalg.norm(rows, axis=0)
    unit = rows / np.where(size > 0.0, size, 1.0)
    _, values, Vt = np.linalg.svd(np.swapaxes(unit[:, chosen], 0, 1).swapaxes(1, 2))
    # Columns that depend on one another span no face; others do.
    firm = values[:, -1] > _NONE
    normals, chosen = Vt[firm, -1], chosen[firm]
    normals, spans = np.concatenate([normals, -normals]), np.concatenate([chosen, chosen])
    levers = normals @ rows
    levers[np.abs(levers) <= _NONE * size] = 0.0
    levers[np.arange(len(spans))[:, None], spans] = 0.0
    with np.errstate(invalid="ignore"):
        supplied = np.where(levers > 0.0, levers * upper, np.where(levers < 0.0, levers * lower, 0.0))
    slack = supplied.sum(axis=1) - normals @ load
    turning = np.linalg.norm(normals[:, :3], axis=1)
    of_idle = turning <= _OF_IDLE
    distance = np.where(of_idle, np.where(slack < 0.0, slack, np.inf), slack / np.where(of_idle, 1.0, turning))
    broken = slack < 0.0
    with np.errstate(divide="ignore", invalid="ignore"):
        need = -slack[broken, None] / levers[broken]
        for k, sign in enumerate((-1.0, 1.0)):
            reliefs[k] = np.where(sign * levers[broken] > 0.0, sign * need, np.inf).max(axis=0, initial=0.0)
    return float(distance.min(initial=np.inf)), *reliefs
