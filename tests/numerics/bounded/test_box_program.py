"""The exact active-set method against enumeration, ProxSuite and LAPACK."""

import itertools

import numpy as np
import pytest
from proxsuite import proxqp

from exo_pin.numerics import least_forces
from exo_pin.numerics.small_linear import least_norm

EPS = np.finfo(float).eps


def enumerated(c, G, low, high):
    """Least |c + G z| and, of those, least |z|, by trying every set of variables on their bounds, all at once."""
    pattern = np.array(list(itertools.product((-1, 0, 1), repeat=G.shape[1])))
    free = pattern == 0
    z = np.where(pattern < 0, low, np.where(pattern > 0, high, 0.0))
    finite = np.isfinite(z).all(axis=1)
    free, z = free[finite], z[finite]
    # The columns of variables on their bounds are zero, so that the shortest solution leaves these out.
    z = z - np.einsum("kij,kj->ki", np.linalg.pinv(G * free[:, None, :], rcond=1e-12), c + z @ G.T)
    z = z[((z >= low - 1e-11) & (z <= high + 1e-11)).all(axis=1)]
    force, norm = np.linalg.norm(c + z @ G.T, axis=1), np.linalg.norm(z, axis=1)
    least = force.min()
    return least, z[np.argmin(np.where(force < least + 1e-10, norm, np.inf))]


def solve(c, G, low, high):
    answer = least_forces(c[None], G[None], low[None], high[None])
    return answer.variables[0], answer.forces[0], answer.gaps[0]


def general(rng, m):
    G = rng.normal(size=(3, m))
    return rng.normal(size=3) * 3, G, -rng.random(m), rng.random(m)


def integer(rng, m):
    """Ties, parallel columns, vertices that are hit exactly, variables that cannot move."""
    low = -rng.integers(0, 3, size=m).astype(float)
    G = rng.integers(-1, 2, size=(3, m)).astype(float)
    return rng.integers(-3, 4, size=3).astype(float), G, low, low + rng.integers(0, 4, size=m)


def flat(rng, m):
    """Columns in a plane, and a least force that is zero exactly at a vertex."""
    G = rng.normal(size=(3, 2)) @ rng.normal(size=(2, m))
    low, high = -rng.random(m), rng.random(m)
    return -G @ np.where(rng.random(m) < 0.5, low, high), G, low, high


def half_open(rng, m):
    c, G, low, high = general(rng, m)
    G[:, m // 2] = G[:, 0]
    low[rng.random(m) < 0.3] = -np.inf
    high[rng.random(m) < 0.3] = np.inf
    return c, G, low, high


@pytest.mark.parametrize("count", [150, pytest.param(500, marks=pytest.mark.full)])
@pytest.mark.parametrize("kind", [general, integer, flat, half_open])
def test_force_and_shortest_variables_equal_enumeration(kind, count):
    rng = np.random.default_rng(60)
    for _ in range(count):
        m = int(rng.integers(1, 6))
        c, G, low, high = kind(rng, m)
        z, force, gap = solve(c, G, low, high)
        best, shortest = enumerated(c, G, low, high)
        assert gap <= 1e-9
        assert ((low <= z) & (z <= high)).all()
        np.testing.assert_allclose(np.linalg.norm(force), best, atol=1e-9)
        # Least force and least norm together leave one answer; enumeration takes the force to 1e-10 only.
        np.testing.assert_allclose(z, shortest, atol=1e-5)
        assert np.linalg.norm(z) <= np.linalg.norm(shortest) + 1e-8


def test_weak_directions():
    """Columns that nearly depend on one another: tiny gradients, but a long way to go."""
    rng = np.random.default_rng(61)
    for _ in range(500):
        m = int(rng.integers(3, 6))
        c, G, low, high = general(rng, m)
        G[:, 2] = G[:, :2] @ rng.normal(size=2) + 10 ** rng.uniform(-16, -1) * rng.normal(size=3)
        low, high = 20 * low, 20 * high
        if rng.random() < 0.2:
            high[0] = np.inf
        _, force, gap = solve(c, G, low, high)
        best, _ = enumerated(c, G, low, high)
        assert abs(np.linalg.norm(force) - best) <= 1e-8 * np.linalg.norm(c)
        assert gap <= 1e-8


def seeded_programs(count):
    """Programs of three side forces as a map meets them, a tenth of them near the singular surface, some one-sided."""
    rng = np.random.default_rng(63)
    G = rng.normal(size=(count, 3, 3))
    tenth = count // 10
    G[:tenth, :, 2] = np.einsum("kij,kj->ki", G[:tenth, :, :2], rng.normal(size=(tenth, 2)))
    G[:tenth, :, 2] += 10 ** rng.uniform(-4, -1, size=(tenth, 1)) * rng.normal(size=(tenth, 3))
    G /= np.linalg.norm(G, axis=1, keepdims=True)
    c = rng.normal(size=(count, 3)) * 20
    low = -20 * rng.random((count, 3))
    high = 20 * rng.random((count, 3))
    low[tenth : 2 * tenth, 0] = 0.0
    high[2 * tenth : 3 * tenth, 1] = low[2 * tenth : 3 * tenth, 1]
    return c, G, low, high


@pytest.mark.parametrize("count", [5_000, pytest.param(100_000, marks=pytest.mark.long)])
def test_seeded_programs_against_proxsuite(count):
    """The force, which is unique; not z, which ProxQP's tolerance leaves loose in weak directions.

    ProxQP's force of z clipped to the bounds is attainable, so it cannot be less; and by strict convexity of |force|²
    what it is more bounds the distance: |F' - F|² <= |F'|² - |F|².
    """
    batch = 5_000
    c, G, low, high = seeded_programs(count)
    answer = least_forces(c, G, low, high)
    assert answer.gaps.max() <= 1e-10
    assert ((low <= answer.variables) & (answer.variables <= high)).all()
    scale = np.maximum(np.abs(c).max(axis=1), np.maximum(-low, high).max(axis=1))
    z = np.empty((count, 3))
    weights, nothing = np.diag([1.0, 1, 1, 0, 0, 0]), np.zeros(6)
    C = np.hstack([np.zeros((3, 3)), np.eye(3)])
    for start in range(0, count, batch):
        programs = proxqp.dense.BatchQP()
        for k in range(start, start + batch):
            program = programs.init_qp_in_place(6, 3, 3)
            program.settings.eps_abs = 1e-10
            program.settings.eps_rel = 0.0
            # Its residuals do not see a multiplier on a bound that is not reached; the gap does.
            program.settings.check_duality_gap = True
            program.settings.eps_duality_gap_abs = 1e-10
            program.settings.eps_duality_gap_rel = 0.0
            A = np.hstack([np.eye(3), -G[k]])
            program.init(weights, nothing, A, c[k] / scale[k], C, low[k] / scale[k], high[k] / scale[k])
        proxqp.dense.solve_in_parallel(programs, 2)
        for k in range(batch):
            z[start + k] = programs.get(k).results.x[3:]
    other = c + np.einsum("kji,ki->kj", G, np.clip(z * scale[:, None], low, high))
    size, reached = np.linalg.norm(other, axis=1), np.linalg.norm(answer.forces, axis=1)
    assert (reached <= size + 1e-12 * scale).all()
    # It stops at residuals of 1e-10 with variables up to 2 away in each of three directions (all in units of the
    # scale): ½|F'|² - ½|F|² is at most √3 · 2 · 1e-10 for the gradient and √3 · 1e-10 · |F'| for the clipping.
    more = (size**2 - reached**2) / scale**2
    assert more.max() <= 2e-9
    assert (((other - answer.forces) ** 2).sum(axis=1) / scale**2).max() <= 2e-9
    # Away from the singular surface and from a vanishing force it is nearer.
    clear = (np.linalg.svd(G, compute_uv=False)[:, 2] > 0.1) & (reached > 0.1 * scale)
    assert clear.sum() > count // 10
    assert (np.linalg.norm(other - answer.forces, axis=1) / scale)[clear].max() <= 1e-7


def test_least_norm_equals_lapack_for_every_rank():
    rng = np.random.default_rng(66)
    for k in range(3000):
        m = int(rng.integers(1, 9))
        G = rng.integers(-1, 2, size=(3, m)).astype(float)
        if k % 2:
            G = rng.normal(size=(3, 2)) @ rng.normal(size=(2, m)) if k % 4 == 1 else rng.normal(size=(3, m))
        c, z = rng.normal(size=3), np.empty(m)
        rank = least_norm(G.copy(), c.copy(), z, 1e-12)
        expected, _, lapack_rank, values = np.linalg.lstsq(G, -c, rcond=1e-12)
        assert rank == lapack_rank
        condition = values[0] / values[rank - 1] if rank else 1.0
        np.testing.assert_allclose(z, expected, atol=1e3 * EPS * condition**2 * (1 + np.abs(expected).max()))
