"""Dynamics of chains with couplings against MuJoCo's joint equalities, and energy."""

import numpy as np
import pytest
from geared_arms import geared, in_mujoco
from mujoco_exact import ExactMujoco

from exo_pin.chain import ClosedChain


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
