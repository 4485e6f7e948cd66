"""What single limbs have to do."""

from dataclasses import replace

import numpy as np
import pytest

import exo_pin as ep
from exo_pin import InvalidInput
from exo_pin.workspace import Criteria, limb_loss, limb_sheet, limb_table
from exo_pin.wrist import BodyShape

BODY = BodyShape.of(ep.Wearer(1.75, 75, "male"))
LIMITS = Criteria(least_tension=5.0, largest_shoulder_force=120.0, body=BODY, least_gap=0.012)


def test_sheet_has_a_column_a_limb_in_millimetres():
    exo = ep.load("four-linear-actuators")
    table = limb_table(exo.mechanism, exo.workspace(12.0, LIMITS))
    lines = {line[:36].strip(): line[36:] for line in limb_sheet(exo.mechanism, table).splitlines()}
    assert lines["limb"].split() == ["1", "2", "3", "4"]
    assert lines["joint on the frame, mm"].split("  ")[-1].strip() == "241, -190, 401"
    assert f"{1e3 * table['used_from_m'][2]:.0f} to {1e3 * table['used_to_m'][2]:.0f}" in lines["used, mm"]
    assert f"{table['force_from_N'][1]:.0f} to {table['force_to_N'][1]:.0f}" in lines["force for the least |F_s|, N"]
    bodiless = exo.replace(arm=replace(exo.arm, wearer=None))
    bare = limb_table(bodiless.mechanism, bodiless.workspace(12.0, ["stroke", "forces"]))
    clear = next(line for line in limb_sheet(bodiless.mechanism, bare).splitlines() if line.startswith("clear of arm"))
    assert clear.split(",")[1].split() == ["mm", "-", "-", "-", "-"]


def test_loss_of_a_limb_in_words_of_the_workspace():
    exo = ep.load("four-linear-actuators")
    found = exo.workspace(12.0, Criteria(names=("forces",), least_moment_without_limb=0.0))
    lost = limb_loss(exo.mechanism, found)
    every = exo.workspace(found.poses[found.inside], Criteria(names=("limb_loss",), least_moment_without_limb=0.0))
    assert every.index <= lost["held"].min() < 1.0
    assert lost["missing_share"].max() > 0.0
    firm = exo.workspace(12.0, Criteria(names=("forces", "limb_loss"), least_moment_without_limb=0.0))
    assert limb_loss(exo.mechanism, firm)["held"].tolist() == [1.0] * 4
    assert limb_loss(exo.mechanism, firm)["missing_Nm"].tolist() == [0.0] * 4


def test_limb_table_adds_up_to_the_workspace():
    exo = ep.load("four-cables")
    found = exo.workspace(10.0, LIMITS)
    table = limb_table(exo.mechanism, found)
    np.testing.assert_array_equal(table["used_from_m"], found.lengths[found.inside].min(axis=0))
    np.testing.assert_array_equal(table["force_to_N"], found.tensions[found.inside].max(axis=0))
    assert (table["used_from_m"] >= table["stroke_from_m"]).all()
    assert (table["used_to_m"] <= table["stroke_to_m"]).all()
    gaps = np.stack([table[f"gap_{name}_m"] for name in ("arm", "torso", "limbs")], axis=-1)
    np.testing.assert_allclose(gaps.min(axis=0), found.gaps[found.inside].min(axis=0), atol=1e-12)
    # A pair has one distance, so the least one occurs twice.
    assert np.sort(gaps[:, 2])[0] == pytest.approx(np.sort(gaps[:, 2])[1])
    with pytest.raises(InvalidInput, match="workspace of 3 limbs, got one of 4"):
        limb_table(ep.load("prototype").mechanism, found)
    with pytest.raises(InvalidInput, match="poses inside"):
        limb_table(exo.mechanism, exo.workspace(20.0, LIMITS.replace(largest_shoulder_force=0.1)))
