"""Forward kinematics: published solutions, round trips, brute force, modes that meet, paths, bad rows."""

import numpy as np
import pytest
from forward_oracle import all_solutions, distance_to_closest, length_equations
from scipy.spatial.transform import Rotation
from wrists import random_mechanism

import exo_pin as ep
from exo_pin import wrist
from exo_pin.core.conventions import mirrored, thesis_angles, thesis_rotation
from exo_pin.core.errors import InvalidInput
from exo_pin.design import WristGeometry, preset, presets
from exo_pin.numerics.polynomial import roots_and_touches

DEGREES = {"degrees": True}
GEOMETRIES = ("prototype", "appendix-d", "scenario-one", "optimised-table-5-3", "optimised-table-c-2")


def test_the_five_geometries_are_all_presets():
    assert sorted(GEOMETRIES) == sorted(presets())


def test_published_lengths_give_exactly_the_four_published_poses():
    exo = ep.load("prototype")
    modes = exo.forward_kinematics(np.array([262.958325, 330.503366, 384.212449]) * 1e-3)
    assert modes.count == 4
    published = np.array(
        [
            (20, -30, 10),
            (-7.850056, -1.419595, -45.672357),
            (14.809148, -18.237551, -17.426002),
            (6.306715, -56.956952, 50.839634),
        ]
    )
    found = thesis_angles(modes.rotations[modes.valid], **DEGREES)
    for angles in published:
        # Six printed decimals of the lengths carry the angles to about 3e-6°.
        assert np.abs(found - angles).max(axis=1).min() < 3e-6


@pytest.mark.parametrize("name", GEOMETRIES)
def test_round_trip_of_ten_thousand_poses(name):
    geometry = preset(name).geometry
    poses = Rotation.random(2000, np.random.default_rng(GEOMETRIES.index(name)))
    state = wrist.inverse_kinematics(geometry, poses)
    regular = wrist.singularity(geometry, poses).kind == "regular"
    for modes, known in (
        (wrist.forward_kinematics(geometry, state.lengths), regular),
        (wrist.forward_kinematics_from_base_angles(geometry, theta_x=state.base_theta_x), regular),
        (wrist.forward_kinematics_from_base_angles(geometry, theta_y=state.base_theta_y), regular),
        (wrist.forward_kinematics_from_base_angles(geometry, state.base_theta_x, state.base_theta_y), regular),
    ):
        chosen = np.nanmax(modes.margin, axis=-1) > 0
        assert chosen.all()
        # An error δ of the cosines, some eps, moves the pose by δ / margin.
        closest = distance_to_closest(modes, poses)
        assert closest.max() < 1e-7
        away = known & (np.where(modes.valid, modes.margin, np.inf).min(axis=-1) > 1e-3)
        assert away.sum() > 1500
        assert closest[away].max() < 1e-10
        assert np.nanmax(modes.residual[away]) < 1e-10
        assert (modes.count == modes.valid.sum(axis=-1)).all()


def test_residuals_are_what_the_modes_give_back():
    geometry = preset("optimised-table-c-2").geometry
    state = wrist.inverse_kinematics(geometry, Rotation.random(50, np.random.default_rng(0)))
    for modes, name in (
        (wrist.forward_kinematics(geometry, state.lengths), "lengths"),
        (wrist.forward_kinematics_from_base_angles(geometry, theta_x=state.base_theta_x), "base_theta_x"),
        (wrist.forward_kinematics_from_base_angles(geometry, theta_y=state.base_theta_y), "base_theta_y"),
    ):
        row, slot = np.nonzero(modes.valid)
        again = getattr(wrist.inverse_kinematics(geometry, modes.rotations[modes.valid]), name)
        gap = again - getattr(state, name)[row]
        gap = gap if name == "lengths" else np.angle(np.exp(1j * gap))
        np.testing.assert_allclose(np.abs(gap).max(axis=1), modes.residual[row, slot], atol=1e-12)
        assert modes.residual[row, slot].max() < 1e-9


def test_no_solution_is_missed():
    # 300 length sets: the presets and asymmetric wrists, poses from everywhere and from planes of symmetry.
    rng = np.random.default_rng(1)
    starts = Rotation.random(300, rng).as_matrix()
    geometries = [preset(name).geometry for name in GEOMETRIES]
    geometries += [random_mechanism(rng, 3).geometry for _ in range(5)]
    counts = []
    for k in range(300):
        geometry = geometries[k % len(geometries)]
        pose = Rotation.random(rng=rng) if k % 3 else thesis_rotation(0, rng.uniform(-np.pi, np.pi), 0)
        lengths = wrist.inverse_kinematics(geometry, pose).lengths
        if k % 7 == 0:
            # Lengths that no pose was made for; many have no solution at all.
            lengths = lengths * rng.uniform(0.8, 1.2, 3)
        modes = wrist.forward_kinematics(geometry, lengths)
        brute = all_solutions(*length_equations(geometry, lengths), starts)
        assert len(brute) == modes.count, (k, lengths)
        counts.append(int(modes.count))
        for solution in brute:
            own = modes.rotations[modes.valid].as_matrix()
            assert np.abs(own - solution).max(axis=(1, 2)).min() < 1e-7
    assert {0, 2, 4, 6} <= set(counts)


def test_eight_solutions_exist_and_are_found():
    geometry = preset("optimised-table-c-2").geometry
    lengths = wrist.inverse_kinematics(geometry, Rotation.random(2000, np.random.default_rng(2))).lengths
    modes = wrist.forward_kinematics(geometry, lengths)
    eight = np.flatnonzero(modes.count == 8)
    assert eight.size > 0
    starts = Rotation.random(600, np.random.default_rng(3)).as_matrix()
    assert len(all_solutions(*length_equations(geometry, lengths[eight[0]]), starts)) == 8


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


def test_lengths_beyond_the_meeting_have_no_such_mode():
    exo = ep.load("prototype")
    pose = exo.nearest_singularity(thesis_rotation(10, 0, 0, **DEGREES)).pose
    lengths = exo.inverse_kinematics(pose).lengths
    counts = [
        int(exo.forward_kinematics(lengths + sign * 1e-4 * direction).count)
        for direction in np.eye(3)
        for sign in (-1, 1)
    ]
    # On one side of the fold the two modes are gone.
    assert max(counts) - min(counts) == 2


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


def test_the_other_shoulder():
    left, right = preset("prototype").geometry, preset("prototype").mirrored().geometry
    poses = Rotation.random(50, np.random.default_rng(12))
    image = mirrored(poses)
    for solve, name in (
        (wrist.forward_kinematics, "lengths"),
        (wrist.forward_kinematics_from_base_angles, "base_theta_x"),
    ):
        a, b = (solve(g, getattr(wrist.inverse_kinematics(g, p), name)) for g, p in ((left, poses), (right, image)))
        np.testing.assert_array_equal(a.count, b.count)
        assert distance_to_closest(b, image).max() < 1e-8
        assert distance_to_closest(a, mirrored(image)).max() < 1e-8


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


def test_more_limbs_than_needed_leave_one_pose():
    rng = np.random.default_rng(8)
    for n in (4, 6):
        geometry = random_mechanism(rng, n).geometry
        poses = Rotation.random(40, rng)
        state = wrist.inverse_kinematics(geometry, poses)
        for modes in (
            wrist.forward_kinematics(geometry, state.lengths),
            wrist.forward_kinematics_from_base_angles(geometry, theta_x=state.base_theta_x),
            wrist.forward_kinematics_from_base_angles(geometry, theta_y=state.base_theta_y),
            wrist.forward_kinematics_from_base_angles(geometry, state.base_theta_x, state.base_theta_y),
        ):
            assert distance_to_closest(modes, poses).max() < 1e-8
            assert (modes.count == 1).mean() > 0.9
        noisy = wrist.forward_kinematics(geometry, state.lengths + 1e-4 * rng.normal(size=(40, n)), tolerance=1e-3)
        assert np.median(distance_to_closest(noisy, poses)) < 5e-3


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


def test_a_curve_of_solutions_is_named():
    # Limbs 1 and 2 share both joints: two equations are left for three freedoms.
    base = np.array([[0.1, -0.1, 0.0], [0.1, -0.1, 0.0], [0.0, -0.1, 0.2]])
    platform = np.array([[0.1, 0.0, -0.1], [0.1, 0.0, -0.1], [0.0, 0.1, -0.1]])
    geometry = WristGeometry(base, platform)
    lengths = wrist.inverse_kinematics(geometry, thesis_rotation(0.3, 0.2, 0.1)).lengths
    modes = wrist.forward_kinematics(geometry, lengths)
    assert modes.status == "continuum"
    assert modes.count == 0


def test_wrong_input_is_named():
    exo = ep.load("prototype")
    with pytest.raises(InvalidInput, match="shape"):
        exo.forward_kinematics([0.3, 0.3])
    with pytest.raises(InvalidInput, match="above zero"):
        exo.forward_kinematics([0.3, -0.3, 0.3])
    with pytest.raises(InvalidInput, match="finite"):
        exo.forward_kinematics([0.3, np.nan, 0.3])
    with pytest.raises(InvalidInput, match="real numbers"):
        exo.forward_kinematics(["a", "b", "c"])
    with pytest.raises(InvalidInput, match="theta_x, theta_y or both"):
        exo.forward_kinematics_from_base_angles()
    with pytest.raises(InvalidInput, match="broadcast"):
        exo.forward_kinematics_from_base_angles(np.zeros((2, 3)), np.zeros((4, 3)))
    with pytest.raises(InvalidInput, match="near"):
        exo.forward_kinematics([0.3, 0.3, 0.3], near=Rotation.random(3, np.random.default_rng(0)))
    with pytest.raises(InvalidInput, match="near="):
        _ = exo.forward_kinematics([0.3, 0.36, 0.36]).nearest_rotations
    with pytest.raises(InvalidInput, match="one path"):
        exo.forward_kinematics([0.3, 0.36, 0.36]).follow(Rotation.identity())


def test_polynomial_roots_against_a_companion_matrix():
    rng = np.random.default_rng(10)
    out = np.empty(16)
    for _ in range(300):
        p = rng.normal(size=9) if rng.random() < 0.7 else np.poly(rng.uniform(-1.5, 1.5, 8))[::-1].copy()
        number = roots_and_touches(p, 8, 0.0, out)
        reference = np.roots(p[::-1])
        real = np.sort(reference[np.abs(reference.imag) < 1e-9].real)
        real = real[np.abs(real) < 1.0]
        own = np.sort(out[:number])
        own = own[np.abs(own) < 1.0]
        np.testing.assert_allclose(own, real, atol=1e-7)
