"""The wearer's model beside measurements of others; what docs/evidence/wearer_measured.md says of it."""

import importlib
import sys
from pathlib import Path

import pytest

pytest.importorskip("myo_sim", reason="needs the extra person: pip install '.[person]'")


@pytest.fixture(scope="module")
def wearer():
    folder = str(Path(__file__).parents[2] / "benchmarks")
    sys.path.insert(0, folder)
    yield importlib.import_module("wearer")
    sys.path.remove(folder)


@pytest.fixture(scope="module")
def rows(wearer):
    return {(row["quantity"], row["plane"], row["angle_deg"], row["load_kg"]): row for row in wearer.measured()}


def test_every_row_has_a_source_and_a_figure(rows):
    assert len(rows) == 19
    for row in rows.values():
        assert row["source"]
        assert row["middle"] or (row["low"] and row["high"])


@pytest.mark.parametrize("plane", ["flexion", "abduction"])
def test_contact_without_a_load_is_within_what_was_measured(wearer, rows, plane):
    row = rows["contact", plane, "90", "0"]
    (value,) = wearer.modelled(row)
    assert float(row["low"]) < value < float(row["high"])
    assert abs(value - float(row["middle"])) < 13.0


def test_what_a_load_in_the_hand_does(wearer, rows):
    """The force grows as the moment does; posture and condition on the socket explain what lies above the patients'."""
    empty, pot, heavy = wearer.explained({})
    arms = [wearer.MAN.with_changes(payload=load).arm for load in (0.0, 1.5, 2.0)]
    moments = [arm.mass * arm.centre_of_mass[2] for arm in arms]
    assert pot / empty == pytest.approx(moments[1] / moments[0], rel=0.01)
    assert heavy / empty == pytest.approx(moments[2] / moments[0], rel=0.01)
    row = rows["contact", "flexion", "90", "1.5"]
    low, high = float(row["low"]), float(row["high"])
    assert pot > high
    for change in ("arm in the scapular plane", "elbow bent 30°", "no condition on the socket", "body of 100 kg"):
        assert low < wearer.explained(wearer.CHANGES[change])[1] < high


def test_strengths(wearer, rows):
    balanced, carried = wearer.modelled(rows["strength", "flexion", "0", "0"])
    assert balanced == pytest.approx(89.9, rel=0.03)
    assert carried >= balanced
    assert wearer.modelled(rows["strength", "flexion", "45", "0"])[0] == pytest.approx(68.6, rel=0.27)
    adduction = rows["strength", "adduction", "60", "0"]
    assert all(float(adduction["low"]) < value < float(adduction["high"]) for value in wearer.modelled(adduction))
    ratio = wearer.modelled(rows["strength ratio", "adduction to abduction", "60", "0"])
    assert min(ratio) == pytest.approx(2.0, rel=0.05)
    share = wearer.modelled(rows["share of strength", "flexion", "90", "0"])
    assert max(share) == pytest.approx(22.0, abs=0.5)


def test_lever_of_the_middle_deltoid(wearer, rows):
    (peak,) = wearer.modelled(rows["lever peak", "middle deltoid", "", "0"])
    assert peak == pytest.approx(30.0, abs=2.1)


def test_women_and_the_rotator_cuff(wearer, rows):
    for plane, angle in (("flexion", "45"), ("abduction", "60"), ("outward rotation", "0")):
        row = rows["women to men", plane, angle, "0"]
        for value in wearer.modelled(row):
            assert value == pytest.approx(float(row["middle"]), abs=0.03)
    share = wearer.modelled(rows["share of a woman's strength", "flexion", "90", "0"])
    assert 23.0 < min(share) <= max(share) < 34.0
    (infraspinatus,) = wearer.modelled(rows["axial lever peak", "infraspinatus", "", "0"])
    assert 23.0 < infraspinatus < 28.0
