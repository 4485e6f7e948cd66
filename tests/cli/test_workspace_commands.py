"""``exo-pin optimise``, and a workspace whose text nobody reads."""

import os
import subprocess
import sys
from pathlib import Path

import numpy as np
import pytest
from command_line import run

import exo_pin as ep
from exo_pin import MissingData
from exo_pin.cli import search_commands
from exo_pin.muscle import muscle_model, save_parameters


def test_optimise_writes_a_design(capsys, tmp_path):
    pytest.importorskip("optuna")
    pytest.importorskip("cmaes")
    path = tmp_path / "found.toml"
    status, out, _ = run(
        capsys, "optimise", "--limbs", "3", "--family", "linear", "--person", "1.75,75,male", "--criteria",
        "singularity,forces", "--without-limb", "0", "--seed", "2", "--budget", "120", "--run-length", "120", "--name",
        "found", "--out", str(path),
    )  # fmt: skip
    assert status == 0
    assert "On the grid of" in out
    exo = ep.load(path)
    assert exo.name == "found"
    assert exo.limbs[0].actuator.family == "linear"
    assert exo.arm.body_mass == 75.0
    command = exo.mechanism.sources["mechanism"]
    assert command.startswith("found by: exo-pin optimise --")
    assert " --limbs 3 --family linear " in command
    assert "--seed 2" in command
    assert "--supply" not in command
    # A limit of zero is one, and a gap of zero is the default.
    assert "--without-limb 0" in command
    assert "--gap" not in command


@pytest.mark.full
def test_files_are_written_though_nobody_reads_the_text(tmp_path):
    """As of ``exo-pin ... | head``, which closes the pipe."""
    place = tmp_path / "reached.csv"
    program = "import sys; from exo_pin.cli import main; sys.exit(main())"
    words = [sys.executable, "-c", program, "workspace", "four-cables", "--step", "20", "--out", str(place)]
    reader, writer = os.pipe()
    os.close(reader)
    status = subprocess.run(words, stdout=writer, stderr=subprocess.DEVNULL, check=False).returncode
    os.close(writer)
    assert status != 0
    assert len(place.read_text().splitlines()) > 6 * 6 * 6


def searched(capsys, monkeypatch, *arguments):
    """What the command passes to the search."""
    passed = {}

    def optimise(exo, variables, **options):
        passed.update(options, exo=exo, variables=variables)
        raise MissingData(["a search"], "this test")

    monkeypatch.setattr(search_commands, "searched", optimise)
    assert run(capsys, "optimise", *arguments)[0] == 2
    return passed


def test_bounds_and_limits_of_the_options_reach_the_search(capsys, monkeypatch, tmp_path):
    monkeypatch.chdir(tmp_path)
    person = ("--person", "1.75,75,male")
    free = searched(
        capsys, monkeypatch, *person, "--limbs", "3", "--base-radius", "120:500", "--drop", "90:200",
        "--vary", "end_fitting[2]_mm=20:80", "--travel", "275",
    )  # fmt: skip
    assert free["variables"]["A[3].radius"] == pytest.approx((0.12, 0.5))
    assert free["variables"]["B[1].drop"] == pytest.approx((0.09, 0.2))
    assert free["variables"]["B[1].radius"] == pytest.approx((0.05, 0.14))
    assert free["variables"]["end_fitting[2]_mm"] == "20:80"
    assert free["exo"].limbs[0].actuator == ep.Actuator("cable", pull_limit=400.0, travel_limit=0.275)
    assert free["person"] is None
    single = searched(capsys, monkeypatch, "four-cables", "--vary", "nominal_length[1]_mm=100:600", "--pull", "150")
    assert list(single["variables"]) == ["nominal_length[1]_mm"]
    assert single["exo"].limbs[3].actuator.pull_limit == 150.0
    save_parameters(muscle_model("best"), "law.toml")
    pulled = searched(
        capsys, monkeypatch, *person, "--family", "pneumatic muscle", "--force-law", "law.toml", "--supply", "3"
    )
    actuator = pulled["exo"].limbs[0].actuator
    assert actuator == ep.Actuator("pneumatic muscle", force_law=Path("law.toml").read_text(), supply_pressure=3e5)
    worn = searched(capsys, monkeypatch, "four-cables", *person, "--objective", "contact_force", "--side", "right")
    assert (worn["person"].height, worn["person"].side) == (1.75, "right")


@pytest.mark.full
def test_command_in_a_file_that_was_found_has_the_offsets(capsys, tmp_path):
    for extra in ("cmaes", "optuna", "myo_sim"):
        pytest.importorskip(extra)
    arguments = (
        "optimise", "four-cables", "--refine", "--person", "1.75,75,male", "--moving-centre", "--fixed-centre",
        "--offset", "2", "0", "-1", "--budget", "24", "--criteria", "stroke,singularity,forces",
    )  # fmt: skip
    status, out, _ = run(capsys, *arguments, "--out", str(tmp_path / "first.toml"))
    assert status == 0
    assert "moves with the arm" in out
    assert "off the shoulder's by (2, 0, -1) mm" in out
    command = ep.load(tmp_path / "first.toml").mechanism.sources["mechanism"].removeprefix("found by: exo-pin ")
    assert run(capsys, *command.split(), "--out", str(tmp_path / "again.toml"))[0] == 0
    first, again = (ep.load(tmp_path / f"{name}.toml").geometry for name in ("first", "again"))
    np.testing.assert_array_equal(first.base_points, again.base_points)
