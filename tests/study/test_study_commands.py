"""Sweeps and comparisons on the command line."""

import re

import numpy as np
import pytest

import exo_pin as ep
from exo_pin.cli import main
from exo_pin.design import DEFAULT_PRESET
from exo_pin.study import adl_box

PERSON = ep.Arm.from_anthropometry(1.75, 75, "male")


@pytest.fixture(scope="module")
def prototype():
    return ep.load("prototype")


def run(capsys, *arguments):
    status = main(list(arguments))
    return status, *capsys.readouterr()


def test_sweep_on_the_command_line(capsys, tmp_path, prototype):
    path = tmp_path / "table.csv"
    vary = ["--vary", "r_A_mm=120:140:2", "--vary", "lean_forward_deg=0,30"]
    status, out, _ = run(capsys, "sweep", "prototype", *vary, "--step", "40", "--limits", "none", "--out", str(path))
    assert status == 0
    values = {"r_A": [0.12, 0.14], "lean_forward": np.radians([0, 30])}
    table = ep.sweep(prototype, values, adl_box(40.0), limits="none")
    rows = [line.split(",") for line in path.read_text().splitlines()]
    column = rows[0].index("median_F_s_N")
    np.testing.assert_allclose([float(row[column]) for row in rows[1:]], table["median_F_s_N"], rtol=1e-12)
    assert str(path) in out.splitlines()[-2:]
    status, out, _ = run(
        capsys,
        "sweep",
        "prototype",
        "--vary",
        "limb_kind=UPU,SPS",
        "--step",
        "50",
        "--limits",
        "pull",
        "--split",
        "minimal",
    )
    assert status == 0
    for bad, message in (
        (["--vary", "r_A"], "NAME=VALUES"),
        (["--vary", "r_A=a"], "finite numbers for r_A"),
        (["--vary", "q=1"], "alpha_A"),
        (["--vary", "r_A=1:2:0.5"], "COUNT"),
        (["--vary", "r_A=0.1", "--step", "0"], "step"),
        (["--vary", "r_A=0.1", "--out", "table.txt"], ".csv"),
    ):
        status, out, err = run(capsys, "sweep", "prototype", *bad)
        assert (status, out) == (2, "")
        assert message in err


def test_movement_on_the_command_line(capsys, tmp_path, prototype):
    t = np.linspace(0, 1, 30)
    path, out_path = tmp_path / "reach.csv", tmp_path / "forces.csv"
    rows = "\n".join(f"{a!r},{20 + 30 * a!r},{10 + 20 * a!r},0.0" for a in t.tolist())
    path.write_text(f"time_s,flexion_deg,abduction_deg,internal_rotation_deg\n{rows}\n")
    arguments = ["reaction", "prototype", "--trajectory", str(path), "--out", str(out_path), "--person", "1.75,75,male"]
    status, out, _ = run(capsys, *arguments)
    assert status == 0
    answer = prototype.worn_by(PERSON).follow(ep.read_movement(path))
    assert np.isnan(answer.peak)  # the prototype holds none of it
    assert re.search(r"peak N +-\n", out)
    assert str(out_path) in out.splitlines()[-2:]
    assert len([line for line in out_path.read_text().splitlines() if not line.startswith("#")]) == 31
    status, out, _ = run(
        capsys, *arguments, "--limits", "pull", "--split", "minimal", "--side-force-limit", "30", "--static"
    )
    assert status == 0
    assert "beyond_limits" in out
    status, out, _ = run(
        capsys, "reaction", "prototype", "--flexion", "30", "--abduction", "20", "--limits", "pull", "--explain"
    )
    assert status == 0
    assert "With the best forces within the limits" in " ".join(out.split())
    for bad, message in (
        (["--trajectory", str(path), "--flexion", "3"], "poses of its own"),
        (["--trajectory", str(path), "--out", "x.txt"], ".json, .csv, .xlsx or .npz"),
        (["--trajectory", str(tmp_path / "none.csv")], "cannot be read"),
        (["--limits", "5"], "MIN,MAX"),
    ):
        status, out, err = run(capsys, "reaction", "prototype", *bad)
        assert (status, out) == (2, "")
        assert message in err


def test_sweep_command_keeps_cables_from_pushing(capsys, tmp_path):
    path = tmp_path / "table.csv"
    arguments = ["four-cables", "--vary", "lean_forward_deg=0", "--step", "50", "--out", str(path)]
    assert run(capsys, "sweep", *arguments)[0] == 0
    header, row = path.read_text().splitlines()[-2:]
    figures = dict(zip(header.split(","), row.split(","), strict=True))
    cables = ep.load("four-cables")
    held = cables.reaction(ep.adl_box(50.0))
    assert held.has_answer.all()
    assert 0.0 < held.can_hold.mean() < 1.0
    assert float(figures["holdable"]) == pytest.approx(held.can_hold.mean())
    assert float(figures["peak_F_s_N"]) == pytest.approx(held.magnitude[held.can_hold].max(), rel=1e-5)


def test_default_design_holds_most_daily_poses_on_everyone():
    sizes = (ep.Wearer(1.525, 51, "female"), ep.Wearer(1.87, 111, "male"))
    names = ("stroke", "forces", "clearance")
    limits = ep.Criteria(names, wearers=sizes, elbow_range=np.radians([0.0, 130.0]))
    designs = [exo for exo in map(ep.load, ep.presets()) if exo.mechanism.limbs[0].stroke is not None]
    assert len(designs) == 8
    share = {exo.name: exo.workspace(20.0, limits).index for exo in designs}
    assert max(share, key=share.get) == DEFAULT_PRESET
    assert share["prototype"] < 0.01
