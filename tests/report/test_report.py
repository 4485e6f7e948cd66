"""The report on a design: its fields beside the questions they answer, and its pages beside its fields."""

import hashlib
import re
from dataclasses import replace
from html import escape

import numpy as np
import pytest
from places import URDF
from scipy.spatial.transform import Rotation

import exo_pin as ep
from exo_pin.load_case.ranges_of_motion import ADL_BOX, DAILY_RANGES
from exo_pin.report.content import sections_of
from exo_pin.report.pages import html_page

MAN = ep.Person(1.75, 75, "male")
#: What a clinician would have to look up.
TERMS = re.compile(r"F_s|\(g|\b[a-z]+_[a-z]+\b|\bnan\b|\binf\b|\bNone\b|self-stress|wrench|undetermined|\[")


def text_of(report):
    """All print of the pages but names of drives and files."""
    cells = [report.verdict]
    for section in sections_of(report):
        cells += [section.title, *section.texts, *section.head, section.source]
        cells += [cell for row in section.rows for cell in row]
    text = "\n".join(cells)
    for drive in report.drives:
        text = text.replace(drive.name, "drive")
    return text


@pytest.fixture(scope="module")
def exo():
    return ep.load("four-linear-actuators-worn").worn_by(MAN)


@pytest.fixture(scope="module")
def report(exo):
    return exo.report(MAN)


@pytest.mark.full
def test_postures_and_tasks_are_those_of_the_questions(exo, report):
    for posture in report.postures:
        pose = exo.pose(posture.flexion_deg, posture.abduction_deg, posture.internal_rotation_deg)
        answer, contact = exo.reaction(pose), exo.joint_contact(pose, MAN, exo.reaction(pose))
        assert posture.holds == ("yes" if answer.can_hold else "no")
        assert posture.joint_N == pytest.approx(float(contact.magnitude), rel=1e-6)
        assert posture.joint_without_N == pytest.approx(float(contact.without_device.magnitude), rel=1e-6)
        parts = [posture.push_out_N, posture.push_up_N, posture.push_forward_N]
        np.testing.assert_allclose(contact.glenoid.T @ parts, -answer.shoulder_force, atol=1e-9)
    for task, box in zip(report.tasks, DAILY_RANGES, strict=True):
        axes = [np.linspace(*ends, 3) for ends in box.intervals]
        poses = exo.pose(*(axis.ravel() for axis in np.meshgrid(*axes, indexing="ij")))
        answer = exo.reaction(poses)
        contact = exo.joint_contact(poses, MAN, answer, outside="mark")
        bare = contact.without_device
        known = answer.held & contact.has_result & bare.has_result
        assert task.held_percent == pytest.approx(100.0 * answer.held.mean())
        assert task.joint_N == pytest.approx(np.median(contact.magnitude[known]))
        assert task.joint_peak_N == pytest.approx(contact.magnitude[known].max())
        assert task.relief_percent == pytest.approx(np.median(contact.relief_percent[known]))


@pytest.mark.full
def test_drives_are_what_the_poses_ask_of_them(exo, report):
    grid = ADL_BOX.poses(30.0)
    box = Rotation.from_quat(grid.as_quat().reshape(-1, 4))
    answer, found = exo.reaction(box), exo.workspace(grid)
    held = answer.held
    force, lengths = answer.actuator_forces[held], exo.inverse_kinematics(box).lengths[held]
    # Lengths one step of the fastest turn later, by finite differences.
    turn, step = np.radians(report.arm_speed_deg_s), 1e-6
    for k, drive in enumerate(report.drives):
        assert drive.pull == pytest.approx(force[:, k].max())
        assert drive.push == pytest.approx(-force[:, k].min())
        assert (drive.limit_pull, drive.limit_push) == (600.0, 600.0)
        assert drive.share_percent == pytest.approx(100.0 * np.abs(force[:, k]).max() / 600.0)
        assert (drive.used_from, drive.used_to) == pytest.approx((lengths[:, k].min(), lengths[:, k].max()))
        rates = []
        for axis in np.eye(3):
            ahead = exo.inverse_kinematics(Rotation.from_rotvec(step * axis) * box).lengths[held]
            rates.append((ahead - lengths)[:, k] / step)
        speed = turn * np.linalg.norm(rates, axis=0)
        assert drive.speed == pytest.approx(speed.max(), rel=1e-4)
        assert drive.power_W == pytest.approx((speed * np.abs(force[:, k])).max(), rel=1e-4)
    assert report.held_percent == pytest.approx(100.0 * held.mean())
    assert report.inside_percent == pytest.approx(100.0 * found.index)
    assert report.criteria_percent["clearance"] == pytest.approx(100.0 * found.fractions["clearance"])
    one = exo.reaction(grid[found.inside], limits=([0.0, -np.inf, -np.inf, -np.inf], [0.0, np.inf, np.inf, np.inf]))
    assert report.drives[0].held_without_percent == pytest.approx(100.0 * one.held.mean(), abs=1.0)
    assert report.cuff_pull_N == pytest.approx(np.abs(answer.cuff_pull[held]).max())


@pytest.mark.full
def test_pages_have_every_field_and_no_other_number(report):
    page = html_page(report)
    for section in sections_of(report):
        for cell in (cell for row in section.rows for cell in row):
            assert f">{escape(cell)}</td>" in page
    # A field that changes changes the pages.
    posture = replace(report.postures[0], joint_N=1234.0)
    changed = replace(report, postures=(posture, *report.postures[1:]), title="<b>bold</b>")
    assert "1230" in html_page(changed)
    assert "<b>bold" not in html_page(changed)
    for number in re.findall(r"(?<![\d.])\d+(?:\.\d+)?(?![\d.])", text_of(report).replace("1.525 m", "")):
        if number not in ("13482", "14971") and not re.fullmatch(r"(19|20)\d\d", number):
            assert len(number.replace(".", "").strip("0")) <= 3, number


@pytest.mark.parametrize(
    "name",
    [
        *(pytest.param(name, marks=pytest.mark.full) for name in ("prototype.urdf", "spring-support.urdf")),
        *(pytest.param(name, marks=pytest.mark.long) for name in ("serial-y-x-z.urdf", "six-cables.urdf")),
    ],
)
def test_every_kind_has_a_report_of_two_pages_without_undefined_terms(name, tmp_path):
    found = ep.load(URDF / name).report(MAN, file=URDF / name)
    assert found.file_hash == hashlib.sha256((URDF / name).read_bytes()).hexdigest()
    assert not TERMS.search(text_of(found)), TERMS.search(text_of(found))
    found.save(tmp_path / "pages.pdf")
    written = (tmp_path / "pages.pdf").read_bytes()
    assert len(re.findall(rb"/Type /Page\b(?!s)", written)) == 2
    assert found.title in str(found)
    assert (len(found.drives) == 0) == (name == "spring-support.urdf")
    if not found.drives:
        assert {posture.holds for posture in found.postures} == {"supports"}
        assert all(posture.left_to_wearer_Nm >= 0.0 for posture in found.postures)
        assert all(0.0 < task.relief_percent < 100.0 for task in found.tasks)


@pytest.mark.full
def test_a_device_that_has_none_of_the_poses_is_not_said_to_lack_strength(report):
    none = replace(report, held_percent=0.0, criteria_percent=dict.fromkeys(report.criteria_percent, 0.0))
    assert none.verdict.startswith("It goes to none of 125 poses")
    near = replace(none, criteria_percent=none.criteria_percent | {"singularity": 50.0})
    assert near.verdict.startswith("It holds none of 125 poses")
