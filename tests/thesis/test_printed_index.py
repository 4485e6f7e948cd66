"""Every number that the thesis prints is in the index once, and goes to a row of the ledger or to a reason."""

import itertools
import tomllib
from collections import Counter
from pathlib import Path

import numpy as np
import pytest

from exo_pin.muscle import table
from exo_pin.thesis.all_rows import printed_index

SECTIONS = printed_index()
ENTRIES = [entry for section in SECTIONS for entry in section.entries]
#: What a scan of the thesis's text found, independent of the index.
TEXT = tomllib.loads(Path(__file__).with_name("numbers_of_the_text.toml").read_text(encoding="utf-8"))


def reference(row):
    return f"{row.source}: {row.quantity}"


@pytest.mark.parametrize("section", SECTIONS, ids=lambda section: section.label)
def test_numbers_of_the_index_are_those_of_the_text(section):
    found = {abs(number) for entry in section.entries for number in entry.numbers}
    assert found == {float(number) for number in TEXT[section.label].split()}


def test_cells_of_long_tables_are_those_of_the_data():
    by_table = Counter()
    for entry in ENTRIES:
        if entry.cells:
            by_table[entry.about.split(",")[0]] += entry.cells
    expected = {f"Table {name}": table(name).present.sum() for name in ("3-1", "3-2", "A-1", "A-2")}
    expected["Table A-3"] = 30  # the weight, which is printed once, is an entry of its own
    for name in ("3-3a", "3-3b", "3-3c"):
        expected[f"Table {name}"] = table(name).present.sum() + np.isfinite(table(name).errors_percent).sum()
    for name in ("3-4", "B-1"):
        expected[f"Table {name}"] = np.isfinite(table(name).groups).sum()
    assert by_table == expected


def test_every_entry_has_rows_or_a_reason():
    for entry in ENTRIES:
        assert bool(entry.rows) != bool(entry.reason), entry.about
        assert entry.count or entry.rows, entry.about
        assert not (entry.cells and entry.printed), entry.about
    for section in SECTIONS:
        assert len({entry.about for entry in section.entries}) == len(section.entries)


def test_every_row_is_of_one_entry_and_every_reference_has_a_row(ledger_rows):
    hits = Counter(reference(row) for entry in ENTRIES for row in entry.select(ledger_rows))
    assert set(hits) == {reference(row) for row in ledger_rows}
    assert {name for name, count in hits.items() if count > 1} == set()
    references = [name for entry in ENTRIES for name in entry.rows]
    for name in references:
        assert any(reference(row).startswith(name) for row in ledger_rows), name
    assert not [pair for pair in itertools.permutations(references, 2) if pair[0].startswith(pair[1])]


def test_rows_compare_the_numbers_that_the_index_has_for_them(ledger_rows):
    """The two were written down separately: a number mistyped in one of them shows here."""
    for entry in ENTRIES:
        if not entry.rows:
            continue
        compared = np.concatenate([row.printed.ravel() for row in entry.select(ledger_rows)])
        if entry.cells:
            assert compared.size == entry.cells or entry.about.startswith("Table 3-4"), entry.about
        found = [number for number in entry.numbers if np.isclose(compared, number, rtol=1e-9).any()]
        assert (found != entry.numbers) == entry.derived, f"{entry.about}: {found}"


def test_a_reproduced_row_that_is_off_by_more_than_its_rounding_says_why(ledger_rows):
    for row in ledger_rows:
        if row.verdict == "reproduced" and np.abs(row.printed - row.computed).max() > 0.5000001 * 10.0**-row.digits:
            assert row.note, reference(row)
