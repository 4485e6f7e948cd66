"""The contact force of a person's shoulder: literature, symmetry, scaling and another centre."""

import numpy as np
import pytest
from mirror_image import MIRROR, mirrored
from scipy.spatial.transform import Rotation

import exo_pin as ep

pytest.importorskip("myo_sim", reason="needs the extra person: pip install '.[person]'")

GRAVITY = np.array([0.0, 0.0, -9.81])
PERSON = ep.Person(1.75, 75, "male")
FREE = ep.ContactOptions(cone=None)


def abduction(*degrees, side="left"):
    return ep.shoulder_rotation(0, np.array(degrees, dtype=float), 0, side=side, degrees=True)


def some_poses(count, seed, side="left"):
    angles = np.random.default_rng(seed).uniform([-15, 5, -30], [80, 100, 40], (count, 3)).T
    return ep.shoulder_rotation(*angles, side=side, degrees=True)


@pytest.mark.parametrize("elbow", [0.0, 40.0, 120.0])
def test_a_force_in_the_hand_is_a_payload_there(elbow):
    person = ep.Person(1.75, 75, "male", elbow_flexion=elbow, degrees=True)
    bend, forearm = person.elbow_flexion, person.forearm_length
    hand = [forearm * np.sin(bend), 0.0, -person.upper_arm_length - forearm * np.cos(bend)]
    pose = ep.shoulder_rotation(50, 20, 0, degrees=True)
    pushed = person.joint_contact(pose, load=ep.Load(1.5 * GRAVITY, at=hand))
    np.testing.assert_allclose(pushed.force, person.with_changes(payload=1.5).joint_contact(pose).force, atol=1e-4)
    # What presses on the upper arm is nothing to the elbow.
    above = ep.Load([0.0, 0.0, -15.0], at=[0.0, 0.0, -0.6 * person.upper_arm_length])
    found = [
        person.joint_contact(pose, load=above, options=ep.ContactOptions(load_on=on)).force
        for on in (None, "upper arm")
    ]
    assert np.array_equal(*found)


def test_elbow_carries_forearm_hand_and_payload():
    person = ep.Person(1.75, 75, "male", elbow_flexion=90, payload=3.0, degrees=True)
    result = person.joint_contact(Rotation.identity())
    forearm = person.forearm
    assert forearm.mass == pytest.approx(person.arm.mass - 0.0271 * 75)
    moment = forearm.mass * 9.81 * forearm.centre_of_mass[0]
    arms = person.limb_state(Rotation.identity()).elbow[0]
    # The axis of flexion is 2.8° off the y axis.
    assert float(arms @ result.muscle_forces) == pytest.approx(moment, rel=0.01)


def test_contact_force_is_of_the_size_that_is_known():
    """Body weights at 30, 60 and 90° of abduction; measured and computed values are within 30 to 100 % at 60 to 90°."""
    share = PERSON.joint_contact(abduction(30, 60, 90)).percent_body_weight
    assert share == pytest.approx([34.6, 66.4, 59.5], abs=0.2)
    # A trial with other strengths, without force-length relation and socket: 55, 54 and 49 %.
    free = PERSON.joint_contact(abduction(30, 60, 90), options=FREE).percent_body_weight
    assert ((free > 30.0) & (free < 75.0)).all()
    lifted = ep.shoulder_rotation([30, 60, 90], 0, 0, degrees=True)
    assert PERSON.joint_contact(lifted).percent_body_weight == pytest.approx([11.4, 37.7, 72.2], abs=0.3)
    loaded = PERSON.with_changes(payload=2.0).joint_contact(abduction(30, 60, 90))
    assert (loaded.percent_body_weight > 1.4 * share).all()


def test_right_arm_is_the_mirror_image():
    poses = some_poses(8, 2)
    motion = ep.Motion([0.5, -0.4, 0.8], [1.0, 2.0, -3.0])
    load = ep.Load([3.0, 4.0, -5.0], moment=[0.1, 0.2, 0.3], at=(0.01, 0.02, -0.1))
    wrench = np.array([4.0, -3.0, 20.0, 0.5, 0.2, -0.1])
    left = PERSON.joint_contact(poses, motion, load, wrench)
    turned = ep.Motion(-motion.angular_velocity @ MIRROR, -motion.angular_acceleration @ MIRROR)
    pushed = ep.Load(load.force @ MIRROR, -load.moment @ MIRROR, load.at @ MIRROR)
    other = np.concatenate([wrench[:3] @ MIRROR, -wrench[3:] @ MIRROR])
    right = PERSON.on_side("right").joint_contact(mirrored(poses), turned, pushed, other)
    assert right.side == "right"
    assert np.abs(left.force - right.force @ MIRROR).max() < 1e-9 * left.magnitude.max()
    assert np.abs(left.activations - right.activations).max() < 1e-9
    assert np.abs(left.centre - right.centre @ MIRROR).max() < 1e-9
    assert np.abs(left.device_wrench[:, 3:] + right.device_wrench[:, 3:] @ MIRROR).max() < 1e-9


def test_a_bigger_person_of_the_same_shape():
    """Lengths by 1.2, masses by 1.2³: moments by 1.2⁴, lever arms by 1.2, forces by 1.2³ and strengths by 1.2²."""
    poses, k = some_poses(5, 5), 1.2
    small, big = ep.Person(1.6, 55, "female"), ep.Person(1.6 * k, 55 * k**3, "female")
    assert big.length_scale == pytest.approx(k * small.length_scale)
    assert big.strength_scale == pytest.approx(k**2 * small.strength_scale)
    one, two = small.joint_contact(poses), big.joint_contact(poses)
    assert np.allclose(two.force, k**3 * one.force, rtol=1e-7)
    assert np.allclose(two.activations, k * one.activations, atol=1e-8)


def test_shifted_centre_is_the_same_as_shifted_moments():
    shift = np.array([0.002, -0.003, 0.004])
    wrench = np.array([10.0, 5.0, 30.0, 0.0, 0.0, 0.0])
    moved = PERSON.joint_contact(abduction(50)[0], device=wrench, options=ep.ContactOptions(centre_shift=shift))
    state = PERSON.limb_state(abduction(50)[0])
    pull, arm = state.pull[0], state.moment[0] - np.cross(shift, state.pull[0])
    weight = PERSON.arm.mass * GRAVITY
    at = abduction(50)[0].as_matrix() @ PERSON.arm.centre_of_mass - shift
    moment = moved.muscle_forces @ arm + np.cross(at, weight) - np.cross(shift, wrench[:3])
    assert np.abs(moment).max() < 1e-9 * moved.magnitude
    assert np.abs(moved.force + moved.muscle_forces @ pull + weight + wrench[:3]).max() < 1e-9 * moved.magnitude
