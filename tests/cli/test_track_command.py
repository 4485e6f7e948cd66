"""``exo-pin track``."""

import json

import numpy as np
import pytest
from command_line import run
from scipy.spatial.transform import Rotation

import exo_pin as ep
from exo_pin.design import preset_file


@pytest.mark.full
def test_track_prints_the_verdict_first_and_writes_files(capsys, tmp_path):
    table, picture = tmp_path / "run.csv", tmp_path / "run.png"
    arguments = ["--no-progress", "--out", str(table), "--plot", str(picture)]
    status, out, _ = run(capsys, "track", "--experiment", "held-abduction", "--controller", "model", *arguments)
    assert status == 0
    first = out.splitlines()[0]
    assert first.startswith("Taken as known: ")
    assert "abduction through poses that the muscles hold: abduction ends at 56° of 55°" in first
    assert out.splitlines()[-3:] == [str(table), str(table.with_suffix(".json")), str(picture)]
    assert json.loads(table.with_suffix(".json").read_text())["experiment"] == "held-abduction"
    assert picture.stat().st_size > 50_000


@pytest.mark.full
def test_forces_and_energies_of_the_table_balance(capsys, tmp_path):
    table = tmp_path / "run.csv"
    run(capsys, "track", "--experiment", "held-abduction", "--no-progress", "--out", str(table))
    lines = table.read_text().splitlines()
    rows = np.array([[float(value) for value in line.split(",")] for line in lines[1:]])
    named = dict(zip(lines[0].split(","), rows.T, strict=True))

    def vectors(name):
        return np.stack([named[name.format(axis)] for axis in "xyz"], axis=1)

    # The file beside it gives the mass; the geometry is Table 5-3's. Nothing else of the package is used.
    beside = json.loads(table.with_suffix(".json").read_text())
    mass, centre = beside["moving_mass_kg"], beside["centre_of_mass_mm"]
    turns = Rotation.from_euler(
        "YXZ",
        np.stack([-named["flexion_deg"], named["abduction_deg"], -named["internal_rotation_deg"]], axis=1),
        degrees=True,
    )
    geometry = ep.load("prototype").geometry
    ends = zip(geometry.base_points, geometry.platform_points.copy(), strict=True)
    span = np.stack([turns.apply(B) - A for A, B in ends])
    lengths = np.linalg.norm(span, axis=2)
    np.testing.assert_allclose(lengths, [named[f"length_{i}_m"] for i in (1, 2, 3)], atol=1e-8)
    pull = sum(named[f"tension_{i}_N"][:, None] * span[i - 1] / lengths[i - 1][:, None] for i in (1, 2, 3))
    C, omega = turns.apply(1e-3 * np.array(centre)), vectors("angular_velocity_{}_rad_s")
    eta = vectors("angular_acceleration_{}_rad_s2")
    acceleration = np.cross(eta, C) + np.cross(omega, np.cross(omega, C))
    up = np.array([0.0, 0.0, 9.81])
    np.testing.assert_allclose(vectors("F_s_{}_N"), mass * (acceleration + up) + pull, atol=1e-6)
    arm, R = ep.experiment("held-abduction").mechanism.arm, turns.as_matrix()
    about_O = R @ (arm.inertia + mass * (np.dot(arm.centre_of_mass, arm.centre_of_mass) * np.eye(3)
                   - np.outer(arm.centre_of_mass, arm.centre_of_mass))) @ R.transpose(0, 2, 1)  # fmt: skip
    spin = np.einsum("nij,nj->ni", about_O, eta) + np.cross(omega, np.einsum("nij,nj->ni", about_O, omega))
    ends = np.stack([turns.apply(B) for B in geometry.platform_points.copy()])
    moment = sum(
        np.cross(ends[i], -named[f"tension_{i + 1}_N"][:, None] * span[i] / lengths[i][:, None]) for i in range(3)
    )
    moment += np.cross(C, -mass * up) + vectors("shoulder_moment_{}_N_m")
    np.testing.assert_allclose(spin, moment, atol=1e-6)
    gained = named["kinetic_energy_J"] + named["potential_energy_J"]
    gained -= gained[0]
    assert named["shoulder_loss_J"][-1] > 1e-3
    work = named["tension_work_J"] - named["shoulder_loss_J"]
    np.testing.assert_allclose(gained, work, atol=1e-4 * np.abs(named["tension_work_J"]).max())


@pytest.mark.full
def test_track_as_json_with_faults_and_sensor(capsys):
    arguments = [
        "--json",
        "--no-progress",
        "--lost-imu",
        "1,2",
        "--drift",
        "0.05",
        "--fault",
        "burst,all,3",
        "--flange",
    ]
    status, out, _ = run(capsys, "track", "--experiment", "flexion", *arguments)
    assert status == 0
    data = json.loads(out)
    assert data["status"] == "completed"
    assert "sensor is lost from 1 to 2 s" in data["findings"][-1]
    experiment = ep.experiment("flexion")
    assert any(text.startswith("all drives: burst") and "without it" in text for text in data["findings"])
    fault = [ep.control.Fault("burst", limb, 3.0) for limb in range(3)]
    imu = ep.control.Imu(lost=((1.0, 2.0),), drift=0.05 * 3.141592653589793 / 180.0)
    again = experiment.replace(second_flange=True, faults=fault, imu=imu).run()
    assert data["numbers"]["end_deg"] == pytest.approx(again.summary()["end_deg"], abs=1e-9)


def test_a_movement_of_ones_own(capsys, tmp_path):
    path = tmp_path / "lift.csv"
    rows = [f"{0.1 * k},{13.0 + 10.0 * k / 20.0},0,0" for k in range(21)]
    path.write_text("\n".join(["time_s,flexion_deg,abduction_deg,internal_rotation_deg", *rows]) + "\n")
    status, out, err = run(capsys, "track", "prototype", "--trajectory", str(path), "--supply", "3")
    assert status == 0
    assert "simulating" not in err  # a bar is for terminals
    first = out.splitlines()[0]
    assert first.startswith("Taken as known: 1 deg of the mounting")
    assert ". lift, prototype: flexion ends at" in first
    assert "of 23°" in out


@pytest.mark.parametrize("design", ["without arm", pytest.param("four-linear-actuators", marks=pytest.mark.full)])
def test_person_wears_a_design_that_has_no_dummy(capsys, tmp_path, design):
    lift, bare, table = (tmp_path / name for name in ("lift.csv", "bare.toml", "run.csv"))
    lift.write_text(
        "time_s,flexion_deg,abduction_deg,internal_rotation_deg\n0,0,0,0\n0.1,1,0,0\n0.2,2,0,0\n0.3,3,0,0\n"
    )
    text = preset_file("four-cables")
    bare.write_text(text[: text.index("[arm]")] + text[text.index("[[limbs]]") :])
    status, _, err = run(capsys, "track", str(bare), "--trajectory", str(lift))
    assert status == 2
    assert "give --person" in err
    name = str(bare) if design == "without arm" else design
    arguments = [name, "--trajectory", str(lift), "--person", "1.70,65,female", "--payload", "1", "--out", str(table)]
    assert run(capsys, "track", *arguments)[0] == 0
    arm = ep.load(name).worn_by(ep.Arm.from_anthropometry(1.70, 65, "female", payload=1.0)).arm
    assert json.loads(table.with_suffix(".json").read_text())["moving_mass_kg"] == pytest.approx(arm.mass)


def test_experiments_are_listed(capsys):
    status, out, _ = run(capsys, "track", "--list")
    assert status == 0
    assert [line.split()[0] for line in out.splitlines()] == ep.experiments()


ABDUCTION, CABLES = ["--experiment", "abduction"], ["--experiment", "four-cables-abduction"]


@pytest.mark.parametrize(
    ("arguments", "word"),
    [
        (["abductoin"], "unknown preset"),
        (["--experiment", "abductoin"], "abduction"),
        ([*ABDUCTION, "--fault", "flood,1,2"], "burst"),
        ([*ABDUCTION, "--fault", "burst,0,2"], "from 1 to 3"),
        ([*ABDUCTION, "--lost-imu", "3"], "2 numbers"),
        ([*CABLES, "--flange"], "shoulder unit"),
        (["held-abduction"], "--experiment held-abduction"),
        (["lift.csv"], "DESIGN --trajectory lift.csv"),
        ([*ABDUCTION, "--out", "x.txt"], ".csv"),
        ([*ABDUCTION, "--fault", "burst,nan,2"], "1 to 3"),
        ([*ABDUCTION, "--fault", "burst,4,2"], "1 to 3"),
        ([*ABDUCTION, "--fault", "burst,inf,2"], "from 1 to 3"),
        ([*ABDUCTION, "--plot", "run.txt"], ".html"),
        ([*ABDUCTION, "--supply", "400000"], "bar"),
        ([*ABDUCTION, "--supply", "nan"], "pressure"),
        ([*ABDUCTION, "--fault", "no-current,1,2"], "pneumatic muscles"),
        ([*CABLES, "--fault", "burst,2,2"], "'supply drop' of limb 2, which has a motor"),
        ([*CABLES, "--fault", "torn,5,2"], "1 to 4"),
        ([*CABLES, "--supply", "3"], "pneumatic muscles"),
        ([*ABDUCTION, "--play", "0.5"], "winches and linear actuators"),
        ([*ABDUCTION, "--fault", "burst,3,99"], "within the run"),
        ([*ABDUCTION, "--noise", "-1"], "got -1"),
        ([*ABDUCTION, "--plot", "nowhere/x.png"], "make its folder first"),
    ],
)
def test_wrong_arguments_are_one_line(capsys, arguments, word):
    status, _, err = run(capsys, "track", *arguments)
    assert status == 2
    assert len(err.splitlines()) == 1
    assert word in err
