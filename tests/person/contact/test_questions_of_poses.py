"""The same arm is solved once, and what becomes of a pose without an answer."""

from dataclasses import replace

import numpy as np
import pytest

import exo_pin as ep

pytest.importorskip("myo_sim", reason="needs the extra person: pip install '.[person]'")

from muscle_poses import some_pose

from exo_pin.person.contact import query

PERSON = ep.Person(1.75, 75, "male")
POSES = ep.shoulder_rotation([20.0, 40.0], [30.0, 60.0], 0, degrees=True)


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
