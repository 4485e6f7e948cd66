"""``exo-pin track``."""

import json

import pytest
from command_line import run

import exo_pin as ep


def test_track_prints_the_verdict_first_and_writes_files(capsys, tmp_path):
    table, picture = tmp_path / "run.csv", tmp_path / "run.png"
    arguments = ["--no-progress", "--out", str(table), "--plot", str(picture)]
    status, out, _ = run(capsys, "track", "held-abduction", "--controller", "model", *arguments)
    assert status == 0
    assert out.startswith("abduction through poses that the muscles hold: abduction ends at 56° of 55°")
    assert out.splitlines()[-2:] == [str(table), str(picture)]
    assert table.read_text().startswith("# abduction through poses")
    assert picture.stat().st_size > 50_000


def test_track_as_json_with_faults_and_sensor(capsys):
    arguments = ["--json", "--no-progress", "--lost-imu", "1,2", "--drift", "0.05", "--fault", "burst,1,3", "--flange"]
    status, out, _ = run(capsys, "track", "flexion", *arguments)
    assert status == 0
    data = json.loads(out)
    assert data["status"] == "completed"
    assert "sensor is lost from 1 to 2 s" in data["findings"][-1]
    experiment = ep.experiment("flexion")
    fault = ep.control.Fault("burst", 0, 3.0)
    imu = ep.control.Imu(lost=((1.0, 2.0),), drift=0.05 * 3.141592653589793 / 180.0)
    again = experiment.replace(second_flange=True, faults=fault, imu=imu).run()
    assert data["end_deg"] == pytest.approx(again.summary()["end_deg"], abs=1e-9)


def test_a_movement_of_ones_own(capsys, tmp_path):
    path = tmp_path / "lift.csv"
    rows = [f"{0.1 * k},{13.0 + 10.0 * k / 20.0},0,0" for k in range(21)]
    path.write_text("\n".join(["time_s,flexion_deg,abduction_deg,internal_rotation_deg", *rows]) + "\n")
    status, out, _ = run(capsys, "track", str(path), "--no-progress", "--supply", "3")
    assert status == 0
    assert out.startswith("lift: flexion ends at")
    assert "of 23°" in out


def test_experiments_are_listed(capsys):
    status, out, _ = run(capsys, "track", "--list")
    assert status == 0
    assert [line.split()[0] for line in out.splitlines()] == ep.experiments()


@pytest.mark.parametrize(
    ("arguments", "word"),
    [
        ([], "--list"), (["abductoin"], "abduction"), (["abduction", "--fault", "flood,1,2"], "burst"),
        (["abduction", "--fault", "burst,0,2"], "from 1"), (["abduction", "--lost-imu", "3"], "2 numbers"),
        (["four-cables-abduction", "--supply", "3"], "pneumatic"),
        (["four-cables-abduction", "--flange"], "shoulder unit"),
        (["four-cables-abduction", "--fault", "burst,1,1"], "motor"),
        (["abduction", "--fault", "no-current,1,1"], "muscles"),
        (["held-abduction", "--design", "prototype"], "--design"), (["abduction", "--out", "x.txt"], ".csv"),
    ],
)  # fmt: skip
def test_wrong_arguments_are_one_line(capsys, arguments, word):
    status, _, err = run(capsys, "track", *arguments)
    assert status == 2
    assert len(err.splitlines()) == 1
    assert word in err
