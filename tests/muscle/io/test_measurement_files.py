"""Muscle data from files: units by header, and slips that are named with the header that cures them."""

import re
import runpy

import numpy as np
import pytest
from places import DOCS, REPOSITORY

from exo_pin import FileFormatError, InvalidInput
from exo_pin.muscle import find_region, identify_static, read_measurements, read_response, steady_states

STATES = steady_states(valid_only=True)


def write(path, header, *columns):
    rows = (",".join(f"{value:.9g}" for value in row) for row in zip(*columns, strict=True))
    path.write_text(header + "\n" + "\n".join(rows) + "\n")
    return path


@pytest.mark.parametrize(
    ("header", "contraction", "pressure", "force"),
    [
        ("contraction_mm,pressure_bar,force_N", 1e3, 1e-5, 1.0),
        ("Contraction [cm],Pressure (kPa),Load in kgf", 1e2, 1e-3, 1 / 9.80665),
        ("strain,pressure_psi,mass_kg", 1 / 0.3, 1 / 6894.757293168, 1 / 9.81),
        ("contraction_percent,P [MPa],F [N]", 100 / 0.3, 1e-6, 1.0),
        ("STRAIN %,pressure_mbar,weight_lbf", 100 / 0.3, 1e-2, 1 / 4.4482216152605),
        ("contraction_inch,pressure_Pa,force_gf", 1 / 0.0254, 1.0, 1e3 / 9.80665),
        ("contraction_m,pressure_bar,force_kN", 1.0, 1e-5, 1e-3),
    ],
)
def test_headers_say_the_units(tmp_path, header, contraction, pressure, force):
    columns = contraction * STATES.contraction, pressure * STATES.pressure, force * STATES.force
    found = read_measurements(write(tmp_path / "a.csv", header, *columns), 0.3, diameter=0.006)
    np.testing.assert_allclose(found.contraction, STATES.contraction, rtol=1e-7)
    np.testing.assert_allclose(found.pressure, STATES.pressure, rtol=1e-7)
    np.testing.assert_allclose(found.force, STATES.force, rtol=1e-7)
    assert found.cautions == ()


@pytest.mark.parametrize(("separator", "mark"), [(";", ","), ("\t", "."), ("\t", ","), (",", ".")])
@pytest.mark.parametrize("units", ["mm kPa N", ""])
def test_a_table_in_another_dialect_is_the_same(tmp_path, separator, mark, units):
    heads = separator.join(["Contraction", "Pressure", "Force"] if units else ["contraction_mm", "P [kPa]", "force_N"])
    columns = 1e3 * STATES.contraction, 1e-3 * STATES.pressure, STATES.force
    rows = [separator.join(f"{value:.9f}".replace(".", mark) for value in row) for row in zip(*columns, strict=True)]
    lines = ["rig 3", heads, *([units.replace(" ", separator)] if units else []), *rows]
    (tmp_path / "a.txt").write_text("\n".join(lines) + "\n")
    found = read_measurements(tmp_path / "a.txt", 0.3, diameter=0.006)
    for name in ("contraction", "pressure", "force"):
        np.testing.assert_allclose(getattr(found, name), getattr(STATES, name), rtol=1e-6)


def test_lengths_and_absolute_pressures(tmp_path):
    columns = STATES.force, 1e-3 * (STATES.pressure + 101325.0), 1e3 * (0.3 - STATES.contraction)
    found = read_measurements(write(tmp_path / "a.csv", "force_N,pressure_kPa_abs,length_mm", *columns), 0.3)
    np.testing.assert_allclose(found.contraction, STATES.contraction, atol=1e-9)
    np.testing.assert_allclose(found.pressure, STATES.pressure, atol=1e-3)
    assert found.written == ("length in mm", "kPa absolute", "N")


@pytest.mark.parametrize(
    ("header", "message"),
    [
        ("contraction,pressure_bar,force_N", "expected a unit in the header of contraction"),
        ("contraction_mm,pressure,force_N", "expected a unit in the header of pressure"),
        ("contraction_mm,pressure_bar,force_bar", "expected a unit in the header of force"),
        ("contraction_mm,length_mm,force_N", "one column of contraction, .* got contraction_mm, length_mm"),
        ("contraction_mm,pressure_bar,count", "one column of force, .* got none; the header has contraction_mm"),
        ("contraction_mm,pressure_bar,mass_lb", "expected a unit in the header of force"),
    ],
)
def test_headers_without_a_unit_are_refused(tmp_path, header, message):
    path = write(tmp_path / "a.csv", header, STATES.contraction, STATES.pressure, STATES.force)
    with pytest.raises(FileFormatError, match=message):
        read_measurements(path, 0.3)


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


def test_swapped_columns_and_slips_in_a_row(tmp_path):
    x, p, f = 1e3 * STATES.contraction, 1e-5 * STATES.pressure, STATES.force
    for columns, words in (((x, f, p), "pressure and force"), ((p, x, f), "contraction and pressure")):
        with pytest.raises(FileFormatError, match=f"the columns {words} look swapped"):
            read_measurements(write(tmp_path / "a.csv", "contraction_mm,pressure_bar,force_N", *columns), 0.3)
    x = np.where(np.arange(25) == 8, 1e3 * x, x)
    with pytest.raises(FileFormatError, match="measurement 9 alone is out of this range"):
        read_measurements(write(tmp_path / "a.csv", "contraction_mm,pressure_bar,force_N", x, p, f), 0.3)


def test_responses_have_the_same_gate(tmp_path):
    time, strain = np.arange(5) * 10.0, np.full(5, 0.1)
    found = read_response(write(tmp_path / "a.csv", "time_ms,strain,pressure_MPa", time, strain, 2 * strain), 1.3, 0.3)
    np.testing.assert_allclose(found.time, np.arange(5) * 0.01)
    np.testing.assert_allclose(found.contraction, 0.03)
    np.testing.assert_allclose(found.pressure(0.02), 2e5)
    with pytest.raises(FileFormatError, match="unit in the header of time"):
        read_response(write(tmp_path / "a.csv", "time,strain,pressure_bar", time, strain, strain), 1.3, 0.3)


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
