"""A path of the anatomical centre as the arm is lifted."""

import numpy as np
import pytest
from guided_limbs import guided

import exo_pin as ep

DEGREES = {"degrees": True}


@pytest.fixture(scope="module")
def exo():
    return guided(ep.load("prototype").worn_by(ep.Arm.from_anthropometry(1.75, 75, "male")), stiffness=2e4 * np.eye(3))


def test_centre_path(exo):
    angles = np.radians([0.0, 30.0, 90.0, 150.0])
    moved = np.array([[0, 0, 0], [0, 0.001, 0.002], [0, -0.002, 0.012], [0.001, -0.01, 0.02]])
    path = ep.CentrePath(angles, moved)
    np.testing.assert_allclose(path.at(angles), moved, atol=1e-15)
    between = path.at(np.linspace(angles[0], angles[-1], 400))
    assert between[:, 2].min() >= 0
    assert (np.diff(between[:, 2]) >= 0).all()
    poses = ep.shoulder_rotation([30, 60, 90], [20, 30, 40], 0, **DEGREES)
    answer = exo.reaction(poses, split="elastic", centre_offset=path)
    # The arm hangs along -z: its angle from there, whichever way and whatever it turns about itself.
    elevations = np.arccos(poses.as_matrix()[:, 2, 2])
    by_hand = exo.reaction(
        poses, split="elastic", centre_offset=ep.CentreOffset.of_moving_shoulder(path.at(elevations))
    )
    np.testing.assert_allclose(answer.shoulder_force, by_hand.shoulder_force, rtol=1e-12)
    assert not np.allclose(answer.shoulder_force, exo.reaction(poses, split="elastic").shoulder_force, rtol=1e-3)
    other = exo.mirrored().reaction(
        ep.shoulder_rotation([30, 60, 90], [20, 30, 40], 0, side="right", **DEGREES),
        split="elastic",
        centre_offset=path.mirrored(),
    )
    np.testing.assert_allclose(other.magnitude, answer.magnitude, rtol=1e-9)
    with pytest.raises(ep.InvalidInput, match="known"):
        path.at(np.radians(170.0))
    with pytest.raises(ep.InvalidInput, match="degrees"):
        ep.CentrePath([0.0, 30.0], moved[:2])
    with pytest.raises(ep.InvalidInput, match="millimetres"):
        ep.CentrePath(angles, 1e3 * moved)
