"""The command line: what it prints, and what it says to a question that cannot be asked."""

import json
import subprocess
import sys
import xml.etree.ElementTree as ET

import numpy as np
import pytest
from command_line import POSE, run

import exo_pin as ep
from exo_pin.cli import main


def test_reaction_prints_the_three_splits_side_by_side(capsys):
    status, out, _ = run(
        capsys, "reaction", "prototype", *POSE, "--person", "1.75,75,male", "--compare", "--limits", "none"
    )
    assert status == 0
    header = next(line for line in out.splitlines() if "spherical" in line)
    assert header.split() == ["spherical", "minimal", "standalone"]
    force = next(line for line in out.splitlines() if line.startswith("shoulder force")).split()
    exo = ep.load("prototype").worn_by(ep.Arm.from_anthropometry(1.75, 75, "male"))
    expected = exo.reaction(ep.shoulder_rotation(60, 30, 0, degrees=True)).magnitude
    assert float(force[-3]) == pytest.approx(expected, abs=0.006)
    assert force[-2:] == ["0.00", "0.00"]
    assert "Equilibrium alone does not determine 3 of the reactions" in out
    assert "trivial" in out
    assert "% of body weight" in out


def test_reaction_as_json_and_with_a_bound(capsys):
    status, out, _ = run(
        capsys,
        "reaction",
        "prototype",
        *POSE,
        "--side",
        "right",
        "--side-force-limit",
        "actuator",
        "--json",
        "--compare",
    )
    assert status == 0
    data = json.loads(out)
    assert data["side"] == "right"
    assert data["pose"] == {"flexion_deg": 60, "abduction_deg": 30, "internal_rotation_deg": 0}
    left = ep.load("prototype").reaction(ep.shoulder_rotation(60, 30, 0, degrees=True))
    np.testing.assert_allclose(data["spherical"]["actuator_forces"], left.actuator_forces, rtol=1e-9)
    assert data["minimal"]["magnitude"] > 0.1
    assert not data["minimal"]["trivial"]


def test_reaction_of_a_file_with_a_payload(capsys, tmp_path):
    ep.load("prototype").save(tmp_path / "mine.toml")
    forces = []
    for payload in ("0", "2"):
        arguments = [str(tmp_path / "mine.toml"), *POSE, "--person", "1.6,60,female", "--payload", payload, "--json"]
        status, out, _ = run(capsys, "reaction", *arguments)
        assert status == 0
        forces.append(json.loads(out)["spherical"]["magnitude"])
    assert forces[1] > forces[0]


@pytest.mark.parametrize(
    ("arguments", "message"),
    [
        (["reaction", "prototyp"], "did you mean 'prototype'"),
        (["reaction", "none.toml"], "cannot be read"),
        (["reaction", "scenario-one"], "a person who wears it (--person"),
        (["reaction", "prototype", "--person", "175,75,male"], "0.5 to 2.6 m"),
        (["reaction", "prototype", "--person", "tall"], "HEIGHT,MASS,SEX"),
        (["reaction", "prototype", "--payload", "1"], "--person"),
        (["reaction", "prototype", "--flexion", "nan"], "finite"),
        (["reaction", "prototype", "--side-force-limit", "much"], "actuator"),
        (["reaction", "prototype", "--split", "minimal", "--side-force-limit", "-3"], "lower bound above"),
        (
            ["sweep", "prototype", "--vary", "r_A_mm=100:130:nan"],
            "expected finite numbers for r_A_mm, got '100:130:nan'",
        ),
        (["sweep", "prototype", "--vary", "r_A_mm=inf"], "expected finite numbers for r_A_mm, got 'inf'"),
        (["muscle", "step", "--mass-kg", "2", "--to-bar", "2", "--duration-s", "nan"], "--duration-s"),
        (
            ["muscle", "step", "--mass-kg", "2", "--to-bar", "2", "--duration-s", "1e9"],
            "--duration-s of at most 1000 s",
        ),
        (["mobility", "urdf/dummy-shoulder.urdf", "--set", "flexion=1e308rad"], "expected --set flexion in SI units"),
        (["export", "prototype", "--out", "/proc/none.urdf"], "/proc/none"),
        (["export", "prototype", "--out", "here.stl"], ".urdf, .xml or .sdf, got here.stl"),
        (["export", "--published", "x", "--out", "x.sdf"], "--published writes URDF to a folder: leave out --out"),
        (["export", "prototype", "--locked", "elbow"], "--on-person was not given: leave out --locked"),
        (["export", "prototype", "--cuff", "spring"], "--on-person was not given: leave out --cuff"),
        (
            ["export", "prototype", "--on-person", "myoarm", "--payload", "1", "--part", "wrist"],
            "leave out --payload, --part",
        ),
        (["export", "prototype", "--on-person", "none.xml", "--out", "x.xml"], "none.xml"),
        (["reaction", "--plot", "/tmp/picture.xyz"], ".png, .svg or .pdf, got /tmp/picture.xyz"),
        (["reaction", "--out", "forces.png"], "a picture is --plot forces.png"),
        (["sweep", "--vary", "scale=1", "--vary", "scale=2"], "scale twice"),
    ],
)
def test_invalid_arguments_give_one_line_and_status_2(capsys, arguments, message):
    status, out, err = run(capsys, *arguments)
    assert status == 2
    assert out == ""
    assert err.startswith("exo-pin: ")
    assert err.count("\n") == 1
    assert message in err


@pytest.mark.parametrize("word", ["q" * 100_000, "--\x1b[2Jx"])
def test_wrong_words_are_cut_and_made_printable(capsys, word):
    for arguments in ([word], ["reaction", "prototype", "--split", word], ["reaction", "prototype", word]):
        assert main(arguments) == 2
        err = capsys.readouterr().err
        assert len(err) < 3000
        assert "\x1b" not in err


@pytest.mark.parametrize("arguments", [["nonsense"], ["reaction", "prototype", "--flexion", "much"]])
def test_a_wrong_command_is_one_line_and_status_2(capsys, arguments):
    assert main(arguments) == 2
    _, err = capsys.readouterr()
    assert err.startswith("exo-pin: ")
    assert err.count("\n") == 1


def test_side_force_limit_and_elbow_are_heard(capsys):
    exo = ep.load("prototype").worn_by(ep.Arm.from_anthropometry(1.75, 75, "male", elbow_flexion=90, degrees=True))
    pose = ep.shoulder_rotation(60, 30, 0, degrees=True)
    person = ["--person", "1.75,75,male", "--elbow-flexion", "90"]
    least = ["--split", "minimal", "--side-force-limit", "5"]
    _, out, _ = run(capsys, "reaction", "prototype", *POSE, *person, *least, "--json")
    expected = exo.reaction(pose, split="minimal", constraint_bounds=(-5.0, 5.0))
    assert json.loads(out)["minimal"]["magnitude"] == pytest.approx(float(expected.magnitude))


@pytest.mark.full
def test_plot_of_a_singular_pose_and_of_an_unloaded_arm(capsys, tmp_path):
    assert run(capsys, "reaction", "prototype", "--abduction", "90", "--plot", str(tmp_path / "a.png"))[0] == 0
    ep.load("prototype").replace(gravity=[0, 0, 0]).save(tmp_path / "weightless.toml")
    assert run(capsys, "reaction", str(tmp_path / "weightless.toml"), "--plot", str(tmp_path / "b.png"))[0] == 0
    assert run(capsys, "reaction", "--plot", str(tmp_path / "none"))[0] == 2


def test_check_reports_consistent_and_inconsistent_files(capsys):
    status, out, _ = run(capsys, "check", "prototype")
    assert status == 0
    assert "consistent" in out
    assert "rank 15 of 18" in out


@pytest.mark.full
def test_presets_and_thesis(capsys, monkeypatch, ledger_rows):
    _, out, _ = run(capsys, "presets")
    assert [line.split()[0] for line in out.splitlines()] == ep.presets()
    monkeypatch.setattr("exo_pin.thesis.ledger", lambda: ledger_rows)
    status, out, _ = run(capsys, "thesis")
    assert status == 0
    for verdict in ("reproduced", "misprint, corrected", "under another reading: R = Rz Rx Ry", "input not printed"):
        assert verdict in out


def test_export_writes_urdf_with_its_closures(capsys, tmp_path):
    status, out, _ = run(capsys, "export", "prototype", "--out", str(tmp_path / "prototype.urdf"))
    assert status == 0
    assert out.splitlines()[:2] == [str(tmp_path / "prototype.urdf"), str(tmp_path / "prototype.closures.toml")]
    assert sorted(path.name for path in tmp_path.iterdir()) == [
        "prototype.closures.toml",
        "prototype.device.toml",
        "prototype.urdf",
    ]
    assert "open tree" in out
    chain = ep.ClosedChain.from_urdf(tmp_path / "prototype.urdf", tmp_path / "prototype.closures.toml")
    assert np.abs(chain.residual(chain.close(chain.neutral()))).max() < 1e-12


def test_export_writes_a_mujoco_model_with_closed_loops(capsys, tmp_path):
    mujoco = pytest.importorskip("mujoco")
    status, out, _ = run(
        capsys, "export", "prototype", "--person", "1.75,75,male", "--out", str(tmp_path / "prototype.xml")
    )
    assert status == 0
    assert out.splitlines()[0] == str(tmp_path / "prototype.xml")
    model = mujoco.MjModel.from_xml_path(str(tmp_path / "prototype.xml"))
    data = mujoco.MjData(model)
    mujoco.mj_resetDataKeyframe(model, data, 0)
    mujoco.mj_forward(model, data)
    assert (model.nv, model.neq, data.nefc) == (18, 3, 18)
    assert np.abs(data.efc_pos).max() < 1e-12
    chain = ep.load("prototype").worn_by(ep.Arm.from_anthropometry(1.75, 75, sex="male")).chain_with_masses()
    assert model.body_mass.sum() == pytest.approx(sum(body.mass for body in chain.model.inertias), rel=1e-12)


def test_export_writes_an_sdf_with_a_joint_for_every_closure(capsys, tmp_path):
    assert run(capsys, "export", "prototype", "--out", str(tmp_path / "prototype.sdf"))[0] == 0
    joints = ET.parse(tmp_path / "prototype.sdf").getroot().findall("model/joint")
    assert [joint.get("type") for joint in joints].count("fixed") == 3
    # A link that is the child of two joints closes a loop; the world ends one loop a limb.
    assert len(joints) == 1 + 5 * 3 + 3


@pytest.mark.parametrize(
    "arguments",
    [
        ["reaction", "prototype", "--abduction", "-4", "--flexion", "-1e1"],
        ["reaction", "prototype", "--offset", "-5", "0", "-.3"],
        ["reaction", "prototype", "--compare", "minimal", "--limits=-10,20"],
        ["reaction", "prototype", "--limits=-300,500"],
    ],
)
def test_negative_values_need_no_equals_sign(capsys, arguments):
    assert run(capsys, *arguments)[0] == 0


@pytest.mark.full
def test_plot_writes_a_picture(capsys, tmp_path):
    path = tmp_path / "picture.png"
    status, _, _ = run(capsys, "reaction", "prototype", *POSE, "--person", "1.75,75,male", "--plot", str(path))
    assert status == 0
    assert path.read_bytes().startswith(b"\x89PNG")


def test_the_installed_command():
    command = [sys.executable, "-m", "exo_pin.cli", "--version"]
    done = subprocess.run(command, capture_output=True, text=True, check=True)
    assert done.stdout.strip() == ep.__version__
