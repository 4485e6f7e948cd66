"""Freedoms of a device that leave the arm where it is: they follow the least motion, whatever the file or the steps."""

import numpy as np
import pinocchio as pin
import pytest
from places import URDF

import exo_pin as ep


@pytest.fixture(scope="module")
def rps():
    return ep.load(URDF / "3rps-passive-ball.urdf")


def least_motion_along(chain, q, turn, steps):
    """Integrate the velocities of least norm along a turn of the arm by the classical Runge-Kutta method."""
    length = chain.characteristic_length
    column = np.where(chain.metres, length, 1.0)
    arm = chain.velocity_slice("root_joint")
    others = np.setdiff1d(np.arange(chain.model.nv), np.arange(chain.model.nv)[arm])

    def velocity(at):
        J = chain.constraint_jacobian(at)
        v = np.zeros(chain.model.nv)
        v[arm] = turn
        v[others] = column[others] * (np.linalg.pinv(J[:, others] * column[others], 1e-9) @ (-J[:, arm] @ turn))
        return v / steps

    for _ in range(steps):
        k1 = velocity(q)
        k2 = velocity(pin.integrate(chain.model, q, 0.5 * k1))
        k3 = velocity(pin.integrate(chain.model, q, 0.5 * k2))
        k4 = velocity(pin.integrate(chain.model, q, k3))
        q = pin.integrate(chain.model, q, (k1 + 2.0 * (k2 + k3) + k4) / 6.0)
    return q


def test_idle_joints_follow_the_least_motion(rps):
    chain = rps.chain
    poses = rps.pose([60.0, 90.0, -30.0, 105.0], [30.0, 20.0, 60.0, 85.0], [10.0, 45.0, -20.0, 70.0])
    found = rps.configurations(poses)
    at_rest = rps.configurations(rps.pose(0.0, 0.0, 0.0))
    exact = np.array([least_motion_along(chain, at_rest, turn, 120) for turn in poses.as_rotvec()])
    slide = chain.configuration_slice("cuff_slide")
    assert np.abs(exact[:, slide] - at_rest[slide]).min() > 1e-3
    # Metres and rad: a micrometre is what the page about devices says.
    np.testing.assert_allclose(found, exact, atol=1e-6)
    np.testing.assert_allclose(found[:3, slide], exact[:3, slide], atol=1e-7)
