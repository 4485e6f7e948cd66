"""Loops over poses behind :func:`exo_pin.reaction.reaction_map`, compiled, without the interpreter's lock.

They take unit quaternions and build the matrices as they go. Each pose is computed by itself, so neither the way a
stack is cut nor the number of threads changes a bit of the answer.
"""

from __future__ import annotations

from typing import Any, NamedTuple

import numpy as np
from numba import njit

from ..wrist.formulas import (
    NOT_SOLVED,
    SINGULAR,
    along_normals,
    applied_load,
    gram,
    inertia_load,
    limb,
    matrix,
    root,
    rotation_matrix,
    second_invariant,
    status_code,
    triple,
    turn,
    vector,
    weight_load,
)
from ..wrist.kernels import (
    add_open,
    fill_limbs,
    largest_radius,
    open_effects,
    pose_status,
    spherical_forces,
    standalone_forces,
)
from .active_set import GAP_TOLERANCE, least_bounded
from .shortest import workspace
from .stiffness import elastic_forces, side_stiffness

__all__ = ["BY_ACTUATOR", "ELASTIC", "GIVEN", "MINIMAL", "SPHERICAL", "STANDALONE", "Device", "Outputs", "Terms"]

#: Splits.
SPHERICAL, STANDALONE, MINIMAL, ELASTIC = 0, 1, 2, 3
#: Where the bounds on g come from: the arrays, or the pose's own |f_i|.
GIVEN, BY_ACTUATOR = 0, 1

#: Poses worked on together: few enough for their numbers to stay in the nearest cache.
_LANES = 64
#: Rows of a block of three limbs: quaternion, force and moment in; then f, g, F_s, status, margin and |F_s| out.
_ROWS = 22
# Where the rows begin. Unsigned numbers spare the compiler the case of an index that counts from the end, without
# which it does not work on several poses at once.
_FX, _FY, _FZ, _MX, _MY, _MZ = (np.uint64(row * _LANES) for row in range(6))
_F1, _F2, _F3, _G1, _G2, _G3, _SX, _SY, _SZ = (np.uint64(row * _LANES) for row in range(6, 15))
_STATUS, _MARGIN, _SIZE = (np.uint64(row * _LANES) for row in range(15, 18))
_QX, _QY, _QZ, _QW = (np.uint64(row * _LANES) for row in range(18, 22))
_X, _Y, _Z, _W = (np.uint64(column) for column in range(4))

_compile = njit(cache=True, error_model="numpy", nogil=True)
_inline = njit(cache=True, error_model="numpy", nogil=True, forceinline=True)


class Device(NamedTuple):
    """A mechanism as arrays: joint centres (n, 3), indices of the UPU limbs, guides (n, 4), K_s (3, 3)."""

    base: Any
    platform: Any
    upu: Any
    guides: Any
    shoulder: Any


class Terms(NamedTuple):
    """Arm, motion and load. Arrays of the last five have one row a pose, or a single row for all of them."""

    mass: float
    centre: Any
    inertia: Any
    gravity: Any
    moving: bool
    loaded: bool
    in_arm: bool
    velocity: Any
    acceleration: Any
    force: Any
    couple: Any
    at: Any


class Outputs(NamedTuple):
    """Where the answers go, one row a pose; an array without rows is not filled."""

    shoulder: Any
    f: Any
    g: Any
    status: Any
    margin: Any
    magnitude: Any


@_compile
def _pose(w: Any, k: Any) -> Any:
    return rotation_matrix(w[_QX + k], w[_QY + k], w[_QZ + k], w[_QW + k])


@_compile
def _weigh(lanes: Any, mass: float, centre: Any, gravity: Any, w: Any) -> None:
    """Fill force and moment of a block with those of the arm's weight."""
    c, down = vector(centre, 0), vector(gravity, 0)
    for k in range(lanes):
        _, F, M = weight_load(_pose(w, k), mass, c, down)
        w[_FX + k], w[_FY + k], w[_FZ + k] = F
        w[_MX + k], w[_MY + k], w[_MZ + k] = M


@_inline
def _add(w: Any, k: Any, F: Any, M: Any) -> None:
    w[_FX + k] += F[0]
    w[_FY + k] += F[1]
    w[_FZ + k] += F[2]
    w[_MX + k] += M[0]
    w[_MY + k] += M[1]
    w[_MZ + k] += M[2]


@_compile
def _accelerate(
    lanes: Any, start: int, mass: float, centre: Any, inertia: Any, velocity: Any, acceleration: Any, w: Any
) -> None:
    """Add the arm's inertia to force and moment of a block."""
    c, I = vector(centre, 0), matrix(inertia)  # noqa: E741
    step_v, step_a = min(velocity.shape[0] - 1, 1), min(acceleration.shape[0] - 1, 1)
    for k in range(lanes):
        i = start + np.int64(k)
        R = _pose(w, k)
        F, M = inertia_load(R, mass, turn(R, c), I, vector(velocity, i * step_v), vector(acceleration, i * step_a))
        _add(w, k, F, M)


@_compile
def _pull(lanes: Any, start: int, force: Any, couple: Any, at: Any, in_arm: bool, w: Any) -> None:
    """Add a load on the arm to force and moment of a block."""
    step_f, step_c, step_at = min(force.shape[0] - 1, 1), min(couple.shape[0] - 1, 1), min(at.shape[0] - 1, 1)
    for k in range(lanes):
        i = start + np.int64(k)
        at_k = vector(at, i * step_at)
        F, M = applied_load(_pose(w, k), vector(force, i * step_f), vector(couple, i * step_c), at_k, in_arm)
        _add(w, k, F, M)


@_inline
def _fill_block(q: Any, start: int, terms: Terms, w: Any) -> Any:
    """Poses of the block that begins at ``start``, and what limbs and shoulder carry there; returns their number."""
    lanes = np.uint64(min(_LANES, q.shape[0] - start))
    block = q[start:]
    for k in range(lanes):
        w[_QX + k], w[_QY + k], w[_QZ + k], w[_QW + k] = block[k, _X], block[k, _Y], block[k, _Z], block[k, _W]
    _weigh(lanes, terms.mass, terms.centre, terms.gravity, w)
    if terms.moving:
        _accelerate(lanes, start, terms.mass, terms.centre, terms.inertia, terms.velocity, terms.acceleration, w)
    if terms.loaded:
        _pull(lanes, start, terms.force, terms.couple, terms.at, terms.in_arm, w)
    return lanes


@_compile
def _three_limbs(lanes: Any, base: Any, platform: Any, per_radius: float, standalone: bool, w: Any) -> None:
    """One block of poses of three limbs, without bounds or elasticity.

    It has no branch and calls no function, so that poses are done side by side.
    """
    a1, a2, a3 = vector(base, 0), vector(base, 1), vector(base, 2)
    p1, p2, p3 = vector(platform, 0), vector(platform, 1), vector(platform, 2)
    side, rest = (1.0, 0.0) if standalone else (0.0, 1.0)
    for k in range(lanes):
        R = _pose(w, k)
        _, s1, X1, _, h1, folded1 = limb(R, a1, p1)
        _, s2, X2, _, h2, folded2 = limb(R, a2, p2)
        _, s3, X3, _, h3, folded3 = limb(R, a3, p3)
        w1, w2, w3 = h1 * per_radius, h2 * per_radius, h3 * per_radius
        G1, G2, G3 = gram(X1, w1), gram(X2, w2), gram(X3, w3)
        second = second_invariant(
            (
                G1[0] + G2[0] + G3[0],
                G1[1] + G2[1] + G3[1],
                G1[2] + G2[2] + G3[2],
                G1[3] + G2[3] + G3[3],
                G1[4] + G2[4] + G3[4],
                G1[5] + G2[5] + G3[5],
            )
        )
        volume = triple(X1, X2, X3) * w1 * w2 * w3
        margin = root(volume * volume / second)
        margin = margin if second > 0.0 else 0.0
        code = status_code(folded1 | folded2 | folded3, margin)
        y = along_normals((w[_MX + k], w[_MY + k], w[_MZ + k]), X1, X2, X3)
        f1, f2, f3 = y[0] / h1, y[1] / h2, y[2] / h3
        Sx = f1 * s1[0] + f2 * s2[0] + f3 * s3[0] - w[_FX + k]
        Sy = f1 * s1[1] + f2 * s2[1] + f3 * s3[1] - w[_FY + k]
        Sz = f1 * s1[2] + f2 * s2[2] + f3 * s3[2] - w[_FZ + k]
        g = along_normals((Sx, Sy, Sz), X1, X2, X3)
        blank = np.nan if code >= SINGULAR else 0.0
        Sx, Sy, Sz = rest * Sx + blank, rest * Sy + blank, rest * Sz + blank
        w[_F1 + k], w[_F2 + k], w[_F3 + k] = f1 + blank, f2 + blank, f3 + blank
        w[_G1 + k], w[_G2 + k], w[_G3 + k] = side * g[0] + blank, side * g[1] + blank, side * g[2] + blank
        w[_SX + k], w[_SY + k], w[_SZ + k] = Sx, Sy, Sz
        w[_STATUS + k], w[_MARGIN + k], w[_SIZE + k] = float(code), margin, root(Sx * Sx + Sy * Sy + Sz * Sz)


@_inline
def _copy_vectors(w: Any, x: Any, y: Any, z: Any, start: int, lanes: Any, out: Any) -> None:
    if out.shape[0]:
        block = out[start:]
        for k in range(lanes):
            block[k, _X], block[k, _Y], block[k, _Z] = w[x + k], w[y + k], w[z + k]


@_inline
def _copy_numbers(w: Any, row: Any, start: int, lanes: Any, out: Any) -> None:
    if out.shape[0]:
        block = out[start:]
        for k in range(lanes):
            block[k] = w[row + k]


@_compile
def map_three(q: Any, device: Device, terms: Terms, standalone: bool, out: Outputs) -> None:
    """Splits "spherical" and "standalone" of three limbs.

    Parameters
    ----------
    q : ndarray
        Unit quaternions, shape (N, 4), scalar last.
    device, terms, out : NamedTuple
        What is asked, and where the answers go.
    standalone : bool
        Whether F_s = 0 is asked for (three UPU limbs), else g = 0.
    """
    count = q.shape[0]
    w = np.empty(_ROWS * _LANES)
    per_radius = 1.0 / largest_radius(device.platform)
    for start in range(0, count, _LANES):
        lanes = _fill_block(q, start, terms, w)
        _three_limbs(lanes, device.base, device.platform, per_radius, standalone, w)
        _copy_vectors(w, _SX, _SY, _SZ, start, lanes, out.shoulder)
        _copy_vectors(w, _F1, _F2, _F3, start, lanes, out.f)
        _copy_vectors(w, _G1, _G2, _G3, start, lanes, out.g)
        _copy_numbers(w, _STATUS, start, lanes, out.status)
        _copy_numbers(w, _MARGIN, start, lanes, out.margin)
        _copy_numbers(w, _SIZE, start, lanes, out.magnitude)


@_compile
def map_any(
    q: Any, device: Device, terms: Terms, split: int, bounds: int, lower: Any, upper: Any, out: Outputs
) -> None:
    """Any split of any number of limbs.

    Parameters
    ----------
    q : ndarray
        Unit quaternions, shape (N, 4), scalar last.
    device, terms, out : NamedTuple
        What is asked, and where the answers go.
    split, bounds : int
        One of the codes above.
    lower, upper : ndarray
        Bounds on g of "minimal", shape (N, n) or (1, n), N.
    """
    base, upu = device.base, device.upu
    n, u = base.shape[0], upu.shape[0]
    own = n - 3
    m = own + u
    b, s, X, Q, U = np.empty((n, 3)), np.empty((n, 3)), np.empty((n, 3)), np.empty((n, 3)), np.empty((3, 3))
    length, reach, stiffness = np.empty(n), np.empty(n), np.zeros(n)
    f, g, shoulder = np.empty(n), np.empty(n), np.empty(3)
    N, G, c, z = np.empty((n, own)), np.empty((3, m)), np.empty(3), np.empty(m)
    low, high = np.full(m, -np.inf), np.full(m, np.inf)
    work, w = workspace(m), np.empty(_ROWS * _LANES)
    radius = largest_radius(device.platform)
    for i in range(q.shape[0]):
        lane = np.uint64(i % _LANES)
        if lane == 0:
            _fill_block(q, i, terms, w)
        fill_limbs(_pose(w, lane), base, device.platform, b, s, X, length, reach)
        status, margin = pose_status(X, reach, upu, radius)
        if status < SINGULAR:
            F = (w[_FX + lane], w[_FY + lane], w[_FZ + lane])
            M = (w[_MX + lane], w[_MY + lane], w[_MZ + lane])
            spherical_forces(s, X, reach, F, M, f, shoulder, Q, U)
            g[:] = 0.0
            if split == STANDALONE:
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
            elif split == ELASTIC:
                for k in range(u):
                    j = upu[k]
                    stiffness[j] = side_stiffness(
                        vector(base, j), vector(b, j), vector(s, j), length[j], reach[j], device.guides[j]
                    )
                if not elastic_forces(X, stiffness, device.shoulder, g, shoulder):
                    status = NOT_SOLVED
        if status >= SINGULAR:
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
