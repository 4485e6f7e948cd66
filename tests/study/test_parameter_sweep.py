"""Design studies: tables against single queries, every parameter, two processes, the command line."""

import json
import sys

import numpy as np
import pytest
from places import URDF
from wrists import map_of

import exo_pin as ep
from exo_pin import wrist
from exo_pin.cli import main
from exo_pin.core.errors import InvalidInput
from exo_pin.core.progress import processes
from exo_pin.design import DEFAULT_PRESET, PARAMETERS
from exo_pin.design.parameters.changes import value_of, with_values
from exo_pin.design.parameters.names import parameter
from exo_pin.study import StudyTable, adl_box, evaluate
from exo_pin.workspace.optimisation.design_variables import DesignVariables

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
    np.testing.assert_array_equal(wrist.holding(prototype.mechanism, poses).holdable, held)
    assert evaluate(prototype, poses)["pull_only"] == held.mean()
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
        tensions = design.reaction(poses, limits="none").actuator_forces
        assert table["pull_only"][row] == (tensions >= 0.0).all(axis=-1).mean()
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
    """Every name on a design that is given as points and has actuators: by hand, and in one table with both units."""
    exo, cables = ep.load("four-linear-actuators"), ep.load("four-cables").mechanism
    base, platform = exo.geometry.base_points, exo.geometry.platform_points

    def changed(name, value, mechanism=exo.mechanism):
        named = parameter(name)
        return with_values(mechanism, {named: named.in_si(value)})

    height = -platform[:, 2].mean()
    moved = changed("cuff_height_mm", 1e3 * height + 20.0).geometry.platform_points
    np.testing.assert_allclose(moved, platform - [0, 0, 0.02], atol=1e-12)
    larger = changed("scale", 1.1)
    np.testing.assert_allclose(larger.geometry.base_points, 1.1 * base)
    for old, new in zip(exo.limbs, larger.limbs, strict=True):
        assert new.stroke.nominal_length == pytest.approx(1.1 * old.stroke.nominal_length)
        assert (new.stroke.shortest, new.actuator.pull_limit) == (old.stroke.shortest, old.actuator.pull_limit)
    # Forces of a device that is larger as a whole are smaller alike, with the arm and its weight as they are.
    poses = exo.pose([20.0, 60.0], 30.0)
    forces = [each.reaction(poses, limits="none").actuator_forces for each in (exo, exo.from_mechanism(larger))]
    np.testing.assert_allclose(forces[1], forces[0] / 1.1, rtol=1e-8)
    radius = changed("A.radius_mm", 150.0).geometry.base_points
    np.testing.assert_allclose(np.linalg.norm(radius, axis=1), 0.15)
    assert changed("B[2].drop_mm", 200.0).geometry.platform_points[1, 2] == pytest.approx(-0.2)
    assert [limb.actuator.pull_limit for limb in changed("pull_limit[3]", 50.0).limbs].count(50.0) == 1
    assert {limb.actuator.least_tension for limb in changed("least_tension_N", 5.0, cables).limbs} == {5.0}
    assert [limb.kind for limb in changed("limb_kind", "UPU").limbs] == ["UPU"] * 4
    assert changed("limb_kind", "UPU").limbs[0].actuator == exo.limbs[0].actuator
    # Whatever can be searched has its own value in the design.
    for key in ("cuff_height", "A[1].azimuth", "B[4].radius", "nominal_length[2]", "end_fitting[2]"):
        named = parameter(key)
        same = with_values(exo.mechanism, {named: value_of(exo.mechanism, named)})
        np.testing.assert_allclose(same.geometry.base_points, base, atol=1e-12)
        np.testing.assert_allclose(same.geometry.platform_points, platform, atol=1e-12)
    table = ep.sweep(exo, {"cuff_height_mm": "180:220:2", "scale": [0.9, 1.0]}, adl_box(50.0))
    assert list(table)[:2] == ["cuff_height_mm", "scale"]
    assert table["cuff_height_mm"].tolist() == [180.0, 180.0, 220.0, 220.0]
    assert (table["error"] == "").all()
    assert len(set(table["can_hold"])) > 1
    assert set(PARAMETERS) >= {"cuff_height", "scale", "A.radius", "pull_limit"}
    # One language: a search takes the same names, units and texts.
    space = DesignVariables(exo.mechanism, {"A[1].azimuth_deg": "-90:90", "cuff_height": (0.1, 0.3)})
    np.testing.assert_allclose(space.bounds, [[-np.pi / 2, np.pi / 2], [0.1, 0.3]])
    assert space.of_design()["cuff_height"] == pytest.approx(height)


def test_ranking_is_by_held_poses():
    cables, linear = ep.load("four-cables"), ep.load("four-linear-actuators")
    table = cables.compare(linear, cables.pose([0, 30, 60, 90], 30))
    assert table["can_hold"].tolist() == [1.0, 1.0]
    assert table.ranking == (1, 0)  # equal shares: 42.1 N before 67.2 N
    first = "four-linear-actuators ranks first, it holds 100.0% of the poses, peak |F_s| 42.1 N."
    assert table.verdict.startswith(first)
    far = cables.compare(linear, adl_box(30.0))
    assert far.ranking[0] == int(far["can_hold"].argmax())
    both = cables.reaction(adl_box(30.0)).can_hold & linear.reaction(adl_box(30.0)).can_hold
    assert far["common_peak_F_s_N"][1] == pytest.approx(linear.reaction(adl_box(30.0)).magnitude[both].max())
    # What nobody knows to hold ranks behind what is known to.
    unknown = ep.load("appendix-d").compare(cables, adl_box(50.0))
    assert unknown.ranking[0] == 1
    assert "limits are not known" in " ".join(unknown.cautions)
    assert json.loads(unknown.to_json())["ranking"] == [1, 0]


def test_several_designs_of_any_kind_share_one_table(capsys):
    names = ["four-cables", str(URDF / "serial-y-x-z.urdf"), str(URDF / "spherical-3rrr.urdf")]
    man = ep.Wearer(1.755, 85, "male")
    first, *others = (ep.load(name).worn_by(man) for name in names)
    poses = adl_box(50.0)
    table = first.compare(*others, poses=poses)
    assert list(table["design"]) == ["four-cables", "serial-y-x-z", "spherical-3rrr"]
    answers = [exo.reaction(poses) for exo in (first, *others)]
    common = np.all([answer.held for answer in answers], axis=0)
    assert 0 < common.sum() < common.size
    for row, answer in enumerate(answers):
        assert table["holdable"][row] == pytest.approx(answer.held.mean())
        assert table["common_peak_F_s_N"][row] == pytest.approx(answer.magnitude[common].max())
    # Poses after the designs are the same question, and so is the command.
    np.testing.assert_array_equal(first.compare(*others, poses)["peak_F_s_N"], table["peak_F_s_N"])
    assert main(["compare", *names, "--person", "1.755,85,male", "--step", "50", "--json"]) == 0
    printed = json.loads(capsys.readouterr().out)["columns"]
    np.testing.assert_allclose(printed["common_peak_F_s_N"], table["common_peak_F_s_N"])
    for wrong in ((), (others[0],), (poses,)):
        with pytest.raises(InvalidInput):
            first.compare(*wrong)


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


def test_queries_with_limits_and_compare(prototype):
    exo, poses = prototype.worn_by(PERSON), adl_box(30.0)
    other = exo.replace(limbs=(ep.Limb("SPS"),) * 3, name="cables")
    table = exo.compare(other, poses, limits="pull")
    assert list(table["design"]) == ["prototype", "cables"]
    # The prototype's muscles have strokes besides; the cables have no actuator, so that "pull" is all that is known.
    assert table["holdable"][0] == 0.0
    assert table["holdable"][1] == table["pull_only"][1] == table["pull_only"][0]
    free = exo.compare(other, poses, split="minimal", limits="none")
    assert free["peak_F_s_N"][0] < 1e-5 < free["median_F_s_N"][1]
    assert 0 <= table["reach"][0] < 0.1
    assert np.isnan(table["reach"][1])  # strokes of the cables are not known


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
    from exo_pin.core.errors import MissingExtra

    monkeypatch.setitem(sys.modules, "pandas", None)
    with pytest.raises(MissingExtra, match=r"\.\[study\]"):
        StudyTable([{"a": 1.0}]).to_dataframe()


@pytest.mark.full
def test_two_processes_give_the_same_table(prototype):
    parameters = {"r_A": [0.12, 0.13, 0.14], "limb_kind": ["UPU", "SPS"]}
    poses = adl_box(50.0)
    one = ep.sweep(prototype, parameters, poses)
    local = type("Local", (), {"force_limits": staticmethod(lambda length: (0.0 * length, 400.0 + 0.0 * length))})
    with processes(2) as pool:
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
        ({"r_A": [0.1]}, {"jobs": 2}, "sweep has no argument jobs any more: give executor="),
        ({"r_A": [0.1]}, {"split": "fair"}, "spherical"),
    ],
)
def test_studies_that_cannot_be_meant(prototype, parameters, options, message):
    with pytest.raises(ep.InvalidInput, match=message):
        ep.sweep(prototype, parameters, adl_box(50.0), **options)


def run(capsys, *arguments):
    status = main(list(arguments))
    return status, *capsys.readouterr()


def test_sweep_on_the_command_line(capsys, tmp_path, prototype):
    path = tmp_path / "table.csv"
    vary = ["--vary", "r_A_mm=120:140:2", "--vary", "lean_forward_deg=0,30"]
    status, out, _ = run(capsys, "sweep", "prototype", *vary, "--step", "40", "--limits", "none", "--out", str(path))
    assert status == 0
    values = {"r_A": [0.12, 0.14], "lean_forward": np.radians([0, 30])}
    table = ep.sweep(prototype, values, adl_box(40.0), limits="none")
    rows = [line.split(",") for line in path.read_text().splitlines()]
    column = rows[0].index("median_F_s_N")
    np.testing.assert_allclose([float(row[column]) for row in rows[1:]], table["median_F_s_N"], rtol=1e-12)
    assert out.splitlines()[-1] == str(path)
    status, out, _ = run(
        capsys,
        "sweep",
        "prototype",
        "--vary",
        "limb_kind=UPU,SPS",
        "--step",
        "50",
        "--limits",
        "pull",
        "--split",
        "minimal",
    )
    assert status == 0
    for bad, message in (
        (["--vary", "r_A"], "NAME=VALUES"),
        (["--vary", "r_A=a"], "finite numbers for r_A"),
        (["--vary", "q=1"], "alpha_A"),
        (["--vary", "r_A=1:2:0.5"], "COUNT"),
        (["--vary", "r_A=0.1", "--step", "0"], "step"),
        (["--vary", "r_A=0.1", "--out", "table.txt"], ".csv"),
    ):
        status, out, err = run(capsys, "sweep", "prototype", *bad)
        assert (status, out) == (2, "")
        assert message in err


def test_movement_on_the_command_line(capsys, tmp_path, prototype):
    t = np.linspace(0, 1, 30)
    path, out_path = tmp_path / "reach.csv", tmp_path / "forces.csv"
    rows = "\n".join(f"{a!r},{20 + 30 * a!r},{10 + 20 * a!r},0.0" for a in t.tolist())
    path.write_text(f"time_s,flexion_deg,abduction_deg,internal_rotation_deg\n{rows}\n")
    arguments = ["reaction", "prototype", "--trajectory", str(path), "--out", str(out_path), "--person", "1.75,75,male"]
    status, out, _ = run(capsys, *arguments)
    assert status == 0
    answer = prototype.worn_by(PERSON).follow(ep.read_movement(path))
    assert f"{answer.peak:.4g}" in out
    assert out.splitlines()[-1] == str(out_path)
    assert len([line for line in out_path.read_text().splitlines() if not line.startswith("#")]) == 31
    status, out, _ = run(
        capsys, *arguments, "--limits", "pull", "--split", "minimal", "--side-force-limit", "30", "--static"
    )
    assert status == 0
    assert "beyond_limits" in out
    status, out, _ = run(capsys, "reaction", "prototype", "--flexion", "30", "--abduction", "20", "--limits", "pull")
    assert status == 0
    assert "One more muscle" in out
    for bad, message in (
        (["--trajectory", str(path), "--flexion", "3"], "poses of its own"),
        (["--trajectory", str(path), "--out", "x.txt"], ".csv or .npz"),
        (["--trajectory", str(tmp_path / "none.csv")], "cannot be read"),
        (["--limits", "5"], "MIN,MAX"),
    ):
        status, out, err = run(capsys, "reaction", "prototype", *bad)
        assert (status, out) == (2, "")
        assert message in err


def test_sweep_command_keeps_cables_from_pushing(capsys, tmp_path):
    path = tmp_path / "table.csv"
    arguments = ["four-cables", "--vary", "lean_forward_deg=0", "--step", "50", "--out", str(path)]
    assert run(capsys, "sweep", *arguments)[0] == 0
    header, row = path.read_text().splitlines()[-2:]
    figures = dict(zip(header.split(","), row.split(","), strict=True))
    cables = ep.load("four-cables")
    held = cables.reaction(ep.adl_box(50.0))
    assert held.has_answer.all()
    assert 0.0 < held.can_hold.mean() < 1.0
    assert float(figures["holdable"]) == pytest.approx(held.can_hold.mean())
    assert float(figures["peak_F_s_N"]) == pytest.approx(held.magnitude[held.can_hold].max(), rel=1e-5)


def test_default_design_holds_most_daily_poses_on_everyone():
    sizes = (ep.Wearer(1.525, 51, "female"), ep.Wearer(1.87, 111, "male"))
    names = ("stroke", "forces", "clearance")
    limits = ep.Criteria(names, wearers=sizes, elbow_range=np.radians([0.0, 130.0]))
    designs = [exo for exo in map(ep.load, ep.presets()) if exo.mechanism.limbs[0].stroke is not None]
    assert len(designs) == 8
    share = {exo.name: exo.workspace(20.0, limits).index for exo in designs}
    assert max(share, key=share.get) == DEFAULT_PRESET
    assert share["prototype"] < 0.01
