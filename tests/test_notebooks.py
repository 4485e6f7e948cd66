"""The studies in notebooks/ run, on coarser grids, and say what their text says."""

import importlib.util
from pathlib import Path

import pytest

FOLDER = Path(__file__).parent.parent / "notebooks"


def study(name):
    spec = importlib.util.spec_from_file_location(name, FOLDER / f"{name}.py")
    module = importlib.util.module_from_spec(spec)
    spec.loader.exec_module(module)
    return module


def test_what_pulling_muscles_hold(tmp_path):
    module = study("what_pulling_muscles_hold")
    fractions, maps = module.study(step=4.0, search_step=20.0)
    values = list(fractions.values())
    assert values[0] == pytest.approx(0.018, abs=0.001)
    assert values[1] < values[0]
    assert 0.4 < values[3] < values[2] < 0.8
    module.draw(tmp_path / "picture.png", fractions, maps)
    assert (tmp_path / "picture.png").stat().st_size > 10_000


def test_tension_planning(tmp_path):
    module = study("tension_planning")
    rows = module.study(step=25.0)
    four, six = rows
    assert four["held"] > 0.8
    assert six["held"] > 0.8
    # What planning gains depends on what it is held against more than on the number of cables.
    assert 0.05 < four["gain_over_least"] < 0.15
    assert 0.3 < four["gain_over_middle"] < 0.5
    assert six["gain_over_least"] < 0.02
    assert six["gain_over_middle"] > 0.6
    module.draw(tmp_path / "picture.png", rows, samples=11)
    assert (tmp_path / "picture.png").stat().st_size > 10_000
