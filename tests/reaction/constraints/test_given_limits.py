"""Limits as a caller gives them, and those of actuators."""

import numpy as np
import pytest
from scipy.spatial.transform import Rotation
from wrists import random_mechanism, regular_poses

import exo_pin as ep
from exo_pin.reaction import GlenoidCone, Weights


def test_limits_from_actuators():
    class Spring:
        def __init__(self, longest):
            self.longest = longest

        def force_limits(self, length):
            upper = np.where(length <= self.longest, 400.0 * length, np.nan)
            return np.zeros_like(length), upper

    class Refuses(Spring):
        def force_limits(self, length):
            if (length > self.longest).any():
                raise ep.InvalidInput("too long")
            return np.zeros_like(length), 400.0 * length

    mechanism = random_mechanism(np.random.default_rng(69), 4)
    exo = ep.ShoulderExo.from_mechanism(mechanism)
    poses = regular_poses(mechanism, np.random.default_rng(70), 200)
    lengths = exo.inverse_kinematics(poses).lengths
    longest = float(np.quantile(lengths, 0.9))
    answer = exo.reaction(poses, limits=Spring(longest))
    np.testing.assert_array_equal(answer.status == "out_of_stroke", (lengths > longest).any(axis=1))
    held = answer.held
    assert held.sum() > 5
    assert (answer.actuator_forces[held] <= 400.0 * lengths[held] * (1 + 1e-12)).all()
    assert (answer.actuator_forces[held] >= 0).all()
    refused = exo.reaction(poses, limits=[Refuses(longest)] * 4)
    np.testing.assert_array_equal(refused.status, answer.status)
    np.testing.assert_array_equal(refused.actuator_forces, answer.actuator_forces)
    np.testing.assert_array_equal(exo.reaction(poses[0], limits=Spring(0.0)).status, "out_of_stroke")


@pytest.mark.parametrize(
    ("arguments", "error", "message"),
    [
        ({"limits": "push"}, ep.UnknownName, "pull"),
        ({"limits": -3.0}, ep.InvalidInput, "zero or more"),
        ({"limits": True}, ep.InvalidInput, "force_limits"),
        ({"limits": {3.0}}, ep.InvalidInput, "force_limits"),
        ({"limits": (1, 0)}, ep.InfeasibleBounds, "limb index 0"),
        ({"limits": (np.nan, 1)}, ep.InvalidInput, "NaN"),
        ({"limits": (np.inf, np.inf)}, ep.InvalidInput, r"below \+inf"),
        ({"limits": ([0, 0], 1)}, ep.InvalidInput, "broadcast"),
        ({"limits": ("a", "b")}, ep.InvalidInput, "numbers"),
        ({"limits": ("1", "2")}, ep.InvalidInput, "numbers"),
        ({"limits": (False, True)}, ep.InvalidInput, "numbers"),
        ({"limits": {1: 2, 3: 4}}, ep.InvalidInput, "lower, upper"),
        ({"limits": b"12"}, ep.InvalidInput, "lower, upper"),
        ({"constraint_bounds": {1.0, 2.0}, "split": "minimal"}, ep.InvalidInput, "lower, upper"),
        ({"cone": 0.5}, ep.InvalidInput, "GlenoidCone"),
        ({"cone": GlenoidCone(), "split": "standalone"}, ep.InvalidInput, "standalone"),
        ({"weights": Weights()}, ep.InvalidInput, "minimal"),
        ({"weights": (1, 2), "split": "minimal"}, ep.InvalidInput, "Weights"),
    ],
)
def test_limits_that_cannot_be_meant(arguments, error, message):
    with pytest.raises(error, match=message):
        ep.load("prototype").reaction(Rotation.identity(), **arguments)
