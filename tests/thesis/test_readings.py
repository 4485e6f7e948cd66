"""Search for readings: what it finds in Appendix D, what it does not find elsewhere, and what chance would give."""

import numpy as np
import pytest
from reading_searches import searches
from readings import best_reading


def by_row(rig):
    return {(match.source, match.quantity): match for match in searches(rig)}


def test_appendix_d_is_found_and_nothing_else():
    found = by_row(rig=False)
    tensions = found["(D-32)", "f_i (N)"]
    assert tensions.reading == "Rz(θz) Rx(θx) Ry(θy), weight without g along -z"
    np.testing.assert_allclose(tensions.values, [9.517, 25.605, 19.777], atol=5e-4)
    assert tensions.tried == 576
    assert tensions.by_chance < 1e-5
    force = found["(D-33)", "y and z of F_s0, and its size (N)"]
    assert force.reading == tensions.reading + ", left out of F_s0"
    assert force.is_found
    assert {source for (source, _), match in found.items() if match.is_found} == {"(D-32)", "(D-33)"}
    orientation = found["Section 4.2.2", "orientation (degrees)"]
    assert orientation.tried > 1000
    assert np.abs(orientation.values - orientation.printed).max() > 2


@pytest.mark.full
def test_no_reading_gives_the_tables_of_the_rig():
    found = by_row(rig=True)
    rig = {key: match for key, match in found.items() if key[0].startswith("Table 5")}
    assert len(rig) == 3
    assert not any(match.is_found for match in rig.values())
    # The note of the ledger's row.
    assert rig["Table 5-1", "estimated lengths (mm)"].tried == 48
    assert 13 < rig["Table 5-1", "estimated lengths (mm)"].misfit < 14


def test_a_match_by_chance_is_no_reproduction():
    rng = np.random.default_rng(1)
    many = [(f"reading {k}", value) for k, value in enumerate(rng.uniform(0, 10, 5000))]
    match = best_reading("s", "q", 5.0, 0.05, many)
    assert match.misfit < 1
    # 5,000 readings spread over 10 N hold 50 within 0.05 N.
    assert 30 < match.by_chance < 80
    assert not match.is_found
    assert "no reproduction" in str(match)
    three = [(f"reading {k}", value) for k, value in enumerate(rng.uniform(0, 10, (500, 3)))]
    sure = best_reading("s", "q", [5.0, 2.0, 1.0], 0.01, [*three, ("right", [5.0, 2.001, 1.0])])
    assert sure.reading == "right"
    assert sure.is_found
    assert sure.by_chance < 1e-3
