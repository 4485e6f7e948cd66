"""Numbers on docs/evidence/machine_in_motion.md are those of the runs."""

import re

import numpy as np
import pytest
from experiment_runs import tracked
from places import page

PAGE = page("machine_in_motion") + page("control")


def rows():
    """Experiment, controller and the printed numbers of the table of designs."""
    table = PAGE.partition("## The designs of the search")[2].partition("\n\n- ")[0]
    name = ""
    for cells in re.findall(r"^\|(.*?)\| (pi|model) \| (.*) \|$", table, re.MULTILINE):
        name = re.findall(r"`([\w-]+)`", cells[0])[0] if cells[0].strip() else name
        yield name, cells[1], [re.findall(r"[\d.]+", cell) for cell in cells[2].split("|")]


ROWS = list(rows())


def check(row):
    name, controller, (error, peak, pulls, power, _) = row
    found = tracked(name, controller).summary()
    shown = [error[0], peak[0], *pulls, power[0]]
    keys = ["rms_error_deg", "peak_F_s_N", "peak_tension_N", *["peak_push_N"] * (len(pulls) - 1), "mean_power_W"]
    printed = [f"{found[key]:.1f}" if key == "rms_error_deg" else f"{found[key]:.0f}" for key in keys]
    # The last digit may round the other way on another processor.
    assert [float(text) for text in shown] == pytest.approx([float(text) for text in printed], abs=1.01)
    assert float(error[0]) == pytest.approx(found["rms_error_deg"], abs=0.06)


def test_a_row_of_the_designs():
    assert len(ROWS) == 15
    check(next(row for row in ROWS if row[0] == "four-muscle-cables-abduction" and row[1] == "pi"))


@pytest.mark.full
@pytest.mark.parametrize("row", ROWS, ids=lambda row: f"{row[0]}-{row[1]}")
def test_rows_of_the_designs(row):
    check(row)


@pytest.mark.full
@pytest.mark.parametrize(
    ("name", "words"),
    [
        ("held-abduction-burst", r"up to (\d+) N after muscle 3 bursts"),
        ("held-abduction-stuck-valve", r"and (\d+) N with its valve stuck open"),
        ("four-cables-torn", r"reaches \*\*(\d+) N\*\*"),
        ("four-cables-no-current", r"with \|F_s\| up to (\d+) N"),
        ("four-cables-slipping-brake", r"the arm sinks, with up to (\d+) N"),
    ],
)
def test_forces_after_faults(name, words):
    tracking = tracked(name, "model")
    after = tracking.times >= tracking.experiment.faults[0].start
    force = np.linalg.norm(tracking.shoulder_force[after], axis=1).max()
    assert float(re.search(words, PAGE)[1]) == pytest.approx(force, abs=1.01)
