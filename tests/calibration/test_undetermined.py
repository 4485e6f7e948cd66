"""What lengths cannot determine: found by rank, as derived, and shown by moving joints without a length changing."""

import numpy as np
import pytest
from measured_devices import measured, near, poses, random_exo
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


@pytest.mark.parametrize("limbs", [3, 4])
def test_poses_about_one_axis_determine_three_of_six_coordinates_of_a_limb(limbs):
    rng = np.random.default_rng(41)
    axis = Rotation.from_rotvec(np.outer(np.linspace(0, 2, 30), [0.6, -0.64, 0.48]))
    arm = Rotation.from_rotvec([0.2, 0.3, -0.1]) * axis
    found = calibrated(JOINTS, arm, random_exo(rng, limbs))
    check_directions(found, 3 * limbs)
    # What is not determined stays near the design: joints have moved by no more than the device differs from it.
    assert np.linalg.norm(found.values) < 1.1 * 0.004 * np.sqrt(6 * limbs) * 1.5


def test_abduction_and_flexion_alone_leave_one_direction_of_each_limb():
    # A sweep gives three numbers of a limb, two sweeps from one pose five; six are unknown.
    half = np.linspace(0, 90, 20)
    arm = ep.shoulder_rotation(np.append(half, 0 * half), np.append(0 * half, half), 0, degrees=True)
    found = calibrated(JOINTS, arm)
    check_directions(found, 3)
    check_directions(calibrated(JOINTS, arm * ep.thesis_rotation(0, 0, np.tile([0.0, 20.0], 20), degrees=True)), 0)


@pytest.mark.full
def test_noise_hides_that_poses_turn_about_one_axis_and_the_report_still_says_it():
    arm = ep.shoulder_rotation(np.linspace(0, 100, 40), 0, 0, degrees=True)
    wobble = Rotation.from_rotvec(1e-3 * np.random.default_rng(1).normal(size=(40, 3)))
    found = calibrated(JOINTS, arm * wobble, noise=3e-4)
    assert len(found.undetermined) >= 6
    for direction in found.undetermined:
        assert direction.standard_deviation > 0.01
    assert "standard deviation" in str(found)


def test_joints_at_equal_distances_as_on_the_test_rig():
    # |A_i| = |B_i| = 219.2 mm: moving A_i out and B_i in changes lengths in the second order only.
    geometry = ep.load("prototype").geometry
    base, platform = (0.2192 * x / np.linalg.norm(x, axis=1)[:, None] for x in (geometry.base_points,
                                                                               geometry.platform_points))  # fmt: skip
    exo = ep.load("prototype").replace(geometry=geometry.replace(base_points=base, platform_points=platform))
    found = calibrated(JOINTS, exo=exo, joints=0.0)
    check_directions(found, 3)
    # Of one limb each: A_i away from the centre, B_i towards it.
    for direction in found.undetermined:
        parts = direction.direction.reshape(2, 3, 3)
        limb = int(np.abs(parts).max(axis=(0, 2)).argmax())
        away = np.zeros((2, 3, 3))
        away[:, limb] = base[limb], -platform[limb]
        away *= parts[0, limb, 0] / base[limb, 0]
        np.testing.assert_allclose(parts, away, atol=1e-3)


def test_too_few_poses():
    found = calibrated(JOINTS, poses(np.random.default_rng(2), 4), noise=3e-4)
    check_directions(found, 6)
    assert found.degrees_of_freedom == 0
    assert np.isnan(found.probability)
    assert "12 lengths for 18 unknowns: measure more poses" in str(found)


def test_tolerances_bound_what_measurements_do_not():
    rng = np.random.default_rng(43)
    exo = ep.load("prototype")
    seen, lengths = measured(near(exo, rng, 0.001, rings=(0.01, 0.01)), poses(rng, 60), rng, 3e-4)
    found = ep.calibrate(
        seen, lengths, exo, unknowns=OFFSETS, length_noise=3e-4, tolerances=dict.fromkeys(JOINTS, 0.001)
    )
    # The measurements alone cannot separate joints and offset; that joints are within 1 mm can.
    assert sum(direction.is_exact for direction in found.undetermined) == 6
    assert np.isfinite(found.covariance).all()
    assert (np.linalg.eigvalsh(found.covariance) > 0).all()
    tight = found.standard_deviations[found.model.places["base_points"]]
    assert (tight < 0.001).all()
