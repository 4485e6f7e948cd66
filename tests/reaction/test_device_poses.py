"""Poses of devices that are not wrists: joints without drive, offsets, limits, and what is lacking."""

from dataclasses import replace
from types import SimpleNamespace

import numpy as np
import pytest
from arm_alone import arm_alone

import exo_pin as ep
from exo_pin.device import ChainDevice, Drive, Route
from exo_pin.device.device_model import DeviceModel
from exo_pin.reaction import Assumptions, device_poses
from exo_pin.reaction.answer import QUERY_STATUS
from exo_pin.reaction.constraints.actuator_limits import LimbLimits
from exo_pin.reaction.device_poses import OUT_OF_REACH, _passive_error, law_of_device
from exo_pin.reaction.splits.elastic import DeviceElastic, Elastic


@pytest.mark.parametrize("turn", [2.0 * np.pi, 2.0 * np.pi * (1.0 - 1e-10), 20.0])
def test_joints_without_drive_are_as_far_beyond_their_limits_as_the_farthest(turn, monkeypatch):
    low = np.array([-1.0, 0.5, -1.0, -0.5 * turn, 2.0])
    high = np.array([1.0, 0.75, 1.0, 0.5 * turn, 8.0])
    given = SimpleNamespace(
        lower=low, upper=high, joints=("a", "b", "driven", "round", "c"), q_index=np.array([1, 0, 2, 3, 5])
    )
    monkeypatch.setattr("exo_pin.device.device_model.limits_of", lambda model: given)
    device = SimpleNamespace(drives=(SimpleNamespace(joint="driven"), SimpleNamespace(joint=None)))
    model = SimpleNamespace(held=SimpleNamespace(model="model"), device=device)
    found = DeviceModel.passive_limits.func
    monkeypatch.setattr(device_poses, "device_model", lambda _: SimpleNamespace(passive_limits=found(model)))
    q = np.zeros((5, 6))
    q[:, 0], q[:, 5] = 0.6, 3.0
    q[1, 1], q[2, 0] = 1.25, 0.9
    q[3, 2] = q[3, 3] = 100.0
    q[4, 1], q[4, 0], q[4, 5] = -1.1, 0.0, 1.9
    np.testing.assert_allclose(_passive_error(device, q), [0.0, 0.25, 0.15, 0.0, 0.5], atol=1e-12)
    # A hinge with an end just short of a whole turn has one.
    short = given.upper.copy()
    short[3] = low[3] + 2.0 * np.pi * (1.0 - 1e-6)
    given.upper = short
    assert _passive_error(device, q)[3] > 90.0
    # So has one that ends on one side alone.
    given.lower, given.upper = low.copy(), short
    given.lower[3], given.upper[3] = -np.inf, 5.0
    assert _passive_error(device, q)[3] == 95.0
    given.lower = low
    given.upper[3] = np.inf
    assert _passive_error(device, q)[3] == 0.0
    given.upper[3] = low[3] + 2.0 * np.pi * (1.0 - 1e-6)
    device.drives = tuple(SimpleNamespace(joint=name) for name in given.joints)
    np.testing.assert_array_equal(_passive_error(device, q), 0.0)


def test_what_a_split_means_for_a_device():
    rigid = Assumptions("minimal")
    assert law_of_device(rigid) is rigid
    soft = law_of_device(Assumptions("elastic", limits="pull"))
    assert isinstance(soft.law, DeviceElastic)
    assert soft.limits == "pull"
    locked = law_of_device(Assumptions("elastic_locked")).law
    assert (locked.name, locked.chooses_tensions, soft.law.chooses_tensions) == ("elastic_locked", False, True)
    assert QUERY_STATUS[OUT_OF_REACH] == "out_of_reach"


def test_a_locked_device_chooses_nothing_and_a_held_one_its_tensions():
    held, locked = Elastic(), Elastic("locked")
    assert (held.name, held.chooses_tensions, held.locked) == ("elastic", True, False)
    assert (locked.name, locked.chooses_tensions, locked.locked) == ("elastic_locked", False, True)
    assert "cone" in held.options
    assert not locked.options
    assert Elastic.name == "elastic"
    assert Elastic.chooses_tensions


def test_displacements_of_a_device_that_gives_way():
    law = DeviceElastic()
    moved = SimpleNamespace(centre="centre", interfaces="interfaces", share="share")
    found = law.extras(SimpleNamespace(placed=SimpleNamespace(moved=moved)), None)
    assert found == {"interface_displacements": "interfaces", "load_share": "share", "centre_displacement": "centre"}


@pytest.fixture(scope="module")
def cables():
    """A device of four cables as routes, with a shoulder that gives way, and the same with three."""
    exo = ep.load("four-cables")
    ends = zip(exo.geometry.base_points, exo.geometry.platform_points, exo.mechanism.limbs, strict=True)
    drives = [
        Drive(f"cable_{k}", route=Route.over(("universe", a), ("arm", b)), actuator=limb.actuator)
        for k, (a, b, limb) in enumerate(ends)
    ]
    shoulder = ep.Shoulder(stiffness=np.diag([1e4, 2e4, 3e4]))
    return exo, [
        ep.ShoulderExo.from_device(ChainDevice(arm_alone(), tuple(drives[:n]), arm=exo.arm, shoulder=shoulder))
        for n in (4, 3)
    ]


def test_efforts_of_a_soft_device_are_looked_for_where_there_is_a_choice(cables, monkeypatch):
    exo, (four, three) = cables
    called = []
    monkeypatch.setattr(device_poses, "_within_limits", lambda *given: called.append(given[2]))
    pose = exo.pose(60.0)
    for device, split, limits, expected in (
        (four, "elastic", "none", 0), (four, "spherical", "pull", 0), (four, "elastic", "pull", 1),
        (three, "elastic", "pull", 0), (four, "elastic", "design", 1),
    ):  # fmt: skip
        called.clear()
        device.reaction(pose, split=split, limits=limits)
        assert len(called) == expected


def test_a_soft_device_without_an_offset_is_one_with_an_offset_of_nothing(cables):
    exo, (four, _) = cables
    poses = exo.pose([60.0])
    plain = four.reaction(poses, split="elastic", limits="none")
    assert plain.has_answer.all()
    # Held in balance: the arm's weight, cables and shoulder; the shoulder's spring carries F_s.
    moved = np.linalg.solve(np.diag([1e4, 2e4, 3e4]), -plain.shoulder_force.T).T
    np.testing.assert_allclose(plain.centre_displacement, moved, atol=1e-9)
    zero = four.reaction(poses, split="elastic", limits="none", centre_offset=ep.CentreOffset(np.zeros(3), np.zeros(3)))
    np.testing.assert_allclose(zero.shoulder_force, plain.shoulder_force, atol=1e-7)
    limited = four.reaction(poses, split="elastic", limits="pull")
    assert limited.held.all()
    assert (limited.actuator_forces >= -1e-9).all()
    moved = np.linalg.solve(np.diag([1e4, 2e4, 3e4]), -limited.shoulder_force.T).T
    np.testing.assert_allclose(limited.centre_displacement, moved, atol=1e-8)
    assert limited.residual.max() < 1e-9


def test_limits_that_were_not_asked_are_not_looked_up(cables):
    exo, (four, three) = cables
    poses = exo.pose([60.0, 40.0])
    unlimited = four.reaction(poses, limits="none")
    assert unlimited.limits.asked is False
    assert unlimited.source.poses.limits.passive_error is None
    asked = four.reaction(poses)
    np.testing.assert_array_equal(asked.source.poses.limits.passive_error, 0.0)
    np.testing.assert_array_equal(asked.source.poses.stiffness, np.zeros((2, 4)))
    assert three.reaction(poses, limits="none").has_answer.all()


def test_poses_without_equilibrium_have_no_tensions_and_the_others_keep_theirs(cables, monkeypatch):
    exo, (four, _) = cables
    case, own = ep.Case(exo.pose([60.0, 50.0, 40.0, 55.0, 45.0])), Assumptions(limits="none")
    whole, _ = device_poses.device_poses(four.device, case, own, False)
    solved = device_poses.device_equilibrium
    status, reached = np.array([0, 1, 2, 4, 0], dtype=np.int8), np.arange(5) < 4
    monkeypatch.setattr(
        device_poses, "device_equilibrium", lambda *a, **k: solved(*a, **k)._replace(status=status, reached=reached)
    )
    poses, _ = device_poses.device_poses(four.device, case, own, False)
    assert poses.status.tolist() == [0, 1, 2, 4, OUT_OF_REACH]
    for name in ("f", "shoulder", "singular_values"):
        np.testing.assert_array_equal(getattr(poses.tensions, name)[:2], getattr(whole.tensions, name)[:2])
        assert np.isnan(getattr(poses.tensions, name)[2:]).all()
    np.testing.assert_array_equal(poses.tensions.self_stress[:2], whole.tensions.self_stress[:2])
    np.testing.assert_array_equal(poses.tensions.self_stress[2:], 0.0)


def test_speeds_are_limited_in_motion_where_limits_are_those_of_the_design(cables, monkeypatch):
    exo, (four, _) = cables
    called = []
    plain = LimbLimits.in_motion
    monkeypatch.setattr(LimbLimits, "in_motion", lambda *given: called.append(given[2]) or plain(*given))
    slow = four.replace(drives=[replace(drive, speed_limit=0.01) for drive in four.device.drives])
    free = four.replace(drives=[replace(drive, speed_limit=None, power_limit=None) for drive in four.device.drives])
    pose, motion = exo.pose(60.0), ep.Motion([0.2, -0.1, 0.1], np.zeros(3))
    given = [SimpleNamespace(force_limits=lambda length: (0.0 * length, 400.0 + 0.0 * length))] * 4
    for device, asked, limits, expected in (
        (slow, motion, "design", 1), (slow, None, "design", 0), (slow, motion, "none", 0), (free, motion, "design", 0),
        (slow, motion, given, 0), (slow, motion, "pull", 1),
    ):  # fmt: skip
        called.clear()
        device.reaction(pose, motion=asked, limits=limits)
        assert len(called) == expected


def test_three_tensions_that_pull_bound_side_forces(cables):
    """They follow from equilibrium: |g| <= |f| is then known, and routes have no side force."""
    exo, (_, three) = cables
    pose = exo.pose([60.0, 50.0])
    bounded = three.reaction(pose, split="minimal", limits="pull", constraint_bounds="actuator")
    plain = three.reaction(pose, limits="pull")
    np.testing.assert_array_equal(bounded.status, plain.status)
    np.testing.assert_allclose(bounded.shoulder_force, plain.shoulder_force, atol=1e-10)
