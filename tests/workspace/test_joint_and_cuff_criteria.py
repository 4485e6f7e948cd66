"""The criteria of socket, cuff and the loss of a limb: by hand, against single answers and by linear programs."""

import numpy as np
import pytest
from scipy.optimize import linprog
from scipy.spatial.transform import Rotation

import exo_pin as ep
from exo_pin import Interface, Interfaces, InvalidInput
from exo_pin.workspace import Criteria

PRESETS = ("four-cables", "four-linear-actuators", "three-linear-actuators")
SOFT = Interfaces(cuff=Interface.upper_arm_cuff(0.2))
HANGING, FORWARD = np.eye(3), Rotation.from_euler("y", -90, degrees=True).as_matrix()


def some_poses(exo, count=12):
    numbers = np.random.default_rng(7)
    return exo.pose(numbers.uniform(0, 100, count), numbers.uniform(0, 90, count), numbers.uniform(-20, 60, count))


def test_slip_by_hand():
    """10 N on 1 and 2 N/mm are 10 and 5 mm; 2 N m on 50 N m/rad are 0.04 rad."""
    cuff = Interface.of([2000.0, 2000.0, 1000.0], 50.0, (0.0, 0.0, -0.2))
    along = cuff.slip(np.array([0.0, 0.0, 10.0, 0.0, 0.0, 0.0]), HANGING)
    np.testing.assert_allclose(along, [0.0, 0.0, 0.01, 0.0, 0.0, 0.0], atol=1e-15)
    # Across at the cuff itself: the moment about O is that of the lever of 0.2 m, and the cuff does not turn.
    across = np.concatenate([[10.0, 0.0, 0.0], np.cross([0.0, 0.0, -0.2], [10.0, 0.0, 0.0])])
    np.testing.assert_allclose(cuff.slip(across, HANGING), [0.005, 0.0, 0.0, 0.0, 0.0, 0.0], atol=1e-15)
    across[4] += 2.0
    np.testing.assert_allclose(cuff.slip(across, HANGING)[3:], [0.0, 0.04, 0.0], atol=1e-15)


def test_mean_force_over_area_on_the_skin():
    """By NumPy from the wrench; the force along the arm does not press. Off a person's arm there is no cuff."""
    exo = ep.load("four-cables").replace(interfaces=Interfaces(cuff_area=0.01))
    poses = some_poses(exo)
    answer = exo.reaction(poses)
    axes = poses.apply([0.0, 0.0, -1.0])
    force = answer.cuff_wrench[:, :3]
    across = force - (force * axes).sum(axis=1)[:, None] * axes
    np.testing.assert_allclose(answer.cuff_pressure, np.linalg.norm(across, axis=1) / 0.01, rtol=1e-9)
    one = exo.reaction(poses[0])
    kilopascals = float(answer.cuff_pressure[0]) / 1e3
    assert f"mean force over area on the skin is {kilopascals:.1f} kPa" in one.cuff_text() == answer.cuff_text((0,))
    assert "26 ± 1.6 kPa (Eur J Pain 2001, 5:267)" in one.as_dict()["cuff_pressure_limits"]
    # Of all held poses the most, and a column each.
    held = answer.held
    words = f"up to {np.abs(answer.cuff_pull[held]).max():.0f} N"
    assert words in answer.cuff_text()
    assert f"skin is up to {answer.cuff_pressure[held].max() / 1e3:.1f} kPa, on 100 cm²." in answer.cuff_text()
    np.testing.assert_array_equal(answer.columns()["cuff_pull_N"], answer.cuff_pull)
    np.testing.assert_array_equal(answer.columns()["cuff_pressure_Pa"], answer.cuff_pressure)
    assert "cuff_slip_m" not in answer.columns()
    soft = exo.replace(interfaces=SOFT).reaction(poses)
    np.testing.assert_allclose(soft.columns()["cuff_slip_m"], np.linalg.norm(soft.cuff_slip[:, :3], axis=1))
    assert ep.load("four-cables").reaction(poses).cuff_pressure is None
    assert exo.replace(arm=ep.Arm(3.0, (0.0, 0.0, -0.3), device=True)).reaction(poses[0]).cuff_text() == ""


def test_cuff_ends_above_the_elbow_by_hand():
    """The lowest joint of a preset at 142 mm, its highest at 60: a sleeve of 102 mm about 101 mm, so down to 152 mm."""
    exo = ep.load("four-linear-actuators-worn")
    woman, man = ep.Wearer(1.525, 51, "female"), ep.Wearer(1.87, 111, "male")
    arm = 1.525 * 275.1 / 1735.0
    assert woman.upper_arm_length == pytest.approx(arm)
    for wearers in ((woman,), (man, woman)):
        found = exo.workspace(exo.pose([0, 60], 0), Criteria(wearers=wearers, least_above_elbow=0.02))
        np.testing.assert_allclose(found.margins["elbow"], arm - 0.152 - 0.02, atol=1e-9)
    assert "elbow" not in exo.workspace(exo.pose([0, 60], 0), Criteria(wearers=(woman,))).margins
    far = exo.workspace(exo.pose([0, 60], 0), Criteria(wearers=(woman,), least_above_elbow=0.1))
    assert not far.inside.any()
    with pytest.raises(InvalidInput, match="least_above_elbow"):
        Criteria(least_above_elbow=-0.01)


@pytest.mark.parametrize("name", PRESETS)
def test_loss_of_a_limb_by_linear_programs(name):
    exo = ep.load(name)
    poses = some_poses(exo, 8)
    found = exo.workspace(poses, Criteria(names=("forces", "limb_loss"), least_moment_without_limb=0.0))
    n, weight = exo.geometry.limb_count, exo.arm.mass * np.array([0.0, 0.0, -9.81])
    least, most = (-400.0 if "linear" in name else 0.0), 400.0
    for k, R in enumerate(poses.as_matrix()):
        ends = exo.geometry.platform_points @ R.T
        along = exo.geometry.base_points - ends
        along /= np.linalg.norm(along, axis=1, keepdims=True)
        moments, missing = np.cross(ends, along).T, -np.cross(R @ exo.arm.centre_of_mass, weight)
        held = []
        for lost in range(n):
            bounds = [(0.0, 0.0) if i == lost else (least, most) for i in range(n)]
            held.append(linprog(np.zeros(n), A_eq=moments, b_eq=missing, bounds=bounds, method="highs").status == 0)
        assert all(held) == found.met["limb_loss"][k]
