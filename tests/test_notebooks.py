"""Notebooks run from top to bottom, ask before they answer, and end in asserts and what was learnt."""

import json
import subprocess
import sys
from pathlib import Path

import pytest

FOLDER = Path(__file__).parent.parent / "notebooks"
NOTEBOOKS = sorted(FOLDER.glob("*.ipynb"))

pytest.importorskip("nbclient", reason="the extra notebooks is not installed")
pytest.importorskip("ipykernel", reason="the extra notebooks is not installed")


def test_there_are_notebooks():
    assert {"01_quickstart.ipynb", "03_shoulder_force.ipynb", "05_your_own_mechanism.ipynb"} <= {
        path.name for path in NOTEBOOKS
    }


@pytest.mark.parametrize("path", NOTEBOOKS, ids=lambda path: path.stem)
def test_notebook_runs(path):
    done = subprocess.run([sys.executable, str(FOLDER / "run.py"), str(path)], capture_output=True, text=True)
    assert done.returncode == 0, done.stderr
    assert path.name in done.stdout


@pytest.mark.parametrize("path", NOTEBOOKS, ids=lambda path: path.stem)
def test_notebook_opens_with_a_question_and_ends_in_asserts(path):
    cells = json.loads(path.read_text(encoding="utf-8"))["cells"]
    assert cells[0]["cell_type"] == "markdown"
    assert "?" in "".join(cells[0]["source"])
    code = [cell for cell in cells if cell["cell_type"] == "code"]
    assert "assert " in "".join(code[-1]["source"])
    assert cells[-1]["cell_type"] == "markdown"
    assert "learnt" in "".join(cells[-1]["source"])
    for cell in code:
        assert cell["outputs"] == []
        assert cell["execution_count"] is None


def test_a_failing_notebook_is_told(tmp_path):
    nbformat = pytest.importorskip("nbformat")
    notebook = nbformat.v4.new_notebook(cells=[nbformat.v4.new_code_cell("assert 1 == 2")])
    nbformat.write(notebook, tmp_path / "bad.ipynb")
    command = [sys.executable, str(FOLDER / "run.py"), str(tmp_path / "bad.ipynb")]
    done = subprocess.run(command, capture_output=True, text=True)
    assert done.returncode == 1
    assert "AssertionError" in done.stderr
