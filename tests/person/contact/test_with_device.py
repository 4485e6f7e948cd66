"""The contact force with a device on."""

import numpy as np
import pytest
from mirror_image import mirrored

import exo_pin as ep
from exo_pin import InvalidInput, UnknownName

pytest.importorskip("myo_sim", reason="needs the extra person: pip install '.[person]'")

PERSON = ep.Person(1.75, 75, "male")
POSES = ep.shoulder_rotation(0, np.array([30.0, 45.0, 60.0, 75.0]), 0, degrees=True)


@pytest.fixture(scope="module")
def device():
    return ep.load("prototype").replace(limbs=None)


def test_device_that_carries_the_arm_relieves_the_joint(device):
    result = device.joint_contact(POSES, PERSON)
    assert (result.relief_percent > 25.0).all()
    assert (result.relief_percent[1:] > 55.0).all()
    assert result.assumptions["device"].startswith("limbs carry 100 %")
    # Its limbs leave no moment for the shoulder's muscles.
    moment = result.device_wrench[:, 3:]
    weight = PERSON.arm.mass * ep.load("prototype").mechanism.gravity
    carried = np.cross(POSES.as_matrix() @ PERSON.arm.centre_of_mass, weight)
    assert np.abs(moment + carried).max() < 1e-9
    # Muscles, joint and device together balance the arm.
    assert (result.residual < 1e-9).all()


def test_share_runs_from_a_transparent_device_to_one_that_carries_all(device):
    shares = [device.joint_contact(POSES, PERSON, share) for share in (0.0, 0.5, 1.0)]
    assert np.abs(shares[0].device_wrench[:, 3:]).max() < 1e-9
    middle = 0.5 * (shares[0].device_forces + shares[2].device_forces)
    assert np.allclose(shares[1].device_forces, middle)
    efforts = [result.effort for result in shares]
    assert (efforts[0] > efforts[1]).all()
    assert (efforts[1] > efforts[2]).all()


def test_limb_forces_are_those_of_the_reaction(device):
    reaction = device.worn_by(PERSON).reaction(POSES)
    given = device.joint_contact(POSES, PERSON, reaction)
    computed = device.joint_contact(POSES, PERSON)
    assert np.allclose(given.device_forces, computed.device_forces)
    assert np.allclose(given.force, computed.force, atol=1e-4)
    again = device.joint_contact(POSES, PERSON, reaction.actuator_forces)
    assert np.allclose(again.force, computed.force, atol=1e-4)


def test_worn_by_a_person_is_worn_by_the_arm(device):
    one, two = device.worn_by(PERSON), device.worn_by(PERSON.arm)
    assert np.array_equal(one.reaction(POSES).shoulder_force, two.reaction(POSES).shoulder_force)


def test_limits_of_the_design_are_those_of_its_actuators():
    cables = ep.load("four-cables")
    pose = cables.pose(flexion=20, abduction=60)
    own = cables.joint_contact(pose, PERSON, "least_effort", limits="design")
    pull = cables.limbs[0].actuator.pull_limit
    given = cables.joint_contact(pose, PERSON, "least_effort", limits=(0.0, pull))
    assert np.array_equal(own.device_forces, given.device_forces)


def test_chosen_forces_respect_bounds_and_beat_any_share(device):
    best = device.joint_contact(POSES, PERSON, "least_effort", limits=(0.0, 400.0))
    assert (best.status == "ok").all()
    assert (best.device_forces >= 0.0).all()
    assert (best.device_forces <= 400.0).all()
    free = device.joint_contact(POSES, PERSON, "least_effort")
    assert (free.effort <= best.effort + 1e-9).all()
    assert (free.effort <= device.joint_contact(POSES, PERSON, 1.0).effort + 1e-9).all()
    none = device.joint_contact(POSES, PERSON, np.zeros(3))
    assert (best.effort <= none.effort + 1e-9).all()


def test_least_contact_is_a_lower_bound(device):
    bounds = (0.0, 400.0)
    least = device.joint_contact(POSES, PERSON, "least_contact", limits=bounds)
    effort = device.joint_contact(POSES, PERSON, "least_effort", limits=bounds)
    assert (least.magnitude <= effort.magnitude + 1e-6).all()
    assert "lower bound" in least.assumptions["device"]


def test_both_sides_give_mirrored_results(device):
    left = device.joint_contact(POSES, PERSON)
    poses = ep.shoulder_rotation(0, np.array([30.0, 45.0, 60.0, 75.0]), 0, side="right", degrees=True)
    right = device.mirrored().joint_contact(poses, PERSON)
    assert np.allclose(left.force, right.force * [1, -1, 1], atol=1e-6)
    assert np.allclose(left.relief_percent, right.relief_percent, atol=1e-6)


def test_side_forces_of_the_mirror_image_have_the_other_sign(device):
    low, high = np.array([-20.0, -30.0, -5.0]), np.array([10.0, 15.0, 40.0])
    left = device.joint_contact(POSES[1], PERSON, "least_contact", limits=100.0, constraint_bounds=(low, high))
    bounds = {"limits": 100.0, "constraint_bounds": (-high, -low)}
    right = device.mirrored().joint_contact(mirrored(POSES[1]), PERSON, "least_contact", **bounds)
    assert np.abs(left.constraint_forces).min() > 1.0
    assert np.allclose(right.constraint_forces, -left.constraint_forces, atol=1e-4)
    for one, other in ((left, right), (right, left)):
        assert np.allclose(one.mirrored().constraint_forces, other.constraint_forces, atol=1e-4)
        assert np.allclose(one.mirrored().device_wrench, other.device_wrench, atol=1e-4)


def test_moving_centre_of_the_shoulder_changes_the_relief(device):
    poses = POSES[:3]
    fixed = device.joint_contact(poses, PERSON, centre_offset=PERSON.centre_path())
    ideal = device.joint_contact(poses, PERSON)
    assert (fixed.status == "ok").all()
    assert np.abs(fixed.device_forces - ideal.device_forces).max() > 1.0
    # Either way the limbs carry the moments about the shoulder where it is.
    assert np.allclose(fixed.device_wrench[:, 3:], ideal.device_wrench[:, 3:], atol=1e-9)


def test_device_that_pulls_the_head_out_of_the_socket_is_unstable(device):
    result = device.joint_contact(POSES[3], PERSON, [-9600.0, 11100.0, -6400.0])
    assert result.status in ("unstable", "too_weak")
    assert np.isnan(result.force).all()
    pulled = PERSON.joint_contact(POSES[1], device=np.array([0.0, 9e3, 0.0, 0.0, 0.0, 0.0]))
    assert pulled.status == "unstable"
    assert np.isnan(pulled.missing_moment).all()


def test_pose_without_limb_forces_is_marked(device):
    pose = ep.shoulder_rotation(0, 90, 0, degrees=True)
    result = device.joint_contact(pose, PERSON)
    assert result.status == "no_device_force"
    assert result.without_device.status == "ok"
    assert "no limb forces" in result.verdict


@pytest.mark.full
def test_range_over_the_assumptions_includes_the_device(device):
    found = device.contact_range(POSES[2], PERSON)
    low, high = found.relief_percent
    assert 0.0 < low < found.reference.relief_percent < high < 100.0


@pytest.mark.parametrize(
    ("arguments", "error", "message"),
    [
        ({"forces": 50}, InvalidInput, "percent"),
        ({"forces": "all"}, UnknownName, "least_effort"),
        ({"forces": [1.0, 2.0]}, InvalidInput, "shape"),
        ({"forces": 1.0, "limits": "push"}, UnknownName, "pull"),
        ({"person": PERSON.arm}, InvalidInput, "Person"),
    ],
)
def test_wrong_arguments_are_refused(device, arguments, error, message):
    with pytest.raises(error, match=message):
        device.joint_contact(POSES, **{"person": PERSON, **arguments})


def test_reaction_of_other_poses_is_refused(device):
    reaction = device.worn_by(PERSON).reaction(POSES[:2])
    with pytest.raises(InvalidInput, match="same poses"):
        device.joint_contact(POSES, PERSON, reaction)
    with pytest.raises(InvalidInput, match="its own"):
        device.joint_contact(POSES[:2], PERSON, reaction, centre_offset=PERSON.centre_path())


def test_what_passes_through_the_wearer_is_said_beside_the_relief():
    """With a bent elbow and with the device's centre off, as the reaction of the same pose says."""
    cables = ep.load("four-cables")
    pose, moving = cables.pose(60, 10), PERSON.centre_path()
    bent = ep.Person(1.755, 85, "male", elbow_flexion=90, degrees=True)
    for person, given in ((bent, {}), (PERSON, {"centre_offset": moving})):
        said = cables.worn_by(person).reaction(pose, **given).verdict.partition("As it is worn, ")[2]
        for forces in (1.0, "least_effort"):
            verdict = cables.joint_contact(pose, person, forces, **given).verdict
            assert verdict.partition("As it is worn, ")[2].startswith(said)
    assert "passes through the wearer's arm" in cables.joint_contact(pose, bent).verdict
    assert "As it is worn" not in cables.joint_contact(pose, PERSON).verdict
