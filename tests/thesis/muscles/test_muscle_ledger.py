"""The ledger: every published number of the muscle chapters has a verdict that its own figures bear out."""

from collections import Counter

import numpy as np
import pytest

from exo_pin.thesis.muscle_ledger import rows


@pytest.fixture(scope="module")
def ledger():
    return rows()


def find(ledger, source, quantity):
    (row,) = [r for r in ledger if r.source == source and r.quantity.startswith(quantity)]
    return row


def test_every_cell_has_its_row(ledger):
    cells = Counter(r.source for r in ledger if r.quantity.startswith("force at"))
    # 70 cells less two printed as strokes; Table A-3 has ten.
    assert cells == {"Table 3-3a": 68, "Table 3-3b": 68, "Table 3-3c": 68, "Table A-3": 10}
    assert len({(r.source, r.quantity) for r in ledger}) == len(ledger)


def test_verdicts_follow_from_the_figures(ledger):
    tolerance = {"Table 3-3a": 0.25, "Table 3-3b": 0.03, "Table 3-3c": 0.03, "Table A-3": 0.5}
    for row in ledger:
        if not row.quantity.startswith("force at"):
            continue
        if np.isnan(row.computed):
            assert row.verdict == "input not printed"
            assert "no data" in row.note
            continue
        assert np.isfinite(row.computed)
        close = abs(row.printed - row.computed) <= tolerance[row.source]
        assert (row.verdict == "reproduced") == close
        assert close or row.verdict == "misprint, corrected"


def test_counts(ledger):
    cells = [r for r in ledger if r.quantity.startswith("force at")]
    counts = Counter((r.source, r.verdict) for r in cells)
    for table in ("Table 3-3a", "Table 3-3b"):
        assert counts[table, "reproduced"] == 66
        assert counts[table, "input not printed"] == 2
    assert counts["Table 3-3c", "reproduced"] == 24
    assert counts["Table 3-3c", "misprint, corrected"] == 42
    assert counts["Table A-3", "reproduced"] == 10


def test_misprinted_cells_are_named(ledger):
    row = find(ledger, "Table 3-3c", "force at 1.6 bar, 22.74 N")
    assert row.printed == 21.14
    assert abs(row.computed - 22.13) < 0.005
    assert "-2.7 %" in row.note
    copied = [r for r in ledger if "copied from Table 3-3a" in r.note]
    assert len(copied) == 41
    errors = {(r.source, r.quantity) for r in ledger if r.quantity.startswith("error at")}
    assert errors == {
        ("Table 3-3a", "error at 1.6 bar, 22.74 N (%)"),
        ("Table 3-3b", "error at 2.8 bar, 32.74 N (%)"),
    }


def test_figures_beside_the_tables(ledger):
    optimised = find(ledger, "Section 3.2.1, optimised set", "K_1 to S_3")
    assert optimised.verdict == "input not printed"
    assert "0.68 %" in optimised.note
    mean = find(ledger, "Section 3.2.1", "mean deviation")
    assert mean.verdict == "reproduced"
    assert "1.585 %" in mean.note
    line = find(ledger, "Tables 3-3a, 3-3b", "cells inside")
    assert line.computed == line.printed == 25
    assert "(3.6 bar, 62.74 N), (4.0 bar, 72.74 N)" in line.note
    assert find(ledger, "(3-30)", "D_1").verdict == "reproduced"
    for table in "ab":
        six = find(ledger, f"Section 3.2.1, set of Table 3-3{table}", "K_1")
        # The print of the second set lost the sign of K_2.
        assert six.verdict == {"a": "misprint, corrected", "b": "reproduced"}[table]
        assert "weak test" in six.note
    rest = find(ledger, "(3-31), Table 3-2", "measured rests")
    assert rest.computed == rest.printed == 12
    air = find(ledger, "(3-18)", "viscosity")
    assert (air.verdict, air.reading) == ("reproduced under another reading", "T = 300 K")
    assert abs(air.computed - 17.1298) < 1e-4
    for source, symbol, value in (("second set", "K_2", -271.6), ("optimised set", "S_2", -439.24)):
        sign = find(ledger, f"Section 3.2.1, {source}", f"{symbol} (")
        assert sign.verdict == "misprint, corrected"
        assert abs(sign.computed - value) < 0.05
    settling = find(ledger, "Figure 3-2", "settling time")
    assert settling.verdict == "input not printed"
    assert "3.6 s with a lag of 1 s" in settling.note
    relaxation = [r for r in ledger if r.source == "Table A-2" and "relaxation" in r.quantity]
    assert len(relaxation) == 6
    assert all(r.verdict == "reproduced" for r in relaxation)
