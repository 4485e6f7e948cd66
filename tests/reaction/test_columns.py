"""Answers as tables: units in the names, numbers as in the answer."""

import numpy as np
import pytest

import exo_pin as ep
from exo_pin.core import errors

CLINICAL_ANGLES = ("flexion_deg", "abduction_deg", "internal_rotation_deg")

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
    for answer in (exo.reaction(poses), exo.reaction_map(poses)):
        words = {name: answer.columns()[name].tolist() for name in ("verdict", "status")}
        assert words == {"verdict": ["not held"] * 2, "status": ["out_of_stroke"] * 2}
        assert {type(word) for column in words.values() for word in column} == {str}
    with pytest.raises(errors.InvalidInput, match="magnitude"):
        _ = margin.peak
