"""The loop over poses of any limbs behind :func:`exo_pin.reaction.reaction_map`, compiled, without the GIL.

The input are unit quaternions. Each pose is computed by itself, so that the result does not depend on the blocks or on
the number of threads, to the last bit.
"""

from __future__ import annotations

from typing import Any

import numpy as np

from ...core.compiled import kernel
from ...numerics.bounded.box_descent import scratch
from ...numerics.bounded.box_program import GAP_TOLERANCE, least_bounded
from ...numerics.bounded.polytope_program import FEW
from ...numerics.vectors import NOT_SOLVED, SINGULAR, root
from ...wrist.forces.force_kernels import add_open, open_effects, spherical_forces, standalone_forces
from ...wrist.limbs import fill_limbs, largest_radius, pose_status
from ..answer import QUERY_STATUS
from .map_blocks import FX, FY, FZ, LANES, MX, MY, MZ, ROWS, Device, Outputs, Terms, fill_block, pose
from .tension_kernels import NOT_HELD, many_tensions_within, tensions_within

#: Splits.
SPHERICAL, STANDALONE, MINIMAL = 0, 1, 2
#: Status of a pose in which no tensions are within their limits.
INFEASIBLE = QUERY_STATUS.index("infeasible")
#: Where the bounds on g come from: the arrays, or the pose's own |f_i|.
GIVEN, BY_ACTUATOR = 0, 1


@kernel(stack=True)
def map_any(
    q: Any, device: Device, terms: Terms, split: int, bounds: int, lower: Any, upper: Any, low_f: Any, high_f: Any,
    out: Outputs,
) -> None:  # fmt: skip
    """Any split of any number of limbs.

    Parameters
    ----------
    q : ndarray
        Unit quaternions, shape (N, 4), scalar last.
    device, terms, out : NamedTuple
        The mechanism, the query, and the arrays for the results.
    split, bounds : int
        One of the codes above.
    lower, upper : ndarray
        Bounds on g of "minimal", shape (N, n) or (1, n), N.
    low_f, high_f : ndarray
        Limits of f of "spherical", shape (N, n) or (1, n), N, or (0, n) for none. Poses in which no tensions meet them
        get the code :data:`INFEASIBLE`; those in which rounding decides keep the tensions of least norm.
    """
    base, upu = device.base, device.upu
    n, u = base.shape[0], upu.shape[0]
    own = n - 3
    m = own + u
    each = base.shape
    b, s, X, Q, U = np.empty(each), np.empty(each), np.empty(each), np.empty(each), np.empty((3, 3))
    length, reach = np.empty(n), np.empty(n)
    f, g, shoulder = np.empty(n), np.empty(n), np.empty(3)
    N, G, c, z = np.empty((n, own)), np.empty((3, m)), np.empty(3), np.empty(max(m, 1))
    low, high = np.full(m, -np.inf), np.full(m, np.inf)
    work, w, limb_work = scratch(m), np.empty(ROWS * LANES), scratch(n)
    own_G, arms, moment, relief = np.empty((3, own)), np.empty(each), np.empty((2, 3)), np.empty((2, n))
    limited = low_f.shape[0] > 0 and own > 0 and split == SPHERICAL
    radius = largest_radius(device.platform)
    for i in range(q.shape[0]):
        lane = np.uint64(i % LANES)
        if lane == 0:
            fill_block(q, i, terms, w)
        fill_limbs(pose(w, lane), base, device.platform, b, s, X, length, reach)
        status, margin = pose_status(X, reach, upu)
        if status < SINGULAR:
            F = (w[FX + lane], w[FY + lane], w[FZ + lane])
            M = (w[MX + lane], w[MY + lane], w[MZ + lane])
            spherical_forces(s, X, reach, F, M, f, shoulder, Q, U)
            g[:] = 0.0
            if limited:
                row = min(i, low_f.shape[0] - 1)
                if own <= FEW:
                    room = (N, own_G, c, z, arms, moment, relief)
                    found = tensions_within(s, X, reach, M, radius, Q, low_f[row], high_f[row], *room, f, shoulder)
                else:
                    some = (c, arms, moment, relief, limb_work)
                    found = many_tensions_within(s, X, reach, M, radius, low_f[row], high_f[row], *some, f, shoulder)
                if found == NOT_HELD:
                    status = INFEASIBLE
            elif split == STANDALONE:
                if not standalone_forces(s, X, upu, Q, f, g, shoulder, N, G, c, z):
                    status = SINGULAR
            elif split == MINIMAL and m > 0:
                open_effects(s, X, upu, Q, N, G)
                low_row, high_row = min(i, lower.shape[0] - 1), min(i, upper.shape[0] - 1)
                for k in range(u):
                    limit = abs(f[upu[k]])
                    low[own + k] = -limit if bounds == BY_ACTUATOR else lower[low_row, upu[k]]
                    high[own + k] = limit if bounds == BY_ACTUATOR else upper[high_row, upu[k]]
                if least_bounded(shoulder, G, low, high, z, work) <= GAP_TOLERANCE:
                    add_open(upu, N, z, f, g)
                    for j in range(3):
                        for k in range(m):
                            shoulder[j] += G[j, k] * z[k]
                else:
                    status = NOT_SOLVED
        if status >= SINGULAR and status != INFEASIBLE:
            f[:], g[:], shoulder[:] = np.nan, np.nan, np.nan
        if out.shoulder.shape[0]:
            out.shoulder[i] = shoulder
        if out.f.shape[0]:
            out.f[i] = f
        if out.g.shape[0]:
            out.g[i] = g
        if out.status.shape[0]:
            out.status[i] = status
        if out.margin.shape[0]:
            out.margin[i] = margin
        if out.magnitude.shape[0]:
            out.magnitude[i] = root(shoulder[0] ** 2 + shoulder[1] ** 2 + shoulder[2] ** 2)
