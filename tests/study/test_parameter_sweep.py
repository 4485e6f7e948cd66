"""Design studies: tables against single queries, every parameter, two processes, the command line."""

import sys
from concurrent.futures import ProcessPoolExecutor
from multiprocessing import get_context

import numpy as np
import pytest
from wrists import map_of

import exo_pin as ep
from exo_pin.core import errors
from exo_pin.design import PARAMETERS
from exo_pin.study import StudyTable, adl_box, evaluate

PERSON = ep.Arm.from_anthropometry(1.75, 75, "male")


@pytest.fixture(scope="module")
def prototype():
    return ep.load("prototype")


@pytest.fixture(scope="module")
def bare():
    """Without actuators, so that no limits are known."""
    return ep.load("prototype").replace(limbs=None)


@pytest.mark.full
def test_what_three_pulling_muscles_of_the_prototype_hold(prototype):
    """1.8 % of the 2° grid with the moving part alone: by the closed form's signs and by the exact moment set."""
    poses = adl_box(2.0)
    assert poses.shape == (56, 51, 53)
    tensions = map_of(prototype.mechanism, poses).actuator_forces
    held = (tensions >= 0).all(axis=-1)
    assert round(100 * held.mean(), 1) == 1.8
    rest = map_of(prototype.mechanism, ep.shoulder_rotation(0, 0, 0)).actuator_forces
    np.testing.assert_allclose(rest, [-1.3, -4.0, -6.2], atol=0.05)


def test_box_of_daily_activities():
    assert adl_box(4.0).shape == (28, 26, 27)
    for side in ("left", "right"):
        box = adl_box(10.0, side)
        assert box.shape == (12, 11, 11)
        for index, angles in {
            (0, 0, 0): (110, -4, 85),
            (11, 0, 0): (0, -4, 85),
            (11, 10, 0): (0, 96, 85),
            (3, 4, 10): (80, 36, -15),
        }.items():
            named = ep.shoulder_rotation(*angles, side=side, degrees=True)
            np.testing.assert_allclose(box.as_matrix()[index], named.as_matrix(), atol=1e-12)
    with pytest.raises(ep.InvalidInput, match="half a degree"):
        adl_box(0.1)


def test_a_sweep_is_its_single_queries(prototype):
    exo, poses = prototype.worn_by(PERSON), adl_box(25.0)
    values = {"r_A": [0.12, 0.14], "lean_forward": [0.0, 0.4]}
    table, free = ep.sweep(exo, values, poses), ep.sweep(exo, values, poses, limits="none")
    assert table.row_count == 4
    for row in range(4):
        geometry = exo.geometry.replace(r_A=table["r_A"][row])
        angle = table["lean_forward"][row]
        gravity = 9.81 * np.array([np.sin(angle), 0, -np.cos(angle)])  # leaning forward, down is forward of the trunk
        design = exo.replace(geometry=geometry, gravity=gravity)
        assert table["holdable"][row] == design.reaction(poses).held.mean() == 0.0
        assert np.isnan(table["peak_F_s_N"][row])
        force = free["peak_F_s_N"][row], free["median_F_s_N"][row]
        sizes = design.reaction(poses, limits="none").magnitude
        assert force == pytest.approx((sizes.max(), np.median(sizes)), rel=1e-6)
        state = design.singularity(poses)
        assert table["one_side"][row] == max((state.determinant > 0).mean(), (state.determinant < 0).mean())
    assert (table["error"] == "").all()


def test_every_parameter_changes_what_it_names(bare):
    exo, poses = bare.worn_by(PERSON), adl_box(40.0)
    base = exo.geometry.circles
    values = {
        "r_A": (0.15, lambda e: e.geometry.circles.r_A == 0.15),
        "r_B": (0.11, lambda e: e.geometry.circles.r_B == 0.11),
        "h_A": (0.05, lambda e: e.geometry.circles.h_A == 0.05),
        "h_B": (0.21, lambda e: e.geometry.circles.h_B == 0.21),
        "alpha": (base.alpha_A + 0.1, None),
        "alpha_A": (base.alpha_A + 0.1, None),
        "alpha_B": (base.alpha_B - 0.1, None),
        "arm": (PERSON, None),
        "person": (ep.Arm.from_anthropometry(1.6, 55, "female"), None),
        "payload": (2.0, None),
        "limbs": ((ep.Limb("SPS"),) * 3, None),
        "limb_kind": ("SPS", None),
        "gravity": ([0.0, 9.81, 0.0], None),
        "lean_forward": (0.3, None),
        "lean_left": (0.3, None),
    }
    plain = evaluate(exo, poses)["median_F_s_N"]
    for name, (value, _) in values.items():
        table = ep.sweep(exo, {name: [value]}, poses, payload_at=[0, 0, -0.6])
        assert table["error"][0] == ""
        if name not in ("limbs", "limb_kind"):
            assert table["median_F_s_N"][0] != plain
    one = ep.sweep(exo, {"alpha_A[2]": [1.2], "alpha[1]": [0.6]}, poses)
    angles = np.array(base.alpha_A)
    angles[1], angles[0] = 1.2, 0.6
    platform = np.array(base.alpha_B)
    platform[0] = 0.6
    other = exo.replace(geometry=exo.geometry.replace(alpha_A=angles, alpha_B=platform))
    assert one["median_F_s_N"][0] == pytest.approx(evaluate(other, poses)["median_F_s_N"])
    payload = ep.sweep(exo, {"payload": [2.0]}, poses, payload_at=[0, 0, -0.6])["median_F_s_N"][0]
    load = ep.Load([0, 0, -2 * 9.81], at=[0, 0, -0.6])
    assert payload == pytest.approx(np.median(exo.reaction(poses, load=load).magnitude))
    left = ep.sweep(exo, {"lean_left": [np.pi / 2]}, poses)["median_F_s_N"][0]
    towards = exo.replace(gravity=[0, 9.81, 0])  # lying on the left side, down is to the left
    assert left == pytest.approx(evaluate(towards, poses)["median_F_s_N"])


def test_designs_of_points_have_parameters():
    exo = ep.load("four-linear-actuators")
    table = ep.sweep(exo, {"cuff_height_mm": "180:220:2", "scale": [0.9, 1.0]}, adl_box(50.0))
    assert list(table)[:2] == ["cuff_height_mm", "scale"]
    assert table["cuff_height_mm"].tolist() == [180.0, 180.0, 220.0, 220.0]
    assert (table["error"] == "").all()
    assert len(set(table["can_hold"])) > 1
    assert set(PARAMETERS) >= {"cuff_height", "scale", "A.radius", "pull_limit"}


def test_a_bad_design_marks_its_own_row(bare):
    table = ep.sweep(bare, {"r_A": [-1.0, 0.1363, np.nan]}, adl_box(50.0))
    assert [bool(text) for text in table["error"]] == [True, False, True]
    assert np.isnan(table["median_F_s_N"][[0, 2]]).all()
    assert table["median_F_s_N"][1] == evaluate(bare, adl_box(50.0))["median_F_s_N"]


def test_a_value_of_the_wrong_shape_is_one_row_too(prototype):
    angles = prototype.geometry.circles.alpha_A
    table = ep.sweep(prototype, {"alpha": [angles, "bad", angles[:2]]}, adl_box(50.0))
    assert [bool(text) for text in table["error"]] == [False, True, True]
    np.testing.assert_array_equal(table["alpha_3"], [angles[2], np.nan, np.nan])
    assert table["alpha"].tolist() == ["", "bad", ""]
    assert list(table)[:4] == ["alpha_1", "alpha_2", "alpha_3", "alpha"]


def test_tables(bare, tmp_path):
    pandas = pytest.importorskip("pandas")
    table = ep.sweep(bare, {"alpha": [np.radians([30, 60, 120]), np.radians([20, 60, 130])]}, adl_box(50.0))
    assert list(table)[:3] == ["alpha_1", "alpha_2", "alpha_3"]
    frame = table.to_dataframe()
    assert isinstance(frame, pandas.DataFrame)
    assert frame.shape == (2, len(table))
    table.to_csv(tmp_path / "table.csv")
    back = pandas.read_csv(tmp_path / "table.csv")
    np.testing.assert_array_equal(back["peak_F_s_N"], table["peak_F_s_N"])
    head = str(table).split("\n\n")[1].splitlines()[0]
    assert head.split()[:2] == ["alpha_1_rad", "alpha_2_rad"]
    assert table.peak == table["peak_F_s_N"].max()
    assert "<th" in table._repr_html_()
    assert "alpha_2_rad" in table._repr_html_()
    notes = StudyTable([{"design": "one", "blank": "reach (a stroke is not known)"}])._repr_html_()
    assert "one, blank: reach (a stroke is not known)." in notes
    with pytest.raises(ep.UnknownName, match="peak_F_s_N"):
        table["peak"]
    with pytest.raises(ValueError, match="read-only"):
        table["alpha_1"][0] = 0.0
    assert str(StudyTable([])) == ""
    for rows in (3, None, "ab", [1, 2]):
        with pytest.raises(ep.InvalidInput, match="sequence of mappings"):
            StudyTable(rows)
    for other in ({"a": 1.0, "b": 2.0}, {}, {"b": 1.0}):
        with pytest.raises(ep.InvalidInput, match="row 2 differs in"):
            StudyTable([{"a": 1.0}, other])


def test_pandas_is_optional(prototype, monkeypatch):
    monkeypatch.setitem(sys.modules, "pandas", None)
    with pytest.raises(errors.MissingExtra, match=r"\.\[study\]"):
        StudyTable([{"a": 1.0}]).to_dataframe()


@pytest.mark.full
def test_two_processes_give_the_same_table(prototype):
    parameters = {"r_A": [0.12, 0.13, 0.14], "limb_kind": ["UPU", "SPS"]}
    poses = adl_box(50.0)
    one = ep.sweep(prototype, parameters, poses)
    local = type("Local", (), {"force_limits": staticmethod(lambda length: (0.0 * length, 400.0 + 0.0 * length))})
    with ProcessPoolExecutor(2, mp_context=get_context("spawn")) as pool:
        two = ep.sweep(prototype, parameters, poses, executor=pool)
        with pytest.raises(ep.InvalidInput, match="another process"):
            ep.sweep(prototype, parameters, poses, executor=pool, limits=local())
    for name in one:
        np.testing.assert_array_equal(one[name], two[name])


@pytest.mark.parametrize(
    ("parameters", "options", "message"),
    [
        ({"radius": [1]}, {}, "alpha_A"),
        ({}, {}, "map names"),
        ({"r_A": []}, {}, "sequence of values"),
        ({"r_A": 0.1}, {}, "sequence of values"),
        ({"limb_kind": 3}, {}, "sequence of values"),
        ({"r_A": "0.1,x"}, {}, "finite numbers for r_A"),
        ({"r_A_deg": [5.0]}, {}, "r_A in m or mm"),
        ({"lean_forward": [0.0, 30.0]}, {}, "lean_forward_deg"),
        ({"r_A[2]": [0.1]}, {}, "without a limb"),
        ({"A[7].radius": [0.1]}, {}, "limb from 1 to 3"),
        ({"person": "1.75"}, {}, "objects in Python"),
        ({"payload": [1.0]}, {}, "payload_at"),
        ({"r_A": [0.1]}, {"executor": 3}, "executor"),
        ({"r_A": [0.1]}, {"split": "fair"}, "spherical"),
    ],
)
def test_studies_that_cannot_be_meant(prototype, parameters, options, message):
    with pytest.raises(ep.InvalidInput, match=message):
        ep.sweep(prototype, parameters, adl_box(50.0), **options)
