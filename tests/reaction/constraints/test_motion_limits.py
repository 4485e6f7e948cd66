"""Speed and power of actuators in questions with a motion."""

import dataclasses

import numpy as np
import pytest
from scipy.spatial.transform import Rotation

import exo_pin as ep

STEP = 1e-5


def device(name="four-cables", **limits):
    exo = ep.load(name)
    own = [
        dataclasses.replace(limb, actuator=dataclasses.replace(limb.actuator, **limits)) for limb in exo.mechanism.limbs
    ]
    return exo.replace(limbs=own)


def rates(exo, pose, omega):
    """dl/dt by a central difference of the lengths."""
    ends = [
        exo.inverse_kinematics(Rotation.from_rotvec(sign * STEP * np.array(omega)) * pose).lengths for sign in (-1, 1)
    ]
    return (ends[1] - ends[0]) / (2.0 * STEP)


def test_a_limb_that_is_too_slow_cannot_follow():
    exo = device(speed_limit=0.15)
    pose, motion = exo.pose(60, 30), ep.Motion([0.4, -1.2, 0.3], [0.0, 0.0, 0.0])
    speed = np.abs(rates(exo, pose, motion.angular_velocity))
    assert (speed > 0.15).any()
    assert (speed < 0.15).any()
    found = exo.reaction(pose, motion)
    assert found.status == "beyond_limits"
    assert not found.can_hold
    np.testing.assert_allclose(found.limits.excess_speed, np.maximum(speed - 0.15, 0.0), atol=1e-8)
    assert "faster than the actuator can" in found.verdict
    assert exo.reaction(pose).can_hold
    assert exo.reaction(pose, motion, limits="none").status == "ok"
    assert "too fast" in exo.reaction(exo.pose([60, 60], 30), motion).verdict


def test_power_bounds_the_force_of_a_limb_that_works():
    name = "four-linear-actuators"
    pose, motion = ep.load(name).pose(60, 30), ep.Motion([0.0, -1.0, 0.0], [0.0, 0.0, 0.0])
    free = device(name).reaction(pose, motion)
    rate = rates(device(name), pose, motion.angular_velocity)
    most = float((-free.actuator_forces * rate).max())
    assert most > 1.0
    # A little less than it needs: forces are chosen anew, and keep the power of every limb.
    exo = device(name, power_limit=0.97 * most)
    found = exo.reaction(pose, motion)
    assert found.held
    assert (-found.actuator_forces * rate).max() == pytest.approx(0.97 * most, rel=1e-6)
    assert (found.residual[found.has_answer] <= 1e-9).all()
    # None at all: the arm cannot be lifted.
    assert not device(name, power_limit=1e-3).reaction(pose, motion).held
    # On its way back the actuators brake, which takes no power.
    assert device(name, power_limit=0.5 * most).reaction(pose, ep.Motion([0.0, 1.0, 0.0], [0.0, 0.0, 0.0])).held
    # Limits as numbers narrow those of the design; actuators take their place.
    assert exo.reaction(pose, motion, limits=400.0).actuator_forces == pytest.approx(found.actuator_forces)


def test_a_movement_is_held_to_speed_and_power():
    exo = device(speed_limit=0.05)
    times = np.linspace(0.0, 0.5, 40)
    lift = ep.Movement.from_samples(times, exo.pose(40.0 * (1.0 - np.cos(2.0 * np.pi * times)), 20.0), smoothing=None)
    slow, fast = exo.follow(lift).reaction, device(speed_limit=50.0).follow(lift).reaction
    assert fast.held.all()
    assert 0 < slow.held.sum() < 20
