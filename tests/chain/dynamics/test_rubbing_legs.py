"""Robots on three legs that rub in all joints: many coordinates stick that depend on each other, MuJoCo beside them."""

import mujoco
import numpy as np
import pinocchio as pin
import pytest
from gauss_principle import gauss_acceleration
from mjcf_chains import random_robot
from mujoco_exact import ExactMujoco, problem_of
from rubbing_legs import VARIANTS, three_legs

from exo_pin.chain import ClosedChain

CASES = [pytest.param(*case, marks=() if k in (20, 38) else pytest.mark.full) for k, case in enumerate(VARIANTS)]


def start_of(chain, seed):
    """Closed loops, at rest or with a motion whose largest number is 1 m/s or rad/s."""
    q = chain.close(chain.neutral())
    if seed is None:
        return q, np.zeros(chain.model.nv)
    _, values, ways = np.linalg.svd(chain.constraint_jacobian(q))
    motions = ways[np.count_nonzero(values > 1e-8) :].T
    v = motions @ np.random.default_rng(seed).normal(size=motions.shape[1])
    return q, v / max(np.abs(v).max(), 1e-300)


@pytest.mark.parametrize(("foot", "middle", "balls", "friction", "seed"), CASES)
def test_legs_stick_and_slip_through(foot, middle, balls, friction, seed):
    text = three_legs(foot, middle, balls, friction)
    chain = ClosedChain.from_mjcf(text)
    q, v = start_of(chain, seed)
    run = chain.simulate(q, v, np.linspace(0.0, 0.3, 4))
    assert run.opening.max() < 1e-11
    assert run.energy_drift < 1e-7
    assert (np.diff(run.dissipated) >= -1e-9).all()
    theirs = moved_in_mujoco(mujoco.MjModel.from_xml_string(text), q, v)
    assert np.abs(theirs - run.q[-1]).max() < 0.02 * np.abs(run.q - q).max() + 2e-3


def moved_in_mujoco(model, qpos, qvel):
    """Positions after 0.3 s; loops and friction are soft there, so stiff ones and small steps."""
    model.opt.timestep, model.opt.integrator = 1e-4, mujoco.mjtIntegrator.mjINT_IMPLICIT
    model.opt.iterations, model.opt.tolerance = 200, 1e-12
    model.eq_solref[:], model.eq_solimp[:] = (4e-4, 1.0), (0.9999, 0.9999, 1e-3, 0.5, 2.0)
    model.dof_solref[:], model.dof_solimp[:] = (4e-4, 1.0), (0.99, 0.99, 1e-3, 0.5, 2.0)
    data = mujoco.MjData(model)
    data.qpos[:], data.qvel[:] = qpos, qvel
    mujoco.mj_step(model, data, 3000)
    return data.qpos


#: Random robots whose loops bear forces so large that MuJoCo's, a ten-thousandth of which gives way, move otherwise.
TOO_SOFT = (2, 4, 18, 21, 33, 39, 52, 58, 60, 66, 70)


@pytest.mark.parametrize("seed", [pytest.param(k, marks=() if k < 3 else pytest.mark.full) for k in range(75)])
def test_random_robots_rub_through(seed):
    """As they move in MuJoCo; where its loops are too soft, the acceleration is that of its matrices at the start."""
    text = random_robot(seed).text
    chain, model = ClosedChain.from_mjcf(text), mujoco.MjModel.from_xml_string(text)
    exact = ExactMujoco(model, chain)
    friction = np.random.default_rng(seed).uniform(0.0, 3.0, chain.model.nv)
    for _, theirs, _, own in exact.joints:
        # That of a free joint is in the world's axes there.
        friction[own] = 0.0 if own.stop - own.start == 6 else friction[own]
        model.dof_frictionloss[theirs] = friction[own]
    chain.model.lowerDryFrictionLimit, chain.model.upperDryFrictionLimit = -friction, friction
    q, v = start_of(chain, seed if seed % 2 else None)
    run = chain.simulate(q, v, np.linspace(0.0, 0.3, 4))
    # The drift is a share of the kinetic energy, which one that friction holds has none of.
    assert run.energy_drift < 1e-6 or np.abs(run.v).max() < 1e-12
    assert (np.diff(run.dissipated) >= -1e-9).all()
    qpos = exact.qpos_of(q)
    if seed in TOO_SOFT:
        M, smooth, _, resting = problem_of(chain, exact, qpos, v, np.zeros_like(v))
        exact.at(qpos)
        motions = np.linalg.solve(exact.velocity_map(qpos), exact.motions())
        a = gauss_acceleration(M, motions, smooth, resting, [])
        assert np.abs(chain.forward_dynamics(q, v).a - a).max() < 1e-9 * max(1.0, np.abs(smooth).max())
        return
    model.opt.disableflags &= ~int(mujoco.mjtDisableBit.mjDSBL_FRICTIONLOSS)
    there = exact.q_of(moved_in_mujoco(model, qpos, exact.velocity_map(qpos) @ v))
    off = np.abs(pin.difference(chain.model, run.q[-1], there)).max()
    assert off < 0.02 * np.abs(pin.difference(chain.model, q, run.q[-1])).max() + 2e-3
