"""Limb and side forces within limits: optimality, exhaustive answers, and proofs that none fits."""

import itertools

import numpy as np
import pytest
from programs import KINDS, Problem
from scipy.linalg import null_space
from scipy.optimize import linprog, nnls


def stationarity(problem, z):
    """Distance of the cost's gradient from the cone of active constraints, by nonnegative least squares.

    Shares nothing with the solver but the problem: constraints count as active by their slack alone.
    """
    scale, near = problem.scale, 1e-8
    z, force = z / scale, problem.force(z) / scale
    S = problem.effect
    gradient = z.copy() if problem.goal is None else S.T @ problem.goal.T @ problem.goal @ force
    if problem.goal is not None:
        gradient[: problem.n] += problem.tension * z[: problem.n]
    arms = problem.arms.T / problem.radius
    columns = [arms, -arms]
    if problem.kind == "alone":
        columns += [S.T, -S.T]
    columns.append(np.eye(len(z))[:, z >= problem.high / scale - near])
    columns.append(-np.eye(len(z))[:, z <= problem.low / scale + near])
    rows = problem.side_rows()
    columns.append(rows[rows @ z >= -near].T)
    if problem.cone is not None:
        columns.append((problem.N @ S)[problem.N @ force >= problem.h / scale - near].T)
    return nnls(np.hstack(columns), -gradient, maxiter=1000)[1]


def violation(problem, z):
    """Largest violation of any constraint over the forces in play."""
    force = problem.force(z)
    misses = [
        np.abs(problem.arms @ z - problem.moment).max() / problem.radius,
        (problem.low - z).max(),
        (z - problem.high).max(),
        (problem.side_rows() @ z).max(initial=0.0),
    ]
    if problem.kind == "alone":
        misses.append(np.abs(force).max())
    if problem.kind == "hard_cone":
        misses.append((problem.N @ force - problem.h).max())
    return max(misses) / problem.scale


@pytest.mark.parametrize("kind", KINDS)
@pytest.mark.parametrize(
    "count", [16, pytest.param(100, marks=pytest.mark.full), pytest.param(1000, marks=pytest.mark.long)]
)
def test_forces_of_every_kind_are_optimal_or_proven_infeasible(kind, count):
    rng, held, proven = np.random.default_rng([50, KINDS.index(kind)]), 0, 0
    for case in range(count):
        problem = Problem(rng, kind, reachable=True if kind in ("hard_cone", "alone") and case % 3 else None)
        answer = problem.answer()
        if not answer.held:
            proven += 1
            missing = answer.infeasibility
            assert missing.required > missing.available
            assert missing.valid_up_to > 1e6  # N
            continue
        held += 1
        z, best = problem.forces(answer), answer.optimum
        assert answer.residual <= 1e-9
        np.testing.assert_allclose(answer.shoulder_force, problem.force(z), atol=1e-9 * problem.scale)
        assert best.kkt <= 1e-8
        assert best.gap <= 1e-6 * problem.scale
        assert violation(problem, z) <= 1e-8
        if kind == "soft_cone":
            continue
        assert stationarity(problem, z) <= 1e-6 * max(1.0, problem.tension)
        # A random step along what balances, as far as the limits let it, never lowers the cost.
        balancing = problem.arms if kind != "alone" else np.vstack([problem.arms, problem.effect])
        free = null_space(balancing)
        for _ in range(10):
            other = z + free @ rng.normal(size=free.shape[1]) * problem.scale * 1e-3
            if violation(problem, other) <= 0.0:
                assert problem.cost(other) >= problem.cost(z) - 1e-9 * problem.scale**2
    assert held >= count // 4
    assert proven >= count // 20


def exhaustive(problem):
    """Least cost by trying every active set of limits and faces."""
    scale, n, S = problem.scale, problem.n, problem.effect
    count = n + problem.u
    low, high = problem.low / scale, problem.high / scale
    E = np.vstack([problem.goal @ S, np.sqrt(problem.tension) * np.eye(n, count)])
    d = np.concatenate([-problem.goal @ problem.shoulder / scale, np.zeros(n)])
    A, b = problem.arms / problem.radius, problem.moment / problem.radius / scale
    C, c = np.zeros((0, count)), np.zeros(0)
    if problem.cone is not None:
        C, c = problem.N @ S, (problem.h - problem.N @ problem.shoulder) / scale
    faces = [subset for size in range(min(3, len(c)) + 1) for subset in itertools.combinations(range(len(c)), size)]
    best = np.inf
    for pattern in itertools.product((-1, 0, 1), repeat=count):
        pattern = np.array(pattern)
        bound = np.where(pattern < 0, low, np.where(pattern > 0, high, 0.0))
        if not np.isfinite(bound).all():
            continue
        fixed = pattern != 0
        for subset in faces:
            rows = np.vstack([A, np.eye(count)[fixed], C[list(subset)]])
            right = np.concatenate([b, bound[fixed], c[list(subset)]])
            k = len(right)
            K = np.block([[E.T @ E, rows.T], [rows, np.zeros((k, k))]])
            z = np.linalg.lstsq(K, np.concatenate([E.T @ d, right]), rcond=1e-12)[0][:count]
            miss = max(np.abs(A @ z - b).max(), (low - z).max(), (z - high).max(), (C @ z - c).max(initial=0.0))
            if miss <= 1e-9:
                best = min(best, float(((E @ z - d) ** 2).sum()))
    return scale * np.sqrt(best)


@pytest.mark.parametrize(
    ("kind", "cases", "u", "faces"),
    [("pull", 20, 1, None), ("range", 10, 1, None), ("tight", 10, 1, None), ("weights", 10, 1, None),
     ("hard_cone", 4, 0, 4)],
)  # fmt: skip
def test_least_shoulder_force_equals_an_exhaustive_answer(kind, cases, u, faces):
    rng, done = np.random.default_rng(51), 0
    while done < cases:
        problem = Problem(rng, kind, n=4, u=u, faces=faces, reachable=True)
        answer = problem.answer()
        if not answer.held:
            continue
        done += 1
        found = np.sqrt(problem.cost(problem.forces(answer)))
        assert abs(found - exhaustive(problem)) <= 1e-8 * problem.scale


@pytest.mark.parametrize("kind", ["range", "pull", "by_tension", "hard_cone", "alone"])
@pytest.mark.parametrize("count", [6, pytest.param(40, marks=pytest.mark.full)])
def test_farkas_directions_hold_without_the_solver(count, kind):
    """y·needed stands above y·supplied for all admissible forces: by the support of the limits, rays of the cone,
    and a linear program of its own that finds the pose infeasible as well.
    """
    rng, found = np.random.default_rng(53), 0
    while found < count:
        problem = Problem(rng, kind, faces=12, reachable=False)
        answer = problem.answer()
        missing = answer.infeasibility
        if missing is None:
            continue
        found += 1
        y, scale, n, u = missing.direction, problem.scale, problem.n, problem.u
        # Limbs pull the arm with -effect z and -arms z; balance needs the opposite of the load.
        per = -y[:3] @ problem.effect - y[3:] @ problem.arms
        needed = np.append(problem.shoulder, -problem.moment)
        most = 0.0
        if kind not in ("hard_cone", "alone"):
            np.testing.assert_array_equal(y[:3], 0)
        if kind == "hard_cone":
            N, h = problem.N, problem.h
            apex = np.linalg.lstsq(N, h, rcond=None)[0]
            np.testing.assert_allclose(N @ apex, h, atol=1e-9 * (1 + h.max()))
            rays = np.cross(N, np.roll(N, -1, axis=0))
            rays *= -np.sign(rays @ N.sum(axis=0))[:, None]
            assert (N @ rays.T <= 1e-12).all()
            assert (rays @ y[:3]).max() <= 1e-9
            most = y[:3] @ apex
        for each, below, above in zip(per, problem.low, problem.high, strict=True):
            reach = above if each > 0 else below
            if np.isinf(reach):
                assert abs(each) <= 1e-9
            else:
                most += each * reach
        assert y @ needed > most + 1e-12 * scale
        np.testing.assert_allclose(y @ needed, missing.required, rtol=1e-9, atol=1e-9 * scale)
        np.testing.assert_allclose(most, missing.available, atol=1e-7 * scale)
        # The closest forces keep every limit and miss exactly what is said.
        f, g = missing.closest_actuator_forces, missing.closest_constraint_forces
        assert (f >= problem.f_low).all()
        assert (f <= problem.f_high).all()
        assert kind != "by_tension" or (np.abs(g) <= f + 1e-9 * scale).all()
        z = np.append(f, g[:u])
        supplied = np.append(missing.closest_shoulder_force - problem.effect @ z, -problem.arms @ z)
        np.testing.assert_allclose(needed - supplied, missing.missing_wrench, atol=1e-8 * scale)
        # HiGHS agrees that nothing admissible balances.
        T = np.hstack([np.vstack([-problem.effect, -problem.arms]), np.eye(6, 3)])
        shoulder = [(0, 0) if kind == "alone" else (None, None)] * 3
        cone = {}
        if kind == "hard_cone":
            cone = {"A_ub": np.hstack([np.zeros((len(h), n + u)), N]), "b_ub": h}
        elif kind == "by_tension":
            cone = {"A_ub": np.hstack([problem.side_rows(), np.zeros((2 * u, 3))]), "b_ub": np.zeros(2 * u)}
        limits = [*zip(problem.low, problem.high, strict=True), *shoulder]
        answer = linprog(np.zeros(n + u + 3), A_eq=T, b_eq=needed, bounds=limits, **cone)
        if missing.required - missing.available > 1e-4 * scale:
            assert answer.status == 2


def test_limbs_that_push_are_those_that_pull_under_the_opposite_load():
    """All loads and forces change their signs: side forces within |f| as well."""
    rng, bound = np.random.default_rng(63), 0
    for _ in range(12):
        problem = Problem(rng, "by_tension", n=5, reachable=True)
        one = problem.answer()
        problem.f_low, problem.f_high = -problem.f_high, -problem.f_low
        other = problem.answer(size=-1.0)
        f, g, scale = other.actuator_forces, other.constraint_forces, problem.scale
        assert (np.abs(g) <= np.abs(f) + 1e-8 * scale).all()
        np.testing.assert_allclose(f, -one.actuator_forces, atol=1e-6 * scale)
        np.testing.assert_allclose(g, -one.constraint_forces, atol=1e-6 * scale)
        bound += bool(np.isclose(np.abs(g), np.abs(f), atol=1e-8).any())
    assert bound >= 5


@pytest.mark.parametrize("tension", [0.01, 1.0, 9.0])
def test_the_best_of_weights_without_limits_is_a_least_squares_answer(tension):
    problem = Problem(np.random.default_rng(23), "weights", n=5, u=0, reachable=True)
    weights = type(problem.options["weights"])(3.0, 0.5, tension, problem.options["weights"].glenoid)
    goal = np.sqrt([0.5, 3.0, 3.0])[:, None] * weights.glenoid.axes(problem.exo.side, problem.pose)
    problem.f_low, problem.f_high = np.full((2, 5), [[-1e6], [1e6]])
    answer = problem.answer(weights=weights)
    start, along = np.linalg.lstsq(problem.arms, problem.moment, rcond=None)[0], null_space(problem.arms)
    cost = np.vstack([goal @ problem.effect, np.sqrt(tension) * np.eye(5)])
    wanted = -np.append(goal @ problem.shoulder, np.zeros(5)) - cost @ start
    y = np.linalg.lstsq(cost @ along, wanted, rcond=None)[0]
    np.testing.assert_allclose(answer.actuator_forces, start + along @ y, atol=1e-6 * problem.scale)
