"""Tables that other programs open as they are."""

import pytest

import exo_pin as ep
from exo_pin.cli import main
from exo_pin.control import MeasuredRun, write_run


def opened(path):
    """The table as pandas reads it, with no option but what a cell without a number is."""
    pandas = pytest.importorskip("pandas")
    read = pandas.read_excel if path.suffix == ".xlsx" else pandas.read_csv
    return read(path, keep_default_na=False, na_values=[""])


@pytest.mark.full
def test_every_table_opens_in_pandas(tmp_path):
    """Units in the names, poses or times, and no line that is not the table."""
    lift = ["--trajectory", "examples/lift.csv"]
    asked = {
        "map": ["workspace", "four-cables", "--step", "45"],
        "movement": ["reaction", "four-cables", *lift],
        "splits": ["reaction", "four-cables", "--compare"],
        "sweep": ["sweep", "four-cables", "--vary", "cuff_height_mm=180,200", "--step", "45"],
        "compare": ["compare", "four-cables", "four-linear-actuators", "--step", "45"],
        "tasks": ["tasks", "four-cables", "--step", "40"],
        "uncertainty": ["uncertainty", "four-cables"],
        "person": ["person", "four-cables", "--map", "--step", "60"],
        "track": ["track", "--experiment", "abduction", "--no-progress"],
        "thesis": ["thesis", "--section", "5.1.2"],
        "force": ["muscle", "force", "--contraction-mm", "20", "30", "--pressure-bar", "3"],
    }
    for name, words in asked.items():
        for ending in (".csv", ".xlsx"):
            path = tmp_path / f"{name}{ending}"
            assert main([*words, "--out", str(path)]) == 0, name
            table = opened(path)
            assert len(table) >= 1, name
            assert not table.columns.str.startswith("Unnamed").any(), name
            if name in ("map", "movement", "splits", "person", "track"):
                assert {"flexion_deg", "abduction_deg", "internal_rotation_deg"} <= set(table.columns), name
            if name in ("map", "movement", "splits"):
                assert {"verdict", "reason"} <= set(table.columns), name
        assert path.with_suffix(".json").exists() == (name not in ("thesis", "force")), name
    exo = ep.load("prototype")
    poses = exo.pose([0.0, 20.0])
    write_run(MeasuredRun(poses, exo.inverse_kinematics(poses).lengths), tmp_path / "run.csv", ["bench 2"])
    assert opened(tmp_path / "run.csv").shape == (2, 7)
    frame = exo.reaction_map(exo.pose([[0.0, 20.0], [40.0, 60.0]])).to_dataframe()
    assert frame["flexion_deg"].round(9).tolist() == [0.0, 20.0, 40.0, 60.0]
    assert frame["verdict"].isin(["held", "not held", "not known"]).all()
