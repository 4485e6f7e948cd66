"""The spring support: the published force comes back, in size and direction, at every elevation and in every plane."""

import mujoco
import numpy as np
import pytest
from device_files import device_table, loaded
from published_devices.spring_support import ACROSS, ALONG, ARM_SHARE, ELEVATIONS, FOOT_RATIO
from scipy.optimize import least_squares

from exo_pin import shoulder_rotation

CHAIN = loaded("spring-support")
UPPER_ARM = 0.2817 * 1.755 / 1.741  # de Leva 1996, men, scaled with stature


def strut():
    """The strut's table and its ends, the one on the torso first."""
    (spring,) = device_table("spring-support")["springs"]
    foot, end = spring["points"]
    assert (foot["link"], end["link"], end["point_m"]) == ("universe", "cuff_middle", [0.0, 0.0, 0.0])
    return spring, np.array(foot["point_m"])


def force_on_arm(pose):
    """Force of the strut on the arm, base frame, and the place where it acts, by the device file's table."""
    spring, foot = strut()
    q = CHAIN.neutral()
    q[CHAIN.configuration_slice("root_joint")] = pose.as_quat()
    at = CHAIN.placement(q, "cuff_middle").translation
    length = np.linalg.norm(at - foot)
    push = -np.interp(length, spring["coordinates_m"], spring["forces_N"])
    return push * (at - foot) / length, at


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


def test_mujocos_tendon_turns_the_arm_as_much():
    _, foot = strut()
    end = " ".join(map(str, CHAIN.placement(CHAIN.neutral(), "cuff_middle").translation))
    model = mujoco.MjModel.from_xml_string(f"""<mujoco><worldbody>
    <site name="foot" pos="{" ".join(map(str, foot))}"/>
    <body><joint type="ball"/><inertial pos="0 0 -0.3" mass="4" diaginertia="0.1 0.1 0.01"/>
    <site name="end" pos="{end}"/></body></worldbody>
    <tendon><spatial name="strut"><site site="foot"/><site site="end"/></spatial></tendon>
    <actuator><motor tendon="strut"/></actuator></mujoco>""")
    data = mujoco.MjData(model)
    for angles in ((20, 10, 30), (60, 40, 0), (15, 80, -20)):
        pose = shoulder_rotation(*angles, degrees=True)
        force, at = force_on_arm(pose)
        data.qpos[:] = pose.as_quat(scalar_first=True)
        data.ctrl[:] = np.linalg.norm(force)  # along growing length: it pushes
        mujoco.mj_forward(model, data)
        assert data.ten_length[0] == pytest.approx(np.linalg.norm(at - foot))
        np.testing.assert_allclose(pose.apply(data.qfrc_actuator), np.cross(at, force), atol=1e-9)
