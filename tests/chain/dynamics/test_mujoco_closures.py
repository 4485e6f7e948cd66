"""Dynamics of chains with ball and rigid closures against MuJoCo with its own connects and welds."""

import numpy as np
import pytest
from closed_motion import MAKERS, closed_motion, named, some_load
from geared_arms import geared, in_mujoco
from mujoco_exact import ExactMujoco
from mujoco_tree import MujocoLoops

from exo_pin.chain import ClosedChain

#: Not the wrists without shoulder, whose limbs hold the arm's centre by couples alone: MuJoCo's springs, the stiffest
#: there are, are too soft for them, and the extrapolation below does not settle. The open tree's test has them.
NAMES = [
    name
    for name in MAKERS
    if {closure.type for closure in named(name).closures.closures} <= {"spherical", "rigid"}
    and name not in ("prototype-wrist", "wrist alone")
]


#: MuJoCo's largest impedance, and the others by halves: 1 - d = ε, 2 ε, 4 ε, 8 ε.
IMPEDANCES = 1.0 - 1e-4 * np.array([1.0, 2.0, 4.0, 8.0])


def extrapolated(values):
    """Limit ε → 0 of a function of ε known at ε, 2 ε, 4 ε, 8 ε, and how far off it may be.

    An answer of MuJoCo is a smooth function of ε (the compliance is proportional to ε/(1 - ε)). Every step of
    Richardson's takes the lowest power of ε away: with the last one the error is of fourth order, and the step itself
    shows the error of the one before, which is larger.
    """
    table = [np.array(values)]
    for power in (1, 2, 3):
        last = table[-1]
        table.append((2**power * last[:-1] - last[1:]) / (2**power - 1))
    return table[3][0], float(np.abs(table[3][0] - table[2][0]).max())


def joints(chain):
    return list(chain.model.names)[1:]


def problem(name, moving, seed=1):
    chain, q, v, a = closed_motion(name, seed)
    if not moving:
        v = np.zeros_like(v)
        a = chain.project_acceleration(q, v, a)
    gravity = np.random.default_rng(seed).normal(size=3) * 8
    chain.model.gravity.linear = gravity
    return chain, (q, v, a), gravity, some_load(chain, seed)


def mujocos(name, chain, state, gravity, load, tau):
    """Acceleration and all joints' wrenches, each with a bound on its error, and ``state``'s acceleration."""
    accelerations, wrenches = [], []
    for d in IMPEDANCES:
        loops = MujocoLoops(named(name), gravity, d)
        loops.put(chain, *state)
        expected = loops.data.qacc.copy()
        for link, wrench in load.items():
            loops.push(link, wrench, chain.placement(state[0], link).translation)
        accelerations.append(loops.forward(chain, tau))
        wrenches.append(np.concatenate([loops.transmitted(joint) for joint in joints(chain)]))
    return extrapolated(accelerations), extrapolated(wrenches), expected


@pytest.mark.parametrize("moving", [False, True])
@pytest.mark.parametrize("name", NAMES)
def test_efforts_of_the_inverse_make_mujocos_loops_move_as_given(name, moving):
    chain, state, gravity, load = problem(name, moving)
    forces = chain.inverse_dynamics(*state, external=load)
    (a, a_error), (wrenches, wrench_error), expected = mujocos(name, chain, state, gravity, load, forces.tau)
    # Rounding of MuJoCo's solver, amplified eightfold by the extrapolation.
    rounding = 1e-11
    size = np.abs(expected).max()
    assert a_error < 1e-3 * size
    assert np.abs(a - expected).max() < a_error + rounding * size
    expressed = [forces.joint_reaction(joint, in_frame="local", intervals=False) for joint in joints(chain)]
    ours, unique = (np.concatenate([getattr(item, key) for item in expressed]) for key in ("wrench", "unique"))
    size = np.abs(wrenches).max()
    assert wrench_error < 1e-3 * size
    assert np.abs(wrenches - ours)[unique].max() < wrench_error + rounding * size
    if forces.undetermined:
        # MuJoCo shares the undetermined part in its own way: where it differs, the certificate said so.
        assert np.abs(wrenches - ours)[~unique].max() > 1e-3 * size


@pytest.mark.parametrize("name", NAMES)
def test_forward_dynamics_is_mujocos(name):
    chain, (q, v, _), gravity, load = problem(name, True, seed=3)
    rng = np.random.default_rng(9)
    tau = np.zeros(chain.model.nv)
    driven = chain.velocity_indices(chain.roles.actuated)
    tau[driven] = rng.normal(size=len(driven)) * 5
    motion = chain.forward_dynamics(q, v, tau, external=load)
    (a, a_error), (wrenches, wrench_error), expected = mujocos(name, chain, (q, v, motion.a), gravity, load, tau)
    size = np.abs(expected).max()
    assert a_error < 1e-3 * size
    assert np.abs(a - expected).max() < a_error + 1e-9 * size
    expressed = [motion.forces.joint_reaction(joint, in_frame="local", intervals=False) for joint in joints(chain)]
    ours, unique = (np.concatenate([getattr(item, key) for item in expressed]) for key in ("wrench", "unique"))
    size = np.abs(wrenches).max()
    assert np.abs(wrenches - ours)[unique].max() < wrench_error + 1e-9 * size


def moving(seed):
    urdf, closures = geared(seed)
    chain = ClosedChain.from_urdf(urdf, closures)
    rng = np.random.default_rng(seed)
    q = chain.close(rng.uniform(-0.5, 0.5, chain.model.nv))
    return urdf, closures, chain, q, chain.project_velocity(q, rng.normal(size=chain.model.nv)), rng


@pytest.mark.parametrize("seed", range(12))
def test_accelerations_are_mujocos_with_exact_joint_equalities(seed):
    urdf, closures, chain, q, v, rng = moving(seed)
    exact = ExactMujoco(in_mujoco(urdf, closures), chain)
    qpos = exact.qpos_of(q)
    exact.at(qpos)
    gaps, J = exact.rows()
    assert np.abs(gaps).max() < 1e-12
    T = exact.velocity_map(qpos)
    np.testing.assert_allclose(chain.constraint_jacobian(q), J @ T, atol=1e-12)
    np.testing.assert_allclose(chain.constraint_drift(q, v), exact.drift(qpos, T @ v), atol=1e-9 * (1 + v @ v))
    tau = rng.normal(size=len(v))
    expected = np.linalg.solve(T, exact.acceleration(qpos, T @ v, np.linalg.solve(T.T, tau)))
    motion = chain.forward_dynamics(q, v, tau)
    np.testing.assert_allclose(motion.a, expected, rtol=0, atol=1e-8 * np.abs(expected).max())
    # Driven in all joints but the followers, the efforts come back with the multipliers' share in the leaders.
    free = [joint for joint in list(chain.model.names)[1:] if joint not in ("joint_2", "joint_4")]
    forces = chain.inverse_dynamics(q, v, motion.a, actuated=free)
    work = chain.reduced_jacobian(q).T @ (forces.tau - tau)
    np.testing.assert_allclose(work, 0.0, atol=1e-9 * np.abs(tau).max())
