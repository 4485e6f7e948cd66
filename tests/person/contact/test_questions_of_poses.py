"""What the query asks of the muscles in each pose, and what becomes of a pose without an answer."""

from dataclasses import replace

import numpy as np
import pytest
from scipy.spatial.transform import Rotation

import exo_pin as ep
from exo_pin import OutsideRangeOfMotion
from exo_pin.load_case.pose_stacks import as_query
from exo_pin.person import MUSCLES

pytest.importorskip("myo_sim", reason="needs the extra person: pip install '.[person]'")

from muscle_poses import some_pose

from exo_pin.person.contact import query
from exo_pin.person.contact.query import Balance

PERSON = ep.Person(1.75, 75, "male")
POSES = ep.shoulder_rotation([20.0, 40.0], [30.0, 60.0], 0, degrees=True)
FREE = ep.ContactOptions(cone=None)


@pytest.fixture
def asked(monkeypatch):
    """The poses as the choice of the activations gets them."""
    monkeypatch.setattr(query, "_solve_pose", query._solve_pose.__wrapped__)
    found, original = [], query.least_effort
    monkeypatch.setattr(query, "least_effort", lambda pose: (found.append(pose), original(pose))[1])
    return found


def test_the_same_arm_is_solved_once_whatever_the_device(monkeypatch):
    query._solve_pose.cache_clear()
    solved, original = [], query.least_effort
    monkeypatch.setattr(query, "least_effort", lambda pose: (solved.append(pose), original(pose))[1])
    lifts = np.array([[0.0, 0.0, each, 0.0, -0.1 * each, 0.0] for each in (5.0, 10.0)])
    first, second = (PERSON.joint_contact(POSES, device=lift) for lift in lifts)
    # Of the bare arm and of two devices, two poses each.
    assert len(solved) == 6
    np.testing.assert_array_equal(first.without_device.force, second.without_device.force)
    np.testing.assert_array_equal(PERSON.joint_contact(POSES[::-1]).force, first.without_device.force[::-1])
    assert len(solved) == 6


def test_what_is_asked_of_the_muscles(asked):
    options = ep.ContactOptions(power=3, weights="volume", cone=ep.GlenoidCone(superior=0.5, anterior=0.4))
    answer = PERSON.on_side("right").joint_contact(
        ep.shoulder_rotation(20, 50, 0, "right", degrees=True), options=options
    )
    (pose,) = asked
    volume = PERSON.muscle_table.volume
    np.testing.assert_allclose(pose.weights, volume * len(volume) / volume.sum())
    assert (pose.power, pose.least, pose.stopped) == (3, "effort", True)
    np.testing.assert_allclose(pose.socket * [[1.0], [0.5], [0.4]], answer.glenoid, atol=1e-15)
    assert pose.low.tolist() == [0.0] * len(MUSCLES)
    assert pose.high.tolist() == [1.0] * len(MUSCLES)
    np.testing.assert_allclose(pose.pull @ answer.activations + pose.rest, answer.force, atol=1e-9)
    np.testing.assert_allclose((pose.rows @ answer.activations + pose.constant)[[0, 1, 2, 4]], 0.0, atol=1e-9)


@pytest.mark.parametrize(("degrees", "stopped"), [(0.0, True), (0.98, True), (1.02, False), (60.0, False)])
def test_a_straight_elbow_rests_on_its_stop(asked, degrees, stopped):
    PERSON.with_changes(elbow_flexion=np.radians(degrees)).joint_contact(POSES[0], options=FREE)
    assert asked[0].stopped == stopped
    assert asked[0].socket is None
    assert asked[0].weights.tolist() == [1.0] * len(MUSCLES)


def test_given_limb_forces_are_loads_and_the_others_are_chosen(asked):
    """Whether a given force is one of the limbs or part of the constant wrench."""
    rng = np.random.default_rng(4)
    limbs = np.concatenate([rng.normal(size=(4, 3)), 0.1 * rng.normal(size=(4, 3))], axis=1)
    low, high = np.array([0.0, 15.0, -5.0, -20.0]), np.array([60.0, 15.0, 40.0, -20.0])
    constant = np.array([1.0, 2.0, 5.0, 0.1, -0.2, 0.3])
    mixed = PERSON.joint_contact(POSES, device=ep.DeviceAction(constant, limbs, low, high, side_forces=1))
    moved = constant + 15.0 * limbs[1] - 20.0 * limbs[3]
    apart = PERSON.joint_contact(POSES, device=ep.DeviceAction(moved, limbs[[0, 2]], low[[0, 2]], high[[0, 2]]))
    assert (mixed.status == "ok").all()
    np.testing.assert_allclose(mixed.device_forces, np.insert(apart.device_forces, 1, 15.0, axis=-1), atol=1e-6)
    # Of a left arm: side forces have the other sign in the mirror image, and back.
    np.testing.assert_allclose(mixed.constraint_forces, -20.0)
    np.testing.assert_allclose(mixed.device_wrench, apart.device_wrench, atol=1e-6)
    np.testing.assert_allclose(mixed.force, apart.force, atol=1e-5)
    # Of the bare arm, of the mixed action and of the other, two poses each.
    assert [len(pose.low) - pose.muscles for pose in asked] == [0, 0, 2, 2] * 2
    assert (mixed.device_forces[:, [0, 2]] >= low[[0, 2]] - 1e-9).all()
    wrench = constant + np.concatenate([mixed.device_forces, mixed.constraint_forces], axis=1) @ limbs
    np.testing.assert_allclose(mixed.device_wrench, wrench, atol=1e-9)


def test_least_contact_is_asked_only_where_forces_are_chosen(asked):
    limbs = np.eye(6)[[2]]
    for high, least in ((50.0, "contact"), (0.0, "effort")):
        action = ep.DeviceAction(np.zeros(6), limbs, np.zeros(1), np.array([high]), least="contact")
        PERSON.joint_contact(POSES[0], device=action)
        assert asked[-1].least == least


@pytest.mark.parametrize("name", ["limbs", "lower", "upper"])
def test_a_missing_number_takes_its_pose_alone(name):
    fields = {"limbs": np.ones((2, 1, 6)), "lower": np.zeros((2, 1)), "upper": np.ones((2, 1))}
    fields[name][1, 0, ...] = np.nan
    found = PERSON.joint_contact(POSES, device=ep.DeviceAction(np.zeros(6), **fields))
    assert found.status.tolist() == ["ok", "no_device_force"]
    for values in (found.force, found.activations, found.muscle_forces, found.device_forces, found.device_wrench):
        assert np.isfinite(values[0]).all()
        assert np.isnan(values[1]).all()
    assert np.isnan([found.kkt[1], found.gap[1]]).all()
    assert found.without_device.status.tolist() == ["ok", "ok"]


def test_outside_counts_before_a_missing_force():
    poses = ep.shoulder_rotation(
        [[30.0, 20.0], [160.0, 30.0], [60.0, -90.0]], [[0.0] * 2, [-80.0, 0.0], [0.0] * 2], 0, degrees=True
    )
    marked = PERSON.joint_contact(poses, outside="mark", device=np.zeros(6))
    outside = ~PERSON.allows(poses)
    assert outside.any()
    assert ((marked.status == "outside") == outside).all()
    first = tuple(int(i[0]) for i in np.nonzero(outside))
    with pytest.raises(OutsideRangeOfMotion) as told:
        PERSON.joint_contact(poses)
    assert told.value.index == first
    assert told.value.count == outside.sum()
    state = PERSON.limb_state(poses[first])
    which = int(np.argmax(state.outside))
    assert f"of {np.degrees(state.angles.reshape(-1)[which]):.1f}°" in told.value.reason
    with pytest.raises(OutsideRangeOfMotion) as told:
        PERSON.joint_contact(Rotation.from_matrix(poses.as_matrix()[first]))
    assert told.value.index == ()


def test_rates_of_the_lengths_are_powers_of_the_moments():
    """Virtual work about a scapula that is held: the rate of a length is minus its moment times the angular rate."""
    person = PERSON.on_side("right").with_changes(scapular_motion=0.0, elbow_flexion=0.5)
    poses = ep.shoulder_rotation([20.0, 50.0, 40.0], [30.0, 40.0, 60.0], [0.0, 20.0, -10.0], "right", degrees=True)
    motion = ep.Motion([[0.2, -0.3, 0.1], [0.0, 0.0, 0.0], [-3.0, 1.0, 0.2]], np.zeros(3))
    rates = query._length_rates(person, as_query(poses, motion, None))
    state = person.limb_state(poses)
    expected = -np.einsum("nmi,ni->nm", state.moment, motion.angular_velocity)
    np.testing.assert_allclose(rates, expected, atol=2e-6)
    assert np.abs(rates[[0, 2]]).max(axis=1).min() > 0.005
    assert (rates[1] == 0.0).all()


def test_residual_is_what_the_moments_miss_of_their_sum():
    rng = np.random.default_rng(6)
    rows, constant, a, wrench = (
        rng.normal(size=(2, 5, 4)),
        rng.normal(size=(2, 5)),
        rng.uniform(size=(2, 4)),
        rng.normal(size=(2, 6)),
    )
    rows[1], constant[1], wrench[1] = 0.0, 0.0, 0.0
    balance = Balance(rows, constant, np.zeros((2, 3, 4)), np.zeros((2, 3)))
    outer = constant[0] + np.concatenate([wrench[0, 3:], np.zeros(2)])
    miss = np.array([sum(rows[0, k, j] * a[0, j] for j in range(4)) + outer[k] for k in range(5)])
    size = np.abs(rows[0] * a[0]).sum() + np.abs(outer).sum()
    for stopped in (False, True):
        # The stop holds what would extend: a moment of one sign.
        counted = np.where((np.arange(5) == 3) & stopped, np.maximum(miss, 0.0), miss)
        found = query._residual(balance, a, wrench, stopped)
        np.testing.assert_allclose(found, [np.abs(counted).max() / size, 0.0], rtol=1e-13)
    # A moment that bends is missed with the stop, too, and one that extends is not.
    for sign, missed in ((1.0, True), (-1.0, False)):
        only = Balance(np.zeros((1, 5, 4)), sign * np.eye(5)[[3]], np.zeros((1, 3, 4)), np.zeros((1, 3)))
        assert (query._residual(only, a[:1], np.zeros((1, 6)), stopped=True)[0] > 0.0) == missed
    assert (constant[0] != outer).any()


def weak(rim):
    pose = some_pose(2, rim=rim)
    return replace(pose, high=np.full(12, 0.1))


@pytest.mark.parametrize(("rim", "missing", "status"), [
    (True, [(1e-5, True)], "too_weak"),
    (True, [(1e-5, False)], "not_solved"),
    (True, [(0.0, True), (1e-5, True)], "unstable"),
    (True, [(0.9e-6, True), (np.nan, True)], "unstable"),
    (True, [(0.0, True), (1e-5, False)], "not_solved"),
    (True, [(0.0, True), (0.9e-6, True)], "not_solved"),
    (False, [(0.9e-6, True)], "not_solved"),
    (False, [(1.1e-6, True)], "too_weak"),
])  # fmt: skip
def test_what_becomes_of_a_pose_without_a_balance(monkeypatch, rim, missing, status):
    answers, sockets = list(missing), []

    def least_missing(_pose, in_socket):
        sockets.append(in_socket)
        moment, proved = answers.pop(0)
        return np.array([0.0, 0.0, 0.0, -moment, 0.0]), proved

    monkeypatch.setattr(query, "least_missing", least_missing)
    z, told, kkt, gap, moment = query._solve_pose.__wrapped__(weak(rim))
    assert (z, told) == (None, status)
    assert sockets == [False, True][: len(missing)]
    assert np.isnan([kkt, gap]).all()
    np.testing.assert_array_equal(moment[3], 0.0 if status == "not_solved" else -missing[-1][0])


def test_missing_moments_come_back_with_their_pose():
    found = PERSON.with_changes(strength=0.2).joint_contact(POSES, options=FREE)
    assert found.status.tolist() == ["ok", "too_weak"]
    assert found.body_weight == pytest.approx(75.0 * 9.81, rel=1e-12)
    assert np.isnan(found.kkt).tolist() == np.isnan(found.gap).tolist() == [False, True]
    for missing in (found.missing_moment, found.missing_elbow):
        assert not missing[0].any()
    assert np.linalg.norm(found.missing_moment[1]) > 0.1
    assert found.residual[0] < 1e-12
