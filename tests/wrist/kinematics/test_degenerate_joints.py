"""Forward kinematics of wrists whose joints lie in special places: every regular pose comes back from its own data."""

import numpy as np
import pytest
from degenerate_wrists import FAMILIES, smallest_singular_value, wrist_of
from forward_oracle import all_solutions, distance_to_closest, length_equations
from scipy.spatial.transform import Rotation

from exo_pin import wrist

#: A pose counts as regular above this; an error of some eps then moves it by 1e-12.
REGULAR = 1e-4


def measured(geometry, poses, what):
    """Modes from what is measured in the poses, with the poses as near=, and which poses are regular."""
    state = wrist.inverse_kinematics(geometry, poses)
    regular = (state.lengths > 1e-6).all(axis=1)
    regular &= smallest_singular_value(geometry, poses, what == "planes") > REGULAR
    if what == "lengths":
        return wrist.forward_kinematics(geometry, state.lengths, near=poses), regular
    if what == "both":
        angles = (state.base_theta_x, state.base_theta_y)
        return wrist.forward_kinematics_from_base_angles(geometry, *angles, near=poses), regular
    if what == "planes":
        return wrist.forward_kinematics_from_base_angles(
            geometry, theta_y=state.base_theta_y, near=poses, tolerance=1e-7
        ), regular
    # θ_x is a singular sensor where b·s = 0.
    along = np.abs(np.einsum("nij,nij->ni", state.platform_points, state.directions)).min(axis=1)
    regular &= along > REGULAR * np.linalg.norm(geometry.platform_points, axis=1).max()
    return wrist.forward_kinematics_from_base_angles(
        geometry, theta_x=state.base_theta_x, near=poses, tolerance=1e-7
    ), regular


@pytest.mark.full  # kernels of all kinds of measurements, which no other short test compiles
@pytest.mark.parametrize("designs", [40])
@pytest.mark.parametrize("n", [3, 4, 6, 8])
def test_every_regular_pose_comes_back(n, designs):
    rng = np.random.default_rng(100 + n)
    asked = 0
    for family in FAMILIES:
        for _ in range(designs):
            geometry = wrist_of(family, n, rng)
            if geometry is None:
                continue
            poses = Rotation.random(4, rng=rng)
            for what in ("lengths", "twist", "planes", "both"):
                if what == "both" and n > 4 and designs > 1:
                    continue  # up to 2^n fits a set
                modes, regular = measured(geometry, poses, what)
                away = distance_to_closest(modes, poses)
                assert (away[regular] < 1e-7).all(), (family, what, away[regular].max())
                # The mode that is nearest to the pose is the pose.
                chosen = modes.rotations.as_quat()[np.arange(4), modes.nearest]
                turn = (Rotation.from_quat(chosen) * poses.inv()).magnitude()
                assert (turn[regular] < 1e-7).all(), (family, what)
                asked += int(regular.sum())
    assert asked > 100 * designs


@pytest.mark.parametrize("sets", [12, pytest.param(500, marks=pytest.mark.full)])
def test_no_solution_is_missed(sets):
    """Newton's method from 300 starts finds no other pose; of 500 sets of lengths 467 are degenerate."""
    rng = np.random.default_rng(7)
    starts = Rotation.random(300, rng=rng).as_matrix()
    compared = 0
    for k in range(sets):
        geometry = wrist_of(FAMILIES[k % len(FAMILIES)], 3, rng)
        if geometry is None:
            continue
        pose = Rotation.random(rng=rng)
        lengths = wrist.inverse_kinematics(geometry, pose).lengths
        modes = wrist.forward_kinematics(geometry, lengths)
        if modes.status != "ok" or modes.margin[modes.valid].min() < REGULAR:
            # A multiple root, or nearly: reported, and Newton's method finds it to 1e-8 at best.
            assert modes.status in ("meeting", "continuum") or modes.margin[modes.valid].min() < REGULAR
            continue
        own = modes.rotations[modes.valid].as_matrix()
        brute = all_solutions(*length_equations(geometry, lengths), starts)
        assert len(brute) == modes.count, (FAMILIES[k % len(FAMILIES)], k)
        for solution in brute:
            assert np.abs(own - solution).max(axis=(1, 2)).min() < 1e-7
        compared += 1
    assert compared > 0.6 * sets
