"""Crossings, columns, tables and pictures of answers, from records that are written down."""

from dataclasses import replace
from types import SimpleNamespace

import numpy as np
import pytest
from wrists import PERSON

import exo_pin as ep
from exo_pin.reaction import columns, cuff_load, table
from exo_pin.reaction.columns import force_columns, peak_of

NAN, INF = np.nan, np.inf


def crossings(determinant, singular=()):
    determinant = np.array(determinant, dtype=float)
    status = np.full(determinant.shape, "ok", dtype="<U10")
    for index in singular:
        status[index] = "singular"
    found = columns.crossings(SimpleNamespace(determinant=determinant, equilibrium_status=status))
    assert found.dtype == np.int64
    assert found.shape[1] == determinant.ndim
    return found.tolist()


def test_crossings_of_paths_of_signs():
    assert crossings(0.7) == []
    assert crossings([]) == []
    assert crossings([0.7]) == []
    assert crossings([1.0, 2.0, -1.0, -2.0, 3.0]) == [[1], [3]]
    # A pose on the surface belongs to neither side: onto it and on is once, onto it and back is not at all.
    assert crossings([1.0, 0.2, -1.0], [1]) == [[0]]
    assert crossings([1.0, -0.2, 1.0], [1]) == []
    assert crossings([0.5, 1.0, -1.0], [0]) == [[1]]
    assert crossings([1.0, -1.0, 0.5], [2]) == [[0]]
    assert crossings([1.0, NAN, -1.0]) == [[0]]
    assert crossings([NAN, NAN]) == []
    # Paths run along the last axis of a stack.
    assert crossings([[1.0, -1.0, -1.0], [1.0, 1.0, -1.0]]) == [[0, 0], [1, 1]]
    assert crossings([[1.0, 1.0], [-1.0, -1.0]]) == []
    assert crossings([[[1.0, -1.0]], [[2.0, 3.0]], [[-2.0, 3.0]]]) == [[0, 0, 0], [2, 0, 0]]


def test_columns_of_forces_are_named_after_limbs_or_drives():
    f, g = np.array([[1.0, 2.0], [3.0, 4.0]]), np.array([[5.0, 6.0], [7.0, 8.0]])
    parts = {"shoulder_force": None, "magnitude": None, "margin": None}
    limbs = SimpleNamespace(actuator_forces=f, constraint_forces=g, **parts)
    found = force_columns(limbs)
    assert {name: values.tolist() for name, values in found.items()} == {
        "f_1_N": [1.0, 3.0], "f_2_N": [2.0, 4.0], "g_1_N": [5.0, 7.0], "g_2_N": [6.0, 8.0],
    }  # fmt: skip
    assert list(force_columns(SimpleNamespace(actuator_forces=None, constraint_forces=g, **parts))) == [
        "g_1_N",
        "g_2_N",
    ]
    assert list(force_columns(SimpleNamespace(actuator_forces=f, constraint_forces=None, **parts))) == [
        "f_1_N",
        "f_2_N",
    ]
    assert force_columns(SimpleNamespace(actuator_forces=None, constraint_forces=None, **parts)) == {}
    drives = (("lift", "N m"), ("rope", "N"))
    named = force_columns(SimpleNamespace(actuator_forces=f, constraint_forces=g, drive_units=drives, **parts))
    assert list(named) == ["lift_N_m", "rope_N", "g_1_N", "g_2_N"]
    np.testing.assert_array_equal(named["rope_N"], [2.0, 4.0])


def test_the_peak_is_of_finite_values():
    assert peak_of(np.array([3.0, INF, 5.0, NAN, -7.0])) == 5.0
    assert np.isnan(peak_of(np.array([NAN, INF])))
    assert np.isnan(peak_of(np.empty(0)))


@pytest.fixture(scope="module")
def cables():
    return ep.load("four-cables").worn_by(PERSON)


def test_the_clearance_is_that_of_the_workspace(cables):
    poses = cables.pose([[0.0, 40.0], [90.0, 20.0]], [[-60.0, 10.0], [0.0, 120.0]])
    found = cables.reaction(poses).clearance
    np.testing.assert_array_equal(found, cables.workspace(poses, ["clearance"]).margins["clearance"])
    assert found.min() < 0.0 < found.max()


def test_plain_data_of_one_pose_has_its_range_and_evidence(cables):
    held, stack = cables.reaction(cables.pose(60.0)), cables.reaction(cables.pose([60.0, 70.0]))
    data, allowed = held.as_dict(), held.range()
    assert data["range_least"] == pytest.approx(float(allowed.least))
    assert data["range_greatest"] == pytest.approx(float(allowed.greatest))
    assert data["range_unbounded"] is False
    assert not any(name.startswith("range") for name in stack.as_dict())
    assert "missing_wrench" not in data
    assert "cuff_pressure_limits" not in data
    lost = cables.reaction(cables.pose(60.0), load=ep.Load([0.0, 0.0, -400.0], at=[0.0, 0.0, -0.5])).as_dict()
    np.testing.assert_array_equal(np.isfinite(lost["missing_wrench"]), True)
    assert not any(name.startswith("range") for name in lost)
    padded = cables.replace(interfaces=ep.Interfaces(cuff_area=0.01))
    assert "cuff_pressure_limits" in padded.reaction(cables.pose(60.0)).as_dict()


def test_the_slip_of_a_device_that_gives_way_is_that_of_its_cuff():
    moved = np.arange(24.0).reshape(2, 2, 6)
    own = SimpleNamespace(interface_displacements=moved)
    np.testing.assert_array_equal(cuff_load.cuff_slip(own), moved[:, 1])


def cuff_text(index=(), worn=True, held=(True, True, True), pulls=(-3.0, 8.0, -20.0), slip=None, pressure=None):
    poses = SimpleNamespace(mechanism=SimpleNamespace(interfaces=ep.Interfaces(cuff_area=0.02)))
    slip, pressure = (None if part is None else np.array(part) for part in (slip, pressure))
    own = SimpleNamespace(
        cuff_pull=np.array(pulls), status=np.array(["ok"] * 3), held=np.array(held), is_worn=worn, cuff_slip=slip,
        cuff_pressure=pressure, source=SimpleNamespace(poses=poses),
    )  # fmt: skip
    return cuff_load.cuff_text(own, index)


def test_the_cuff_in_words():
    assert cuff_text() == "The cuff pulls along the arm with up to 20 N, towards the shoulder."
    assert cuff_text((0,)) == "The cuff pulls along the arm with 3 N, towards the shoulder."
    assert cuff_text((1,)) == "The cuff pulls along the arm with 8 N, towards the hand."
    # A single pose is described though it is not held; of several only the held ones are.
    assert cuff_text((2,), held=(True, True, False)).startswith("The cuff pulls along the arm with 20 N")
    assert cuff_text(held=(True, True, False)) == "The cuff pulls along the arm with up to 8 N, towards the hand."
    assert cuff_text(held=(True, False, False)) == "The cuff pulls along the arm with 3 N, towards the shoulder."
    assert cuff_text(held=(False, False, False)) == ""
    assert cuff_text((2,), pulls=(1.0, 1.0, NAN)) == ""
    assert cuff_text(worn=False) == ""
    assert cuff_text((1,), pulls=(0.0, 0.4, 0.0)).endswith("with 0 N.")
    slips = np.zeros((3, 6))
    slips[0, :3], slips[1, 3:] = [0.003, 0.0, 0.004], np.radians([0.0, 3.0, 4.0])
    assert cuff_text(slip=slips).endswith("; by its stiffness it slips up to 5.0 mm and turns up to 5.0°.")
    assert cuff_text((0,), slip=slips).endswith("; by its stiffness it slips 5.0 mm and turns 0.0°.")
    assert cuff_text(pressure=[1200.0, 3400.0, 2000.0]).endswith(
        ". Across the arm, its mean force over area on the skin is up to 3.4 kPa, on 200 cm²."
    )


@pytest.mark.parametrize("wrench", [[0.0, 0.0, -7.0], [0.0, 0.0, -0.25], [0.3, 0.0, 0.4], [0.0, 0.0, 0.0]])
def test_the_mean_pressure_is_zero_of_a_pull_along_the_arm(wrench):
    interfaces = ep.Interfaces(cuff_area=0.05)
    pull = -wrench[2]
    own = SimpleNamespace(
        cuff_wrench=np.array([*wrench, 1.0, 2.0, 3.0]), cuff_pull=np.array(pull),
        source=SimpleNamespace(poses=SimpleNamespace(mechanism=SimpleNamespace(interfaces=interfaces))),
    )  # fmt: skip
    assert cuff_load.cuff_pressure(own) == pytest.approx(np.hypot(wrench[0], wrench[1]) / 0.05, abs=1e-9)


def test_a_map_of_f_s_alone_has_magnitudes(cables):
    poses = cables.pose([0.0, 30.0, 60.0], 20.0)
    load = ep.Load(np.zeros(3), [[900.0, 0.0, 0.0], [0.0, 0.0, 0.0], [0.0, 0.0, 0.0]])
    whole = cables.reaction_map(poses, load=load)
    vectors = cables.reaction_map(poses, load=load, keep=("shoulder_force", "status"))
    assert not whole.held[0]
    assert vectors.peak == pytest.approx(whole.magnitude[1:].max(), rel=1e-12)
    with pytest.raises(ep.InvalidInput, match="neither"):
        _ = cables.reaction_map(poses, keep=("margin", "status")).peak


def test_numbers_of_tables():
    assert [table._number(value) for value in (NAN, INF, 0.0049, -0.0049, 0.006, -12.345)] == [
        "-", "-", "0.00", "0.00", "0.01", "-12.35",
    ]  # fmt: skip
    assert [table._number(value, 1) for value in (0.049, -0.06)] == ["0.0", "-0.1"]


def test_the_range_in_a_table():
    def told(least, greatest, single=False):
        found = SimpleNamespace(least=np.array(least), greatest=np.array(greatest), is_single=single)
        return table._allowed(SimpleNamespace(range=lambda: found))

    assert told(1.25, 30.06) == "1.2 to 30.1"
    assert told(1.26, INF) == "1.3 to unbounded"
    assert told(1.0, 1.0, True) == "no other"
    assert table._allowed(SimpleNamespace(range=lambda: None)) == "none"


def test_tables_of_one_pose_and_of_several(cables):
    """Each row of a table is what the answer says; values are read back from the text."""
    exo = cables.replace(limbs=[replace(limb, kind="UPU") for limb in cables.mechanism.limbs])
    one = exo.reaction(exo.pose(60.0, 20.0), split="minimal", constraint_bounds=20.0)
    rows = dict(table._cells([one])[1])
    assert rows["  % of body weight"] == f"{float(one.percent_body_weight):.2f}"
    for axis, name in enumerate(("x (forward)", "y (left)", "z (up)")):
        assert float(rows[f"  F_s {name}, N"]) == pytest.approx(one.shoulder_force[axis], abs=5.1e-3)
    for i in range(4):
        assert float(rows[f"limb {i + 1} tension f, N"]) == pytest.approx(one.actuator_forces[i], abs=5.1e-3)
        assert float(rows[f"limb {i + 1} side force g, N"]) == pytest.approx(one.constraint_forces[i], abs=5.1e-3)
    for owner, wrench in (("cuff on the arm", one.cuff_wrench), ("harness on the torso", one.harness_wrench)):
        assert float(rows[f"{owner}, force, N"]) == pytest.approx(np.linalg.norm(wrench[:3]), abs=5.1e-3)
        assert float(rows[f"{owner}, moment, N m"]) == pytest.approx(np.linalg.norm(wrench[3:]), abs=5.1e-3)
    assert rows["status"] == "ok"
    load = ep.Load(np.zeros(3), np.array([[0.0, 0.0, 0.0], [0.0, 0.0, 0.0], [900.0, 0.0, 0.0]]))
    stack = exo.reaction(exo.pose([50.0, 60.0, 70.0], 20.0), load=load)
    assert stack.held.tolist() == [True, True, False]
    rows = dict(table._cells([stack])[1])
    assert (rows["poses"], rows["  in equilibrium"], rows["  within all known limits"]) == ("3", "3", "2")
    assert rows["  marked near_singular"] == str((stack.equilibrium_status == "near_singular").sum())
    assert float(rows["held: peak |F_s|, N"]) == pytest.approx(stack.magnitude[:2].max(), abs=5.1e-3)
    assert float(rows["held: median |F_s|, N"]) == pytest.approx(stack.magnitude[:2].mean(), abs=5.1e-3)
    assert float(rows["held: peak |f_i|, N"]) == pytest.approx(np.abs(stack.actuator_forces[:2]).max(), abs=5.1e-3)
    assert float(rows["held: peak |g_i|, N"]) == 0.0
    assert rows["crossings of det X = 0"] == "-"
    nowhere = exo.reaction(exo.pose([50.0, 60.0]), load=ep.Load(np.zeros(3), [900.0, 0.0, 0.0]))
    rows = dict(table._cells([nowhere])[1])
    assert {rows[f"held: {name}, N"] for name in ("peak |F_s|", "median |F_s|", "peak |f_i|", "peak |g_i|")} == {"-"}


def test_notes_below_a_table(cables):
    pose = cables.pose(60.0, 20.0)
    free, least = (cables.reaction(pose, split=split) for split in ("spherical", "minimal"))
    single = [text for text, _ in table._notes([free])]
    both = [text for text, _ in table._notes([free, least])]
    assert single[0] == free.certificate.statement
    assert single[1] == f"spherical assumes {free.certificate.chosen_by}. Criterion: {free.criterion}."
    assert free.cuff_text() in single
    # With two splits each says whose cuff it is, and the same statement stands there once.
    assert both.count(free.certificate.statement) == 1
    assert f"spherical: {free.cuff_text()}" in both
    assert f"minimal: {least.cuff_text()}" in both
    determined = ep.load("prototype").reaction(pose, limits="none")
    assert determined.certificate.undetermined > 0
    lost = cables.reaction(pose, load=ep.Load(np.zeros(3), [900.0, 0.0, 0.0]))
    assert f"spherical: {lost.infeasibility.explain()}" in [text for text, _ in table._notes([lost])]
