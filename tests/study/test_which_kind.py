"""The comparison of all kinds of devices: its figures, the page's tables, and words that follow from them."""

import importlib
import itertools
import struct
import sys
from pathlib import Path

import numpy as np
import pytest

import exo_pin as ep
from exo_pin import InvalidInput
from exo_pin.cli import main

ROOT = Path(__file__).parents[2]
PAGE = (ROOT / "docs" / "evidence" / "which_kind.md").read_text(encoding="utf-8")
FEW = ((60.0, 0.0, 0.0), (0.0, 60.0, 0.0), (30.0, 45.0, 30.0))


@pytest.fixture(scope="module")
def study():
    """The script that writes the page."""
    sys.path.insert(0, str(ROOT / "benchmarks"))
    try:
        return importlib.import_module("compare_devices")
    finally:
        sys.path.remove(str(ROOT / "benchmarks"))


@pytest.fixture(scope="module")
def tables(study):
    found = study.read(PAGE)
    assert list(found) == list(study.DEVICES)
    assert {len(cells) for cells in found.values()} == {sum(map(len, study.TABLES))}
    return found


def detailed(exo, poses, other=None, **question):
    """All figures of a device and of another one, or of one alone."""
    table = exo.compare(exo if other is None else other, poses=poses, detailed=True, **question)
    rows = [{name: table[name][row] for name in table} for row in range(2)]
    return rows[0] if other is None else rows


def on_an_arm(exo):
    """The device on an arm that is nobody's, of which no contact is asked."""
    return exo.replace(arm=ep.Arm(exo.arm.mass, exo.arm.centre_of_mass, exo.arm.inertia))


def within_reach(status):
    return ~np.isin(status, ("out_of_reach", "beyond_singular", "out_of_stroke"))


def check_rows(study, tables, names):
    pytest.importorskip("myo_sim")
    tables_of = (study.compared(names, bend, progress=False) for bend in (0.0, study.BEND))
    assert study.texts(*tables_of) == {name: tables[name] for name in names}


@pytest.mark.full
def test_rows_of_the_page_come_back(study, tables):
    check_rows(study, tables, ["three-linear-actuators", "four-cables", "spherical-3rrr", "spring-support"])


@pytest.mark.long
def test_all_rows_of_the_page_come_back(study, tables):
    check_rows(study, tables, study.DEVICES)


@pytest.mark.full
def test_its_picture_is_drawn_as_it_is_committed(study, tmp_path):
    """From one pose: the poses of the page take a minute and a half, and the picture is as large."""
    pytest.importorskip("myo_sim")
    first, *others = map(study.device, study.DEVICES)
    found = first.compare(*others, poses=first.pose(60, 30), detailed=True)
    found.plot().savefig(tmp_path / "drawn.png", dpi=200)
    files = (tmp_path / "drawn.png", ROOT / "docs" / "pictures" / "which_kind.png")
    drawn, committed = (struct.unpack(">II", path.read_bytes()[16:24]) for path in files)
    assert drawn == committed


def test_the_page_shows_the_command_of_these_devices(study):
    command = PAGE.split("exo-pin compare")[1].split("```")[0].replace("\\\n", "")
    given = [word.removeprefix("urdf/").removesuffix(".urdf") for word in command.split()]
    assert given[: len(study.DEVICES)] == list(study.DEVICES)
    assert (
        f"--person {study.MAN['height']},{study.MAN['mass']:.0f},{study.MAN['sex']} --step {study.STEP:.0f}" in command
    )
    assert "--detailed" in given


@pytest.mark.full
def test_the_command_is_the_function(tmp_path, capsys):
    pytest.importorskip("myo_sim")
    names = ["four-cables", "prototype"]
    question = ["--person", "1.755,85,male", "--flexion", "60", "--to", "90,30,0", "--poses", "3"]
    picture, data = tmp_path / "which.png", tmp_path / "which.csv"
    files = ["--detailed", "--out", str(data), "--plot", str(picture)]
    assert main(["compare", *names, *question, *files]) == 0
    out = capsys.readouterr().out
    first, other = (ep.load(name).worn_by(ep.Wearer(1.755, 85, "male")) for name in names)
    poses = first.pose([60.0, 75.0, 90.0], [0.0, 15.0, 30.0])
    table = first.compare(other, poses=poses, detailed=True)
    heads, *rows = (line.split(",") for line in data.read_text().splitlines())
    assert heads == list(table)
    for name in ("relief", "held_after_failure", "change_by_10_mm_N", "stroke_mm"):
        assert name in out
        read = [float(row[heads.index(name)] or "nan") for row in rows]
        np.testing.assert_allclose(read, table[name], rtol=1e-9)
    assert picture.stat().st_size > 10_000
    assert table["relief"][0] > 0.5
    assert np.isnan(table["relief"][1])  # it holds none of the poses
    with pytest.raises(InvalidInput, match="centre_offset"):
        first.compare(other, poses=poses, detailed=True, centre_offset=[0.0, 0.0, 0.01])


def test_what_each_figure_counts(study):
    pytest.importorskip("myo_sim")
    exo = study.device("four-cables")
    poses = ep.adl_box(50.0)
    answer = exo.reaction(poses)
    held = answer.held
    assert 0 < held.sum() < held.size
    figures = detailed(exo, poses)
    assert figures["effort_N"] == pytest.approx(answer.actuator_forces[held].max())
    assert figures["effort_share"] == pytest.approx(answer.actuator_forces[held].max() / 400.0)
    lengths = exo.inverse_kinematics(poses).lengths[within_reach(answer.status)]
    assert figures["stroke_mm"] == pytest.approx(1e3 * np.ptp(lengths, axis=0).max())
    assert np.isnan([figures["effort_Nm"], figures["stroke_deg"]]).all()
    own = exo.joint_contact(poses, ep.Person(**study.MAN), forces=answer, outside="mark")
    known = held & np.isfinite(own.magnitude)
    assert figures["contact_N"] == pytest.approx(np.median(own.magnitude[known]))
    assert figures["relief"] == pytest.approx(np.median((1.0 - own.magnitude / own.without_device.magnitude)[known]))


@pytest.mark.full
def test_any_list_of_poses_is_compared(study):
    """A grid and a single pose, of a wrist and of a passive device; the arm hangs in one."""
    pytest.importorskip("myo_sim")
    cables, support = study.device("four-cables"), study.device("spring-support")
    for poses in (cables.pose([[0.0, 60.0, 90.0]]), cables.pose(60.0)):
        table = cables.compare(support, poses=poses, detailed=True)
        assert table["relief"][0] > 0.5
        assert 0.4 < table["left_to_wearer"][1] < 1.0
    rest = cables.pose([0.0])
    assert np.isnan(detailed(support, rest)["left_to_wearer"])


def test_ten_millimetres_are_the_worst_of_all_directions(study):
    exo = on_an_arm(study.device("four-cables"))
    pose = exo.pose(*FEW[2])
    found = detailed(exo, pose)
    rng = np.random.default_rng(3)
    directions = rng.normal(size=(300, 3))
    offsets = 0.01 * directions / np.linalg.norm(directions, axis=1, keepdims=True)
    there = exo.reaction(pose, limits="none").shoulder_force
    stack = exo.pose(*(np.full(300, angle) for angle in FEW[2]))
    moved = exo.reaction(stack, limits="none", centre_offset=ep.CentreOffset(offsets, offsets)).shoulder_force
    worst = np.linalg.norm(moved - there, axis=1).max()
    # 26 directions are at most 27.4° from any other.
    assert 0.88 * worst < found["change_by_10_mm_N"] < 1.02 * worst
    assert found["follows_10_mm"] == 1.0


@pytest.mark.full
def test_a_soft_cuff_is_compared_on_a_wrist_and_on_its_own_chain(study):
    exo = on_an_arm(study.device("four-linear-actuators"))
    chain = ep.ShoulderExo.from_chain(exo.chain)
    pose = exo.pose(20.0, 30.0)
    wrist, other = detailed(exo, pose, chain.replace(arm=exo.arm))
    assert wrist["change_on_cuff_N"] > 0.0
    for name in ("change_by_10_mm_N", "follows_10_mm", "change_on_cuff_N"):
        np.testing.assert_allclose(other[name], wrist[name], rtol=1e-9, err_msg=name)
    # By hand: the cuff is at the mean of the joints on the arm.
    cuff = ep.Interface.upper_arm_cuff(-exo.geometry.platform_points[:, 2].mean())
    soft = exo.replace(interfaces=ep.Interfaces(cuff=cuff))
    there = soft.reaction(pose, split="elastic", limits="none").shoulder_force
    ways = np.array([way for way in itertools.product((-1.0, 0.0, 1.0), repeat=3) if any(way)])
    offsets = 0.01 * ways / np.linalg.norm(ways, axis=1, keepdims=True)
    stack = exo.pose(np.full(26, 20.0), np.full(26, 30.0))
    moved = soft.reaction(stack, split="elastic", limits="none", centre_offset=offsets).shoulder_force
    change = np.linalg.norm(moved - there, axis=1).max()
    np.testing.assert_allclose(wrist["change_on_cuff_N"], change, rtol=1e-9)


def test_which_devices_pull_the_arm_from_its_socket(study):
    for name, sign in {"four-cables": 1, "six-cables": 1, "spherical-3rrr": -1, "3rps-passive-ball": -1,
                       "serial-y-x-z": -1, "nesm": -1}.items():  # fmt: skip
        exo = study.device(name)
        poses = exo.pose(*np.transpose(FEW))
        along = -poses.as_matrix()[:, :, 2]
        assert ((exo.reaction(poses).shoulder_force * along).sum(axis=1) * sign > 10.0).all()


@pytest.mark.full
def test_a_lost_drive_is_one_without_effort(study):
    poses = ep.adl_box(50.0)
    cables, eye = (on_an_arm(study.device(name)) for name in ("six-cables", "spherical-3rrr"))
    geometry, shares = cables.geometry, []
    for lost in range(6):
        keep = np.delete(np.arange(6), lost)
        five = ep.WristGeometry(geometry.base_points[keep], geometry.platform_points[keep])
        shares.append(cables.replace(geometry=five, limbs=[cables.limbs[k] for k in keep]).reaction(poses).held.mean())
    assert min(shares) > 0.3
    figures = [row["held_after_failure"] for row in detailed(cables, poses, eye)]
    assert figures[0] == pytest.approx(min(shares))
    # Numbers only narrow what a design can do: without its limits there is no such question.
    assert np.isnan(detailed(cables, poses[0], limits="none")["held_after_failure"])
    drives = [eye.device.drives[0].idle(), *eye.device.drives[1:]]
    assert figures[1] == eye.replace(drives=drives).reaction(poses).held.mean() == 0.0


def test_the_3rps_does_not_hold_turning_about_the_arm(study):
    poses, exo = ep.adl_box(50.0), study.device("3rps-passive-ball")
    found = exo.singularity(poses)
    assert (found.kind == "passive").all()
    assert np.abs((found.lost_direction * poses.as_matrix()[..., 2]).sum(axis=-1)).min() > 1.0 - 1e-9
    assert exo.reaction(poses).can_hold.all()


def test_what_a_bent_elbow_asks_of_the_wearer_of_a_3rps(study, tables):
    arm = ep.Arm.from_anthropometry(1.755, 85, sex="male", elbow_flexion=90, degrees=True)
    answer = study.device("3rps-passive-ball").worn_by(arm).reaction(ep.adl_box(study.STEP))
    moments = np.linalg.norm(answer.actuator_forces[..., 3:], axis=-1)
    assert not answer.can_hold.any()
    text = f"leaves its wearer {np.median(moments):.1f} N m (median, at most {moments.max():.1f})"
    assert text in " ".join(PAGE.split())
    assert tables["3rps-passive-ball"]["held, %"] == "100"
    assert tables["3rps-passive-ball"]["90°: held, %"] == "0"


@pytest.mark.full
def test_where_a_bent_arm_has_more_contact_with_a_device_than_without(study, tables):
    pytest.importorskip("myo_sim")
    poses, words = ep.adl_box(study.STEP), " ".join(PAGE.split())
    man = ep.Wearer(**study.MAN, elbow_flexion=study.BEND, degrees=True)
    for name, text in (
        ("three-linear-actuators", "the contact is {:.0f} N, where the arm without device has {:.0f} N"),
        ("spring-support", "the joint bears {:.0f} N, where the arm without device has {:.0f} N"),
    ):
        exo = study.device(name).worn_by(man)
        answer = exo.reaction(poses, limits="none" if name == "spring-support" else "design")
        person = ep.Person(**study.MAN, elbow_flexion=man.elbow_flexion)
        found = exo.joint_contact(poses, person, answer, outside="mark")
        force = np.where(answer.held & np.isfinite(found.magnitude), found.magnitude, 0.0)
        there = np.unravel_index(force.argmax(), force.shape)
        assert f"{force.max():.0f}" == tables[name]["90°: peak contact, N"]
        assert text.format(force.max(), found.without_device.magnitude[there]) in words


def test_the_serial_device_ends_where_it_is_singular(study):
    exo = study.device("serial-y-x-z")
    there = within_reach(exo.reaction_map(ep.adl_box(study.STEP)).status)
    assert there[:, :-1].all()
    assert not there[:, -1].any()
    # The smallest singular value falls with the cosine of the abduction.
    J = exo.jacobian(exo.pose(30, [80.0, 89.0]))
    values = np.linalg.svd(J, compute_uv=False)
    far, near = values[:, 2] / values[:, 0]
    assert near < 0.05 < far
    assert near / far == pytest.approx(np.cos(np.radians(89)) / np.cos(np.radians(80)), rel=0.05)


def test_a_passive_device_counts_with_its_wearer(study):
    exo, poses = study.device("spring-support"), ep.adl_box(50.0)
    table = exo.compare(study.device("four-cables"), poses=poses)
    assert table["holdable"][0] == 0.0
    assert table["median_F_s_N"][0] == pytest.approx(np.median(exo.reaction(poses, limits="none").magnitude))
    assert np.isfinite(table["common_peak_F_s_N"]).all()


def test_what_the_lift_asks(study):
    """In motion nothing changes for the designs of the box that hold the arm about every axis."""
    lift = ep.read_movement(ROOT / "examples" / "lift.csv", side="left")
    every = slice(None, None, 10)
    motion = ep.Motion(lift.motion.angular_velocity[every], lift.motion.angular_acceleration[every])
    shares = {
        name: study.device(name).reaction_map(lift.poses[every], motion=motion).held.mean()
        for name in study.DEVICES
        if name != "spring-support"
    }
    whole = {name for name, share in shares.items() if share == 1.0}
    # The arm turns about itself, too, and the 3RPS does not: the wearer takes the few mN m, and does not feel them.
    assert whole == set(shares) - {"prototype", "optimised-table-c-2", "nesm"}
    assert 0.2 < shares["nesm"] < 0.5
    assert shares["prototype"] == shares["optimised-table-c-2"] == 0.0


def test_words_of_the_page_are_its_tables(study, tables):
    def number(name, head):
        return float(tables[name][head].split(" ")[0])

    words = " ".join(PAGE.split())
    pulling = ["spherical-3rrr", "3rps-passive-ball", "serial-y-x-z", "nesm"]
    limbs = ["three-linear-actuators", "four-linear-actuators-worn", "four-cables", "six-cables"]
    active = [*limbs, *pulling]
    values = {
        "pull_low": min(number(name, "median F_s, N") for name in pulling),
        "pull_high": max(number(name, "median F_s, N") for name in pulling),
        "pull_contact": max(number(name, "median contact, N") for name in pulling),
        "relief": min(number(name, "relief, %") for name in active),
        "bent_change": max(
            abs(number(name, "held, %") - number(name, "90°: held, %"))
            for name in tables
            if name != "3rps-passive-ball"
        ),
        "limbs_low": min(number(name, "change by 10 mm, N") for name in limbs),
        "limbs_high": max(number(name, "change by 10 mm, N") for name in limbs),
        "moves": number("spherical-3rrr", "on the arm, kg") + number("spherical-3rrr", "other links, kg"),
        "rps": number("3rps-passive-ball", "on the arm, kg") + number("3rps-passive-ball", "other links, kg"),
        "serial": number("serial-y-x-z", "on the arm, kg") + number("serial-y-x-z", "other links, kg"),
    }
    cell = {f"{name} {head}": text for name, cells in tables.items() for head, text in cells.items()}
    for text in (
        "F_s of {pull_low:.0f} to {pull_high:.0f} N (median)",
        "gives a contact of at most {pull_contact:.0f} N (median)",
        "{six-cables median contact, N} N with six cables",
        "relieve the joint by {relief:.0f} % or more (median)",
        "The shares of the other devices change by {bent_change:.0f} % at most",
        "four cables are clear in {four-cables clear, %} % of the poses with a straight elbow and in "
        "{four-cables 90°: clear, %} % with a bent one",
        "found with the elbow bent, are clear in {four-linear-actuators-worn clear, %} % either way",
        "the peak of F_s with three actuators is {three-linear-actuators 90°: peak F_s, N} N in place of "
        "{three-linear-actuators peak F_s, N} N",
        "limbs between two balls at {limbs_low:.0f} to {limbs_high:.0f} N",
        "{serial-y-x-z on a soft cuff, N} N on a measured cuff",
        "The 3RPS follows, at {3rps-passive-ball change by 10 mm, N} N",
        "hold {four-linear-actuators-worn held after a failure, %} % of the box and six cables "
        "{six-cables held after a failure, %} %",
        "Four cables hold {four-cables held after a failure, %} %",
        "Serial devices move {serial:.0f} kg",
        "{serial-y-x-z on the arm, kg} kg are on the arm",
        "The 3RRR moves {moves:.2f} kg",
        "the 3RPS {rps:.2f} kg",
        "relieves the joint by {spring-support relief, %} %",
    ):
        filled = text
        for key, value in cell.items():
            filled = filled.replace(f"{{{key}}}", value)
        assert filled.format(**values) in words
    for name in ("serial-y-x-z", "nesm", "spherical-3rrr"):
        assert (tables[name]["follows 10 mm, %"], tables[name]["undetermined"]) == ("0", "3")
        assert tables[name]["on a soft cuff, N"] == tables["nesm"]["on a soft cuff, N"]
    for name in ("prototype", "optimised-table-c-2", "three-linear-actuators", *pulling):
        assert tables[name]["held after a failure, %"] == "0"
    assert tables["four-linear-actuators-worn"]["90°: clear, %"] == tables["four-linear-actuators-worn"]["clear, %"]
    assert number("prototype", "stroke, mm") / 0.25 == pytest.approx(1100.0, abs=50.0)
    assert tables["spherical-3rrr"]["held, %"] == tables["3rps-passive-ball"]["held, %"] == "100"
    assert tables["spherical-3rrr"]["singular, %"] == tables["prototype"]["reached, %"] == "0"


def test_what_a_spring_leaves(study):
    exo, poses = study.device("spring-support"), ep.adl_box(study.STEP)
    person = ep.Person(**study.MAN).arm
    weight = np.cross(poses.as_matrix() @ person.centre_of_mass, person.mass * exo.device.gravity)
    moments = exo.reaction(poses, limits="none").actuator_forces
    left = np.median(np.linalg.norm(moments, axis=-1) / np.linalg.norm(weight, axis=-1))
    assert f"leaves the wearer {100.0 * left:.0f} % of the moments" in " ".join(PAGE.split())
