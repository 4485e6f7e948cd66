"""Every number that the thesis prints is in the index once, and goes to a row of the ledger or to a reason."""

import itertools
import json
import tomllib
from collections import Counter
from pathlib import Path

import numpy as np
import pytest

from exo_pin import UnknownName
from exo_pin.cli import main
from exo_pin.muscle import table
from exo_pin.thesis import all_rows
from exo_pin.thesis.all_rows import printed_index, sections_named, summary
from exo_pin.thesis.rows import VERDICTS

SECTIONS = printed_index()
ENTRIES = [entry for section in SECTIONS for entry in section.entries]
#: What a scan of the thesis's text found, independent of the index.
TEXT = tomllib.loads(Path(__file__).with_name("numbers_of_the_text.toml").read_text(encoding="utf-8"))
#: Entries and numbers of the index; long tables with their cells.
ENTRY_COUNT, NUMBER_COUNT = 195, 1254


def reference(row):
    return f"{row.source}: {row.quantity}"


def test_counts():
    assert len(ENTRIES) == ENTRY_COUNT
    assert sum(entry.count for entry in ENTRIES) == NUMBER_COUNT


def test_index_has_every_section_once_and_in_order():
    labels = [section.label for section in SECTIONS]
    assert labels == list(TEXT)
    assert len(set(labels)) == len(labels)


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


def test_every_reason_of_the_list_is_used():
    path = Path(all_rows.__file__).with_name("printed_numbers.toml")
    reasons = tomllib.loads(path.read_text(encoding="utf-8"))["reasons"]
    assert set(reasons.values()) <= {entry.reason for entry in ENTRIES}
    assert all(" " in entry.reason for entry in ENTRIES if entry.reason)  # a sentence, no name without one


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
        if entry.derived or not entry.rows:
            continue
        compared = np.concatenate([row.printed.ravel() for row in entry.select(ledger_rows)])
        if entry.cells:
            assert compared.size == entry.cells or entry.about.startswith("Table 3-4"), entry.about
        for number in entry.numbers:
            assert np.isclose(compared, number, rtol=1e-9).any(), f"{entry.about}: {number}"


def test_a_reproduced_row_that_is_off_by_more_than_its_rounding_says_why(ledger_rows):
    for row in ledger_rows:
        if row.verdict == "reproduced" and np.abs(row.printed - row.computed).max() > 0.5000001 * 10.0**-row.digits:
            assert row.note, reference(row)


def test_sections_by_label():
    assert [one.label for one in sections_named("5.1", SECTIONS)] == ["5.1", "5.1.1", "5.1.2"]
    assert [one.label for one in sections_named("D", SECTIONS)] == ["D.1", "D.2"]
    with pytest.raises(UnknownName, match=r"5\.9.*there are: 1\.1, "):
        sections_named("5.9", SECTIONS)


def test_summary_counts_each_number_and_each_row_once(ledger_rows):
    head, *lines = summary(SECTIONS, ledger_rows)
    assert head == ["chapter", *"123456ABCD", "all"]
    counts = {line[0].strip(): [int(cell.replace("-", "0")) for cell in line[1:]] for line in lines}
    assert all(sum(cells[:-1]) == cells[-1] for cells in counts.values())
    total = {name: cells[-1] for name, cells in counts.items()}
    assert total["printed numbers"] == NUMBER_COUNT
    assert total["compared in a row"] + total["not compared, with a reason"] == NUMBER_COUNT
    assert total["rows"] == len(ledger_rows) == sum(total[verdict] for verdict in VERDICTS)


@pytest.fixture
def answer(capsys, monkeypatch, ledger_rows):
    monkeypatch.setattr("exo_pin.thesis.ledger", lambda: ledger_rows)

    def run(*arguments):
        assert main(["thesis", *arguments]) == 0
        return capsys.readouterr().out

    return run


def test_command_begins_with_the_summary_and_shows_one_section(answer):
    whole = answer()
    assert whole.splitlines()[0].split() == ["chapter", *"123456ABCD", "all"]
    section = answer("--section", "5.1.2")
    assert "| Section 5.1.2 | differences of measured and estimated θ_x, θ_y, θ_z, ° | 3.20, 0.65, 2.49 |" in section
    assert "Table 5-1, measured lengths: 275, 175" in section
    assert "(D-32)" not in section
    assert answer("--section", "1.3").count("|") == 0
    assert len(answer("--reasons").splitlines()) > len(whole.splitlines())


def test_notes_of_reproduced_rows_are_in_print_in_the_table_and_in_json(answer, ledger_rows):
    notes = {row.note for row in ledger_rows if row.verdict == "reproduced" and row.note}
    assert len(notes) > 20
    printed, every = answer(), answer("--all")
    content = json.loads(answer("--json"))
    for note in notes:
        shown = note.replace("|", "\\|")
        assert shown in printed
        assert shown in every
    assert notes <= {row["note"] for row in content["rows"]}
    assert len(content["rows"]) == len(ledger_rows)
    told = sum(entry["count"] for entry in content["without_row"])
    assert told == sum(entry.count for entry in ENTRIES if entry.reason)
