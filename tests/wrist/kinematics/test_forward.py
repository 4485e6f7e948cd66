"""Forward kinematics: published solutions, round trips, brute force, modes that meet, paths, bad rows."""

import numpy as np
import pytest
from forward_oracle import all_solutions, distance_to_closest, length_equations
from mirror_image import mirrored
from scipy.spatial.transform import Rotation
from wrists import random_mechanism

import exo_pin as ep
from exo_pin import InvalidInput, thesis_angles, thesis_rotation, wrist
from exo_pin.design import WristGeometry, preset, published
from exo_pin.wrist.kinematics.forward import _triples

DEGREES = {"degrees": True}

GEOMETRIES = ("prototype", "appendix-d", "scenario-one", "optimised-table-5-3", "optimised-table-c-2")


def test_the_five_geometries_are_all_published_ones():
    assert sorted(GEOMETRIES) == published()


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


@pytest.mark.parametrize("count", [400, pytest.param(2000, marks=pytest.mark.full)])
@pytest.mark.parametrize("name", GEOMETRIES)
def test_round_trip_of_random_poses(name, count):
    geometry = preset(name).geometry
    poses = Rotation.random(count, np.random.default_rng(GEOMETRIES.index(name)))
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
        assert away.sum() > 0.75 * count
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


@pytest.mark.parametrize("sets", [50, pytest.param(300, marks=pytest.mark.full)])
def test_no_solution_is_missed(sets):
    # Sets of lengths: the presets and asymmetric wrists, poses from everywhere and from planes of symmetry.
    rng = np.random.default_rng(1)
    starts = Rotation.random(300, rng).as_matrix()
    geometries = [preset(name).geometry for name in GEOMETRIES]
    geometries += [random_mechanism(rng, 3).geometry for _ in range(5)]
    counts = []
    for k in range(sets):
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


def test_roots_that_stop_short_leave_the_pose_to_the_exact_one():
    # Two roots of the first triple lead to this pose, and one of them stops 1e-7 short of it.
    exo = ep.load("four-cables")
    lost = Rotation.from_quat([-0.22655159497099553, 0.780199234297049, 0.3867335397385386, 0.43634928538923536])
    poses = Rotation.concatenate([lost, Rotation.random(3000, random_state=8)])
    modes = exo.forward_kinematics(exo.inverse_kinematics(poses).lengths, near=poses)
    assert (modes.status == "ok").all()
    nearest = Rotation.from_quat(modes.rotations.as_quat()[np.arange(len(poses)), modes.nearest])
    assert (nearest * poses.inv()).magnitude().max() < 1e-6


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


def test_every_pose_is_among_those_of_its_lengths():
    """5,000 poses all over the rotation group, of the geometry whose limbs come near O."""
    poses = Rotation.random(5_000, rng=1)
    for name in ("prototype", "optimised-table-5-3", "optimised-table-c-2"):
        exo = ep.load(name)
        modes = exo.forward_kinematics(exo.inverse_kinematics(poses).lengths, near=poses)
        assert (modes.count >= 2).all()
        away = (modes.nearest_rotations * poses.inv()).magnitude()
        # Where modes nearly meet, the lengths' rounding moves them apart by its root.
        assert away.max() < 1e-6
        assert np.median(away) < 1e-14


@pytest.mark.parametrize("side", [0, 1])
def test_triples_that_leave_a_curve_of_poses_come_last(side):
    """Of five limbs, three with parallel directions on one side: their rows have rank one there."""
    rng = np.random.default_rng(62)
    directions = rng.normal(size=(2, 5, 3))
    directions /= np.linalg.norm(directions, axis=-1, keepdims=True)
    directions[side, [0, 2, 3]] = directions[side, 0]
    assert sorted(_triples(*directions)[-1]) == [0, 2, 3]
    # Two equations that are one and the same.
    directions = rng.normal(size=(2, 4, 3))
    directions[:, 1] = directions[:, 3]
    assert all({1, 3} <= set(triple.tolist()) for triple in _triples(*directions)[-2:])
