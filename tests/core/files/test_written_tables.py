"""Tables that other programs open as they are: CSV with notes beside it, workbooks."""

import json

import numpy as np
import pytest

import exo_pin as ep
from exo_pin import InvalidInput
from exo_pin.cli import main
from exo_pin.control import MeasuredRun, write_run
from exo_pin.core.conventions import CLINICAL_ANGLES
from exo_pin.core.files import write_columns

DOUBTFUL = {"n": [1.5, np.nan, np.inf], "=1+1": ["=2+2", "a\x07b", "plain"], "ok": [True, False, True]}


def opened(path):
    """The table as pandas reads it, with no option but what a cell without a number is."""
    pandas = pytest.importorskip("pandas")
    read = pandas.read_excel if path.suffix == ".xlsx" else pandas.read_csv
    return read(path, keep_default_na=False, na_values=[""])


def test_notes_stand_beside_a_table_and_replace_no_other_file(tmp_path):
    path = tmp_path / "t.csv"
    assert write_columns(path, {"a_m": [1.0, 2.0]}, {"verdict": "yes"}) == (path, tmp_path / "t.json")
    said = json.loads((tmp_path / "t.json").read_text())
    assert said == {"schema": "exo_pin.table/1", "table": "t.csv", "columns": ["a_m"], "verdict": "yes"}
    write_columns(path, {"a_m": [3.0]}, {"verdict": "no"})
    assert opened(path)["a_m"].tolist() == [3.0]
    for other in ('{"schema": "exo_pin.reaction/1"}', "{", "[]"):
        (tmp_path / "t.json").write_text(other)
        with pytest.raises(InvalidInput, match="is no file about a table"):
            write_columns(path, {"a_m": [4.0]}, {"verdict": "no"})
        assert opened(path)["a_m"].tolist() == [3.0]
        assert (tmp_path / "t.json").read_text() == other
        assert main(["reaction", "four-cables", "--out", str(path)]) == 2
    assert write_columns(tmp_path / "bare.csv", {"a_m": [1.0]}) == (tmp_path / "bare.csv",)


def test_workbooks_hold_numbers_as_numbers_and_no_formula(tmp_path):
    openpyxl = pytest.importorskip("openpyxl")
    path = tmp_path / "t.xlsx"
    write_columns(path, DOUBTFUL, {"verdict": "=no", "cautions": ["a"]})
    book = openpyxl.load_workbook(path)
    assert book.sheetnames == ["table", "notes"]
    rows = [[(cell.value, cell.data_type) for cell in row] for row in book["table"].iter_rows()]
    assert rows[0] == [("n", "s"), ("=1+1", "s"), ("ok", "s")]
    assert rows[1] == [(1.5, "n"), ("=2+2", "s"), (True, "b")]
    assert [row[0][0] for row in rows[2:]] == [None, "inf"]
    assert rows[2][1][0] == "a\\x07b"
    assert [[cell.value for cell in row] for row in book["notes"].iter_rows()] == [
        ["verdict", "=no"],
        ["cautions", '["a"]'],
    ]
    with pytest.raises(InvalidInput, match="expected at most 1048575 rows"):
        write_columns(path, {"a": np.zeros(1_048_576)})


@pytest.mark.parametrize("ending", [".csv", pytest.param(".xlsx", marks=pytest.mark.full)])
def test_rows_of_a_way_say_what_they_are_and_why(tmp_path, ending):
    path = tmp_path / f"way{ending}"
    words = ["reaction", "four-cables", "--flexion", "-60", "--to", "60,0,0", "--poses", "7", "--out", str(path)]
    assert main(words) == 0
    table, exo = opened(path), ep.load("four-cables")
    assert all(name.isidentifier() for name in table.columns)
    answer = exo.reaction(exo.pose(*table[list(CLINICAL_ANGLES)].to_numpy().T))
    assert table["flexion_deg"].tolist() == [-60.0, -40.0, -20.0, 0.0, 20.0, 40.0, 60.0]
    np.testing.assert_allclose(table["F_s_N"], answer.magnitude, rtol=1e-9)
    assert table["verdict"].tolist() == np.where(answer.can_hold, "held", "not held").tolist()
    assert set(table["verdict"]) == {"held", "not held"}
    # The reason of a row is that of the pose alone.
    alone = [exo.reaction(exo.pose(angle)).verdict for angle in table["flexion_deg"]]
    reasons = table["reason"].fillna("")
    for text, reason, held in zip(alone, reasons, answer.can_hold, strict=True):
        assert (reason == "") == held
        assert reason in text


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
