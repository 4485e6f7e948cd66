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


def test_the_states_have_friction_stops_and_locked_joints():
    """Enough of each that the comparison says something."""
    stops, resting, moving, locked = 0, 0, 0, 0
    for seed in range(40):
        found = state_of(seed)
        if found is not None:
            chain, own, _, _, _, v, Z, _ = found
            frictional = chain.model.upperDryFrictionLimit != 0.0
            stops += len(own)
            resting += np.count_nonzero(frictional & (v == 0.0))
            moving += np.count_nonzero(frictional & (np.abs(v) > 1e-3))
            locked += sum(np.linalg.norm(Z[i]) < REST for i, _ in own)
    assert min(stops, resting, moving) > 40
    assert locked >= 5


#: A triangle of three hinges is rigid; a pendulum hangs on one of its sides.
TRUSS = """<mujoco model="truss"><option gravity="0 0 -9.81"/><compiler angle="radian"/>
  <default><geom type="capsule" size="0.01" mass="0.4"/><joint axis="0 1 0"/></default>
  <worldbody><body name="left"><joint name="left" range="{range}" frictionloss="{friction}"/>
    <geom fromto="0 0 0 0.1 0 0.3"/><site name="top_left" pos="0.1 0 0.3"/>
    <body name="pendulum" pos="0.05 0 0.15"><joint name="pendulum"/><geom fromto="0 0 0 0.2 0 0"/></body></body>
  <body name="right" pos="0.2 0 0"><joint name="right"/><geom fromto="0 0 0 -0.1 0 0.3"/>
    <site name="top_right" pos="-0.1 0 0.3"/></body></worldbody>
  <equality><connect name="top" site1="top_left" site2="top_right"/></equality></mujoco>"""


@pytest.mark.full
@pytest.mark.parametrize(
    ("limits", "friction"),
    [
        ("-1 0", 0.0),
        ("0 1", 2.0),
        *(pytest.param(*each, marks=pytest.mark.full) for each in (("0 1", 0.0), ("-1 1", 2.0))),
    ],
)
def test_contacts_of_a_locked_joint_do_not_touch_the_others(limits, friction):
    """The pendulum's acceleration by its own formula, whatever rests in the truss; and it swings with its energy."""
    chain = ClosedChain.from_mjcf(TRUSS.format(range=limits, friction=friction))
    q = chain.neutral()
    motion = chain.forward_dynamics(q, stops=True)
    swing = chain.velocity_slice("pendulum")
    # Of the compiled body: m g c / (I + m c²) about its hinge, horizontal.
    inertia = chain.model.inertias[chain.model.getJointId("pendulum")]
    about = inertia.inertia[1, 1] + inertia.mass * inertia.lever[0] ** 2
    expected = np.zeros(chain.model.nv)
    expected[swing] = 9.81 * inertia.mass * inertia.lever[0] / about
    np.testing.assert_allclose(motion.a, expected, atol=1e-9)
    found = chain.simulate(q, np.zeros(chain.model.nv), np.linspace(0.0, 1.0, 11), stops=True)
    assert found.energy_drift <= 1e-7
    assert np.ptp(found.q[:, swing]) > 1.0
    others = np.ones(chain.model.nv, dtype=bool)
    others[swing] = False
    assert np.abs(found.v[:, others]).max() <= 1e-9
