"""The comparison of all kinds of devices: the page's tables are computed again, and its words follow from them."""

import importlib
import sys
import warnings
from pathlib import Path
from types import SimpleNamespace

import numpy as np
import pytest

import exo_pin as ep

ROOT = Path(__file__).parents[2]
PAGE = (ROOT / "docs" / "concepts" / "which_kind.md").read_text(encoding="utf-8")


@pytest.fixture(scope="module")
def study():
    """The script and its tables as one."""
    sys.path.insert(0, str(ROOT / "benchmarks"))
    try:
        found = importlib.import_module("compare_devices")
        return SimpleNamespace(**(vars(importlib.import_module("device_tables")) | vars(found)))
    finally:
        sys.path.remove(str(ROOT / "benchmarks"))


@pytest.fixture(scope="module")
def tables(study):
    merged = {}
    for heads in (study.HOLDING, study.SHOULDER, study.DRIVES):
        for name, texts in study.cells(PAGE, heads).items():
            merged.setdefault(name, {}).update(texts)
    assert list(merged) == list(study.DEVICES)
    return merged


def computed(study, name, whole):
    with warnings.catch_warnings():
        warnings.simplefilter("ignore", ep.OutsideHumanRange)
        found = study.figures(name, whole)
    return found, study.row(name, found) | study.drive_row(name, found)


@pytest.mark.parametrize("name", ["four-cables", "spring-support"])
def test_rows_of_the_page_come_back(study, tables, name):
    _, texts = computed(study, name, False)
    for key in tables[name].keys() - {"contact", "relief", "cuff"}:
        assert tables[name][key] == (texts[key] or "-"), key


@pytest.mark.full
def test_all_rows_of_the_page_come_back(study, tables):
    pytest.importorskip("myo_sim")
    for name in study.DEVICES:
        assert tables[name] == {key: text or "-" for key, text in computed(study, name, True)[1].items()}, name


def test_contact_of_devices_that_are_no_wrists(study, tables):
    pytest.importorskip("myo_sim")
    for name in ("spring-support", "serial-y-x-z"):
        with_device, without = study.contacts(study.device(name))
        assert tables[name]["contact"] == ", ".join(map(study.number, with_device))
        assert tables[name]["relief"] == ", ".join(map(study.number, 100.0 * (1.0 - with_device / without)))


def test_which_devices_pull_the_arm_from_its_socket(study):
    for name, sign in {"four-cables": 1, "six-cables": 1, "spherical-3rrr": -1, "3rps-passive-ball": -1,
                       "serial-y-x-z": -1, "nesm": -1}.items():  # fmt: skip
        exo = study.device(name)
        poses = exo.pose(*np.transpose(study.FEW))
        along = -poses.as_matrix()[:, :, 2]
        assert ((exo.reaction(poses).shoulder_force * along).sum(axis=1) * sign > 10.0).all()


def test_a_lost_drive_is_one_without_effort(study):
    exo, poses = study.device("spherical-3rrr"), ep.adl_box(50.0)
    drives = [exo.device.drives[0], *exo.device.drives[1:]]
    lost = exo.replace(drives=[type(drives[0])(drives[0].name, drives[0].joint, lower=0.0, upper=0.0), *drives[1:]])
    assert study.held_after_failure(exo, poses)[0] == lost.reaction(poses).held.mean() == 0.0


def test_the_3rps_hardly_holds_turning_about_the_arm(study):
    poses = ep.adl_box(50.0)
    axes = study.device("3rps-passive-ball").singularity(poses).lost_direction
    assert np.abs((axes * poses.as_matrix()[..., 2]).sum(axis=-1)).min() > 0.98


def test_the_serial_device_ends_where_it_is_singular(study):
    exo = study.device("serial-y-x-z")
    there = study.within_travel(exo.reaction(ep.adl_box(study.STEP)))
    assert there[:, :-1].all()
    assert not there[:, -1].any()
    # The smallest singular value falls with the cosine of the abduction.
    far, near = study.dexterity(exo, exo.pose(30, [80.0, 89.0]))
    assert near < study.NEAR < far
    assert near / far == pytest.approx(np.cos(np.radians(89)) / np.cos(np.radians(80)), rel=0.05)


def test_words_of_the_page_are_its_tables(study, tables):
    def number(name, key, part=0):
        return float(tables[name][key].split(" ")[part].strip(","))

    words = " ".join(PAGE.split())
    active = [name for name in study.DEVICES if tables[name]["contact"] != "-, -, -" and name != "spring-support"]
    reliefs = {
        name: [float(part) for part in tables[name]["relief"].split(", ")]
        for name in study.DEVICES
        if "-" not in tables[name]["relief"]
    }
    assert f"relieve the joint by {min(min(reliefs[name]) for name in active):.0f} % or more" in words
    support = reliefs["spring-support"]
    assert f"relieves the joint by {min(support):.0f} to {max(support):.0f} %" in words
    left = np.median(study.wearers_share(study.device("spring-support"), ep.adl_box(study.STEP)))
    assert f"leaves the wearer {100.0 * left:.0f} % of the moments" in words
    pulling = ["serial-y-x-z", "nesm", "spherical-3rrr", "3rps-passive-ball"]
    medians = [number(name, "median") for name in pulling]
    assert f"F_s of {min(medians):.0f} to {max(medians):.0f} N (median)" in words
    most = max(float(part) for name in pulling for part in tables[name]["contact"].split(", "))
    assert f"a contact of at most {most:.0f} N" in words
    limbs = [
        number(n, "off") for n in ("three-linear-actuators", "four-linear-actuators-worn", "four-cables", "six-cables")
    ]
    assert f"10 mm change F_s by {min(limbs):.0f} to {max(limbs):.0f} N" in words
    for name in ("serial-y-x-z", "nesm", "spherical-3rrr"):
        assert (tables[name]["off"], tables[name]["open"]) == ("cannot follow", "3")
        assert f"On a measured cuff 10 mm change F_s by {tables[name]['cuff']} N, the same for all three" in words
    for name in study.DEVICES:
        if tables[name]["effort"].count(",") == 2:
            assert tables[name]["failed"] == "0"
    own = {
        name: number(name, "moving") + number(name, "links")
        for name in ("spherical-3rrr", "3rps-passive-ball", "serial-y-x-z")
    }
    assert f"Serial devices move {own['serial-y-x-z']:.0f} kg" in words
    for text in (
        f"{number('six-cables', 'contact'):.0f} N at 60° of flexion with six cables",
        "{0[four-linear-actuators-worn][failed]} % of the box and six cables {0[six-cables][failed]} %",
        "Four cables hold {0[four-cables][failed]} %",
        "{0[serial-y-x-z][moving]} kg are on the arm",
        f"The 3RRR moves {own['spherical-3rrr']:.2f} kg",
        f"the 3RPS {own['3rps-passive-ball']:.2f} kg",
        "the serial device uses {0[serial-y-x-z][share]} % of its 92 N m",
        "nearly singular in {0[3rps-passive-ball][singular]} % of them",
        "ask for {0[three-linear-actuators][share]} % of their force",
        "ask for {0[four-cables][share]} % of their force",
        "{0[three-linear-actuators][peak]} N and {0[four-cables][peak]} N there",
        "{0[spherical-3rrr][dexterity]} for the 3RRR, {0[prototype][dexterity]} and ",
        "{0[prototype][dexterity]} and {0[optimised-table-c-2][dexterity]} for the wrists",
        "reaches: {0[three-linear-actuators][dexterity]}, with {0[three-linear-actuators][share]} % of its effort",
        "where the 3RRR needs {0[spherical-3rrr][share]} %",
        "{0[three-linear-actuators][useful]} % of the poses are held and clear, {0[spherical-3rrr][useful]} % with",
        "are clear in {0[spherical-3rrr][clear]} %",
        "({0[three-linear-actuators][singular]} %, none for the 3RRR)",
        "clear in {0[prototype][clear]} % and {0[optimised-table-c-2][clear]} % of the poses",
        "reaches {0[serial-y-x-z][reached]} % of the box",
        "Its links are clear in {0[serial-y-x-z][clear]} %",
        "NESM's travel reaches {0[nesm][reached]} %, with links clear in {0[nesm][clear]} %",
        f"by up to {number('prototype', 'travel'):.0f} mm",
        "no cable of six pulls more than 93 N",
    ):
        assert text.format(tables) in words
    assert max(float(part) for part in tables["six-cables"]["effort"].removesuffix(" N").split(", ")) == 93.0
    assert number("prototype", "travel") / 0.25 == pytest.approx(1100.0, abs=50.0)
    assert tables["spherical-3rrr"]["held"] == tables["3rps-passive-ball"]["held"] == "100"
    assert tables["spherical-3rrr"]["singular"] == tables["prototype"]["reached"] == "0"
