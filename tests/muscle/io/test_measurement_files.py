"""Muscle data from files: planted mistakes are named, and regions lose no good states."""

import re
import runpy

import pytest
from places import DOCS, REPOSITORY


@pytest.mark.full
def test_planted_mistakes_are_named_and_genuine_sets_pass(capsys, monkeypatch):
    monkeypatch.setattr("sys.argv", ["muscle_mistakes.py"])
    runpy.run_path(str(REPOSITORY / "benchmarks" / "muscle_mistakes.py"), run_name="__main__")
    out = capsys.readouterr().out
    assert "25 of 25 refused or named at both doors; planted cause first in 25 of 25" in out
    assert "0 false alarms" in out


@pytest.mark.full
def test_regions_lose_no_good_states(capsys, monkeypatch):
    monkeypatch.setattr("sys.argv", ["muscle_regions.py"])
    runpy.run_path(str(REPOSITORY / "benchmarks" / "muscle_regions.py"), run_name="__main__")
    out = capsys.readouterr().out
    lost, good = map(int, re.search(r"lost (\d+) of (\d+) good", out).groups())
    assert good > 10_000
    assert lost <= 0.005 * good
    assert out.split("\n\n")[0] in (DOCS / "evidence" / "measured_data.md").read_text()
