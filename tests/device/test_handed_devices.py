"""A device that is written in any format, with its device file beside it, is read as the same device."""

import os
import re

import numpy as np
import pytest
from handed_devices import BASES, FORMATS, MAN, answers, handed
from places import URDF

import exo_pin as ep
from exo_pin.cli import main

WITH_ARM = [
    "3rps-passive-ball", "nesm", "prototype", "prototype-shoulder", "serial-y-x-z", "six-cables", "spherical-3rrr",
    "spring-support",
]  # fmt: skip
QUICK = {("nesm", ".xml"), ("spring-support", ".sdf"), ("six-cables", ".xml"), ("spherical-3rrr", ".sdf")}
SEEDS = {10: ".xml"}
#: And those of the full run, which take longer.
SLOW_SEEDS = {8: ".urdf", 13: ".sdf", 20: ".sdf"}
PRESETS = {"prototype": ".xml", "four-muscle-cables": ".sdf", "four-cables": ".urdf"}


def cases(names, quick, formats=FORMATS):
    """A case for each name and format; those that are not quick are of the full run, drawn devices of the long one."""
    pairs = [(name, form) for name in names for form in formats]
    drawn = [isinstance(name, int) and SLOW_SEEDS.get(name) != form for name, form in pairs]
    slow = [pytest.mark.long if far else pytest.mark.full for far in drawn]
    return [pytest.param(*pair, marks=() if pair in quick else mark) for pair, mark in zip(pairs, slow, strict=True)]


def assert_same_device(exo, again, elastic=True):
    """The same names and parts, and the same answer to every question, to 1e-8 of the largest number in it."""
    assert (again.name, again.side) == (exo.name, exo.side)
    assert again.device.title == exo.device.title
    assert dict(again.device.sources) == dict(exo.device.sources)
    assert repr(again.device.limbs) == repr(exo.device.limbs)  # drives with their names, in order
    assert again.chain.roles == exo.chain.roles
    one, other = (answers(each, elastic) for each in (exo, again))
    # Whether a device can give way is decided by the order of its bodies, too, which is a file's.
    unlike = {key for key in one.keys() | other.keys() if key.startswith("elastic")}
    left_out = unlike if "elastic raises" in one.keys() | other.keys() else set()
    assert one.keys() - left_out == other.keys() - left_out
    assert any(key.startswith("design.") for key in one)
    for key in one.keys() - left_out:
        if one[key].dtype.kind != "f":
            np.testing.assert_array_equal(other[key], one[key], err_msg=key)
            continue
        known = one[key][np.isfinite(one[key])]
        scale = max(1.0, float(np.abs(known).max(initial=0.0)))
        # The elastic equilibrium is found by iteration.
        share = 1e-6 if key.startswith("elastic") else 1e-8
        np.testing.assert_allclose(other[key], one[key], rtol=0.0, atol=share * scale, err_msg=key)


def soft_parts(exo):
    """Numbers of all that gives way."""
    own, soft = exo.device.interfaces, exo.device.soft_links
    springs = [each for each in (own.cuff, own.harness, *(link.spring for link in soft)) if each is not None]
    more = [own.cuff_area, exo.device.shoulder.stiffness]
    numbers = [np.asarray(each, dtype=float) for each in more]
    return [*numbers, *(spring.stiffness for spring in springs), *(np.asarray(spring.at) for spring in springs)]


@pytest.mark.parametrize(("name", "form"), cases(WITH_ARM, QUICK))
def test_a_shipped_device_comes_back(name, form, tmp_path):
    exo = ep.load(URDF / f"{name}.urdf")
    written = exo.export(tmp_path / f"other{form}")
    assert written.lost == ()
    assert_same_device(exo, ep.load(written[0]))
    assert_same_device(exo, ep.load(tmp_path / "other.device.toml"), elastic=False)


@pytest.mark.parametrize(("name", "form"), cases(ep.presets(), set(PRESETS.items())))
def test_a_preset_comes_back_though_simulators_need_masses(name, form, tmp_path):
    exo = ep.load(name, side="right")
    exo = exo if exo.arm is not None else exo.worn_by(MAN)
    written = exo.export(tmp_path / f"mine{form}")
    again = ep.load(written[0])
    assert written.lost == ()
    for number, each in enumerate((exo, again)):
        each.save(tmp_path / f"design_{number}.toml")
    assert (tmp_path / "design_0.toml").read_text() == (tmp_path / "design_1.toml").read_text()
    assert_same_device(exo, again)


@pytest.mark.parametrize(("seed", "form"), cases(range(4 * len(BASES)), set(SEEDS.items())))
def test_a_device_with_every_part_comes_back(seed, form, tmp_path):
    exo = handed(seed)
    written = exo.export(tmp_path / f"drawn{form}")
    assert written.lost == ()
    again = ep.load(written[0])
    assert again.device.drives == exo.device.drives
    assert again.device.springs == exo.device.springs
    for one, other in zip(soft_parts(exo), soft_parts(again), strict=True):
        np.testing.assert_array_equal(other, one)
    assert repr(again.arm.wearer) == repr(exo.arm.wearer)
    assert_same_device(exo, again)


@pytest.mark.parametrize(
    "seed",
    [pytest.param(k, marks=pytest.mark.full if k == 11 else pytest.mark.long) for k in range(22)],
)
def test_a_device_is_saved_and_saved_again(seed, tmp_path):
    exo = handed(seed)
    path = tmp_path / "mine.toml"
    exo.save(path)
    again = ep.load(path)
    assert_same_device(exo, again)
    before = {file.name: file.read_text() for file in tmp_path.iterdir()}
    again.save(path)
    assert before.keys() == {file.name for file in tmp_path.iterdir()}
    assert_same_device(exo, ep.load(tmp_path / "mine.device.toml"))


def test_of_a_robot_that_is_no_device_roles_are_lost_by_name(tmp_path, capsys):
    status = main(["export", str(URDF / "dummy-shoulder.urdf"), "--out", str(tmp_path / "dummy.sdf")])
    assert status == 1
    assert "Lost, in no file: the roles of its parts." in capsys.readouterr().out
    assert main(["export", str(URDF / "spring-support.urdf"), "--out", str(tmp_path / "support.sdf")]) == 0
    said = " ".join(capsys.readouterr().out.split())
    assert "support.sdf alone lacks, and support.device.toml has" in said
    assert "the springs strut" in said


def test_saving_overwrites_nobody_elses_file(tmp_path):
    exo = ep.load(URDF / "nesm.urdf")
    (tmp_path / "mine.urdf").write_text("<robot/>")
    with pytest.raises(ep.InvalidInput, match=r"mine\.urdf is there, and is no part"):
        exo.save(tmp_path / "mine.toml")
    assert [file.name for file in tmp_path.iterdir()] == ["mine.urdf"]
    with pytest.raises(ep.InvalidInput, match=r"expected the file to end in \.toml"):
        exo.save(tmp_path / "mine.urdf")
    with pytest.raises(ep.InvalidInput, match="names no arm"):
        ep.load(ep.load(URDF / "nesm.urdf").export(tmp_path / "bare.xml")[0].rename(tmp_path / "alone.xml")).save(
            "a.toml"
        )


def test_nothing_stays_of_a_device_that_cannot_be_written(tmp_path, monkeypatch):
    exo = ep.load(URDF / "nesm.urdf")
    real = os.replace

    def full_disk(temporary, path):
        """A disk that is full when the device file is written to the folder."""
        if str(path) == str(tmp_path / "mine.device.toml"):
            raise OSError("disk full")
        real(temporary, path)

    monkeypatch.setattr(os, "replace", full_disk)
    with pytest.raises(ep.ExoPinError, match="disk full"):
        exo.save(tmp_path / "mine.toml")
    assert list(tmp_path.iterdir()) == []


def test_springs_of_a_design_file(tmp_path):
    """They act beside the limbs, on either side; a device file that holds a design has them nowhere else."""
    plain = ep.load("four-linear-actuators").worn_by(MAN)
    plain.save(tmp_path / "mine.toml")
    spring = """
[[springs]]
name = "lift"
law = "linear"
stiffness_N_m = 300
slack_mm = 200
points = [{ link = "universe", point_mm = [-200, 100, 300] }, { link = "arm", point_mm = [0, 70, -200] }]
"""
    (tmp_path / "sprung.toml").write_text((tmp_path / "mine.toml").read_text() + spring)
    exo = ep.load(tmp_path / "sprung.toml")
    pose = exo.pose([0, 40, 80], 20)
    answer, turn = exo.reaction(pose), pose.as_matrix()
    # Of four limbs and the spring, from torso to arm.
    below = np.vstack([plain.geometry.platform_points, [0.0, 0.07, -0.2]]) @ turn.transpose(0, 2, 1)
    along = below - np.vstack([plain.geometry.base_points, [-0.2, 0.1, 0.3]])
    length = np.linalg.norm(along, axis=-1, keepdims=True)
    tensions = np.hstack([answer.actuator_forces, 300.0 * (length[:, 4] - 0.2)])
    pulls, weight = -tensions[..., None] * along / length, exo.arm.mass * np.array([0.0, 0.0, -9.81])
    forces = answer.shoulder_force + pulls.sum(axis=1) + weight
    moments = np.cross(below, pulls).sum(axis=1) + np.cross(turn @ exo.arm.centre_of_mass, weight)
    np.testing.assert_allclose([forces, moments], 0.0, atol=1e-8)
    right = ep.load(tmp_path / "sprung.toml", side="right")
    mirrored = right.reaction(right.pose([0, 40, 80], 20)).shoulder_force
    np.testing.assert_allclose(mirrored * [1.0, -1.0, 1.0], answer.shoulder_force, atol=1e-8)
    changed = plain.replace(springs=exo.device.springs).reaction(pose)
    np.testing.assert_allclose(changed.shoulder_force, answer.shoulder_force, atol=1e-8)
    with pytest.raises(ep.InvalidInput, match="such a device has no 'estimated'"):
        ep.load("prototype").replace(springs=exo.device.springs)
    assert ep.load("prototype").replace(springs=exo.device.springs, estimated=()).device.springs == exo.device.springs
    with pytest.raises(ep.UnknownName, match="sprung"):
        plain.replace(sprung=())
    for old, new, said in (
        ("universe", "trunk", "unknown frame 'trunk'"), ("point_mm = [0", "point_m = [0", "millimetres?"),
        ("slack_mm", "rest_mm", "springs\\[0\\].rest_mm: unknown key"), ('"linear"\n', '"spring"\n', "expected one of"),
        ('family = "linear"', 'family = "spring"', "it stands in ..springs.. of the file"),
    ):  # fmt: skip
        (tmp_path / "wrong.toml").write_text((tmp_path / "sprung.toml").read_text().replace(old, new))
        with pytest.raises(ep.ExoPinError, match=said):
            ep.load(tmp_path / "wrong.toml")
    plain.export(tmp_path / "robot.urdf")
    with (tmp_path / "robot.device.toml").open("a") as file:
        file.write(spring)
    with pytest.raises(ep.FileFormatError, match="springs: no effect"):
        ep.load(tmp_path / "robot.urdf")


@pytest.mark.parametrize("form", FORMATS)
def test_a_torso_that_leans_has_its_gravity_in_every_format(form, tmp_path):
    leaning = np.array([3.0, 1.0, -9.0])
    robot = ep.load(URDF / "six-cables.urdf")
    model = robot.chain.model.copy()
    model.gravity.linear = leaning
    robot = robot.replace(chain=ep.ClosedChain(model, robot.chain.description))
    for exo in (robot, ep.load("four-cables").replace(gravity=leaning)):
        path = tmp_path / f"{exo.name}{form}"
        exported = exo.export(path)
        again = ep.load(path)
        np.testing.assert_allclose(again.device.gravity, leaning, atol=1e-12)
        np.testing.assert_allclose(again.chain.model.gravity.linear, leaning, atol=1e-12)
        assert ("the direction of gravity" in exported.beside) == (form == ".sdf")


def test_an_endless_hinge_that_rests_elsewhere_is_read_back_from_an_sdf_with_its_zero(tmp_path):
    text = (URDF / "serial-y-x-z.urdf").read_text(encoding="utf-8")
    at, (same, turned) = text.index('<joint name="flexion"'), ('xyz="0.0 0.0 0.0" /', 'xyz="0 0 0" rpy="0 0.4 0" /')
    endless = text[:at] + text[at:].replace("revolute", "continuous", 1).replace(same, turned, 1)
    for file in URDF.glob("serial-y-x-z.*"):
        (tmp_path / file.name).write_bytes(file.read_bytes())
    (tmp_path / "serial-y-x-z.urdf").write_text(endless, encoding="utf-8")
    exo = ep.load(tmp_path / "serial-y-x-z.urdf")
    exported = exo.export(tmp_path / "other.sdf")
    assert not exported.lost
    one, other = (own.chain.placements(own.chain.neutral()) for own in (exo, ep.load(exported[0])))
    for name in ("arm", "link_1", "frame"):
        np.testing.assert_allclose(other[name].homogeneous, one[name].homogeneous, atol=1e-9)
    beside = tmp_path / "other.device.toml"
    for key in ("zero", "coordinates"):
        text = re.sub(rf"(name = \"flexion\"\n){key} = \[", r"\g<0>0.0, ", beside.read_text(encoding="utf-8"))
        (tmp_path / "wrong.device.toml").write_text(text, encoding="utf-8")
        with pytest.raises(ep.InvalidInput, match="expected 1 coordinates of joint 'flexion', got 3"):
            ep.load(tmp_path / "wrong.device.toml")


def test_limbs_without_thickness_and_a_least_tension_are_read_back_from_an_mjcf(tmp_path):
    exo = ep.load("four-cables")
    half = ep.LimbBody(0.2, 0.1, 1e-3, 0.0)
    cable = ep.Actuator("cable", pull_limit=200.0, least_tension=5.0)
    thin = exo.replace(limbs=[ep.Limb("SPS", half, half, actuator=cable)] * 4)
    pose = exo.pose([10, 40], 20)
    for name, own in (("wrist", thin), ("chain", ep.ShoulderExo.from_device(thin.device.as_chain()))):
        exported = own.export(tmp_path / f"{name}.xml")
        assert not exported.lost
        again = ep.load(tmp_path / f"{name}.xml")
        assert [limb.effort_range for limb in again.device.limbs] == [limb.effort_range for limb in own.device.limbs]
        forces = [each.reaction(pose).actuator_forces for each in (own, again)]
        assert forces[0].min() == pytest.approx(5.0)
        np.testing.assert_allclose(forces[1], forces[0], rtol=1e-6)
