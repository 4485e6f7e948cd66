"""The scene of a device that is not a wrist: arrows are the answer's forces, where they act."""

import numpy as np
import pinocchio as pin
import pytest
from drawn_scenes import APART
from parallelogram_supports import parallelogram_support
from places import URDF
from scenes import commands, panel, place, placements

import exo_pin as ep
from exo_pin.view import ChainScene, Scene

MAN = ep.Wearer(1.755, 85, "male")
#: No arrow is cut at this scale.
SCALE = 1e-3


def arrow(scene, name):
    """Where a drawn arrow starts and how far it reaches, m; None where it is not drawn."""
    shaft, head = (place(scene, f"/meshcat/forces/{name}/{part}") for part in ("shaft", "head_0"))
    if np.linalg.norm(head[:3, 2]) < 1e-5:
        return None
    last = f"/meshcat/forces/{name}/head_1"
    drawn = {item["path"] for item in commands(scene) if item["type"] == "set_object"}
    end = place(scene, last) if last in drawn else head
    return shaft[:3, 3], end[:3, 3] + end[:3, 2] - shaft[:3, 3]


def texts(scene):
    return [label["text"] for label in panel(scene, "labels")]


def legend(scene):
    return [item["text"] for item in panel(scene, "legend")["items"]]


@pytest.mark.parametrize(
    "name",
    [
        *("serial-y-x-z", "nesm", "spring-support"),
        *(pytest.param(name, marks=pytest.mark.full) for name in ("spherical-3rrr", "3rps-passive-ball")),
    ],
)
def test_a_device_is_drawn_on_its_wearer_with_the_forces_of_its_answer(name):
    exo = ep.load(URDF / f"{name}.urdf").worn_by(MAN)
    scene = exo.view(metres_per_newton=SCALE)
    assert type(scene) is Scene
    pose = exo.pose(50, 30)
    answer = scene.show(pose)
    np.testing.assert_allclose(answer.shoulder_force, exo.reaction(pose).shoulder_force)
    (o, shoulder), (centre, weight), (cuff, device) = (arrow(scene, part) for part in ("shoulder", "weight", "device"))
    np.testing.assert_allclose(o, 0.0, atol=1e-12)
    np.testing.assert_allclose(shoulder / SCALE, answer.shoulder_force, atol=1e-9)
    # The arm is at rest: the arrows on it add up to nothing, and of their moments only a couple is left that goes
    # through the cuff, and what the wearer adds.
    np.testing.assert_allclose((shoulder + weight + device) / SCALE, 0.0, atol=1e-9)
    moment = (np.cross(centre, weight) + np.cross(cuff, device)) / SCALE
    couple = answer.cuff_wrench[3:] - np.cross(cuff, answer.cuff_wrench[:3])
    wearer = exo.device.moment_of_wearer(answer.actuator_forces[None])[0]
    np.testing.assert_allclose(moment + couple + wearer, 0.0, atol=1e-9)
    # Who wears it is drawn, with one arm: the chain's own is not.
    drawn = {item["path"] for item in commands(scene) if item["type"] == "set_object"}
    assert any("/bust/" in path for path in drawn)
    if any("/human/" in path for path in drawn):
        assert not any(path.startswith("/meshcat/exo/visuals/arm_") for path in drawn)
    numbers = panel(scene, "numbers")
    assert numbers["values"][0]["value"] == f"{answer.magnitude:.1f} N"
    assert answer.verdict in [note["text"] for note in numbers["notes"]]
    for drive in exo.device.drives:
        assert any(text.startswith(drive.name) for text in texts(scene))


def test_moments_of_hinges_turn_about_their_axes_the_right_way_round():
    exo = ep.load(URDF / "nesm.urdf").worn_by(MAN)
    scene = exo.view(human=False)
    pose = exo.pose(50, 30)
    answer, model = scene.show(pose), exo.chain.model
    for i, drive in enumerate(exo.device.drives):
        turned = place(scene, f"/meshcat/forces/drive_{i}/turn/round")
        axis = turned[:3, 2] / np.linalg.norm(turned[:3, 2])
        # Work of the moment on the link beyond the hinge is effort times the joint's own turn.
        joint = model.getJointId(drive.joint)
        link = next(f.name for f in model.frames if f.parentJoint == joint and f.name != drive.joint)
        q, dq = exo.configurations(pose), np.zeros(model.nv)
        dq[exo.chain.velocity_slice(drive.joint)] = 1e-6
        after = exo.chain.placement(pin.integrate(model, q, dq), link).rotation
        small = pin.log3(after @ exo.chain.placement(q, link).rotation.T) / 1e-6
        np.testing.assert_allclose(small, axis * np.sign(answer.actuator_forces[i]), atol=1e-4)
    assert "moment of a drive, not to scale" in legend(scene)


def test_a_mirrored_device_has_mirrored_arrows():
    exo = ep.load(URDF / "spring-support.urdf").worn_by(MAN)
    S = np.diag([1.0, -1.0, 1.0])
    pictures = []
    for each in (exo, exo.mirrored()):
        scene = each.view(human=False, metres_per_newton=SCALE)
        scene.show(each.pose(50, 30))
        pictures.append(scene)
    for name in ("shoulder", "weight", "device", "spring_0/push"):
        for one, two in zip(arrow(pictures[0], name), arrow(pictures[1], name), strict=True):
            np.testing.assert_allclose(S @ one, two, atol=1e-9)
    # A moment is mirrored the other way round.
    turns = [place(scene, "/meshcat/forces/wearer/round")[:3, 2] for scene in pictures]
    np.testing.assert_allclose(-S @ turns[0], turns[1], atol=1e-9)


def test_options_fit_every_device_or_are_refused():
    serial, robot = ep.load(URDF / "serial-y-x-z.urdf"), ep.load(URDF / "dummy-shoulder.urdf")
    assert not {drive.joint for drive in serial.device.drives} & set(texts(serial.view(human=False)))
    with pytest.raises(ep.InvalidInput, match="labels"):
        serial.view(labels=True)
    assert serial.view(human=False, metres_per_newton=0.002).metres_per_newton == 0.002
    assert type(serial.view(q=serial.chain.neutral())) is ChainScene
    assert type(ep.load("prototype").view(q=ep.load("prototype").chain.neutral())) is ChainScene
    with pytest.raises(ep.InvalidInput, match="muscles"):
        serial.view(limbs="muscles")
    with pytest.raises(ep.InvalidInput, match="human"):
        robot.view(human=True)
    with pytest.raises(ep.InvalidInput, match="metres_per_newton"):
        serial.view(q=serial.chain.neutral(), metres_per_newton=0.01)
    with pytest.raises(ep.InvalidInput, match="person"):
        serial.view(device=False)


def drawn(scene):
    """Where each part of the device is, by its path, shape (4, 4)."""
    return {
        item["path"]: np.array(item["matrix"]).reshape(4, 4).T
        for item in commands(scene)
        if item["type"] == "set_transform" and item["path"].startswith("/meshcat/exo")
    }


def notes(scene):
    return [note["text"] for note in panel(scene, "numbers")["notes"] if "drawn as if" in note["text"]]


def test_a_device_apart_is_drawn_alike_whether_its_joints_or_the_arm_s_come_first():
    first, last = [
        parallelogram_support(3, order).view(human=False, metres_per_newton=SCALE)
        for order in ("arm first", "arm last")
    ]
    for scene in (first, last):
        scene.show(scene.exo.pose(20.0, 10.0, 5.0), centre_offset=APART, limits="none")
    drawn, other = placements(first), placements(last)
    assert drawn.keys() == other.keys()
    for path, matrix in drawn.items():
        assert other[path] == pytest.approx(matrix, abs=1e-9), path
