"""``exo-pin person`` and ``exo-pin reaction --muscles``."""

import json
import re
import runpy
import sys

import numpy as np
import pytest
from places import REPOSITORY, SCRIPTS, page

pytest.importorskip("myo_sim", reason="needs the extra person: pip install '.[person]'")

import exo_pin as ep
from exo_pin.cli import main
from exo_pin.load_case.ranges_of_motion import ADL_BOX

PAGE = page("wearer_measured")


def run(capsys, *arguments):
    status = main(["person", *(str(argument) for argument in arguments)])
    return status, *capsys.readouterr()


def test_json_beside_a_picture_is_json(capsys, tmp_path):
    for more in (("--abduction", 40), ("--map", "--step", 110)):
        status, out, _ = run(capsys, "--bare", *more, "--json", "--plot", tmp_path / "picture.png")
        assert status == 0
        assert json.loads(out)
        assert (tmp_path / "picture.png").stat().st_size > 10_000


def test_contact_with_and_without_the_device(capsys):
    status, out, _ = run(capsys, "prototype", "--abduction", 60)
    assert status == 0
    # The prototype cannot hold this pose: no relief is claimed for forces that it cannot give.
    assert "the closest forces that it can give are taken" in out
    assert "less than without the device" not in out
    assert "limb 3 force, N" in out
    _, bare, _ = run(capsys, "prototype", "--abduction", 60, "--bare")
    assert "No device" in bare
    assert "The joint carries 489 N" in bare


def test_contact_as_json(capsys):
    _, out, _ = run(capsys, "--abduction", 60, "--share", 50, "--json", "--cubes", "--volumes", "--any-direction")
    data = json.loads(out)
    assert data["status"] == "ok"
    assert data["assumptions"]["criterion"].startswith("least sum of cubed activations, volume weights")
    assert data["without_device"]["magnitude"] > data["magnitude"]


def test_contact_with_chosen_limb_forces(capsys):
    _, out, _ = run(capsys, "--abduction", 45, "--least", "effort", "--limits", "0,400", "--moving-centre")
    assert "chosen together with the activations" in out


def test_contact_over_the_assumptions(capsys):
    _, out, _ = run(capsys, "--abduction", 60, "--bare", "--range")
    assert "no condition on the socket" in out
    assert "centre +5 mm up" in out


def test_contact_force_is_plotted(capsys, tmp_path):
    status, out, _ = run(capsys, "--flexion", 30, "--plot", tmp_path / "contact.png")
    assert status == 0
    assert out.strip().endswith("contact.png")
    assert (tmp_path / "contact.png").read_bytes().startswith(b"\x89PNG")


def test_person_is_described(capsys):
    _, out, _ = run(capsys, "--bare", "--person", "1.6,50,female", "--payload", 1, "--strength", 80, "--flexion", 30)
    build = out[out.index("\nPerson\n") :]
    person = ep.Person(1.6, 50, "female", strength=0.8, payload=1.0)
    assert build.split("\n", 2)[2].rstrip() == str(person)
    assert f"arm {person.arm.mass:.2f} kg with 1 kg in the hand" in build
    deltoid = person.muscle_table.force[:3].sum()
    assert f"deltoid {deltoid:.0f}," in build


@pytest.mark.full
def test_contact_along_a_movement(capsys, tmp_path):
    lift, table, picture = REPOSITORY / "examples" / "lift.csv", tmp_path / "c.csv", tmp_path / "c.png"
    status, out, _ = run(capsys, "four-cables", "--trajectory", lift, "--out", table, "--plot", picture)
    assert status == 0
    exo, movement = ep.load("four-cables"), ep.read_movement(lift)
    answer = exo.joint_contact(movement.poses, ep.Person(1.75, 75, "male"), motion=movement.motion, outside="mark")
    assert f"201 samples, the largest contact force at {movement.times[answer.peak_row]:.3g} s" in out
    assert answer.verdict in " ".join(out.split())
    columns = np.genfromtxt(table, delimiter=",", names=True, dtype=None, encoding="utf-8")
    np.testing.assert_allclose(columns["contact_N"], answer.magnitude, rtol=1e-9)
    np.testing.assert_allclose(columns["contact_without_device_N"], answer.without_device.magnitude, rtol=1e-9)
    angles = ep.shoulder_angles(movement.poses, exo.side, degrees=True)
    np.testing.assert_allclose(columns["flexion_deg"], angles[:, 0], atol=1e-9)
    deltoid = answer.activations[:, answer.muscles.index("DELT1")]
    np.testing.assert_allclose(columns["activation_DELT1"], deltoid, rtol=1e-9)
    assert answer.summary()["peak_contact_N"] == np.nanmax(answer.magnitude)
    assert picture.stat().st_size > 10_000


def test_map_over_the_box(capsys, tmp_path):
    status, out, _ = run(capsys, "four-cables", "--map", "--step", 55, "--plot", tmp_path / "map.png")
    assert status == 0
    poses = ADL_BOX.poses(55.0)
    result = ep.load("four-cables").joint_contact(poses, ep.Person(1.75, 75, "male"), outside="mark")
    good = np.isfinite(result.relief_percent)
    median = np.median(result.relief_percent[good])
    assert re.search(rf"relief, %, median +{median:.0f}\n", out)
    assert re.search(rf"less force, % +{100 * (result.relief_percent[good] > 0).mean():.0f}\n", out)
    assert f"{result.has_result.sum()} of {good.size} poses have a result" in out
    assert (tmp_path / "map.png").read_bytes().startswith(b"\x89PNG")
    _, bare, _ = run(capsys, "--bare", "--map", "--step", 110, "--json")
    assert np.shape(json.loads(bare)["magnitude"]) == (2, 2, 2)


def test_reaction_compares_with_the_muscles_of_the_wearer(capsys):
    pose = ["--flexion", "60", "--abduction", "30"]
    assert main(["reaction", "four-cables", *pose, "--person", "1.75,75,male", "--explain"]) == 0
    text = " ".join(capsys.readouterr().out.split())
    person, exo = ep.Person(1.75, 75, "male"), ep.load("four-cables")
    orientation = exo.pose(60, 30, 0)
    worn = exo.worn_by(person)
    contact = worn.joint_contact(orientation, person, worn.reaction(orientation))
    assert f"carries {contact.without_device.magnitude:.0f} N without the device" in text
    assert f"and {contact.magnitude:.0f} N with it, {contact.relief_percent:.0f} % less" in text
    assert main(["reaction", "four-cables", *pose, "--person", "1.75,75,male", "--muscles", "--json"]) == 0
    data = json.loads(capsys.readouterr().out)["with_muscles"]
    assert data["magnitude"] == pytest.approx(contact.magnitude, rel=1e-6)
    # A pose without limb forces still has its yardstick.
    assert (
        main(["reaction", "prototype", "--abduction", "90", "--person", "1.75,75,male", "--muscles", "--explain"]) == 0
    )
    text = " ".join(capsys.readouterr().out.split())
    assert "N without the device" in text
    assert "The device has no limb forces in this pose." in text


@pytest.mark.parametrize(
    "more",
    [
        ["--no-muscles"],
        ["--elbow-flexion", "140"],  # beyond the joint of the model
        ["--internal-rotation", "120"],  # outside the range of motion
        ["not installed"],
    ],
)
def test_reaction_has_its_usual_yardstick_where_muscles_cannot_be_counted(capsys, monkeypatch, more):
    if more == ["not installed"]:
        monkeypatch.setitem(sys.modules, "clarabel", None)
        more = []
    assert main(["reaction", "four-cables", "--flexion", "60", "--person", "1.75,75,male", "--explain", *more]) == 0
    out = capsys.readouterr().out
    assert "For comparison: at this elevation a bare arm loads" in out
    assert "With the wearer's own muscles" not in out


@pytest.mark.parametrize("more", [["--table"], ["--compare"], ["--json"]])
def test_tables_have_muscles_only_on_request(capsys, more):
    query = ["reaction", "four-cables", "--flexion", "60", "--person", "1.75,75,male", *more]
    assert main(query) == 0
    plain = capsys.readouterr().out
    assert "own muscles" not in plain
    assert "with_muscles" not in plain
    assert main([*query, "--muscles"]) == 0
    with_them = capsys.readouterr().out
    assert "own muscles" in with_them or "with_muscles" in with_them


@pytest.mark.parametrize(
    ("arguments", "message"),
    [
        (["--muscles"], "--person"),
        (["--muscles", "--person", "1.75,75,male", "--trajectory", "none.csv"], "exo-pin person --trajectory"),
    ],
)
def test_muscles_need_a_person_and_a_pose(capsys, arguments, message):
    assert main(["reaction", *arguments]) == 2
    assert message in capsys.readouterr().err


@pytest.mark.parametrize(
    ("arguments", "message"),
    [
        (("--share", 50, "--least", "effort"), "one of the two"),
        (("--limits", "push"), "limits"),
        (("--bare", "--share", 50), "without a device"),
        (("--range", "--out", "x.csv"), "leave out --out"),
        (("--trajectory", "x.csv", "--flexion", 30), "poses of its own"),
        (("--range", "--map"), "give one of them"),
        (("--map", "--flexion", 30), "poses of its own"),
        (("--bare", "--side-force-limit", 30), "without a device"),
        (("--side-force-limit", -30), "zero or more"),
        (("--abduction", 200), "plane of elevation"),
        (("--person", "tall"), "HEIGHT,MASS,SEX"),
        (("--elbow-flexion", 150), "130"),
    ],
)
def test_wrong_options_give_one_line(capsys, arguments, message):
    status, out, err = run(capsys, *arguments)
    assert status == 2
    assert message in err
    assert out == ""


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
