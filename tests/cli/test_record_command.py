"""The command that reads, checks and converts recordings, and the pictures of recorded movements."""

import json

import foreign_records as foreign
import numpy as np
import pytest
from command_line import run

import exo_pin as ep


def test_a_recording_is_described_and_converted(tmp_path, capsys):
    truth = foreign.movement(3, "right")
    path, _ = foreign.isb(tmp_path, truth)
    status, out, _ = run(capsys, "record", str(path), "--side", "right", "--out", str(tmp_path / "clinical.csv"))
    assert status == 0
    assert out.startswith("A right arm can have moved like this.")
    assert "CSV: ISB angles" in out
    table = np.genfromtxt(tmp_path / "clinical.csv", delimiter=",", names=True)
    smoothed = ep.read_movement(path, "right").poses
    # What rests hangs, where plane and axial rotation are not separate: the angle from straight down is below 5°.
    hanging = int((smoothed.as_matrix()[:, 2, 2] > np.cos(np.radians(5.0))).sum())
    assert hanging > 100
    assert f"and {hanging} of the ISB's" in " ".join(out.split())
    expected = ep.shoulder_angles(smoothed, "right", degrees=True)
    np.testing.assert_allclose(table["flexion_deg"], expected[:, 0], atol=1e-9)
    status, out, _ = run(capsys, "record", str(path), "--side", "right", "--json")
    answer = json.loads(out)
    np.testing.assert_allclose(answer["clinical"], expected, atol=1e-9)
    assert answer["cautions"] == []


def test_a_task_in_percent_needs_its_duration(tmp_path, capsys):
    truth = foreign.movement(0, "left", noise=0.0)
    rows = np.c_[100 * truth.t / truth.t[-1], foreign.isb_values(truth)][::5].tolist()
    names = ("time_percent", "plane_of_elevation_deg", "elevation_deg", "axial_rotation_deg")
    path = foreign.lines(tmp_path / "task.csv", [], names, rows)
    status, _, err = run(capsys, "record", str(path))
    assert status == 2
    assert "--duration S" in err
    status, out, _ = run(capsys, "record", str(path), "--duration", "3")
    assert status == 0
    assert "samples in 2.9" in out


@pytest.mark.full
def test_pictures_of_tasks_and_paths(tmp_path, capsys):
    path, _ = foreign.clinical(tmp_path, foreign.movement(0, "left"))
    for words in (
        ("record", str(path), "--against", str(path), "--plot", str(tmp_path / "path.png")),
        ("tasks", "four-cables", "--no-ranges", "--movement", f"lift={path}", "--plot", str(tmp_path / "status.png")),
    ):
        status, _, err = run(capsys, *words)
        assert status == 0, err
        assert (tmp_path / words[-1]).stat().st_size > 5000
    status, _, err = run(capsys, "tasks", "four-cables", "--plot", str(tmp_path / "none.png"))
    assert status == 2
    assert "--movement NAME=FILE" in err
