"""Friction and stops by trying every active set; of exo_pin only the constraint Jacobian and its drift.

Accelerations of a chain come from one linear system in all coordinates, M a - Jᵀλ - Σ e f = forces with J a = -J̇ v,
with every contact in one of its cases: sticking (a = 0), slipping up or down, or a stop that is left.
"""

import itertools

import numpy as np
import pinocchio as pin


def every_active_set(A, c, low, high, tolerance=1e-8):
    """(f, w) of the first active set that meets the conditions of w = A f + c, or None."""
    for sides in itertools.product((0, -1, 1), repeat=len(c)):
        sides = np.array(sides)
        f = np.where(sides < 0, low, np.where(sides > 0, high, 0.0))
        if not np.isfinite(f).all():
            continue
        free = sides == 0
        if free.any():
            f[free] = np.linalg.lstsq(A[np.ix_(free, free)], -(c + A @ f)[free], rcond=1e-10)[0]
        w = A @ f + c
        inside = (f >= low - tolerance).all() and (f <= high + tolerance).all()
        still = np.abs(w[free]).max(initial=0.0) <= tolerance
        if inside and still and (w[sides < 0] >= -tolerance).all() and (w[sides > 0] <= tolerance).all():
            return f, w
    return None


def contact_acceleration(chain, q, v, forces, contacts, tolerance=1e-8):
    """Acceleration by enumeration.

    ``forces`` are all but those of contacts and gravity; ``contacts`` are (index in v, low, high).
    """
    model, data = chain.model, chain.model.createData()
    M = np.triu(pin.crba(model, data, q))
    M = M + np.triu(M, 1).T
    h = pin.nonLinearEffects(model, data, q, v)
    J, drift = chain.constraint_jacobian(q), chain.constraint_drift(q, v)
    n, rows = model.nv, len(J)
    for cases in itertools.product((0, -1, 1), repeat=len(contacts)):
        given = np.array([[0.0, low, high][case] for case, (_, low, high) in zip(cases, contacts, strict=True)])
        if not np.isfinite(given).all():
            continue
        stuck = [k for k, case in enumerate(cases) if case == 0]
        W = np.zeros((len(stuck), n))
        for row, k in enumerate(stuck):
            W[row, contacts[k][0]] = 1.0
        push = forces - h
        for (index, _, _), force in zip(contacts, given, strict=True):
            push[index] += force
        system = np.block(
            [
                [M, -J.T, -W.T],
                [J, np.zeros((rows, rows + len(stuck)))],
                [W, np.zeros((len(stuck), rows + len(stuck)))],
            ]
        )
        right = np.concatenate([push, -drift, np.zeros(len(stuck))])
        x = np.linalg.lstsq(system, right, rcond=1e-11)[0]
        if np.abs(system @ x - right).max() > tolerance * (1.0 + np.abs(right).max()):
            continue
        a, size = x[:n], 1.0 + np.abs(x[:n]).max()
        # A redundant set of sticking joints has many forces: those found by projection on the ranges will do.
        free = np.linalg.svd(system)[2][np.linalg.matrix_rank(system, 1e-9) :, n + rows :].T
        low, high = (np.array([contacts[k][side] for k in stuck]) for side in (1, 2))
        if not _within(x[n + rows :], free, low, high, tolerance):
            continue
        ways = [a[contacts[k][0]] * case for k, case in enumerate(cases) if case]
        # At the lower end of its force a contact accelerates upwards, at the upper end downwards.
        if all(way >= -tolerance * size for way in ways):
            return a
    return None


def _within(force, free, low, high, tolerance):
    """Whether force + free z lies in its range for some z."""
    from scipy.optimize import linprog

    if not len(force):
        return True
    bounds = [(None if np.isinf(a) else a, None if np.isinf(b) else b) for a, b in zip(low, high, strict=True)]
    if not free.size or np.abs(free).max() < 1e-9:
        return bool(((low - tolerance <= force) & (force <= high + tolerance)).all())
    count = free.shape[1]
    A = np.hstack([np.eye(len(force)), -free])
    found = linprog(np.zeros(len(force) + count), A_eq=A, b_eq=force, bounds=[*bounds, *[(None, None)] * count])
    return found.status == 0
