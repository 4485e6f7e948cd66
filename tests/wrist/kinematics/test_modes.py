"""Modes: nearest ones, paths that are followed, stacks and empty slots."""

import numpy as np
import pytest
from scipy.spatial.transform import Rotation

import exo_pin as ep
from exo_pin import thesis_rotation

DEGREES = {"degrees": True}


@pytest.mark.parametrize(
    ("name", "start"),
    [("prototype", (10, 0, 0)), ("scenario-one", (0, 45, 45)), ("optimised-table-c-2", (-20, 30, 60))],
)
def test_modes_that_meet_are_found_once_and_reported(name, start):
    exo = ep.load(name)
    pose = exo.nearest_singularity(thesis_rotation(*start, **DEGREES)).pose
    assert abs(exo.singularity(pose).determinant) < 1e-12
    modes = exo.forward_kinematics(exo.inverse_kinematics(pose).lengths, near=pose)
    assert modes.status == "meeting"
    slot = int(modes.nearest)
    assert modes.meets[slot]
    assert modes.ambiguous
    assert modes.residual[slot] < 1e-12
    # A double root carries half the digits.
    assert (modes.nearest_rotations * pose.inv()).magnitude() < 1e-6
    others = np.flatnonzero(modes.valid & (np.arange(8) != slot))
    assert all((modes.rotations[int(k)] * pose.inv()).magnitude() > 1e-3 for k in others)
    # Off the locus there are two of them, as far apart on either side, and none is reported to meet.
    axis = exo.singularity(pose).lost_direction
    beside = Rotation.from_rotvec(0.01 * axis) * pose
    near = exo.forward_kinematics(exo.inverse_kinematics(beside).lengths, near=beside)
    assert near.status == "ok"
    assert near.count == modes.count + 1
    assert not near.ambiguous
    twin = min(
        (near.rotations[int(k)] * beside.inv()).magnitude() for k in np.flatnonzero(near.valid) if k != near.nearest
    )
    assert 0.005 < twin < 0.05


def test_following_a_path_keeps_the_mode_and_flags_the_crossing():
    exo = ep.load("prototype")
    abduction = np.linspace(20, 60, 81)
    poses = ep.shoulder_rotation(0, abduction, 0, **DEGREES)
    modes = exo.forward_kinematics(exo.inverse_kinematics(poses).lengths)
    path = modes.follow(poses[0])
    assert (path.rotations * poses.inv()).magnitude().max() < 1e-9
    assert not path.ambiguous.any()
    # Through the locus at 6.21°: carried on by the last two steps, and flagged around it.
    crossing = np.linspace(20, -3, 231)
    through = ep.shoulder_rotation(0, crossing, 0, **DEGREES)
    modes = exo.forward_kinematics(exo.inverse_kinematics(through).lengths)
    path = modes.follow(through[0])
    assert (path.rotations * through.inv()).magnitude().max() < 1e-6
    flagged = crossing[path.ambiguous]
    # Once, at the first row beyond it.
    assert flagged.size == 1
    assert 6.21 - 0.1 < flagged[0] < 6.21
    side = modes.side[np.arange(len(crossing)), path.index]
    assert (side[crossing > 6.22] == side[0]).all()
    assert (side[crossing < 6.2] == -side[0]).all()
