"""Programs of limb forces within limits: optimality, exhaustive answers, and proofs that none fits."""

import itertools
from types import SimpleNamespace

import numpy as np
import pytest
from programs import KINDS, cost, random_pose, shoulder_force
from scipy.optimize import linprog, nnls

import exo_pin as ep
from exo_pin.reaction.holding.infeasible_poses import shortfall
from exo_pin.reaction.splits.limb_and_side_forces import Pose, choose, force_scale

DEGREES = {"degrees": True}
PERSON = ep.Arm.from_anthropometry(1.75, 75, "male")


def stationarity(pose, f, g):
    """Distance of the cost's gradient from the cone of active constraints, by nonnegative least squares.

    Shares nothing with the solver but the problem: constraints count as active by their slack alone.
    """
    scale = force_scale(pose)
    z = np.concatenate([f, g[pose.upu]]) / scale
    S, n = pose.shoulder_effect, len(f)
    force = shoulder_force(pose, f, g) / scale
    gradient = z.copy() if pose.goal is None else S.T @ pose.goal.T @ pose.goal @ force
    if pose.goal is not None:
        gradient[:n] += pose.tension * z[:n]
    columns = [pose.moment_effect.T, -pose.moment_effect.T]
    if pose.alone:
        columns += [S.T, -S.T]
    near = 1e-9
    columns.append(np.eye(len(z))[:, z >= pose.high / scale - near])
    columns.append(-np.eye(len(z))[:, z <= pose.low / scale + near])
    rows = pose.side_rows()
    columns.append(rows[rows @ z >= -near].T)
    if pose.socket is not None:
        columns.append((pose.socket.N @ S)[pose.socket.N @ force >= pose.socket.h / scale - near].T)
    return nnls(np.hstack(columns), -gradient, maxiter=1000)[1]


def violation(pose, f, g):
    """Largest violation of any constraint over the forces in play."""
    z, scale = np.concatenate([f, g[pose.upu]]), force_scale(pose)
    force = shoulder_force(pose, f, g)
    misses = [
        np.abs(pose.state.moment_of_f @ f - pose.state.moment).max() / pose.radius,
        (pose.low - z).max(),
        (z - pose.high).max(),
        (pose.side_rows() @ z).max(initial=0.0),
    ]
    if pose.alone:
        misses.append(np.abs(force).max())
    if pose.socket is not None and pose.socket.is_hard:
        misses.append((pose.socket.N @ force - pose.socket.h).max())
    return max(misses) / scale


@pytest.mark.parametrize(
    "count", [200, pytest.param(1000, marks=pytest.mark.full), pytest.param(10_000, marks=pytest.mark.long)]
)
def test_programs_of_every_kind_are_optimal_or_proven_infeasible(count):
    rng = np.random.default_rng(50)
    held = dict.fromkeys(KINDS, 0)
    proven = dict.fromkeys(KINDS, 0)
    for case in range(count):
        kind = KINDS[case % len(KINDS)]
        reachable = True if kind in ("hard_cone", "alone") and case % 3 else None
        pose = random_pose(rng, kind, reachable=reachable)
        missing = shortfall(pose)
        if missing is not None:
            proven[kind] += 1
            assert missing.required > missing.available
            assert missing.valid_up_to > 1e6  # N
            continue
        held[kind] += 1
        answer = choose(pose)
        assert answer.kkt <= 1e-8
        assert answer.gap <= 1e-8 * force_scale(pose)
        assert violation(pose, answer.f, answer.g) <= 1e-8
        if kind != "soft_cone" and case % 7 == 0:
            assert stationarity(pose, answer.f, answer.g) <= 1e-8 * max(1.0, pose.tension)
    assert min(held.values()) >= count // 100, held
    assert min(proven.values()) >= count // 200, proven


def exhaustive(pose):
    """Least cost by trying every active set of limits and faces."""
    scale, n = force_scale(pose), len(pose.f_low)
    S, count = pose.shoulder_effect, n + pose.upu.size
    low, high = pose.low / scale, pose.high / scale
    E = np.eye(count) if pose.goal is None else np.vstack([pose.goal @ S, np.sqrt(pose.tension) * np.eye(n, count)])
    d = np.zeros(count)
    if pose.goal is not None:
        d = np.concatenate([-pose.goal @ pose.state.shoulder / scale, np.zeros(n)])
    A, b = pose.moment_effect, pose.state.moment / pose.radius / scale
    C, c = np.zeros((0, count)), np.zeros(0)
    if pose.socket is not None:
        C = pose.socket.N @ S
        c = (pose.socket.h - pose.socket.N @ pose.state.shoulder) / scale
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
    ("kind", "cases", "faces"),
    [("pull", 20, None), ("range", 10, None), ("tight", 10, None), ("weights", 10, None), ("hard_cone", 4, 4)],
)
def test_least_shoulder_force_equals_an_exhaustive_answer(kind, cases, faces):
    rng = np.random.default_rng(51)
    done = 0
    while done < cases:
        pose = random_pose(rng, kind, n=4, faces=faces, reachable=True)
        pose = pose._replace(upu=pose.upu[:1], g_low=pose.g_low[:1], g_high=pose.g_high[:1])
        if kind == "hard_cone":
            pose = pose._replace(upu=pose.upu[:0], g_low=pose.g_low[:0], g_high=pose.g_high[:0])
        if shortfall(pose) is not None:
            continue
        done += 1
        answer = choose(pose)
        best = exhaustive(pose)
        assert abs(np.sqrt(cost(pose, answer.f, answer.g)) - best) <= 1e-8 * force_scale(pose)


def test_soft_cone_pays_for_what_it_leaves():
    from programs import distance_to_cone

    rng = np.random.default_rng(52)
    for _ in range(15):
        pose = random_pose(rng, "soft_cone", n=5, faces=8, reachable=True)

        def total(f, g, pose=pose):
            return cost(pose, f, g) + pose.socket.penalty * distance_to_cone(pose, shoulder_force(pose, f, g))

        answer = choose(pose)
        least = total(answer.f, answer.g)
        n = 5
        stress = np.linalg.svd(pose.state.moment_of_f)[2][3:]
        for _ in range(20):
            f = answer.f + stress.T @ rng.normal(size=2) * 10 ** rng.uniform(-3, 1)
            g = np.zeros(n)
            g[pose.upu] = np.clip(answer.g[pose.upu] + rng.normal(size=pose.upu.size), pose.g_low, pose.g_high)
            if (f >= pose.f_low).all() and (f <= pose.f_high).all():
                assert total(f, g) >= least * (1 - 1e-7) - 1e-9


def supplied(pose, f, g, force):
    """Wrench of limbs and shoulder on the arm, moments about O."""
    closure = f @ pose.state.closure_of_f + g @ pose.state.closure_of_g
    return closure + np.concatenate([force, np.zeros(3)])


def needed(pose):
    return np.concatenate([pose.state.shoulder, pose.state.moment])


@pytest.mark.parametrize("count", [6, pytest.param(40, marks=pytest.mark.full)])
def test_farkas_directions_hold_without_the_solver(count):
    """y·needed stands above y·supplied for all admissible forces: by the support of the limits, rays of the cone,
    and a linear program of its own that finds the pose infeasible as well.
    """
    rng = np.random.default_rng(53)
    found = dict.fromkeys(("range", "pull", "by_tension", "hard_cone", "alone"), 0)
    while min(found.values()) < count:
        kind = min(found, key=found.get)
        pose = random_pose(rng, kind, faces=12, reachable=False)
        missing = shortfall(pose)
        if missing is None:
            continue
        found[kind] += 1
        y, scale = missing.direction, force_scale(pose)
        n = len(pose.f_low)
        per_f, per_g = pose.state.closure_of_f @ y, (pose.state.closure_of_g @ y)[pose.upu]
        F_free = kind not in ("hard_cone", "alone")
        if F_free:
            np.testing.assert_array_equal(y[:3], 0)
        if kind == "hard_cone":
            N, h = pose.socket.N, pose.socket.h
            apex = np.linalg.lstsq(N, h, rcond=None)[0]
            np.testing.assert_allclose(N @ apex, h, atol=1e-9 * (1 + h.max()))
            rays = np.cross(N, np.roll(N, -1, axis=0))
            rays *= -np.sign(rays @ N.sum(axis=0))[:, None]
            assert (N @ rays.T <= 1e-12).all()
            assert (rays @ y[:3]).max() <= 1e-9
            most = y[:3] @ apex
        else:
            most = 0.0
        for gain, low, high in ((per_f, pose.f_low, pose.f_high), (per_g, pose.g_low, pose.g_high)):
            for each, below, above in zip(gain, low, high, strict=True):
                reach = above if each > 0 else below
                if np.isinf(reach):
                    assert abs(each) <= 1e-9
                else:
                    most += each * reach
        assert y @ needed(pose) > most + 1e-12 * scale
        np.testing.assert_allclose(y @ needed(pose), missing.required, rtol=1e-9, atol=1e-9 * scale)
        np.testing.assert_allclose(most, missing.available, atol=1e-7 * scale)
        # The closest forces keep every limit and miss exactly what is said.
        assert (missing.f >= pose.f_low).all()
        assert (missing.f <= pose.f_high).all()
        force = missing.shoulder
        miss = needed(pose) - supplied(pose, missing.f, missing.g, force)
        np.testing.assert_allclose(miss, missing.missing, atol=1e-8 * scale)
        # HiGHS agrees that nothing admissible balances.
        u = pose.upu.size
        T = np.hstack([pose.state.closure_of_f.T, pose.state.closure_of_g[pose.upu].T, np.eye(6, 3)])
        shoulder = [(0, 0) if kind == "alone" else (None, None)] * 3
        cone = {}
        if kind == "hard_cone":
            cone = {"A_ub": np.hstack([np.zeros((len(h), n + u)), N]), "b_ub": h}
        elif kind == "by_tension":
            cone = {"A_ub": np.hstack([pose.side_rows(), np.zeros((2 * u, 3))]), "b_ub": np.zeros(2 * u)}
        limits = [*zip(pose.low, pose.high, strict=True), *shoulder]
        answer = linprog(np.zeros(n + u + 3), A_eq=T, b_eq=needed(pose), bounds=limits, **cone)
        if missing.required - missing.available > 1e-4 * scale:
            assert answer.status == 2


@pytest.mark.parametrize("sign", [1.0, -1.0])
def test_side_forces_stay_below_the_forces_of_limbs_that_pull_or_push(sign):
    limits = np.sort(sign * np.array([[0.0, 500.0]] * 3), axis=1).T
    pose = SimpleNamespace(f_low=limits[0], f_high=limits[1], upu=np.array([0, 2]), by_actuator=True)
    rows = Pose.side_rows(pose)
    rng = np.random.default_rng(21)
    for _ in range(50):
        f, g = sign * rng.uniform(0.0, 500.0, 3), rng.uniform(-500.0, 500.0, 2)
        allowed = (np.abs(g) <= np.abs(f[[0, 2]])).all()
        assert (rows @ np.concatenate([f, g]) <= 0.0).all() == allowed


@pytest.mark.parametrize("goal", [True, False])
def test_limbs_that_push_are_those_that_pull_under_the_opposite_load(goal):
    """All loads and forces change their signs: side forces within |f| as well."""
    rng = np.random.default_rng(63)
    bound = 0
    for _ in range(12):
        pulling = random_pose(rng, "by_tension", n=5, reachable=True)
        if not goal:
            pulling = pulling._replace(goal=None)
        state = pulling.state
        pushing = pulling._replace(
            state=state._replace(moment=-state.moment, shoulder=-state.shoulder),
            f_low=-pulling.f_high,
            f_high=-pulling.f_low,
        )
        one, other = choose(pulling), choose(pushing)
        assert (np.abs(other.g) <= np.abs(other.f) + 1e-8 * force_scale(pushing)).all()
        np.testing.assert_allclose(other.f, -one.f, atol=1e-6 * force_scale(pulling))
        np.testing.assert_allclose(other.g, -one.g, atol=1e-6 * force_scale(pulling))
        bound += bool(np.isclose(np.abs(one.g), np.abs(one.f), atol=1e-8).any())
    assert bound >= (5 if goal else 0)
