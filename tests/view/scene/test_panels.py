"""What the page says of a pose: its angles, sizes in few digits, and each remark where it is due."""

from dataclasses import replace

import numpy as np
import pytest
from scenes import URDF
from scipy.spatial.transform import Rotation

import exo_pin as ep
from exo_pin.view.colours import CIVIDIS, hexadecimal, scale_colours
from exo_pin.view.scene.panels import ANGLES, PoseSliders, bar, notebook_cell, numbers_panel
from exo_pin.view.stage.force_arrows import PoseContact, ShownForces, round_up
from exo_pin.view.stage.stage import Stage


@pytest.fixture(scope="module")
def exo():
    return ep.load("prototype").worn_by(ep.Arm.from_anthropometry(1.75, 75, "male"))


@pytest.fixture(scope="module")
def forces(exo):
    return ShownForces.of(exo.reaction(exo.pose(40.0, 30.0)), ())


def texts(told):
    return [(note["text"], note["warn"]) for note in told["notes"]]


def test_numbers_of_a_wrist(exo, forces):
    pose = exo.pose(40.0, 30.0, -10.0)
    told = numbers_panel(exo, pose, forces, ["a note"])
    assert told["pose"].replace("\N{NO-BREAK SPACE}", " ") == (
        "left shoulder: flexion 40°, abduction 30°, internal rotation −10°"
    )
    assert told["title"] == exo.device.title
    size = np.linalg.norm(forces.shoulder)
    assert told["values"] == [
        {"name": "on the shoulder, |F_s|", "value": f"{size:.1f} N"},
        {"name": "margin, det X", "value": f"{forces.determinant:+.3f}".replace("-", "−")},
    ]
    assert told["headline"] == ""
    said = texts(told)
    assert (forces.verdict, True) in said
    assert (f"{forces.percent:.1f} % of body weight", False) in said
    assert said[-1] == ("a note", True)
    assert any("(split “spherical”)" in text for text, _ in said)
    assert not any("singular" in text for text, _ in said)
    # What the verdict says already is not said again.
    again = numbers_panel(exo, pose, forces, [forces.verdict[:20]])
    assert len(texts(again)) == len(said) - 1
    asked = numbers_panel(exo, pose, forces, [], (-0.2, 100.4, 0.0))
    assert "flexion\N{NO-BREAK SPACE}0°, abduction\N{NO-BREAK SPACE}100°" in asked["pose"]
    near = numbers_panel(exo, pose, replace(forces, is_near_singular=True, percent=None, cuff_text="it pulls"), [])
    assert ("Near a singular pose: limb forces far above the load. Move the arm away from it.", True) in texts(near)
    assert ("it pulls", False) in texts(near)
    assert not any("body weight" in text for text, _ in texts(near))
    held = numbers_panel(exo, pose, replace(forces, status="ok", verdict="It holds."), [])
    assert ("It holds.", False) in texts(held)


@pytest.mark.parametrize(
    ("size", "said"),
    [
        (0.04, "0.0 N"),
        (999.9, "999.9 N"),
        (1000.4, "1000 N"),
        (99999.6, "100000 N"),
        (1e6, "1e+06 N"),
        (2.346e7, "2.35e+07 N"),
    ],
)
def test_sizes_have_few_digits(exo, forces, size, said):
    told = numbers_panel(exo, Rotation.identity(), replace(forces, shoulder=np.array([0.0, -size, 0.0])), [])
    assert told["values"][0]["value"] == said


@pytest.mark.parametrize(("value", "said"), [(-0.0004, "0.000"), (0.0006, "+0.001"), (-0.25, "−0.250")])
def test_a_margin_has_its_sign(exo, forces, value, said):
    told = numbers_panel(exo, Rotation.identity(), replace(forces, determinant=value), [])
    assert told["values"][-1] == {"name": "margin, det X", "value": said}
    lost = numbers_panel(exo, Rotation.identity(), replace(forces, determinant=np.nan), [])
    assert len(lost["values"]) == 1


def test_a_pose_without_forces_and_another_device(exo, forces):
    none = replace(forces, shoulder=np.full(3, np.nan), status="near_singular", verdict="It is lost.")
    told = numbers_panel(exo, Rotation.identity(), none, [])
    assert (told["headline"], texts(told)) == ("No solution: near singular", [("It is lost.", False)])
    serial = ep.load(URDF / "serial-y-x-z.urdf").worn_by(ep.Wearer(1.75, 75, "male"))
    pose = serial.pose(40.0, 20.0)
    answer = serial.reaction(pose)
    told = numbers_panel(serial, pose, ShownForces.of(answer, ()), [])
    values = {item["name"]: item["value"] for item in told["values"]}
    for (name, unit), effort in zip(serial.device.drive_units, answer.actuator_forces, strict=True):
        assert values[name] == f"{effort:.1f} {unit}".replace("-", "−")
    assert "margin, det X" not in values
    assert "margin, det X" not in str(numbers_panel(serial, pose, None, []))
    bare = numbers_panel(serial, pose, ShownForces.of(answer, ()).without_device(), [])
    assert bare["title"] == "Without a device"


def test_the_load_of_the_joint_comes_first(exo, forces):
    contact = PoseContact(np.array([30.0, 40.0, 0.0]), 7.2, 210.4, np.zeros(3), 0.4, "ok")
    told = numbers_panel(exo, Rotation.identity(), replace(forces, contact=contact), [])
    size = np.linalg.norm(forces.shoulder)
    assert [item["name"] for item in told["values"]][:2] == ["load of the joint", "F_s, no muscles"]
    assert [item["value"] for item in told["values"]][:2] == ["50.0 N", f"{size:.1f} N"]
    assert texts(told)[0] == (
        "7 % of body weight, with the wearer's own muscles; without the device 210.4 N", False
    )  # fmt: skip
    alone = numbers_panel(exo, Rotation.identity(), replace(forces, contact=contact).without_device(), [])
    assert texts(alone)[0][0] == "7 % of body weight, with the wearer's own muscles"
    assert [item["name"] for item in alone["values"]] == ["load of the joint"]
    lost = replace(forces, contact=replace(contact, force=np.full(3, np.nan), status="too_weak"))
    told = numbers_panel(exo, Rotation.identity(), lost, [])
    assert texts(told)[0][0].startswith("No contact force of the joint: ")
    assert texts(told)[0][1]
    assert told["values"][0]["name"] == "F_s, no muscles"


def test_a_bar_of_colours_and_a_frame():
    told = bar("tension, N", 0.0, 123.456)
    assert (told["label"], told["low"], told["high"]) == ("tension, N", "0", "123")
    assert len(told["colours"]) == 9
    assert (told["colours"][0], told["colours"][-1]) == (CIVIDIS[0], CIVIDIS[-1])
    assert told["colours"][4] == hexadecimal(scale_colours(np.array([0.5]), 0.0, 1.0)[0])
    html = notebook_cell('src="a"', 321.7).data
    assert "height: 321px" in html
    assert '<iframe src="a"' in html


@pytest.mark.parametrize(
    ("value", "up"),
    [(1.0, 1.0), (1.01, 1.5), (2.2, 3.0), (6.5, 8.0), (8.1, 10.0), (0.3, 0.3), (0.031, 0.04), (250.0, 300.0)],
)
def test_round_numbers_above(value, up):
    assert round_up(value) == up


def test_sliders_follow():
    stage, drawn = Stage(), []
    sliders = PoseSliders(stage, "right", drawn.append)
    sliders.follow(ep.shoulder_rotation(30.0, 20.0, -5.0, side="right", degrees=True))
    told = stage.panel("sliders")
    assert [(each["name"], each["value"]) for each in told["angles"]] == [
        ("flexion", 30.0), ("abduction", 20.0), ("internal rotation", -5.0),
    ]  # fmt: skip
    assert [(each["low"], each["high"]) for each in told["angles"]] == list(ANGLES.values())
    assert (told["answered"], told["refusal"]) == (0, "")
