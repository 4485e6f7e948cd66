"""Activations of least effort against SciPy, and the proof that they are optimal."""

from dataclasses import replace

import numpy as np
import pytest
import scipy

pytest.importorskip("clarabel", reason="needs the extra person: pip install '.[person]'")

from muscle_poses import some_pose

from exo_pin.person.contact.activation import least_effort


def by_scipy(pose, start):
    """An independent minimiser, from an optimal neighbourhood to an accuracy of about 1e-6."""
    m = pose.muscles
    held = np.arange(5) != 3 if pose.stopped else np.ones(5, dtype=bool)
    conditions = [{"type": "eq", "fun": lambda z: (pose.rows @ z + pose.constant)[held] / 10.0}]
    if pose.stopped:
        conditions.append({"type": "ineq", "fun": lambda z: -(pose.rows @ z + pose.constant)[3] / 10.0})
    if pose.socket is not None:

        def inside(z):
            v = pose.socket @ (pose.pull @ z + pose.rest) / 500.0
            return v[0] - np.hypot(v[1], v[2])

        conditions.append({"type": "ineq", "fun": inside})
    found = scipy.optimize.minimize(
        lambda z: float((pose.weights * np.abs(z[:m]) ** pose.power).sum()),
        start,
        jac=lambda z: np.concatenate(
            [pose.power * pose.weights * np.maximum(z[:m], 0.0) ** (pose.power - 1), np.zeros(len(z) - m)]
        ),
        bounds=list(zip(pose.low, pose.high, strict=True)),
        constraints=conditions,
        method="SLSQP",
        options={"ftol": 1e-13, "maxiter": 400},
    )
    return found.x, float(found.fun)


def checked(pose):
    """Chosen activations, after a comparison with SciPy."""
    chosen = least_effort(pose)
    assert chosen.is_optimal
    z = chosen.z
    cost = float((pose.weights * z[: pose.muscles] ** pose.power).sum())
    reference, least = by_scipy(pose, np.clip(z + 0.03, pose.low, pose.high))
    assert cost <= least * (1.0 + 1e-7) + 1e-9
    assert np.abs(reference - z)[: pose.muscles].max() < (2e-4 if pose.power == 2 else 2e-2)
    return chosen


@pytest.mark.parametrize("power", [2, 3])
@pytest.mark.parametrize("rim", [True, False])
@pytest.mark.parametrize("seed", range(4))
def test_least_effort_is_that_of_another_solver(power, rim, seed):
    chosen = checked(some_pose(seed, power=power, rim=rim))
    assert chosen.kkt < (1e-9 if power == 2 else 1e-6)


@pytest.mark.full
@pytest.mark.parametrize("power", [2, 3])
@pytest.mark.parametrize("seed", range(100, 200))
def test_least_effort_of_many_poses(power, seed):
    checked(some_pose(seed, power=power, stopped=bool(seed % 2)))


def shortest(pose, z, held):
    """The z of least Σ w a² + Σ (f / 500 N)² with the same moments and ``held`` sums (SciPy); its cost and z's."""
    cost = np.concatenate([pose.weights, np.full(len(z) - pose.muscles, 500.0**-2)])
    unit = cost**-0.5
    N = scipy.linalg.null_space(np.vstack([pose.rows, held]) * unit, rcond=1e-9)
    N[np.abs(N) < 1e-12] = 0.0
    moves = (N != 0.0).any(axis=1)
    low, high = np.isfinite(pose.low) & moves, np.isfinite(pose.high) & moves

    def at(y):
        return z + unit * (N @ y)

    conditions = [
        {"type": "ineq", "fun": lambda y: ((at(y) - pose.low) / unit)[low]},
        {"type": "ineq", "fun": lambda y: ((pose.high - at(y)) / unit)[high]},
    ]
    if pose.socket is not None:

        def inside(y):
            v = pose.socket @ (pose.pull @ at(y) + pose.rest) / 500.0
            return v[0] - np.hypot(v[1], v[2])

        conditions.append({"type": "ineq", "fun": inside})
    found = scipy.optimize.minimize(
        lambda y: float(cost @ at(y) ** 2), np.zeros(N.shape[1]), method="SLSQP", constraints=conditions,
        jac=lambda y: 2.0 * N.T @ (at(y) / unit), options={"ftol": 1e-14, "maxiter": 500},
    )  # fmt: skip
    return at(found.x), float(found.fun), float(cost @ z**2)


@pytest.mark.parametrize("rim", [True, False])
@pytest.mark.parametrize("limbs", [4, 6])
def test_limb_forces_that_effort_leaves_open_are_the_shortest(rim, limbs):
    """Six limb forces have three moments: without the bounds, effort alone would not determine three of them."""
    for seed in range(4):
        pose = some_pose(seed, limbs=limbs, rim=rim)
        z = least_effort(pose).z
        np.testing.assert_allclose(pose.rows @ z, -pose.constant, atol=1e-6)
        reference, least, own = shortest(pose, z, np.eye(pose.muscles, len(z)))
        assert own <= least * (1.0 + 1e-6) + 1e-9
        assert np.abs(reference - z).max() < 0.05
        # Nor do they grow where they have no bounds.
        m = pose.muscles
        low, high = pose.low.copy(), pose.high.copy()
        low[m:], high[m:] = -np.inf, np.inf
        wide = replace(pose, low=low, high=high)
        free = least_effort(wide).z
        np.testing.assert_allclose(pose.rows @ free, -pose.constant, atol=1e-6)
        _, least, own = shortest(wide, free, np.eye(m, len(z)))
        assert own <= least * (1.0 + 1e-6) + 1e-9


def test_activations_that_the_contact_force_leaves_open_are_the_shortest():
    """Two muscles of the forearm that pull against each other, past the shoulder, do not help: they stay quiet."""
    for seed in range(8):
        pose = some_pose(seed, muscles=16, limbs=3)
        inside = least_effort(pose).z
        rows, pull = pose.rows.copy(), pose.pull.copy()
        rows[:, :2], rows[4, :2], pull[:, :2] = 0.0, (10.0, -10.0), 0.0
        rest = pose.rest + (pose.pull - pull) @ inside
        pose = replace(pose, rows=rows, constant=-rows @ inside, pull=pull, rest=rest, least="contact")
        z = least_effort(pose).z
        assert z[:2].min() < 1e-3
        _, least, own = shortest(pose, z, pose.pull)
        assert own <= 1.001 * least + 1e-6


@pytest.mark.parametrize("power", [2, 3])
@pytest.mark.parametrize("rim", [True, False])
def test_effort_of_muscles_that_weigh_differently_with_limbs_and_a_stop(power, rim):
    for seed in (0,):
        weights = np.random.default_rng(seed).uniform(0.3, 3.0, 12)
        pose = some_pose(seed + 40, limbs=3, power=power, rim=rim, stopped=True, weights=weights)
        # Against a load that is large beside the forces of muscles, too.
        far = replace(pose, rest=pose.rest + np.array([5e3, 0.0, 0.0]))
        for each in (pose, far):
            assert checked(each).gap < 1e-7
