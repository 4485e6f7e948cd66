"""Forward kinematics: published solutions, round trips, brute force, modes that meet, paths, bad rows."""

import numpy as np
import pytest
from forward_oracle import all_solutions, distance_to_closest, length_equations
from scipy.spatial.transform import Rotation
from wrists import random_mechanism

import exo_pin as ep
from exo_pin import thesis_angles, thesis_rotation, wrist
from exo_pin.design import preset

DEGREES = {"degrees": True}

GEOMETRIES = ("prototype", "appendix-d", "scenario-one", "optimised-table-5-3", "optimised-table-c-2")


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
