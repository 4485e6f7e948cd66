"""The table of the bare arm, which is printed beside shoulder forces."""

import runpy

import numpy as np
import pytest
from places import SCRIPTS

import exo_pin as ep
from exo_pin.exo.pose_report import PoseReport
from exo_pin.person.bare_arm import bare_arm_share


def test_the_table_is_the_answer_of_joint_contact():
    pytest.importorskip("mujoco")
    poses = ep.shoulder_rotation([0.0, 60.0, 0.0], [60.0, 0.0, 105.0], [0.0, 40.0, 0.0], degrees=True)
    low, high = bare_arm_share(poses)
    person = ep.Person(1.75, 75.0, "male")
    for row, ends in [(0, high), (2, low)]:
        assert ends[row] == pytest.approx(float(person.joint_contact(poses[row]).percent_body_weight), abs=0.06)
    # Rotation of the arm about its own axis is no elevation.
    assert (low[0], high[0]) == pytest.approx((low[1], high[1]))
    assert (low < high).all()


def test_above_the_table_nothing_is_claimed():
    assert np.isnan(bare_arm_share(ep.shoulder_rotation(0.0, 150.0, 0.0, degrees=True))).all()


@pytest.mark.full
def test_the_command_writes_the_table_that_ships():
    made = runpy.run_path(str(SCRIPTS / "bare_arm.py"))
    shipped = np.loadtxt(made["TABLE"], delimiter=",", skiprows=1)
    np.testing.assert_allclose(made["bare_arm_table"](), shipped, atol=0.051)


@pytest.mark.parametrize(("lean", "known"), [(0.0, True), (9.0, True), (12.0, False), (90.0, False), (180.0, False)])
def test_it_is_that_of_an_upright_wearer(lean, known):
    exo = ep.load("four-linear-actuators-worn")
    lean = np.radians(lean)
    leaning = exo.replace(gravity=[-9.81 * np.sin(lean), 0.0, -9.81 * np.cos(lean)])
    report = PoseReport(leaning.reaction(exo.pose(60.0)), None, None)
    assert np.isfinite(report.bare_arm_share).all() == known
    assert ("of body weight without a device" in str(report)) == known


@pytest.mark.parametrize("force", [0.0, 30.0])
def test_a_load_of_nothing_is_none(force):
    exo = ep.load("four-linear-actuators-worn")
    report = PoseReport(exo.reaction(exo.pose(60.0), load=ep.Load([0.0, 0.0, -force], at=[0.0, 0.0, -0.5])), None, None)
    assert np.isfinite(report.bare_arm_share).all() == (force == 0.0)
