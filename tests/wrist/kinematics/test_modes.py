"""Modes: nearest ones, paths that are followed, stacks and empty slots."""

import numpy as np
import pytest
from scipy.spatial.transform import Rotation

import exo_pin as ep
from exo_pin import InvalidInput, thesis_rotation

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


def test_near_picks_row_by_row_and_single():
    exo = ep.load("prototype")
    poses = thesis_rotation([20, 40], [-30, -20], [10, -30], **DEGREES)
    lengths = exo.inverse_kinematics(poses).lengths
    modes = exo.forward_kinematics(lengths, near=poses)
    assert (modes.nearest_rotations * poses.inv()).magnitude().max() < 1e-9
    one = exo.forward_kinematics(lengths[0], near=poses[0])
    assert one.nearest.shape == ()
    assert (one.nearest_rotations * poses[0].inv()).magnitude() < 1e-9
    assert (exo.forward_kinematics(lengths, near=poses[0]).nearest >= 0).all()


def test_stacks_keep_their_shape_and_bad_rows_to_themselves():
    exo = ep.load("prototype")
    lengths = np.array(exo.inverse_kinematics(Rotation.random(6, np.random.default_rng(9))).lengths).reshape(2, 3, 3)
    clean = exo.forward_kinematics(lengths)
    assert clean.rotations.shape == (2, 3, 8)
    spoiled = lengths.copy()
    spoiled[0, 0, 1], spoiled[0, 1], spoiled[1, 2, 0] = np.nan, 10.0, -0.1
    modes = exo.forward_kinematics(spoiled, near=Rotation.identity())
    assert modes.status[0, 0] == modes.status[1, 2] == "invalid"
    assert modes.status[0, 1] == "unreachable"
    assert modes.nearest[0, 1] == -1
    assert modes.ambiguous[0, 1]
    for row in ((0, 2), (1, 0), (1, 1)):
        np.testing.assert_array_equal(modes.rotations.as_quat()[row], clean.rotations.as_quat()[row])
    assert exo.forward_kinematics(lengths[:0]).count.shape == (0, 3)
    angles = np.full((2, 3), 0.3)
    angles[1, 0] = np.nan
    assert exo.forward_kinematics_from_base_angles(theta_y=angles).status[1] == "invalid"
    assert exo.forward_kinematics_from_base_angles(theta_x=angles).status[1] == "invalid"
    assert exo.forward_kinematics_from_base_angles(angles, angles).status[1] == "invalid"


def test_empty_slots_hold_no_other_orientation():
    exo = ep.load("prototype")
    modes = exo.forward_kinematics(
        [[262.958325e-3, 330.503366e-3, 384.212449e-3], [9.0, 9.0, 9.0]], near=Rotation.identity()
    )
    quats = modes.rotations.as_quat()
    assert (quats[0][~modes.valid[0]] == quats[0, 0]).all()
    assert not modes.valid[1].any()
    assert np.isnan(modes.residual[~modes.valid]).all()
    with pytest.raises(InvalidInput, match=r"1 of 2 rows"):
        _ = modes.nearest_rotations


def test_a_path_that_is_lost_holds_the_last_pose():
    exo = ep.load("prototype")
    poses = ep.shoulder_rotation(0, np.linspace(20, 40, 5), 0, **DEGREES)
    lengths = np.array(exo.inverse_kinematics(poses).lengths)
    lengths[2] = 9.0
    path = exo.forward_kinematics(lengths).follow(poses[0])
    assert path.index[2] == -1
    assert path.ambiguous[2]
    np.testing.assert_array_equal(path.rotations.as_quat()[2], path.rotations.as_quat()[1])
    assert (path.rotations[3] * poses[3].inv()).magnitude() < 1e-9
