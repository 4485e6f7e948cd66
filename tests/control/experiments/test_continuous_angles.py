"""Angles over time that do not jump: against the angles that a movement was made of."""

from dataclasses import replace

import numpy as np
import pytest

import exo_pin as ep


@pytest.fixture(scope="module")
def tracking():
    return ep.experiment("abduction-long").replace(duration=0.02).run()


def angles(tracking, path, convention):
    made = ep.thesis_rotation if convention == "thesis" else ep.shoulder_rotation
    return replace(tracking, wanted=made(*path.T, degrees=True)).angles(wanted=True, convention=convention)


@pytest.mark.parametrize("convention", ["shoulder", "thesis"])
def test_angles_of_a_movement_are_those_it_was_made_of(tracking, convention):
    rng = np.random.default_rng(12)
    for _ in range(20):
        # Through both locks of abduction, and over half a turn of flexion.
        path = rng.uniform(-60.0, 60.0, 3) + np.linspace(0.0, 1.0, 800)[:, None] * rng.uniform(-230.0, 230.0, 3)
        np.testing.assert_allclose(angles(tracking, path, convention), path, atol=1e-4)
    # Exactly at the lock, in a movement that turns about the arm's own axis there.
    for middle in (90.0, -90.0):
        path = np.array([[20.0, 0.9 * middle, 10.0], [20.0, middle, 10.0], [20.0, middle, 35.0], [20.0, middle, 60.0]])
        np.testing.assert_allclose(angles(tracking, path, convention), path, atol=1e-4)
