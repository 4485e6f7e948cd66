"""Friction and stops of random robots with loops: MuJoCo's matrices, and two other programs that solve the contacts.

The robots have couplings, several bodies on the world, and joints of several kinds on one body. Where a loop locks a
joint, friction and stops there change nothing.
"""

import mujoco
import numpy as np
import pytest
from complementarity_program import complementary_acceleration
from gauss_principle import gauss_acceleration
from mjcf_chains import random_robot
from mujoco_exact import REST, ZERO, ExactMujoco, problem_of

from exo_pin.chain import ClosedChain

SEEDS = [pytest.param(seed, marks=() if seed < 20 else pytest.mark.full) for seed in range(400)]


def with_contacts(chain, q, v, rng):
    """The same chain with random friction, and stops at random joints that are at rest; and the stops."""
    model = chain.model
    friction = rng.uniform(0.0, 3.0, model.nv) * (rng.random(model.nv) < 0.6)
    model.upperDryFrictionLimit = friction
    model.lowerDryFrictionLimit = -friction * np.where(rng.random(model.nv) < 0.5, 1.0, rng.uniform(0.0, 1.5, model.nv))
    lower, upper, stops = np.full(model.nq, -np.inf), np.full(model.nq, np.inf), []
    for joint in range(1, model.njoints):
        i, k = model.idx_vs[joint], model.idx_qs[joint]
        if model.nqs[joint] == 1 and abs(v[i]) < 1e-12 and rng.random() < 0.5:
            side = int(rng.choice([-1, 1]))
            (lower if side > 0 else upper)[k] = q[k]
            stops.append((i, side))
    model.lowerPositionLimit, model.upperPositionLimit = lower, upper
    return ClosedChain(model, chain.description), stops


def state_of(seed):
    """A robot with contacts at rest, in motion, or with some joints at rest; None near singular configurations."""
    robot, rng = random_robot(seed), np.random.default_rng(seed)
    chain = ClosedChain.from_mjcf(robot.text)
    exact = ExactMujoco(mujoco.MjModel.from_xml_string(robot.text), chain)
    q = exact.q_of(robot.qpos)
    exact.at(robot.qpos)
    values = exact.singular_values()
    if exact.rank() is None or (values[values > ZERO] < 1e-3).any():
        return None
    Z = np.linalg.solve(exact.velocity_map(robot.qpos), exact.motions())
    if seed % 3 and Z.shape[1] > 1:
        still = rng.permutation(chain.model.nv)[: Z.shape[1] // 2 if seed % 3 == 2 else 0]
        _, sizes, ways = np.linalg.svd(Z[still])
        left = Z @ ways[np.count_nonzero(sizes > REST) :].T
        v = left @ rng.normal(size=left.shape[1])
        v[still] = 0.0
    else:
        v = np.zeros(chain.model.nv)
    return *with_contacts(chain, q, v, rng), exact, robot.qpos, q, v, Z, 3.0 * rng.normal(size=chain.model.nv)


@pytest.mark.parametrize("seed", SEEDS)
def test_accelerations_are_those_of_gauss_principle(seed):
    """With MuJoCo's mass matrix, bias and equalities; the forces satisfy the equations of motion and their ranges."""
    found = state_of(seed)
    if found is None:
        return
    chain, stops, exact, qpos, q, v, Z, tau = found
    model = chain.model
    low, high = model.lowerDryFrictionLimit, model.upperDryFrictionLimit
    M, smooth, sliding, resting = problem_of(chain, exact, qpos, v, tau)
    motion = chain.forward_dynamics(q, v, tau, stops=True)
    expected = gauss_acceleration(M, Z, smooth, resting, stops)
    size = max(1.0, np.abs(smooth).max())
    np.testing.assert_allclose(motion.a, expected, rtol=0, atol=1e-6 * size)
    missing = Z.T @ (M @ (motion.a - smooth) - (motion.friction - sliding + motion.stop_reactions))
    assert np.abs(missing).max(initial=0.0) <= 1e-8 * max(1.0, np.abs(M @ smooth).max())
    assert (motion.friction <= high + 1e-12).all()
    assert (motion.friction >= low - 1e-12).all()
    sides = np.zeros(model.nv)
    for i, side in stops:
        sides[i] = side
    assert (motion.stop_reactions * sides >= -1e-12).all()
    assert (motion.stop_reactions[sides == 0.0] == 0.0).all()


def test_accelerations_are_those_of_a_complementarity_problem():
    """Solved by Drake's Moby solver, in the forces; Lemke's method ends without an answer for a robot in forty."""
    differ = []
    for seed in range(40):
        found = state_of(seed)
        if found is None:
            continue
        chain, stops, exact, qpos, q, v, Z, tau = found
        M, smooth, _, resting = problem_of(chain, exact, qpos, v, tau)
        theirs = complementary_acceleration(M, Z, smooth, resting, stops)
        if theirs is not None and (stops or resting):
            a = chain.forward_dynamics(q, v, tau, stops=True).a
            differ.append(np.abs(a - theirs).max() / max(1.0, np.abs(smooth).max()))
    assert len(differ) >= 30
    # Singular values go down to 1e-3, and errors with their inverse square: 1.3e-9 on one processor, 3e-12 on another.
    assert max(differ) <= 1e-8
