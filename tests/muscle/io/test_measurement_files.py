"""Muscle data from files: units by header, and slips that are named with the header that cures them."""

import re
import runpy

import pytest
from places import DOCS, REPOSITORY

from exo_pin import FileFormatError, InvalidInput
from exo_pin.muscle import find_region, identify_static, read_measurements, steady_states


def write(path, header, *columns):
    rows = (",".join(f"{value:.9g}" for value in row) for row in zip(*columns, strict=True))
    path.write_text(header + "\n" + "\n".join(rows) + "\n")
    return path


SLIPS = [  # factors and shifts of the three columns, the words of the first suggestion, whether it is refused
    ((1, 0), (14.5038, 0), (1, 0), "pressure looks like psi: write its header pressure_psi", True),
    ((1, 0), (0.1, 0), (1, 0), "pressure looks like MPa: write its header pressure_MPa", False),
    ((1, 0), (1, 1.01325), (1, 0), "pressure looks like bar absolute: write its header pressure_bar_abs", False),
    ((1 / 3, 0), (1, 0), (1, 0), "contraction looks like percent: write its header contraction_percent", False),
    ((-1, 300), (1, 0), (1, 0), "contraction looks like length in mm: write its header length_mm", True),
    ((-1, 0), (1, 0), (1, 0), "contraction has the other sign: shorter is positive", True),
    ((1, 0), (1, 0), (1 / 9.80665, 0), "force looks like kgf: write its header force_kgf", False),
]


@pytest.mark.parametrize(("contraction", "pressure", "force", "words", "refused"), SLIPS)
@pytest.mark.parametrize("valid", [True, pytest.param(False, marks=pytest.mark.full)])
def test_slips_are_named_at_both_doors(tmp_path, valid, contraction, pressure, force, words, refused):
    states = steady_states(valid_only=valid)
    given = 1e3 * states.contraction, 1e-5 * states.pressure, states.force
    x, p, f = (a * values + b for values, (a, b) in zip(given, (contraction, pressure, force), strict=True))
    path = write(tmp_path / "a.csv", "contraction_mm,pressure_bar,force_N", x, p, f)
    arrays = 1e-3 * x, 1e5 * p, f
    if refused:
        with pytest.raises(FileFormatError, match=words):
            read_measurements(path, 0.3)
        with pytest.raises(InvalidInput, match=words.split(":")[0].replace(" mm", "")):
            find_region(*arrays, 0.3)
    else:
        (caution,) = read_measurements(path, 0.3).cautions
        assert caution.split(": the ")[1].startswith(words)
        assert identify_static(*arrays, 0.3, diameter=0.006).doubts


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
