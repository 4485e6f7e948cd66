"""The comparison of all kinds of devices: its figures, the page's tables, and words that follow from them."""

import importlib
import itertools
import struct
import sys
from pathlib import Path

import numpy as np
import pytest

import exo_pin as ep

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
