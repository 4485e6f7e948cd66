"""Poses of devices that are not wrists: joints without drive, offsets, and limits."""

import re
import shutil
from dataclasses import replace
from types import SimpleNamespace

import numpy as np
import pytest
from arm_alone import arm_alone
from places import URDF

import exo_pin as ep
from exo_pin.device import ChainDevice, Drive, Route


def test_joints_without_drive_are_as_far_beyond_their_ends_as_they_turn(tmp_path):
    """The verdict says so, and the workspace by how much; of a hinge that turns round no end counts."""
    shutil.copy(URDF / "3rps-passive-ball.closures.toml", tmp_path / "own.closures.toml")
    text = (URDF / "3rps-passive-ball.urdf").read_text()

    def with_ends(low, high):
        ends = rf'\1 lower="{low}" upper="{high}"'
        own, count = re.subn(
            r'(name="limb_1_hinge".*?<limit) lower="[^"]*" upper="[^"]*"', ends, text, count=1, flags=re.S
        )
        assert count == 1
        (tmp_path / "own.urdf").write_text(own)
        return ep.load(tmp_path / "own.urdf")

    round_about = with_ends(-np.pi, np.pi)
    poses = round_about.pose([0.0, 20.0, 30.0])
    assert round_about.reaction(poses).can_hold.all()
    room = round_about.workspace(poses, ["stroke"]).margins["stroke"]
    narrow, narrower = (with_ends(-end, end) for end in (0.01, 0.004))
    answer = narrow.reaction(poses)
    assert answer.status.tolist() == ["ok", "out_of_stroke", "ok"]
    assert narrow.reaction(poses[1]).verdict == (
        "The device cannot hold this pose: a joint without drive would be beyond its range."
    )
    beyond, more = (exo.workspace(poses, ["stroke"]).margins["stroke"] for exo in (narrow, narrower))
    np.testing.assert_allclose(beyond[[0, 2]], room[[0, 2]], atol=1e-12)
    assert beyond[1] < -1e-4
    np.testing.assert_allclose(more[1], beyond[1] - 0.006, atol=1e-12)
    # One end alone: whichever way it turns, one of the two is passed.
    past = [with_ends(*ends).reaction(poses[1]).status == "out_of_stroke" for ends in ((-0.01, 3.0), (-3.0, 0.01))]
    assert sorted(past) == [False, True]


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


def test_speeds_are_limited_in_motion_where_limits_are_those_of_the_design(cables):
    exo, (four, _) = cables
    slow = four.replace(drives=[replace(drive, speed_limit=0.01) for drive in four.device.drives])
    free = four.replace(drives=[replace(drive, speed_limit=None, power_limit=None) for drive in four.device.drives])
    pose, motion = exo.pose(60.0), ep.Motion([0.2, -0.1, 0.1], np.zeros(3))
    # What is asked narrows the limits of the design; an actuator of the user's replaces them.
    pulls = [SimpleNamespace(force_limits=lambda length: (0.0 * length, 400.0 + 0.0 * length))] * 4
    state = exo.inverse_kinematics(pose)
    rates = np.cross(state.platform_points, state.directions) @ motion.angular_velocity
    assert np.abs(rates).max() > 0.011
    for device, asked, limits, status in (
        (slow, motion, "design", "beyond_limits"), (slow, None, "design", "ok"), (slow, motion, "none", "ok"),
        (free, motion, "design", "ok"), (slow, motion, (0.0, 400.0), "beyond_limits"), (slow, motion, pulls, "ok"),
        (slow, motion, "pull", "beyond_limits"),
    ):  # fmt: skip
        answer = device.reaction(pose, motion=asked, limits=limits)
        assert answer.status == status, (limits, answer.verdict)
    excess = slow.reaction(pose, motion=motion).limits.excess_speed
    np.testing.assert_allclose(excess, np.maximum(np.abs(rates) - 0.01, 0.0), atol=1e-9)


def test_three_tensions_that_pull_bound_side_forces(cables):
    """They follow from equilibrium: |g| <= |f| is then known, and routes have no side force."""
    exo, (_, three) = cables
    pose = exo.pose([60.0, 50.0])
    bounded = three.reaction(pose, split="minimal", limits="pull", constraint_bounds="actuator")
    plain = three.reaction(pose, limits="pull")
    np.testing.assert_array_equal(bounded.status, plain.status)
    np.testing.assert_allclose(bounded.shoulder_force, plain.shoulder_force, atol=1e-10)
