"""``exo-pin workspace``, ``tasks`` and ``optimise``."""

import json
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
from exo_pin.workspace import Criteria, limb_loss, limb_sheet, limb_table


def test_workspace_prints_shares_and_what_was_not_checked(capsys, tmp_path):
    picture = tmp_path / "slices.png"
    status, out, _ = run(capsys, "workspace", "prototype", "--step", "12", "--plot", str(picture))
    assert status == 0
    found = ep.load("prototype").workspace(12.0)
    assert f"{100 * found.index:.1f} % of {found.inside.size} poses" in out
    assert "joint_angles: not checked, because not known" in out
    assert picture.stat().st_size > 10_000


def test_the_body_is_that_of_the_person_in_the_person_s_posture(capsys):
    """The joints of four-cables on the arm lie at the elbow: bent, the forearm is where the limbs are."""
    shares = {}
    for bend in (0.0, 90.0):
        question = (
            "workspace",
            "four-cables",
            "--person",
            "1.75,75,male",
            "--elbow-flexion",
            str(bend),
            "--step",
            "24",
        )
        status, out, _ = run(capsys, *question, "--criteria", "clearance", "--json")
        assert status == 0
        person = ep.Wearer(1.75, 75, "male", elbow_flexion=bend, degrees=True)
        shares[bend] = json.loads(out)["index"]
        assert shares[bend] == ep.load("four-cables").worn_by(person).workspace(24.0, ["clearance"]).index
    assert shares[0.0] > 0.5
    assert shares[90.0] == 0.0


def test_criteria_hold_for_several_persons_while_the_elbow_bends(capsys):
    asked = ("workspace", "four-linear-actuators", "--step", "24", "--elbow-range", "0,130", "--json")
    status, out, _ = run(capsys, *asked, "--fits", "1.52,50,female", "--fits", "1.87,102,male")
    assert status == 0
    persons = ep.Wearer(1.52, 50, "female"), ep.Wearer(1.87, 102, "male")
    exo, bend = ep.load("four-linear-actuators"), (0.0, np.radians(130.0))
    assert json.loads(out)["index"] == exo.workspace(24.0, Criteria(wearers=persons, elbow_range=bend)).index
    status, out, _ = run(capsys, *asked, "--person", "1.75,75,male", "--fits", "1.52,50,female")
    three = Criteria(wearers=(ep.Wearer(1.75, 75, "male"), persons[0]), elbow_range=bend)
    assert json.loads(out)["index"] == exo.workspace(24.0, three).index
    assert run(capsys, *asked[:-1], "--elbow-range", "130,0")[0] == 2
    assert run(capsys, "workspace", "prototype", "--fits", "tall")[0] == 2


def test_workspace_as_json_with_chosen_criteria(capsys):
    arguments = ["--criteria", "singularity,shoulder_range", "--least-margin", "0.1", "--step", "12", "--json"]
    status, out, _ = run(capsys, "workspace", "appendix-d", *arguments, "--side", "right")
    assert status == 2  # it has no range of the shoulder
    status, out, _ = run(capsys, "workspace", "prototype", *arguments, "--side", "right")
    assert status == 0
    data = json.loads(out)
    criteria = ep.Criteria(names=("singularity", "shoulder_range"), least_margin=0.1)
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
    status, _, err = run(capsys, "tasks", "prototype", "--movement", "lift.csv")
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
        "singularity,forces", "--without-limb", "0", "--seed", "2", "--budget", "120", "--run-length", "120", "--name",
        "found", "--out", str(path),
    )  # fmt: skip
    assert status == 0
    assert "Checked with Pinocchio" in out
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


def test_workspace_prints_what_criteria_cost_and_limbs_do(capsys):
    arguments = ("workspace", "three-linear-actuators", "--step", "15", "--gap", "10")
    status, out, _ = run(capsys, *arguments, "--shoulder-force", "150", "--one-by-one", "--limb-table")
    assert status == 0
    exo = ep.load("three-linear-actuators")
    found = exo.workspace(15.0, Criteria(largest_shoulder_force=150.0, least_gap=0.01))
    assert str(found.one_by_one()) in out
    assert limb_sheet(exo.mechanism, limb_table(exo.mechanism, found)) in out
    status, out, _ = run(capsys, *arguments, "--json")
    assert json.loads(out)["one_by_one"]["criterion"][0] == "stroke"
    status, out, err = run(capsys, *arguments, "--json", "--limb-table")
    assert (status, out) == (2, "")
    assert "--limb-table" in err


def test_workspace_judges_socket_cuff_and_the_loss_of_a_limb(capsys):
    pytest.importorskip("myo_sim", reason="needs the extra person: pip install '.[person]'")
    status, out, err = run(capsys, "workspace", "prototype", "--step", "15", "--pull-out", "30")
    assert (status, out) == (2, "")
    assert "whose socket" in err
    arguments = ("workspace", "four-linear-actuators", "--step", "15", "--pull-out", "30")
    felt = ("--person", "1.75,75,male", "--cuff-pull", "60", "--without-limb", "0", "--limb-loss")
    status, out, _ = run(capsys, *arguments, *felt)
    assert status == 0
    exo, person = ep.load("four-linear-actuators"), ep.Person(1.75, 75, "male")
    limits = Criteria(
        largest_pull_out=30.0, socket=person.glenoid_cone(), largest_cuff_pull=60.0, least_moment_without_limb=0.0
    )
    found = exo.worn_by(ep.Wearer(1.75, 75, "male")).workspace(15.0, limits)
    assert {"socket", "cuff_pull", "limb_loss"} < set(found.margins)
    assert str(found) in out
    left = limb_loss(exo.mechanism, found)
    assert str(left) in out
    share = left["missing_share"].max()
    assert ("it drops" in out) == (share >= 1.0)
    assert (f"it sinks, with at most {share:.0%} of its free acceleration" in out) == (0.0 < share < 1.0)


def test_the_design_says_who_wears_it_where_no_person_is_given(capsys):
    pytest.importorskip("myo_sim", reason="needs the extra person: pip install '.[person]'")
    name, step = "four-linear-actuators-worn", ("--step", "20", "--json")
    same = (
        "--elbow-flexion",
        "120",
        "--payload",
        "1",
        "--moving-centre",
        "--pull-out",
        "40",
        "--fits",
        "1.525,51,female",
    )
    status, out, _ = run(capsys, "workspace", name, *step, *same)
    assert status == 0
    named = run(capsys, "workspace", name, *step, *same, "--person", "1.755,85,male")
    assert out == named[1]
    woman = ep.Wearer(1.525, 51, "female")
    man = ep.Person(1.755, 85, "male", elbow_flexion=np.radians(120), payload=1.0)
    limits = Criteria(largest_pull_out=40.0, socket=man.glenoid_cone(), wearers=(man, woman))
    found = ep.load(name).worn_by(man).workspace(20.0, limits, centre_offset=man.centre_path())
    assert json.loads(out)["index"] == found.index
    status, out, err = run(capsys, "workspace", "prototype", "--payload", "1")
    assert (status, out) == (2, "")
    assert "does not say who wears it: give --person too" in err


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


def test_moving_centre_of_a_person(capsys, monkeypatch):
    pytest.importorskip("myo_sim", reason="needs the extra person: pip install '.[person]'")
    exo, person = ep.load("four-cables"), ("--person", "1.75,75,male")
    path = ep.Person(1.75, 75.0, "male").centre_path()
    status, out, _ = run(capsys, "workspace", "four-cables", *person, "--moving-centre", "--step", "15", "--json")
    assert status == 0
    found = exo.workspace(15.0, centre_offset=path)
    assert json.loads(out)["index"] == found.index
    assert json.loads(out)["moving_centre"] is True
    assert found.index < exo.workspace(15.0).index
    both = searched(
        capsys, monkeypatch, "four-cables", *person, "--moving-centre", "--fixed-centre", "--offset", "2", "0", "-1"
    )["centre_offset"]  # fmt: skip
    np.testing.assert_allclose(both[0].base, [0.002, 0.0, -0.001])
    np.testing.assert_allclose(both[1].displacement, path.displacement)
    np.testing.assert_allclose(both[1].fit, [0.002, 0.0, -0.001])
    right = searched(capsys, monkeypatch, "four-cables", *person, "--moving-centre", "--side", "right")
    np.testing.assert_allclose(right["centre_offset"][0].displacement, path.mirrored().displacement, atol=1e-12)


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


def test_offset_of_a_workspace(capsys, monkeypatch):
    status, out, _ = run(capsys, "workspace", "four-cables", "--step", "15", "--offset", "5", "0", "-10", "--json")
    assert status == 0
    assert json.loads(out)["index"] == ep.load("four-cables").workspace(15.0, centre_offset=[0.005, 0.0, -0.01]).index
    assert json.loads(out)["centre_offset_mm"] == [5.0, 0.0, -10.0]
    status, out, _ = run(capsys, "workspace", "four-cables", "--step", "15", "--offset", "5", "0", "-10")
    assert "by at most 11 mm at the base and 11 mm at the cuff" in out
    assert searched(capsys, monkeypatch, "four-cables")["centre_offset"] == (None,)


@pytest.mark.parametrize(
    ("arguments", "message"),
    [
        (("prototype", "--moving-centre"), "give --person too"),
        (("four-cables", "--fixed-centre"), "belongs to --moving-centre"),
        (("four-cables", "--base-radius", "120"), "LOW:HIGH in mm"),
        (("appendix-d", "--pull", "100"), "actuator of limb 1"),
    ],
)
def test_wrong_options_of_a_search(capsys, arguments, message):
    status, _, err = run(capsys, "optimise", *arguments)
    assert status == 2
    assert message in err
