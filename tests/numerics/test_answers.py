"""Answers of quadratic programs, least forces and smoothed samples, as they are stored."""

import numpy as np
from answers import changes, each_of
from asked_chains import all_tried

from exo_pin.numerics import LeastSquares, judged, least_force, least_forces, solve
from exo_pin.numerics.complementarity import bounded_complementarity
from exo_pin.numerics.cones import fork_tilt, smallest_cone
from exo_pin.numerics.continuation import follow
from exo_pin.numerics.smoothing.smoothing_splines import fit_samples

NONE = np.zeros(0)


def program(seed, rows=4, size=6, equalities=1, limits=3, weak=0.0, width=0.8, endless=True):
    """A program with bounds on some variables, some of them equal, and equalities that a point within them meets."""
    rng = np.random.default_rng(seed)
    E, A, C = (rng.normal(size=(count, size)) for count in (rows, equalities, limits))
    if weak:
        E[:, -1] = E[:, 0] + weak * E[:, 1]
    inside, low = rng.uniform(-width, width, size), -width * np.ones(size)
    high = -low
    low[2] = inside[2]
    if endless:
        low[0], high[1] = -np.inf, np.inf
    high[2] = inside[2] if seed % 2 else width
    return LeastSquares(
        E, 2.0 * rng.normal(size=rows), A, A @ inside, low, high, C, C @ inside + rng.uniform(0.0, 0.3, limits)
    )


def of(solution):
    return [
        solution.z,
        solution.residual,
        np.abs(solution.equality),
        solution.inequality,
        solution.bound,
        solution.unique,
        solution.is_optimal,
        bool(solution.kkt < 1e-12),
        bool(solution.gap < 1e-12),
        bool(solution.residual_gap < 1e-12),
    ]


def judgement(seed):
    """How far candidates are from the optimum."""
    given = program(seed, endless=seed == 7)
    best = solve(given)
    rng = np.random.default_rng(seed)
    z = best.z + 0.1 * rng.normal(size=given.size)
    found = [judged(given, z, np.array([y]), given.c * k) for y, k in ((0.2, 0.0), (-0.4, 0.5), (0.3, -0.2))]
    found += [judged(given, best.z, np.array([0.1]), 0.0 * given.c)]
    return [[*of(one), one.kkt, min(one.gap, 1e6), min(one.residual_gap, 1e6), given.violation(z)] for one in found]


def programs():
    shapes = [
        {},
        {"equalities": 0},
        {"limits": 0},
        {"rows": 8},
        {"rows": 2, "weak": 1e-3},
        {"rows": 3, "equalities": 3},
    ]
    found = {
        f"{k} of {seed}": lambda k=k, seed=seed: of(solve(program(seed, **shapes[k])))
        for k in range(6)
        for seed in range(4)
    }
    found |= {
        f"any {seed}": lambda seed=seed: of(solve(program(seed, rows=3, size=7, limits=0), shortest=False))[1:2]
        for seed in (5, 6)
    }
    found |= {f"judged {seed}": lambda seed=seed: judgement(seed) for seed in (7, 8, 9)}
    inf, on = np.inf, np.array
    endless = LeastSquares(
        on([[-1.0, -2.0, 1.0]]), on([2.0]), np.zeros((0, 3)), NONE, on([-inf, -1.0, -inf]), on([-1.0, inf, 3.0]),
        on([[2.0, 2.0, -2.0], [2.0, 1.0, 0.0], [0.0, -2.0, 0.0]]), on([-9.0, -5.0, 4.0]),
    )  # fmt: skip
    corner = LeastSquares(
        on([[-1.0, -1, 1, 1], [1, 1, -1, -1], [0, -2, -1, -2], [-2, -2, -1, -1], [2, 2, -2, -1], [2, 2, 2, 0]]),
        on([1.0, 1, 2, 2, -2, -1]), on([[0.0, 1, -2, -2], [0, 0, 0, -2]]), on([5.0, 4]), on([-2, -inf, 0, -2]),
        on([inf, 1, 0, -2]), on([[0.0, 0, 1, 2], [-2, 2, 1, 2], [-2, 1, 1, 0], [-2, 0, 2, -1]]), on([-4.0, 2, 5, 6]),
    )  # fmt: skip
    found |= {"endless": lambda: of(solve(endless))[:2], "at a corner": lambda: of(solve(corner))[:2]}
    one = program(3)
    crossed = {
        name: LeastSquares(**(vars(one) | {name: value}))
        for name, value in (
            ("E", one.E * np.nan),
            ("d", one.d * np.inf),
            ("low", one.low * np.nan),
            ("c", one.c * np.nan),
            ("b", one.b + 50.0),
        )
    }
    found |= {f"wrong {name}": lambda name=name: of(solve(crossed[name]))[5:7] for name in crossed}
    found |= {
        "no room": lambda: one.violation(np.zeros(5)),
        "no z": lambda: judged(one, np.zeros(5), np.zeros(1), np.zeros(3)),
        "no y": lambda: judged(one, np.zeros(6), NONE, np.zeros(3)),
        "no n": lambda: judged(one, np.zeros(6), np.zeros(1), NONE),
        "not finite": lambda: of(judged(one, np.full(6, np.nan), np.zeros(1), np.zeros(3)))[5:8],
    }
    return all_tried(**found)


def forces():
    """Least forces of one to six variables: bounds that bind, dependent and weak columns, and what is refused."""
    found = {}
    for size in range(1, 7):
        for seed in range(24):
            rng = np.random.default_rng([size, seed])
            c, G = 20.0 * rng.normal(size=3), rng.normal(size=(3, size))
            most = 12.0 if seed < 6 else 80.0 / size
            low, high = -rng.uniform(0.0, most, size), rng.uniform(0.0, most, size)
            if seed in (1, 7, 8, 9):
                G[:, -1] = 2.0 * G[:, 0]
            if seed in (2, 10, 11):
                low, high = np.zeros(size), np.full(size, np.inf)
            if seed == 3:
                low, high = np.full(size, -np.inf), np.full(size, np.inf)
            if seed % 8 == 6:
                low[-1], high[0] = -np.inf, 0.0
            if seed == 4:
                G[2], low[0] = 1e-7 * G[2], high[0]
            found[f"{size} of {seed}"] = lambda c=c, G=G, low=low, high=high: [
                *least_force(c, G, low, high)[:2],
                least_force(c, G, low, high).unique,
                *least_forces(c[None], G[None], low[None], high[None]),
            ]
    c, G, b = np.ones(3), np.eye(3), np.ones(3)
    return all_tried(
        **found,
        crossed=lambda: least_force(c, G, b, -b),
        crossed_stack=lambda: least_forces(c[None], G[None], np.array([[0.0, 2.0, 0.0]]), b[None]),
        shape=lambda: least_force(c, G, b, np.ones(2)),
        shape_of_force=lambda: least_force(np.ones(2), G, b, b),
        shape_of_effects=lambda: least_forces(c[None], G, b[None], b[None]),
        shape_of_bounds=lambda: least_forces(c[None], G[None], b, b[None]),
        shape_of_upper=lambda: least_forces(c[None], G[None], b[None], b),
        one_force=lambda: least_forces(c, G[None], b[None], b[None]),
        nan=lambda: least_force(c * np.nan, G, -b, b),
        nan_effect=lambda: least_force(c, G * np.nan, -b, b),
        nan_low=lambda: least_force(c, G, b * np.nan, b),
        nan_high=lambda: least_force(c, G, -b, b * np.nan),
        infinite=lambda: least_force(c * np.inf, G, -b, b),
        none=lambda: least_force(0.0 * c, G, -b, b),
        at_rest=lambda: least_force(0.0 * c, 0.0 * G, 0.0 * b, 0.0 * b),
        far=lambda: least_force(1e6 * c, 1e-3 * G, -b, np.inf * b),
    )


def fit(count, spread, gap=0.0, near=1.0, waves=9.0, **known):
    """Every seventh sample of a fit, of a wave that is read with some noise at uneven times."""
    rng = np.random.default_rng(count)
    x = np.arange(float(count)) + rng.uniform(-0.2, 0.2, count)
    x[count // 3 :] += gap
    x[3] = x[2] + near * (x[3] - x[2])
    x = (x - x[0]) * (count - 1) / (x[-1] - x[0])
    y = np.stack([np.sin(waves * x / count), np.cos(5.0 * x / count) ** 3], axis=1) + spread * rng.normal(
        size=(count, 2)
    )
    found = fit_samples(x, y, **({"components": 2} | known))
    return found.values[:, ::7], found.noise, found.covariance[::7], found.penalty, found.roughness(0.3)


def fits():
    return {
        "few": fit(11, 0.1),
        "fewest": fit(12, 0.1),
        "five": fit(5, 0.1)[0],
        "none": fit(40, 0.0)[:2],
        "smooth": fit(47, 0.02),
        "rough": fit(96, 0.3),
        "rougher": fit(200, 2.0),
        "one component": fit(47, 0.02, components=1),
        "known": fit(47, 0.02, noise=0.05),
        "no noise": fit(47, 0.02, noise=0.0),
        "from rest": [np.round(part, 3) for part in fit(60, 0.05, rest=True)[:3]],
        "with a gap": fit(60, 0.03, gap=9.0),
        "steep with a gap": fit(40, 1e-4, gap=9.0, waves=40.0),
        "two at once": fit(60, 0.03, near=0.2),
        "almost the same time": fit(60, 0.03, near=1e-7),
    }


def followed(residual, slope, rate, scale=(1.0,), count=1, **start):
    """Ends of paths, and how often and at which λ the equations were asked on the way."""
    tried = []

    def equations(rows, x, at):
        tried.extend(at)
        return residual(rows, x, at[:, None]), slope(x)[:, :, None] * np.eye(len(scale)), rate(rows, x, at[:, None])

    return [
        *follow(equations, np.arange(count), np.array(scale), **start),
        len(tried),
        np.unique(tried)[-6:],
        sum(tried),
    ]


def paths():
    """Corrections that are each q times the one before, just below and above each limit; folds; what is linear."""

    def curved(most, q, start=0.0, **more):
        # The first correction is ``most``, the Jacobian too large by 1/(1 - q).
        c = most / (1.0 - q)
        return followed(
            lambda rows, x, at: x - c * (at - start) ** 2,
            lambda x: 0.0 * x + 1.0 / (1.0 - q),
            lambda rows, x, at: 0.0 * x - 2.0 * c * (at - start),
            start=start,
            **more,
        )

    c, slopes = np.array([[0.2], [0.3], [0.249], [np.nan]]), np.array([1.0, 2.0])
    limits = [(0.0295, 0.0), (0.0305, 0.0), (3e-7, 0.34), (3e-7, 0.36), (0.02, 0.06), (0.0235, 0.06), (0.02, 0.0625)]
    return {
        **{f"{most} by {q}": curved(most, q) for most, q in limits},
        **{f"last {share}": curved(share * 1e-2, 1e-2) for share in (0.95, 1.1)},
        "later": curved(0.07, 0.01, start=0.25),
        "wide": curved(0.07, 0.01, scale=(2.5,)),
        "folds": followed(
            lambda rows, x, at: x - x**2 - at * c[rows], lambda x: 1.0 - 2.0 * x, lambda rows, x, at: 0.0 * x - c[rows],
            count=4,
        ),
        "linear": followed(
            lambda rows, x, at: slopes * x - [0.02, 5.0] * at**2,
            lambda x: 0.0 * x + slopes,
            lambda rows, x, at: 0.0 * x - [0.04, 10.0] * at,
            scale=(1.0, np.inf),
        ),
    }  # fmt: skip


def bounded():
    """Forces within bounds of which some depend on each other, some cannot move and some are held."""
    found = {}
    for seed in range(24):
        rng = np.random.default_rng(seed)
        n, k = int(rng.integers(2, 8)), int(rng.integers(1, 6))
        B = 10.0 ** rng.uniform(-3, 3, (n, 1)) * rng.normal(size=(n, k))
        if seed % 4 == 1:
            B[0] = 0.0
        c = B @ rng.normal(size=k) + (seed % 3 == 0) * 0.3 * rng.normal(size=n) * np.abs(B).max(axis=1)
        size = 1.0 / np.maximum(np.abs(B).max(axis=1), 1e-3)
        low, high = -rng.uniform(0, 1, n) * size, rng.uniform(0, 1, n) * size
        low[rng.random(n) < 0.2], high[rng.random(n) < 0.3] = 0.0, np.inf
        if seed % 5 == 2:
            high[-1] = low[-1]
        found[f"{seed}"] = lambda B=B, c=c, low=low, high=high: of_bounded(B @ B.T, c, low, high)
    return all_tried(**found, skew=lambda: of_bounded(np.triu(np.ones((2, 2))), -np.ones(2), -np.ones(2), np.ones(2)))


def of_bounded(*given):
    one = bounded_complementarity(*given)
    if not one.bounded:
        return [False]
    return [
        np.where(one.unique, one.force, 0.0),
        np.where(np.abs(one.rate) > 1e-9, one.rate, 0.0),
        one.unique,
        bool(one.residual < 1e-11),
    ]


def held_directions():
    """Cones and forks that hold directions on a part of a ball, of all its sides, and one alone."""
    rng = np.random.default_rng(4)
    ways = rng.normal(size=(2300, 3)) * [0.2, 0.5, 0.1] + [0.3, 0.0, 0.9]
    ways /= np.linalg.norm(ways, axis=1, keepdims=True)
    return [[*cone(some)] for cone in (smallest_cone, fork_tilt) for some in (ways, ways[:40], ways[:1])]


ASKED = {
    "paths": paths,
    "bounded": bounded,
    "held_directions": held_directions,
    "programs": programs,
    "forces": forces,
    "fits": fits,
}


@each_of(ASKED)
def test_an_answer_is_as_stored(name):
    assert not changes(__file__, name, ASKED[name])
