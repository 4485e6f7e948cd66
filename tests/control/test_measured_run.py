"""Files of measured runs, and the command that calibrates from one."""

import json

import numpy as np
import pytest
from measured_devices import measured, near, poses
from scipy.spatial.transform import Rotation

import exo_pin as ep
from exo_pin import FileFormatError, InvalidInput, UnknownName
from exo_pin.cli import main
from exo_pin.control import MeasuredRun, read_run, write_run


@pytest.fixture
def run():
    rng = np.random.default_rng(60)
    device = near(ep.load("prototype"), rng)
    arm = poses(rng, 40)
    return MeasuredRun(*measured(device, arm, rng, 3e-4))


def test_an_unknown_side_is_refused_whatever_the_columns(tmp_path):
    run = MeasuredRun(Rotation.identity(2), np.ones((2, 3)))
    write_run(run, tmp_path / "run.csv")
    with pytest.raises(UnknownName, match="right"):
        read_run(tmp_path / "run.csv", side="rigth")


def test_a_run_is_read_back_bit_for_bit(tmp_path, run):
    full = MeasuredRun(run.poses, run.lengths, np.linspace(0, 3.9, 40), 1e5 * np.arange(160).reshape(40, 4))
    for each in (run, full):
        write_run(each, tmp_path / "run.csv", ["made by a test"])
        again = read_run(tmp_path / "run.csv")
        assert (again.poses * each.poses.inv()).magnitude().max() < 1e-15
        np.testing.assert_allclose(again.lengths, each.lengths, rtol=1e-15)
        for name in ("times", "pressures"):
            own, other = getattr(each, name), getattr(again, name)
            assert (own is None and other is None) or np.allclose(own, other, rtol=1e-15)
    assert (tmp_path / "run.csv").read_text().startswith("time_s,qx,qy,qz,qw,length_1_mm")


def test_angles_units_order_of_columns_and_side(tmp_path):
    path = tmp_path / "run.csv"
    path.write_text(
        "length_2_m,flexion_deg,length_1_m,abduction_deg,pressure_1_Pa,internal_rotation_deg,force_1_N\n"
        "0.2,30,0.1,40,200000,10,\n0.25,31,0.15,41,210000,11,a note\n"
    )
    found = read_run(path, side="right")
    np.testing.assert_array_equal(found.lengths, [[0.1, 0.2], [0.15, 0.25]])
    np.testing.assert_array_equal(found.pressures, [[2e5], [2.1e5]])
    expected = ep.shoulder_rotation([30, 31], [40, 41], [10, 11], "right", degrees=True)
    assert (found.poses * expected.inv()).magnitude().max() < 1e-15


@pytest.mark.parametrize(
    ("header", "words"),
    [
        ("qx,qy,qz,qw,length_1_mm,length_3_mm,time_s", "numbered from 1 without a gap"),
        ("qx,qy,qz,qw,length_1_mm,length_2_m,time_s", "in one unit"),
        ("qx,qy,qz,qw,length_1_mm,length_1_m,time_s", "twice"),
        ("qx,qy,qz,qw,length_1_mm,length_2_cm,time_s", "unknown unit of column 'length_2_cm'"),
        ("qx,qy,qz,qw,pressure_1_bar,pressure_2_bar,time_s", "expected columns length_1_mm"),
        ("x,y,z,w,length_1_mm,length_2_mm,time_s", "expected one of these sets of columns"),
    ],
)
def test_wrong_headers_are_named(tmp_path, header, words):
    path = tmp_path / "run.csv"
    path.write_text(f"{header}\n0,0,0,1,100,200,0\n")
    with pytest.raises(FileFormatError, match=words):
        read_run(path)


def test_wrong_rows_are_refused(tmp_path, run):
    path = tmp_path / "run.csv"
    path.write_text("time_s,qx,qy,qz,qw,length_1_mm\n1,0,0,0,1,100\n0,0,0,0,1,100\n")
    with pytest.raises(FileFormatError, match="rise"):
        read_run(path)
    for wrong in (
        lambda: MeasuredRun(run.poses, run.lengths[:5]),
        lambda: MeasuredRun(run.poses[0], run.lengths[:1]),
        lambda: MeasuredRun(run.poses, run.lengths, times=np.zeros(40)),
        lambda: MeasuredRun(run.poses, run.lengths, pressures=np.full((40, 3), np.nan)),
        lambda: write_run(run.lengths, path),
    ):
        with pytest.raises(InvalidInput):
            wrong()


def test_command_prints_the_calibration_and_writes_the_design(tmp_path, run, capsys):
    write_run(run, tmp_path / "run.csv")
    out = tmp_path / "mine.toml"
    noise = ["--length-noise", "0.3", "--tolerance", "base_points=5"]
    assert main(["calibrate", "prototype", str(tmp_path / "run.csv"), *noise, "--out", str(out)]) == 0
    expected = ep.calibrate(
        run.poses,
        run.lengths,
        ep.load("prototype"),
        length_noise=3e-4,
        tolerances={"base_points": 5e-3},
    )
    printed = capsys.readouterr().out
    assert printed.startswith(expected.verdict)
    written = ep.load(str(out))
    np.testing.assert_allclose(written.geometry.base_points, expected.joints[0], atol=1e-10)
    assert main(["calibrate", "prototype", str(tmp_path / "run.csv"), "--unknowns", "base_offset, cuff_offset"]) == 0
    assert "base offset, mm" in capsys.readouterr().out
    design = tmp_path / "offset.toml"
    command = ["calibrate", "prototype", str(tmp_path / "run.csv"), "--unknowns", "cuff_offset"]
    assert main([*command, "--out", str(design)]) == 0
    # A design has no offset: the file is the nominal one, and the command says so.
    assert "no part of it: cuff offset" in capsys.readouterr().out
    np.testing.assert_array_equal(ep.load(design).geometry.base_points, ep.load("prototype").geometry.base_points)
    assert main(["calibrate", "prototype", str(tmp_path / "run.csv"), "--unknowns", "joints"]) == 2
    assert "unknown quantity to calibrate 'joints'" in capsys.readouterr().err
    assert main(["calibrate", "prototype", str(tmp_path / "run.csv"), "--tolerance", "base_points"]) == 2
    assert "NAME=SIZE" in capsys.readouterr().err
    mixed = MeasuredRun(run.poses, 1e3 * np.asarray(run.lengths))
    write_run(mixed, tmp_path / "mixed.csv")
    assert main(["calibrate", "prototype", str(tmp_path / "mixed.csv")]) == 2
    assert "millimetres" in capsys.readouterr().err


def test_notes_stand_beside_the_table_and_old_files_with_comments_are_read(tmp_path, run):
    write_run(run, tmp_path / "run.csv", ["left arm,\nsecond day", ""])
    np.testing.assert_allclose(read_run(tmp_path / "run.csv").lengths, run.lengths, rtol=1e-15)
    text = (tmp_path / "run.csv").read_text()
    assert text.startswith("qx,")
    assert json.loads((tmp_path / "run.json").read_text())["comments"] == ["left arm,\nsecond day", ""]
    (tmp_path / "old.csv").write_text(f"# left arm,\n# second day\n{text}")
    np.testing.assert_array_equal(read_run(tmp_path / "old.csv").lengths, read_run(tmp_path / "run.csv").lengths)


def test_rotations_of_a_run_are_kept_as_they_are():
    assert MeasuredRun(Rotation.identity(2), np.ones((2, 3))).poses.shape == (2,)
