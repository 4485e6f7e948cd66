"""Answers of the ledger of the thesis: every row, and its tables, as stored."""

import re

import numpy as np
from answers import changes, each_of

from exo_pin.thesis import compare, condensed, ledger_table


def made():
    """Rows that agree as they are, mended, read otherwise, within bounds and not at all, with many and few numbers."""
    return [
        compare("a", "one", "m", 1.0, 1.04, 0.05, digits=2),
        compare("a", "two", "", 1.0, 1.06, 0.05, note="too far"),
        compare("a", "three|four", "N", -1.0, 1.0, 0.05, mended=1.0, note="sign"),
        compare("a", "mended too far", "", -1.0, 1.0, 0.05, mended=2.0),
        compare("b", "mirrored", "", -1.0, 1.0, 0.05, reading=("mirrored", -1.02)),
        compare("b", "not even so", "", -1.0, 1.0, 0.05, reading=("mirrored", -1.2), otherwise="contradicted"),
        compare("b", "given", "", 3.0, 1.0, 0.05, verdict="input not printed", note="no data"),
        compare("c", "most", "", 8.0, [7.5, 8.04], 0.05, relation="at most", note="n"),
        compare("c", "more", "", 8.0, [7.5, 8.06], 0.05, relation="at most"),
        compare("c", "between", "", [3.0, 4.0], [2.96, 4.04], 0.05, relation="within"),
        compare("c", "outside", "", [3.0, 4.0], [2.94, 4.0], 0.05, relation="within"),
        compare("d", "wide", "mm", [1.0, -2.0, 3.0, np.nan], [1.1, -2.2, 3.0, 4.0], 0.3),
        compare("d", "narrow", "mm", [1.0, 2.0, 3.0], [1e-6, 4e-11, -0.0], 4.0, digits=3),
        *(compare("e", f"row {k}", "", 10.0 * k, 10.0 * k + 0.01 * k, 0.05, note="same") for k in range(5)),
        *(compare("f", f"row {k}", "", 10.0 * k, 11.0 + 10.0 * k, 0.05, note=f"own {k}") for k in range(4)),
        *(compare("g", f"row {k}", "", np.nan, 1.0, 0.05, note="unknown") for k in range(5)),
    ]


ASKED = {"made": lambda: [made(), ledger_table(made()), condensed(made()), condensed(made(), 3), condensed(made(), 1)]}


@each_of(ASKED)
def test_an_answer_is_as_stored(name):
    assert not changes(__file__, name, ASKED[name])


def told(rows):
    """A row each of few words, and the table of all without the digits of rounding errors."""
    words = re.sub(r"\b\d(\.\d+)?e-(0[7-9]|1\d)", "(rounding)", condensed(rows))
    # Below what is shown nothing is said of a number.
    near = {f"{row.source}: {row.quantity}": np.round(row.computed, row.digits + 3) + 0.0 for row in rows}
    return near, words


def test_every_row_of_the_ledger_is_as_stored(ledger_rows):
    assert not changes(__file__, "ledger", lambda: told(ledger_rows))
