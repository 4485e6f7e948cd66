"""Numbers on docs/evidence/machine_in_motion.md are those of the runs."""

import json
import re

import pytest
from command_line import run
from experiment_runs import tracked
from places import page

import exo_pin as ep
from exo_pin.control.experiments.sensitivity import CHANGES, MOTOR_CHANGES, band_of

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


@pytest.mark.long
def test_forces_after_a_burst():
    shown = re.search(r"controller it is (\d+) to (\d+) N when muscle 3", PAGE).groups()
    band = ep.control.fault_band(ep.experiment("held-abduction-burst", "model"))
    assert [float(text) for text in shown] == pytest.approx(band, abs=0.6)


@pytest.mark.full
@pytest.mark.parametrize(
    ("name", "words", "farthest"),
    [
        ("four-cables-no-current", r"\|F_s\| of (\d+) to (\d+) N\. If the brake", {"axial stiffness", "presliding"}),
        ("four-cables-slipping-brake", r"the arm sinks, with (\d+) to (\d+) N", {"axial stiffness", "coulomb"}),
        (
            "held-abduction-stuck-valve", r"and (\d+) to (\d+) N with its valve stuck open",
            {"valves", "centre of mass of the arm"},
        ),
    ],
)  # fmt: skip
def test_forces_after_faults(name, words, farthest):
    """With the estimates that change the force most, of all."""
    shown = [float(text) for text in re.search(words, PAGE).groups()]
    changes = [change for change in (*CHANGES, *MOTOR_CHANGES) if change[0] in farthest]
    assert shown == pytest.approx(band_of(ep.control.sensitivity(ep.experiment(name, "model"), changes)), abs=0.6)


@pytest.mark.full
def test_the_command_prints_the_band_that_the_page_has(capsys):
    status, out, _ = run(capsys, "track", "--experiment", "four-cables-torn", "--json", "--no-progress")
    assert status == 0
    data = json.loads(out)
    least, greatest = data["fault_band_N"]
    shown = [float(text) for text in re.search(r"Over them it is \*\*(\d+) to (\d+) N\*\*", PAGE).groups()]
    assert shown == pytest.approx([least, greatest], abs=0.6)
    assert least < 0.5 * data["peak_F_s_N"] < 0.8 * greatest
    assert f"peak |F_s| after the fault {least:.0f} to {greatest:.0f} N over the estimates" in data["verdict"]
    assert any("--sensitivity" in text for text in data["cautions"])
