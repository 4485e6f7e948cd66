"""What lengths cannot determine: found by rank, as derived, and shown by moving joints without a length changing."""

import numpy as np
import pytest
from measured_devices import measured, near, poses
from scipy.spatial.transform import Rotation

import exo_pin as ep

JOINTS = ("base_points", "platform_points")
FRAMES = (*JOINTS, "torso_mounting", "arm_mounting")
OFFSETS = (*JOINTS, "base_offset", "cuff_offset")


def calibrated(unknowns, arm=None, exo=None, noise=None, **device):
    rng = np.random.default_rng(40)
    exo = ep.load("prototype") if exo is None else exo
    arm = poses(rng, 60) if arm is None else arm
    seen, lengths = measured(near(exo, rng, **device), arm, rng, 0.0 if noise is None else noise)
    return ep.calibrate(seen, lengths, exo, unknowns=unknowns, length_noise=noise)


def check_directions(found, count):
    """So many directions, independent, along each of which no length changes but in the second order."""
    exact = [direction for direction in found.undetermined if direction.is_exact]
    assert len(exact) == count
    directions = np.array([direction.direction for direction in exact]).reshape(count, found.model.size)
    assert count == 0 or np.linalg.matrix_rank(directions / found.model.scales, tol=1e-3) == count
    measured, values = found.poses.as_matrix(), found.values
    for direction in directions:
        step = 1e-4 * direction / np.linalg.norm(direction)
        ahead, behind = (found.model.lengths(values + sign * step, measured) for sign in (1, -1))
        # The first-order change, over a step of 0.1 mm.
        assert np.abs(ahead - behind).max() < 1e-10
    lost = np.isinf(found.standard_deviations)
    touched = np.abs(directions).max(axis=0, initial=0.0) > 1e-5
    np.testing.assert_array_equal(lost, touched)
    assert np.isnan(found.covariance[lost][:, ~lost]).all()


@pytest.mark.parametrize(
    ("unknowns", "count"),
    [
        (JOINTS, 0),
        ((*JOINTS, "length_offsets"), 0),
        (("base_offset", "cuff_offset", "length_offsets", "torso_mounting", "arm_mounting"), 0),
        (OFFSETS, 6),
        (FRAMES, 6),
        (("base_points", "torso_mounting", "base_offset"), 6),
    ],
)
def test_directions_of_general_poses(unknowns, count):
    """All joints of a ring one way and its offset the other, and a frame that turns with its joints: three each."""
    found = calibrated(unknowns, mounting=0.2 if "torso_mounting" in unknowns else 0.0)
    check_directions(found, count)
    for direction in found.undetermined:
        # The largest component is one, and is among those that are named.
        largest = int(np.abs(direction.direction).argmax())
        assert abs(direction.direction[largest]) == 1.0
        assert "1 " in direction.description.split(",")[0]


def test_finite_moves_of_frame_and_ring_change_no_length():
    # Not only to first order: a ring that turns with its frame by 40°, and one that is shifted against its offset.
    found = calibrated((*FRAMES, "base_offset"), mounting=0.2)
    a, b = found.joints
    turn = Rotation.from_rotvec([0.3, -0.5, 0.4])
    torso, arm = found.torso_mounting, found.arm_mounting
    measured = found.poses

    def lengths(torso, arm, a, b):
        return np.linalg.norm(np.swapaxes((torso * measured * arm).as_matrix() @ b.T, 1, 2) - a, axis=2)

    plain = lengths(torso, arm, a, b)
    np.testing.assert_allclose(lengths(turn * torso, arm, turn.apply(a), b), plain, atol=1e-13)
    np.testing.assert_allclose(lengths(torso, arm * turn.inv(), a, turn.apply(b)), plain, atol=1e-13)


def test_too_few_poses():
    found = calibrated(JOINTS, poses(np.random.default_rng(2), 4), noise=3e-4)
    check_directions(found, 6)
    assert found.degrees_of_freedom == 0
    assert np.isnan(found.probability)
    assert "12 lengths for 18 unknowns: measure more poses" in str(found)
