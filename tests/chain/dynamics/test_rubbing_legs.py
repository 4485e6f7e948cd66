"""Robots on three legs that rub in all joints: many coordinates stick that depend on each other, MuJoCo beside them."""

import mujoco
import numpy as np
import pytest
from mjcf_chains import random_robot
from rubbing_legs import VARIANTS, three_legs

from exo_pin import MasslessMotion
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
    # MuJoCo's loops and friction are soft: stiff ones, and small steps.
    model = mujoco.MjModel.from_xml_string(text)
    model.opt.timestep, model.opt.integrator = 1e-4, mujoco.mjtIntegrator.mjINT_IMPLICIT
    model.opt.iterations, model.opt.tolerance = 200, 1e-12
    model.eq_solref[:], model.eq_solimp[:] = (4e-4, 1.0), (0.9999, 0.9999, 1e-3, 0.5, 2.0)
    model.dof_solref[:], model.dof_solimp[:] = (4e-4, 1.0), (0.99, 0.99, 1e-3, 0.5, 2.0)
    data = mujoco.MjData(model)
    data.qpos[:], data.qvel[:] = q, v
    mujoco.mj_step(model, data, 3000)
    moved = np.abs(run.q - q).max()
    assert np.abs(data.qpos - run.q[-1]).max() < 0.02 * moved + 2e-3


def test_hinges_of_a_ball_in_one_line_are_named():
    """Three hinges with no mass between, the middle one turned by 90 degrees: the outer two turn about one line."""
    turns = "".join(
        f'<joint name="{axis}" axis="{" ".join(str(int(axis == other)) for other in "xyz")}"/>' for axis in "xyz"
    )
    body = f'<body>{turns}<inertial pos="0 0 -0.3" mass="1" diaginertia="1 1 1"/></body>'
    chain = ClosedChain.from_mjcf(f"<mujoco><worldbody>{body}</worldbody></mujoco>")
    with pytest.raises(MasslessMotion, match=r"x and z turn about one line here \(gimbal lock\).*a ball joint") as told:
        chain.forward_dynamics([0.3, np.pi / 2, 0.2])
    assert told.value.in_line == ("x", "z")
    assert np.isfinite(chain.forward_dynamics([0.3, 1.5, 0.2]).a).all()


@pytest.mark.parametrize("seed", [pytest.param(k, marks=() if k < 2 else pytest.mark.full) for k in range(75)])
def test_random_robots_rub_through(seed):
    chain = ClosedChain.from_mjcf(random_robot(seed).text)
    friction = np.random.default_rng(seed).uniform(0.0, 3.0, chain.model.nv)
    chain.model.lowerDryFrictionLimit, chain.model.upperDryFrictionLimit = -friction, friction
    q, v = start_of(chain, seed if seed % 2 else None)
    run = chain.simulate(q, v, np.linspace(0.0, 0.3, 4))
    assert run.energy_drift < 1e-6
    assert (np.diff(run.dissipated) >= -1e-9).all()
