"""Tables of docs/evidence on the wearer are those of ``exo-pin person``."""

import re
import runpy

import numpy as np
import pytest
from places import SCRIPTS, page

pytest.importorskip("myo_sim", reason="needs the extra person: pip install '.[person]'")

import exo_pin as ep
from exo_pin.cli import main

PAGE = page("wearer_measured")


def run(capsys, *arguments):
    status = main(["person", *(str(argument) for argument in arguments)])
    return status, *capsys.readouterr()


def rows_of(text, columns):
    """Rows of a table of a page of docs that begin with a cell of a kind, without its marks."""
    rows = [
        [cell.strip() for cell in line.strip("|").split("|")] for line in text.splitlines() if line.startswith("| ")
    ]
    return [row for row in rows if len(row) == columns]


def test_table_beside_the_literature_is_that_of_the_model():
    script = runpy.run_path(str(SCRIPTS / "literature_table.py"))
    fresh = script["literature_table"](ep.Person(1.75, 75.0, "male"))
    shown = [[cell.rstrip("°") for cell in row] for row in rows_of(PAGE, 7) if row[0].endswith("°")]
    # The last digit may round the other way on another processor.
    np.testing.assert_allclose(np.array(shown, dtype=float), fresh, rtol=0, atol=1.0)


@pytest.mark.full
def test_tables_of_relief_are_those_of_the_command(capsys, tmp_path):
    """Twelve maps and four with side forces, about a second each; the thesis's designs without their actuators."""
    names = {
        "prototype": "prototype",
        "optimised, Table 5-3": "optimised-table-5-3",
        "optimised, Table C-2": "optimised-table-c-2",
        "Scenario One": "scenario-one",
        "Appendix D": "appendix-d",
        "four cables, found by a search": "four-cables",
    }
    for name, design in names.items():
        names[name] = str(tmp_path / f"{design}.toml")
        ep.load(design).replace(limbs=None).save(names[name])
    bare = names["prototype"]
    pulling = ["--least", "effort", "--limits", "pull"]
    queries = {name: ([design], [design, *pulling]) for name, design in names.items()}
    queries["four cables, found by a search"] = (
        ["four-cables"],
        ["four-cables", "--least", "effort"],
    )
    for size in ("20", "50"):
        limit = ["--side-force-limit", size]
        queries[f"{size} N"] = ([bare, *limit], [bare, *pulling, *limit])
    table = {row[0]: row[1:] for row in rows_of(PAGE, 3) if row[0] in queries}
    assert len(table) == len(queries) == 8
    for name, pair in queries.items():
        for query, cell in zip(pair, table[name], strict=True):
            _, out, _ = run(capsys, *query, "--map")
            middle = re.search(r"relief, %, median +(-?\d+)", out)[1]
            low, high = re.search(r"quartiles +(-?\d+) to (-?\d+)", out).groups()
            shown = [float(value) for value in re.findall(r"-?\d+", cell)[:3]]
            assert np.abs(np.array([middle, low, high], dtype=float) - shown).max() <= 1.0, (name, query, cell)
