"""The share of the arm's moments that a device carries: of a passive one what it does, by a free body of the arm."""

import re

import numpy as np
import pytest
from places import URDF

pytest.importorskip("myo_sim", reason="needs the extra person: pip install '.[person]'")

import exo_pin as ep
from exo_pin.cli import main
from exo_pin.device import ConstantForce, Drive, Route, Spring

MAN = ep.Person(1.75, 75, "male")
SUPPORT = URDF / "spring-support.urdf"


def spoken(contact):
    """Share in percent and moment left, N m, as the answer says them."""
    text = re.search(r"it (carries|adds) (-?\d+) %.*?([\d.]+) N m", str(contact).replace("\n", " "))
    return text[1], int(text[2]), float(text[3])


@pytest.mark.parametrize("angles", [(60.0, 0.0), (0.0, 90.0), (100.0, 30.0)])
def test_a_passive_device_carries_what_its_spring_does(angles):
    exo = ep.load(SUPPORT)
    pose = exo.pose(*angles)
    (spring,) = exo.device.springs
    start, middle = (np.array(point.point) for point in spring.route.points)
    middle = exo.chain.placement(exo.chain.neutral(), "cuff_middle").translation + middle
    at = pose.as_matrix() @ middle
    size = np.linalg.norm(at - start)
    push = float(spring.law.force(size)) * (start - at) / size
    weight = MAN.arm.mass * np.array([0.0, 0.0, -9.81])
    bare = np.cross(pose.as_matrix() @ MAN.arm.centre_of_mass, weight)
    # The links on the arm weigh on it, too.
    own = exo.arm.parts[-1]
    assert own.device
    links = np.cross(pose.as_matrix() @ own.centre_of_mass, own.mass * np.array([0.0, 0.0, -9.81]))
    left = np.linalg.norm(bare + links + np.cross(at, push))
    word, share, moment = spoken(exo.joint_contact(pose, MAN))
    assert word == "carries"
    assert share == pytest.approx(100.0 * (1.0 - left / np.linalg.norm(bare)), abs=0.51)
    assert moment == pytest.approx(left, abs=0.0051)
    worn = exo.worn_by(MAN).reaction(pose)
    assert np.linalg.norm(worn.actuator_forces) == pytest.approx(left)
    # The answer of the device says the same.
    assert spoken(exo.joint_contact(pose, MAN, worn)) == (word, share, moment)


def test_a_spring_that_pulls_the_arm_down_adds_to_the_moments():
    way = Route.over(("universe", (0.0, 0.0, -0.5)), ("arm", (0.0, 0.0, -0.2)))
    exo = ep.load(SUPPORT).replace(springs=[Spring("down", ConstantForce(20.0), route=way)])
    assert spoken(exo.joint_contact(exo.pose(60), MAN))[0] == "adds"


def test_a_stack_says_least_median_and_most():
    exo = ep.load(SUPPORT)
    poses = exo.pose([30.0, 60.0, 90.0])
    single = [spoken(exo.joint_contact(pose, MAN)) for pose in poses]
    text = " ".join(str(exo.joint_contact(poses, MAN)).split())
    shares = sorted(share for _, share, _ in single)
    assert f"it carries {shares[0]} to {shares[2]} % (median {shares[1]} %) of the moments of the person's arm" in text
    assert f"leaves at most {max(left for *_, left in single):.2f} N m" in text


def test_the_hanging_arm_needs_no_moment():
    exo = ep.load(SUPPORT)
    contact = exo.joint_contact(exo.pose(), MAN)
    assert contact.status == "ok"
    assert "the arm needs no moment here; it leaves 0.00 N m" in " ".join(str(contact).split())


@pytest.mark.parametrize("share", [0.0, 0.4, 1.0])
def test_a_device_without_drives_refuses_a_share(share):
    exo = ep.load(SUPPORT)
    with pytest.raises(ep.InvalidInput, match="'spring-support', which has no drives that could set one"):
        exo.joint_contact(exo.pose(60), MAN, share)


def test_one_drive_sets_a_share_about_its_axis_alone():
    way = Route.over(("universe", (0.0, 0.1, 0.2)), ("arm", (0.0, 0.04, -0.2)))
    exo = ep.load(SUPPORT).replace(springs=[], drives=[Drive("cable", route=way, upper=400.0)])
    pose = exo.pose(40, 50)
    half, whole = (exo.joint_contact(pose, MAN, share) for share in (0.5, None))
    assert spoken(half)[1] < spoken(whole)[1] < 100


def test_a_device_that_holds_the_arm_carries_what_is_asked():
    exo = ep.load("four-linear-actuators-worn")
    texts = [" ".join(str(exo.joint_contact(exo.pose(60), MAN, share)).split()) for share in (None, 1.0, 0.4)]
    assert texts[0] == texts[1]
    for text, percent in zip(texts[1:], (100, 40), strict=True):
        assert f"limbs carry {percent} % of the moments of the person's arm; no side forces" in text


def test_the_command_says_the_share_and_refuses_another(capsys):
    assert main(["person", str(SUPPORT), "--abduction", "90"]) == 0
    said = " ".join(capsys.readouterr().out.split())
    assert "it carries 59 % of the moments of the person's arm here, and leaves 4.44 N m to the wearer" in said
    assert "100 %" not in said
    assert main(["person", str(SUPPORT), "--abduction", "90", "--share", "40"]) != 0
    refused = capsys.readouterr()
    assert "no drives that could set one" in refused.err
    assert not refused.out


def test_drives_beyond_their_limits_are_no_moment_of_the_wearer():
    """The shipped 3RPS leaves a moment about the arm to its wearer; what 20 N cannot do is another matter."""
    exo = ep.load(URDF / "3rps-passive-ball.urdf")
    bent = ep.Person(1.755, 85, "male", elbow_flexion=np.pi / 2)
    poses = exo.pose([60.0, 90.0], [20.0, 0.0], [0.0, 45.0])
    able, weak = (exo.joint_contact(poses, bent, limits=limits) for limits in ("design", (-20.0, 20.0)))
    assert able.held.all()
    assert not weak.held.any()
    assert np.abs(weak.device_forces[:, :3]).max() <= 20.0 + 1e-6
    assert "the closest forces that it can give are taken there" in weak.caution
    assert "closest" not in able.caution
