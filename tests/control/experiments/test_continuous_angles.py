"""Angles over time that do not jump: against the angles that a movement was made of."""

import numpy as np
import pytest

import exo_pin as ep
from exo_pin import control
from exo_pin.control.experiments.tracking_report import continuous_angles


@pytest.mark.parametrize("side", ["left", "right"])
def test_clinical_angles_of_a_movement_are_those_it_was_made_of(side):
    rng = np.random.default_rng(12)
    for _ in range(20):
        start = np.radians(rng.uniform(-60.0, 60.0, 3))
        # Through both locks of abduction, and over half a turn of flexion.
        path = start + np.linspace(0.0, 1.0, 800)[:, None] * rng.uniform(-4.0, 4.0, 3)
        poses = ep.shoulder_rotation(*path.T, side=side)
        np.testing.assert_allclose(continuous_angles(ep.shoulder_angles(poses, side), -1.0), path, atol=1e-6)


def test_angles_of_the_thesis_too():
    rng = np.random.default_rng(13)
    for _ in range(20):
        path = np.linspace(0.0, 1.0, 800)[:, None] * rng.uniform(-4.0, 4.0, 3)
        poses = ep.thesis_rotation(*path.T)
        np.testing.assert_allclose(continuous_angles(ep.thesis_angles(poses), 1.0), path, atol=1e-6)


@pytest.mark.parametrize("side", ["left", "right"])
@pytest.mark.parametrize("middle", [90.0, -90.0])
def test_where_angles_lock_the_pose_is_the_same(side, middle):
    """Samples exactly at the lock, in a movement that turns about the arm's own axis there."""
    degrees = np.array([[20.0, 0.9 * middle, 10.0], [20.0, middle, 10.0], [20.0, middle, 35.0], [20.0, middle, 60.0]])
    poses = ep.shoulder_rotation(*degrees.T, side=side, degrees=True)
    found = np.degrees(continuous_angles(ep.shoulder_angles(poses, side), -1.0))
    np.testing.assert_allclose(found, degrees, atol=1e-4)
    thesis = ep.thesis_rotation(*degrees.T, degrees=True)
    np.testing.assert_allclose(np.degrees(continuous_angles(ep.thesis_angles(thesis), 1.0)), degrees, atol=1e-4)


def test_a_reference_beyond_the_horizontal_keeps_its_name():
    """Abduction to 120°: the principal angles are 180°, 60°, 180° at its end."""
    experiment = ep.experiment("abduction-outward").replace(reference=control.abduction(np.radians(120.0), 0.5))
    tracking = experiment.run()
    np.testing.assert_allclose(tracking.angles(wanted=True)[-1], [0.0, 120.0, 0.0], atol=1e-6)
    assert tracking.main_angle == 1
    assert "of 120°" in tracking.verdict
    reached = tracking.angles()
    assert np.abs(np.diff(reached, axis=0)).max() < 10.0
    poses = ep.shoulder_rotation(*reached.T, degrees=True)
    assert (poses * tracking.run.rotations.inv()).magnitude().max() < 1e-7
