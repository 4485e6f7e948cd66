"""Answers as tables: units in the names, numbers as in the answer."""

import html

import numpy as np
import pytest

import exo_pin as ep
from exo_pin.core import errors
from exo_pin.core.conventions import CLINICAL_ANGLES
from exo_pin.load_case import Movement
from exo_pin.reaction import SPLITS
from exo_pin.study import StudyTable

PERSON = ep.Arm.from_anthropometry(1.75, 75, "male")
pandas = pytest.importorskip("pandas")


@pytest.fixture(scope="module")
def exo():
    return ep.load("prototype").worn_by(PERSON)


def test_poses_are_rows_with_units_in_the_names(exo):
    answer = exo.reaction(ep.shoulder_rotation([20.0, 50.0, 80.0], 30, 0, degrees=True), limits=(0.0, 300.0))
    frame = answer.to_dataframe()
    assert list(frame) == [
        "flexion_deg", "abduction_deg", "internal_rotation_deg", "verdict", "reason",
        "F_s_x_N", "F_s_y_N", "F_s_z_N", "F_s_N",
        "f_1_N", "f_2_N", "f_3_N", "g_1_N", "g_2_N", "g_3_N",
        "margin", "cuff_pull_N", "det_X", "status",
    ]  # fmt: skip
    np.testing.assert_array_equal(frame[["F_s_x_N", "F_s_y_N", "F_s_z_N"]].to_numpy(), answer.shoulder_force)
    assert frame["status"].tolist() == answer.status.tolist()
    assert np.isnan(frame["F_s_N"][~answer.has_answer]).all()


def test_one_pose_is_one_row_and_a_grid_has_an_index(exo):
    one = exo.reaction(ep.shoulder_rotation(60, 30, 0, degrees=True), limits="none")
    assert len(one.to_dataframe()) == 1
    assert one.peak == one.magnitude
    poses = ep.shoulder_rotation(np.array([[20.0], [50.0]]), [20.0, 30.0, 40.0], 0, degrees=True)
    for answer in (exo.reaction(poses, limits="none"), exo.reaction_map(poses, limits="none")):
        frame = answer.to_dataframe()
        assert frame.index.names == ["axis_0", "axis_1"]
        assert frame.loc[(1, 2), "F_s_N"] == answer.magnitude[1, 2]
        assert answer.peak == answer.magnitude.max()


def test_a_map_has_what_was_kept(exo):
    poses = ep.shoulder_rotation([20.0, 50.0], 30, 0, degrees=True)
    assert list(exo.reaction_map(poses, keep=("magnitude",)).to_dataframe()) == [*CLINICAL_ANGLES, "F_s_N"]
    margin = exo.reaction_map(poses, keep=("margin", "actuator_forces"))
    assert list(margin.to_dataframe()) == [*CLINICAL_ANGLES, "f_1_N", "f_2_N", "f_3_N", "margin"]
    with pytest.raises(errors.InvalidInput, match="magnitude"):
        _ = margin.peak


def test_no_answer_has_no_peak(exo):
    answer = exo.reaction(ep.shoulder_rotation(60, 30, 0, degrees=True), limits=(0.0, 1.0))
    assert np.isnan(answer.peak)


@pytest.mark.parametrize("side", ["left", "right"])
def test_a_movement_has_time_angles_and_motion(exo, side):
    design = exo if side == "left" else exo.mirrored()
    times = np.linspace(0.0, 1.0, 11)
    lift = ep.shoulder_rotation(30 + 40 * times, 30, 10, side=side, degrees=True)
    answer = design.follow(Movement.from_samples(times, lift))
    frame = answer.to_dataframe()
    np.testing.assert_allclose(frame["flexion_deg"], 30 + 40 * times, atol=1e-9)
    np.testing.assert_allclose(frame["internal_rotation_deg"], 10.0, atol=1e-9)
    np.testing.assert_array_equal(frame["time_s"], times)
    np.testing.assert_array_equal(frame["F_s_N"], answer.reaction.magnitude)
    assert {"omega_x_rad_s", "eta_z_rad_s2", "f_3_N", "det_X", "status"} <= set(frame)


def test_a_study_has_units_in_the_names_of_its_parameters():
    table = StudyTable([{"design": "a", "r_A": 0.1, "alpha_A_2": 0.5, "payload": 1.0, "gravity_3": -9.81, "F_N": 2.0}])
    frame = table.to_dataframe()
    assert list(frame) == ["design", "r_A_m", "alpha_A_2_rad", "payload_kg", "gravity_3_m_s2", "F_N"]


def test_a_notebook_shows_the_same_table_as_html(exo):
    answer = exo.reaction(exo.pose([0, 30]))
    shown = answer._repr_html_()
    assert answer.verdict in html.unescape(shown)
    for line in str(answer).splitlines():
        for cell in (part for part in line.split("  ") if part.strip() and "---" not in part):
            if line.startswith(("peak", "median", "poses")):
                assert cell.strip() in shown
    # Text is never taken for markup.
    named = type("Named", (type(SPLITS["spherical"]),), {"name": "<b>"})()
    assert "&lt;b&gt;" in exo.reaction(exo.pose(30), split=named)._repr_html_()
