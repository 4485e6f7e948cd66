"""The one object a user holds: its kinematics, files and contact, for a wrist and for another device."""

import numpy as np
import pytest
from places import URDF
from scipy.spatial.transform import Rotation

import exo_pin as ep
from exo_pin.core.errors import AbsentAttribute

MAN = ep.Person(1.75, 75, "male")
SERIAL = URDF / "serial-y-x-z.urdf"
SERIAL_EXO = ep.load(SERIAL)


@pytest.fixture(scope="module")
def worn():
    return ep.load("four-linear-actuators-worn").worn_by(MAN)


@pytest.mark.parametrize("name", ["four-linear-actuators-worn", SERIAL])
def test_rates_are_those_of_the_positions(name):
    exo = ep.load(name)
    pose, step = exo.pose(50, 30, 10), 1e-6
    turns = Rotation.from_rotvec(step * np.concatenate([np.eye(3), -np.eye(3)]))
    positions = exo.inverse_kinematics(turns * pose).positions
    rates = (positions[:3] - positions[3:]) / (2.0 * step)
    np.testing.assert_allclose(exo.jacobian(pose), rates.T, atol=1e-6)
    q = exo.configurations(Rotation.concatenate([pose, exo.pose()]))
    assert np.abs(exo.assembly_modes(pose, starts=4)[0] - q[0]).max() < 1e-6
    for each in q:
        assert np.abs(exo.chain.residual(each)).max() < 1e-9
    assert exo.accuracy(pose, twins=False).rate == pytest.approx(np.linalg.svd(rates, compute_uv=False)[-1], rel=1e-4)


def test_a_wrist_has_names_that_another_device_lacks():
    exo, other = ep.load("prototype"), ep.load(SERIAL)
    pose = exo.pose(30, 20, 10)
    for side in ("left", "right"):
        assert (ep.load("prototype", side=side).pose(30, 20, 10) * ep.shoulder_rotation(
            30, 20, 10, side=side, degrees=True).inv()).magnitude() < 1e-12  # fmt: skip
    state = exo.inverse_kinematics(pose)
    for modes in (
        exo.forward_kinematics(state.lengths, near=pose),
        exo.forward_kinematics_from_base_angles(theta_x=state.base_theta_x, near=pose),
        exo.forward_kinematics_from_base_angles(theta_y=state.base_theta_y, near=pose),
    ):
        assert (modes.rotations[int(modes.nearest)] * pose.inv()).magnitude() < 1e-9
    near = exo.nearest_singularity(pose)
    assert abs(exo.singularity(near.pose).determinant) < 1e-9
    assert (near.pose * pose.inv()).magnitude() == pytest.approx(float(near.distance))
    for each in ("forward_kinematics", "nearest_singularity", "geometry"):
        assert each in dir(exo)
        assert each not in dir(other)
        assert not hasattr(other, each)
    with pytest.raises(AbsentAttribute, match=r"singularity\(poses\) gives the margin"):
        _ = other.nearest_singularity
    assert (exo.has_arm, other.wrist, exo.name, other.side) == (True, None, "prototype", "left")
    assert repr(exo).startswith("<ShoulderExo 'prototype': 3UPU, left shoulder, arm 0.657 kg>")
    assert "right shoulder" in repr(other.mirrored())
    assert "no arm" in repr(ep.load("scenario-one"))


def test_forces_that_are_given_are_those_of_the_answer(worn):
    poses = worn.pose([60, 20], 30)
    answer = worn.reaction(poses)
    there, same = worn.joint_contact(poses, MAN, answer), worn.joint_contact(poses, MAN, answer.actuator_forces)
    np.testing.assert_allclose(same.force, there.force, rtol=1e-4)
    assert same.held.all()
    assert "beyond" not in same.caution
    assert "given limb forces; no side forces" in str(same)
    much = answer.actuator_forces + np.array([[1000.0, 0.0, 0.0, 0.0], [0.0] * 4])
    beyond = worn.joint_contact(poses, MAN, much, outside="mark")
    assert beyond.held.tolist() == [False, True]
    assert "beyond the device's limits in 1 of 2 poses." in beyond.caution
    chosen = worn.joint_contact(poses[0], MAN, "least_contact")
    assert chosen.magnitude < there.magnitude[0] + 1e-6
    with pytest.raises(ep.InvalidInput, match="Reaction of the same poses"):
        worn.joint_contact(poses[0], MAN, answer)
    off = worn.joint_contact(poses[0], MAN, answer.actuator_forces[0], centre_offset=(0.0, 0.0, 0.01))
    assert abs(off.magnitude - same.magnitude[0]) > 0.1


def test_efforts_of_drives_that_are_given_are_those_of_the_answer():
    exo = ep.load(SERIAL).worn_by(MAN)
    poses = exo.pose([50, 20], 30)
    answer = exo.reaction(poses, limits="none")
    there = exo.joint_contact(poses, MAN, answer)
    same = exo.joint_contact(poses, MAN, answer.actuator_forces, limits="none")
    np.testing.assert_allclose(same.force, there.force, rtol=1e-4)
    assert "given efforts of the drives" in str(same)
    most = np.abs(answer.actuator_forces).max(axis=1)
    weak = exo.joint_contact(poses, MAN, answer.actuator_forces, limits=float(most.mean()))
    assert weak.held.tolist() == (most < most.mean()).tolist()
    with pytest.raises(ep.InvalidInput, match="constraint_bounds are for wrists"):
        exo.joint_contact(poses, MAN, answer.actuator_forces, constraint_bounds=1.0)


def test_a_table_of_designs(tmp_path):
    table = tmp_path / "designs.csv"
    table.write_text("name,design,cuff_height_mm,r_A_mm\n,four-cables,,\nlow,four-cables,200,\n,prototype,210,150\n")
    for side in ("left", "right"):
        one, two, three = ep.load_designs(table, side)
        assert [each.name for each in (one, two, three)] == [
            "four-cables", "low", "prototype cuff_height_mm=210 r_A_mm=150",
        ]  # fmt: skip
        assert {each.side for each in (one, two, three)} == {side}
        assert -two.geometry.platform_points[:, 2].mean() == pytest.approx(0.2)
        assert (three.geometry.circles.h_B, three.geometry.circles.r_A) == pytest.approx((0.21, 0.15))
    ep.load("prototype").save(tmp_path / "mine.toml")
    table.write_text("design\nmine.toml\n")
    assert ep.load_designs(table)[0].name == "prototype"
    for text, message in (
        ("name\nx\n", "column 'design'"),
        ("design\n", "at least one row"),
        ("design,r_A_mm\nprototype,1:2:3\n", "line 2: expected one value"),
        ("design\nprototype\nnone\n", "line 3"),
    ):
        table.write_text(text)
        with pytest.raises(ep.FileFormatError, match=message):
            ep.load_designs(table)


def test_files_of_a_design(tmp_path):
    exo = ep.load("four-cables-worn")
    chain = exo.chain_with_masses()
    for limb, role in zip(exo.limbs, chain.roles.limbs, strict=True):
        own = chain.velocity_slice(role.slide)
        # A slide grows with its limb, which tension shortens.
        assert chain.model.lowerEffortLimit[own] == -limb.actuator.pull_limit
        assert chain.model.upperEffortLimit[own] == 0.0
    names = {
        "a.urdf": ["a.urdf", "a.closures.toml", "a.device.toml"],
        "b.xml": ["b.xml", "b.device.toml"],
    }
    pose = exo.pose(60, 30)
    for name, files in names.items():
        written = exo.export(tmp_path / name)
        assert [file.name for file in written] == files
        again = ep.load(tmp_path / name)
        force = again.replace(arm=exo.arm).reaction(pose, limits="none").shoulder_force
        np.testing.assert_allclose(force, exo.reaction(pose, limits="none").shoulder_force, rtol=0.2)
    assert [file.name for file in exo.export(tmp_path / "c.urdf", part="wrist")] == ["c.urdf", "c.closures.toml"]
    with pytest.raises(ep.UnknownName, match="part"):
        ep.load(SERIAL).chain_with_masses("wrist")


def test_a_tracked_design_is_moved_as_asked():
    exo, stiff = ep.load("four-cables"), ep.control.Passive(stiffness=1.0, damping=0.1, source="as said")
    asked = {
        "options": ep.PlantOptions(play=1e-3), "faults": [ep.control.Fault("torn", 0, start=0.05)], "rate": 50.0,
        "payloads": ep.control.Payload(1.0, (0.0, 0.0, -0.3)), "wearer": [stiff], "title": "mine",
        "feedback": ep.control.FeedbackGains(),
    }  # fmt: skip
    experiment = exo.track("flexion", "model", duration=0.06, **asked).experiment
    for name, value in asked.items():
        own = getattr(experiment, name)
        assert own is value or own == (value,) or tuple(own) == tuple(value), name
    alone = exo.track("flexion", "model", duration=0.02, wearer=stiff, payloads=[asked["payloads"]]).experiment
    assert (alone.wearer, alone.payloads) == ((stiff,), (asked["payloads"],))
    assert alone.title not in ("", "mine")
    with pytest.raises(ep.InvalidInput, match='for the controller "model"'):
        exo.track("flexion", "pi", feedback=ep.control.FeedbackGains())


def test_long_work_says_how_far_it_is(worn, capsys):
    """On request, at each method that may take long; nothing of what is printed goes to the answer's own stream."""
    poses = worn.pose(np.linspace(0.0, 60.0, 8), 20.0)
    asked = {
        "reaction": lambda **more: SERIAL_EXO.reaction(SERIAL_EXO.pose(np.linspace(0.0, 60.0, 8)), **more),
        "joint_contact": lambda **more: worn.joint_contact(poses, MAN, **more),
        "compare": lambda **more: worn.compare(worn, poses=poses, **more),
        "total_uncertainty": lambda **more: worn.total_uncertainty(poses[3], draws=12, **more),
    }
    for name, ask in asked.items():
        ask()
        quiet = capsys.readouterr()
        ask(progress=True)
        said = capsys.readouterr()
        assert (quiet.err, said.out) == ("", ""), name
        assert said.err, name
