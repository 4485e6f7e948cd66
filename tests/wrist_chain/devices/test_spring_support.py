"""The spring support: the published force comes back, in size and direction, at every elevation and in every plane."""

import numpy as np
import pytest
from device_files import device_table, loaded, reached
from scipy.optimize import least_squares

from exo_pin.core.conventions import shoulder_rotation
from exo_pin.wrist_chain.devices.spring_support import ACROSS, ALONG, ARM_SHARE, ELEVATIONS, FOOT_RATIO

CHAIN = loaded("spring-support")
UPPER_ARM = 0.2817 * 1.755 / 1.741  # de Leva 1996, men, scaled with stature


def force_on_arm(pose):
    """Force of the strut on the arm, base frame, and the place where it acts, by the device file's table."""
    q = reached(CHAIN, pose)
    at = CHAIN.placement(q, "strut_cross").translation
    foot = CHAIN.placement(q, "strut_lower").translation
    (spring,) = device_table("spring-support")["springs"]
    slide = q[CHAIN.configuration_slice(spring["joint"])][0]
    push = -np.interp(slide, spring["coordinates_m"], spring["forces_N"])
    return push * (at - foot) / np.linalg.norm(at - foot), at


@pytest.mark.parametrize("plane", ["flexion", "abduction"])
@pytest.mark.parametrize("elevation", ELEVATIONS)
def test_the_published_force_comes_back(elevation, plane):
    pose = shoulder_rotation(
        **{"flexion": 0.0, "abduction": 0.0, "internal_rotation": 0.0} | {plane: elevation}, degrees=True
    )
    force, at = force_on_arm(pose)
    along = pose.apply([0.0, 0.0, -1.0])
    np.testing.assert_allclose(at, ARM_SHARE * UPPER_ARM * along, atol=1e-9)
    ahead = np.array([1.0, 0.0, 0.0] if plane == "flexion" else [0.0, 1.0, 0.0])
    across = np.cos(np.radians(elevation)) * ahead + np.sin(np.radians(elevation)) * np.array([0.0, 0.0, 1.0])
    row = ELEVATIONS.index(elevation)
    assert force @ across == pytest.approx(ACROSS[row], abs=0.3)
    assert force @ along == pytest.approx(ALONG[row], abs=0.3)
    assert np.linalg.norm(force) == pytest.approx(np.hypot(ACROSS[row], ALONG[row]), abs=1e-6)


def test_the_foot_is_where_the_directions_put_it():
    angles, sizes = np.radians(ELEVATIONS), np.hypot(ACROSS, ALONG)
    across, along = np.stack([np.cos(angles), np.sin(angles)], 1), np.stack([np.sin(angles), -np.cos(angles)], 1)

    def errors(foot):
        line = along - foot
        force = sizes[:, None] * line / np.linalg.norm(line, axis=1, keepdims=True)
        return np.concatenate([(force * across).sum(1) - ACROSS, (force * along).sum(1) - ALONG])

    below = least_squares(lambda depth: errors(np.array([0.0, -depth[0]])), [1.0])
    free = least_squares(errors, [0.0, -1.0])
    assert below.x[0] == pytest.approx(FOOT_RATIO, abs=1e-3)
    assert np.abs(below.fun).max() < 0.3
    assert free.x[0] == pytest.approx(0.015, abs=1e-3)
    assert np.sqrt(below.cost / free.cost) < 1.02
    # And the hip of the device, as far below the shoulder as hips of men are: 0.4 to 0.5 m.
    assert 0.4 < FOOT_RATIO * ARM_SHARE * UPPER_ARM < 0.5


def test_the_springs_work_is_the_moment_of_its_force_and_half_of_the_arms_at_80_degrees():
    force, at = force_on_arm(shoulder_rotation(80, 0, 0, degrees=True))
    moment = np.cross(at, force)
    step = 1e-4
    slide = CHAIN.configuration_slice("strut_slide")
    ends = [reached(CHAIN, shoulder_rotation(80 + np.degrees(s * step), 0, 0, degrees=True))[slide][0] for s in (1, -1)]
    # Longer by so much a radian of flexion, which turns about -y.
    assert np.linalg.norm(force) * (ends[0] - ends[1]) / (2 * step) == pytest.approx(-moment[1], rel=1e-6)
    # The arm of 4.199 kg has its centre 0.3007 m down.
    share = -moment[1] / (4.199 * 9.81 * 0.30071 * np.sin(np.radians(80)))
    assert share == pytest.approx(0.50, abs=0.01)


def test_the_wearer_makes_all_moments_and_the_shoulders_force_is_determined():
    q = reached(CHAIN, shoulder_rotation(50, 30, 20, degrees=True))
    assert CHAIN.inverse_dynamics(q, actuated=["root_joint"]).joint_reaction("root_joint").unique.all()
