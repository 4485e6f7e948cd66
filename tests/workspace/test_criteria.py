"""Criteria by name, one by one, and of tasks."""

from dataclasses import replace

import numpy as np
import pytest
from scipy.spatial.transform import Rotation

import exo_pin as ep
from exo_pin import InvalidInput
from exo_pin.workspace import CRITERIA, Criteria, task_reach
from exo_pin.workspace import query as tasks


def toy(**limb):
    """Three limbs along the axes x, y and z at rest, each 0.1 m from O: every figure is known by hand."""
    base = [[0.0, 0.1, 0.3], [0.3, 0.0, 0.1], [0.1, 0.3, 0.0]]
    platform = [[0.0, 0.1, -0.2], [-0.2, 0.0, 0.1], [0.1, -0.2, 0.0]]
    arm = ep.Arm(2.0, [0.0, 0.0, -0.25], np.diag([0.1, 0.1, 0.01]))
    return ep.ShoulderExo(ep.WristGeometry(base, platform), arm=arm, limbs=[ep.Limb("SPS", **limb)] * 3, name="toy")


LINEAR = ep.Actuator("linear", pull_limit=100.0, push_limit=80.0)


def cable_design():
    """Four cables of a design found by a search, joints rounded to centimetres."""
    base = np.array([[8, -22, 8], [-5, 14, 20], [-7, -7, -21], [5, 5, 24]]) / 100.0
    platform = np.array([[8, 6, -11], [-13, 6, -23], [-13, 6, -27], [13, -5, -28]]) / 100.0
    limb = ep.Limb("SPS", actuator=ep.Actuator("cable", pull_limit=400.0))
    arm = ep.Arm.from_anthropometry(1.75, 75, sex="male")
    return ep.ShoulderExo(ep.WristGeometry(base, platform), arm=arm, limbs=[limb] * 4)


def test_tasks_name_their_data_and_what_limits_them(tmp_path):
    path = tmp_path / "lift.csv"
    lines = ["time_s,flexion_deg,abduction_deg,internal_rotation_deg"]
    lines += [f"{0.05 * k},{80 * np.sin(np.pi * k / 40) ** 2:.6f},10,5" for k in range(41)]
    path.write_text("\n".join(lines) + "\n")
    exo = cable_design()
    fast = replace(exo.limbs[0], actuator=ep.Actuator("cable", pull_limit=400.0, speed_limit=5.0, power_limit=1e4))
    exo = exo.replace(limbs=[fast] * 4)
    table = task_reach(exo.mechanism, {"lift": path}, criteria=["singularity", "forces"], step=20.0)
    assert table["data"].tolist() == ["movement", "published range", "published range", "published range"]
    assert table["poses"][0] == 41
    assert table["fast_enough"][0] == 1.0
    slow = exo.replace(limbs=[replace(fast, actuator=replace(fast.actuator, speed_limit=0.05))] * 4)
    assert task_reach(slow.mechanism, {"lift": path}, (), ["forces"])["fast_enough"][0] < 1.0
    with pytest.raises(InvalidInput, match="at least one"):
        task_reach(exo.mechanism, None, ())


def test_names_come_in_the_order_of_the_list():
    assert Criteria(names=("forces", "stroke")).names == ("stroke", "forces")
    assert set(CRITERIA) >= {"stroke", "forces"}
    with pytest.raises(InvalidInput, match="empty"):
        toy().workspace(Rotation.identity(0))


def test_criteria_one_by_one_by_hand():
    exo = toy(stroke=ep.Stroke(0.4, 0.75, 1.0, 0.12), actuator=LINEAR)
    poses = ep.adl_box(20.0)
    found = exo.workspace(poses, ["stroke", "singularity", "forces"])
    table = found.one_by_one()
    assert table["criterion"].tolist() == ["stroke", "singularity", "forces"]
    stroke, singularity, forces = (found.met[name] for name in table["criterion"])
    np.testing.assert_array_equal(
        table["together"], [stroke.mean(), (stroke & singularity).mean(), (stroke & singularity & forces).mean()]
    )
    np.testing.assert_array_equal(table["alone"], [stroke.mean(), singularity.mean(), forces.mean()])
    assert table["cost"].sum() == pytest.approx(1.0 - found.index)
    assert found.one_by_one(["forces", "stroke"])["together"][1] == (forces & stroke).mean()
    with pytest.raises(InvalidInput, match="criterion"):
        found.one_by_one(["clearance"])


def test_a_speed_that_is_not_known_fits_no_limit():
    exo = ep.load("four-cables")
    winch = ep.Actuator("cable", pull_limit=400.0, speed_limit=5.0)
    mechanism = exo.replace(limbs=[replace(limb, actuator=winch) for limb in exo.limbs]).mechanism
    rates, power = tasks._Rates(mechanism, None), np.zeros((2, 4))
    rates.values = np.zeros((2, 4))
    assert rates.fast_enough(power) == 1.0
    rates.values[0, 1] = np.nan
    assert rates.fast_enough(power) == 0.5
