"""``exo-pin workspace``, ``tasks`` and ``optimise``."""

import json

import pytest
from command_line import run

import exo_pin as ep


def test_workspace_prints_shares_and_what_was_not_checked(capsys, tmp_path):
    picture = tmp_path / "slices.png"
    status, out, _ = run(capsys, "workspace", "prototype", "--step", "12", "--out", str(picture))
    assert status == 0
    found = ep.load("prototype").workspace(12.0)
    assert f"{100 * found.index:.1f} % of {found.inside.size} poses" in out
    assert "joint_angles: not checked" in out
    assert picture.stat().st_size > 10_000


def test_workspace_as_json_with_chosen_criteria(capsys):
    arguments = ["--criteria", "singularity,shoulder_range", "--independence", "0.1", "--step", "12", "--json"]
    status, out, _ = run(capsys, "workspace", "appendix-d", *arguments, "--side", "right")
    assert status == 2  # it has no range of the shoulder
    status, out, _ = run(capsys, "workspace", "prototype", *arguments, "--side", "right")
    assert status == 0
    data = json.loads(out)
    criteria = ep.Criteria(names=("singularity", "shoulder_range"), independence=0.1)
    found = ep.load("prototype", side="right").workspace(12.0, criteria)
    assert data["index"] == found.index
    assert data["fractions"] == found.fractions


def test_tasks_are_a_table(capsys, tmp_path):
    path = tmp_path / "tasks.csv"
    status, out, _ = run(
        capsys, "tasks", "prototype", "--criteria", "singularity", "--step", "20", "--out", str(path)
    )  # fmt: skip
    assert status == 0
    assert "published range" in out
    assert path.read_text().startswith("task,data,poses,inside")
    status, _, err = run(capsys, "tasks", "--movement", "lift.csv")
    assert status == 2
    assert "NAME=FILE" in err


def test_optimise_names_what_it_needs(capsys):
    status, _, err = run(capsys, "optimise", "--limbs", "4")
    assert status == 2
    assert "--person" in err
    status, _, err = run(capsys, "optimise", "prototype", "--vary", "r_A_mm=50")
    assert status == 2
    assert "LOW:HIGH" in err


def test_optimise_writes_a_design(capsys, tmp_path):
    pytest.importorskip("optuna")
    pytest.importorskip("cmaes")
    path = tmp_path / "found.toml"
    status, out, _ = run(
        capsys, "optimise", "--limbs", "3", "--family", "linear", "--person", "1.75,75,male", "--criteria",
        "singularity,forces", "--seed", "2", "--budget", "120", "--run-length", "120", "--name", "found",
        "--out", str(path),
    )  # fmt: skip
    assert status == 0
    assert "Answered by Pinocchio" in out
    exo = ep.load(path)
    assert exo.name == "found"
    assert exo.limbs[0].actuator.family == "linear"
    assert exo.arm.body_mass == 75.0
    command = exo.mechanism.sources["mechanism"]
    assert command.startswith("found by: exo-pin optimise --limbs 3 --family linear")
    assert "--seed 2" in command
    assert "--supply" not in command
