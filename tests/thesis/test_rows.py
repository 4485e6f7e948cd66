"""The ledger: verdicts drawn from numbers."""

import numpy as np
import pytest

from exo_pin import InvalidInput
from exo_pin.thesis import compare, condensed, ledger_table


def find(rows, source, quantity):
    return next(row for row in rows if row.source.startswith(source) and row.quantity.startswith(quantity))


def test_rows_are_unique_and_hold_both_numbers(ledger_rows):
    assert len({(row.source, row.quantity) for row in ledger_rows}) == len(ledger_rows)
    for row in ledger_rows:
        assert row.printed.shape == row.computed.shape
        assert np.isfinite(row.computed).all() or row.verdict in ("not reproducible", "input not printed")
        assert bool(row.reading) == (row.verdict == "reproduced under another reading")
        assert row.verdict == "reproduced" or row.note


@pytest.mark.parametrize(
    ("source", "quantity", "verdict"),
    [
        ("Section 4.2.2", "l_i, positive", "reproduced"),
        ("Section 4.2.2", "l_i, negative", "reproduced"),
        ("Section 4.2.2", "θ_yA", "reproduced"),
        ("Section 4.2.2", "A_2", "misprint, corrected"),
        ("Section 4.2.2", "B_2", "misprint, corrected"),
        ("Section 4.2.2", "R_A3", "misprint, corrected"),
        ("Section 4.2.2", "orientation", "contradicted"),
        ("Table 5-4", "distance", "reproduced"),
        ("Table 5-4", "principal", "misprint, corrected"),
        ("(D-32)", "f_i", "reproduced under another reading"),
        ("(D-33)", "F_s0, components y and z", "reproduced under another reading"),
        ("(D-33)", "F_s0, component x", "not reproducible"),
        ("(D-35)", "g_i", "reproduced under another reading"),
        ("Appendix D", "least |F_s|", "reproduced under another reading"),
        ("Appendix D", "g_i", "reproduced under another reading"),
        ("Figure 3-2", "settling", "input not printed"),
        ("Table 5-1, Section", "largest component", "reproduced"),
        ("(D-36)", "F_s", "reproduced"),
        ("(D-8)", "a_C", "misprint, corrected"),
        ("(3-18)", "viscosity", "reproduced under another reading"),
        ("(A-6)", "K_1 to S_3", "misprint, corrected"),
        ("Section 5.1.2", "differences of measured", "reproduced"),
        ("Section 5.1.2", "largest difference of l_i", "reproduced"),
        ("Section 5.2.3", "r_A", "contradicted"),
        ("Section 5.4.1", "contraction", "reproduced under another reading"),
        ("Section 5.4.1", "lengths of muscles 2 and 3", "contradicted"),
        ("Table 5-7", "share of four tasks", "input not printed"),
        ("Table C-2", "optimum", "contradicted"),
    ],
)
def test_verdicts(ledger_rows, source, quantity, verdict):
    assert find(ledger_rows, source, quantity).verdict == verdict


def test_appendix_d_computes_what_its_data_say(ledger_rows):
    np.testing.assert_allclose(find(ledger_rows, "(D-32)", "f_i").computed, [-73.10, -25.23, -27.23], atol=0.005)
    assert "Rz Rx Ry" in find(ledger_rows, "(D-32)", "f_i").reading


def test_scenario_one_lengths(ledger_rows):
    np.testing.assert_allclose(
        find(ledger_rows, "Section 4.2.2", "l_i, positive").computed, [159.5270, 41.6830, 108.7461], atol=1e-4
    )


def test_verdict_follows_the_numbers():
    assert compare("s", "q", "", 1.0, 1.04, 0.05).verdict == "reproduced"
    assert compare("s", "q", "", 1.0, 1.06, 0.05).verdict == "not reproducible"
    assert compare("s", "q", "", -1.0, 1.0, 0.05, mended=1.0).verdict == "misprint, corrected"
    assert compare("s", "q", "", -1.0, 1.0, 0.05, mended=2.0).verdict == "not reproducible"
    other = compare("s", "q", "", -1.0, 1.0, 0.05, reading=("mirrored", -1.02))
    assert (other.verdict, other.reading) == ("reproduced under another reading", "mirrored")
    assert "another reading: mirrored" in ledger_table([other])
    assert compare("s", "q", "", -1.0, 1.0, 0.05, reading=("mirrored", -1.2)).verdict == "not reproducible"
    assert compare("s", "q", "", 1.0, 2.0, 0.05, otherwise="contradicted").verdict == "contradicted"
    assert compare("s", "q", "", [1.0, 2.0], [1.1, 2.0], [0.2, 0.0]).verdict == "reproduced"
    assert compare("s", "q", "", [1.0, 2.0], [1.1, 2.1], [0.2, 0.0]).verdict == "not reproducible"
    assert compare("s", "q", "", np.nan, 1.0, 9.0).verdict == "not reproducible"


@pytest.mark.parametrize(
    ("relation", "printed", "computed", "agrees"),
    [
        ("at most", 8.0, 7.5, True),
        ("at most", 8.0, 8.1, False),
        ("within", [3.0, 4.0], [3.2, 3.9], True),
        ("within", [3.0, 4.0], [2.9, 3.9], False),
        ("within", [3.0, 4.0], [3.2, 4.1], False),
    ],
)
def test_statements_of_bounds(relation, printed, computed, agrees):
    row = compare("s", "q", "", printed, computed, 0.0, relation=relation, note="n")
    assert (row.verdict == "reproduced") == agrees
    assert "bound" in row.note
    assert row.note.endswith("; n")


def test_table_has_a_row_each(ledger_rows):
    lines = ledger_table(ledger_rows).splitlines()
    assert len(lines) == len(ledger_rows) + 2
    assert len({line.replace("\\|", "").count("|") for line in lines}) == 1


@pytest.mark.parametrize("table", [ledger_table, condensed])
def test_a_mapping_is_no_table_of_rows(table):
    with pytest.raises(InvalidInput, match="expected rows to be of type Iterable"):
        table({"source": 1.0})
