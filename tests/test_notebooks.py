"""Notebooks run from top to bottom, ask before they answer, end in what was learnt, and what they show holds."""

import json
import subprocess
import sys
from pathlib import Path

import pytest

FOLDER = Path(__file__).parent.parent / "notebooks"
CHECKS = Path(__file__).parent / "notebook_checks"
NOTEBOOKS = sorted(FOLDER.glob("*.ipynb"))
#: The main line, from a design to the shoulder force. All of them are run by ``python notebooks/run.py``.
MAIN_LINE = FOLDER / "03_shoulder_force.ipynb"

pytest.importorskip("nbclient", reason="the extra notebooks is not installed")
pytest.importorskip("ipykernel", reason="the extra notebooks is not installed")


def test_there_are_notebooks():
    assert {
        "01_quickstart.ipynb",
        "02_kinematics_and_singularity.ipynb",
        "03_shoulder_force.ipynb",
        "04_muscles_from_data.ipynb",
        "05_your_own_mechanism.ipynb",
        "06_design_study.ipynb",
        "07_the_person_inside.ipynb",
        "08_the_prototype_in_motion.ipynb",
    } <= {path.name for path in NOTEBOOKS}


@pytest.mark.full
def test_the_notebook_of_the_main_line_runs():
    done = subprocess.run([sys.executable, str(FOLDER / "run.py"), str(MAIN_LINE)], capture_output=True, text=True)
    assert done.returncode == 0, done.stderr
    assert MAIN_LINE.name in done.stdout


@pytest.mark.parametrize("path", NOTEBOOKS, ids=lambda path: path.stem)
def test_notebook_opens_with_a_question_and_ends_in_what_was_learnt(path):
    cells = json.loads(path.read_text(encoding="utf-8"))["cells"]
    assert cells[0]["cell_type"] == "markdown"
    assert "?" in "".join(cells[0]["source"])
    code = ["".join(cell["source"]) for cell in cells if cell["cell_type"] == "code"]
    # What is checked is no reader's business: run.py runs it after the last cell.
    assert not any(line.lstrip().startswith("assert ") for source in code for line in source.splitlines())
    assert "assert " in (CHECKS / f"{path.stem}.py").read_text(encoding="utf-8")
    # A page shows so many columns, and no output fills a screen.
    assert max(len(line) for source in code for line in source.splitlines()) <= 88
    texts = ["".join(output["text"]) for cell in cells for output in cell.get("outputs", ()) if "text" in output]
    assert all(len(text.splitlines()) <= 25 for text in texts)
    assert cells[-1]["cell_type"] == "markdown"
    assert "learnt" in "".join(cells[-1]["source"])


@pytest.mark.parametrize("path", NOTEBOOKS, ids=lambda path: path.stem)
def test_stored_outputs_are_of_one_run_and_live_without_it(path):
    cells = [cell for cell in json.loads(path.read_text(encoding="utf-8"))["cells"] if cell["cell_type"] == "code"]
    assert [cell["execution_count"] for cell in cells] == list(range(1, len(cells) + 1))
    outputs = [output for cell in cells for output in cell["outputs"]]
    assert any("image/png" in output.get("data", {}) for output in outputs)
    assert any(output["output_type"] == "stream" for output in outputs)
    for output in outputs:
        assert output.get("name") != "stderr"
        assert output["output_type"] != "error"
        # A frame to a port, a page of megabytes or a slider without its kernel would show nothing.
        data = output.get("data", {})
        assert not any("widget" in kind for kind in data)
        # Tables are the only pages within a page that stay as they are.
        page = "".join(data.get("text/html", "<table"))
        assert "<table" in page
        assert not any(tag in page for tag in ("<iframe", "<script"))
        assert len(page) < 50_000
    assert path.stat().st_size < 1_000_000


@pytest.mark.full
def test_failing_notebook_is_reported(tmp_path):
    nbformat = pytest.importorskip("nbformat")
    notebook = nbformat.v4.new_notebook(cells=[nbformat.v4.new_code_cell("assert 1 == 2")])
    nbformat.write(notebook, tmp_path / "bad.ipynb")
    command = [sys.executable, str(FOLDER / "run.py"), str(tmp_path / "bad.ipynb")]
    done = subprocess.run(command, capture_output=True, text=True)
    assert done.returncode == 1
    assert "AssertionError" in done.stderr


@pytest.mark.full
def test_a_check_that_does_not_hold_is_reported(tmp_path):
    nbformat = pytest.importorskip("nbformat")
    nbformat.write(nbformat.v4.new_notebook(cells=[nbformat.v4.new_code_cell("a = 1")]), tmp_path / "mine.ipynb")
    (tmp_path / "mine.py").write_text("assert a == 2\n")
    command = [sys.executable, str(FOLDER / "run.py"), str(tmp_path / "mine.ipynb"), "--checks", str(tmp_path)]
    done = subprocess.run(command, capture_output=True, text=True)
    assert done.returncode == 1
    assert "assert a == 2" in done.stderr


def test_every_live_cell_has_a_picture():
    """Where a notebook shows a scene, live or still, the stored output is what it looked like."""
    ways = set()
    for path in NOTEBOOKS:
        for cell in json.loads(path.read_text(encoding="utf-8"))["cells"]:
            last = "".join(cell["source"]).splitlines()[-1]
            if cell["cell_type"] == "code" and last.endswith("cell()"):
                ways.add(last.rpartition(".")[2])
                kinds = [kind for output in cell["outputs"] for kind in output.get("data", ())]
                assert kinds == ["image/png"], path.stem
    assert ways == {"cell()", "static_cell()"}


@pytest.mark.full
def test_stale_text_is_reported(tmp_path):
    """run.py compares what is stored with what is printed: words exactly, numbers to their last digits."""
    nbformat = pytest.importorskip("nbformat")
    cell = nbformat.v4.new_code_cell("print('force 12.34 N')", execution_count=1)
    for stored, status in (("force 12.35 N\n", 0), ("force 13.34 N\n", 1), ("moment 12.34 N\n", 1)):
        cell.outputs = [nbformat.v4.new_output("stream", text=stored)]
        nbformat.write(nbformat.v4.new_notebook(cells=[cell]), tmp_path / "old.ipynb")
        command = [sys.executable, str(FOLDER / "run.py"), str(tmp_path / "old.ipynb")]
        done = subprocess.run(command, capture_output=True, text=True)
        assert done.returncode == status, (stored, done.stderr)
    assert "force 12.34 N" in done.stderr
    assert "--store" in done.stderr
