"""The wearer's bones, muscles and contact force in the scene."""

import re

import numpy as np
import pytest
from scenes import commands, panel, place, placements

import exo_pin as ep
from exo_pin import InvalidInput
from exo_pin.core.errors import MissingExtra
from exo_pin.person import MUSCLES
from exo_pin.person.limb.limb_state import limb_state
from exo_pin.person.limb.skeleton import BONES, bone_meshes, limb_shape
from exo_pin.view import Scene

pytest.importorskip("myo_sim", reason="needs the extra person: pip install '.[person]'")
pytest.importorskip("clarabel", reason="needs the extra person: pip install '.[person]'")

WEARER = ep.Person(1.75, 75, "male", elbow_flexion=20, degrees=True)


@pytest.fixture(scope="module")
def device():
    return ep.load("four-cables")


@pytest.fixture(scope="module")
def scene(device):
    return device.view(person=WEARER)


def paths_of(scene, muscle):
    """Points along a drawn muscle, shape (k, 3)."""
    placed = placements(scene)
    pieces = []
    while (matrix := placed.get(f"/meshcat/wearer/muscles/{muscle}/{len(pieces)}")) is not None:
        pieces.append(matrix)
    return np.array([*(piece[:3, 3] for piece in pieces), pieces[-1][:3, 3] + pieces[-1][:3, 2]])


@pytest.mark.parametrize("left", [False, True])
def test_paths_are_as_long_as_the_muscles(left):
    """Where a path does not wrap, its length is that of the muscle; around a bone it is drawn straight."""
    side = "left" if left else "right"
    rotations = ep.shoulder_rotation([0, 30, 70], [10, 50, 20], [0, 10, -20], side=side, degrees=True)
    state = limb_state(rotations.as_matrix(), 0.4, 0.1, 0.95, left)
    exact = 0
    for row, matrix in enumerate(rotations.as_matrix()):
        shape = limb_shape(matrix, 0.4, 0.1, 0.95, left)
        for k, path in enumerate(shape.paths):
            length = np.linalg.norm(np.diff(path, axis=0), axis=1).sum()
            assert length <= state.length[row, k] + 1e-9, MUSCLES[k]
            assert length > 0.8 * state.length[row, k], MUSCLES[k]
            exact += abs(length - state.length[row, k]) < 1e-9
        np.testing.assert_allclose(shape.socket_axes, state.glenoid[row], atol=1e-12)
    assert exact >= 10


def test_left_is_the_mirror_image_of_right():
    S = np.diag([1.0, -1.0, 1.0])
    right = ep.shoulder_rotation(40, 30, 10, side="right", degrees=True).as_matrix()
    one, two = limb_shape(right, 0.3, 0.2, 1.1, False), limb_shape(S @ right @ S, 0.3, 0.2, 1.1, True)
    for path, other in zip(one.paths, two.paths, strict=True):
        np.testing.assert_array_equal(path @ S, other)
    for name in BONES:
        vertices, faces = bone_meshes("right")[name]
        mirrored, corners = bone_meshes("left")[name]
        for mesh, bone, sign in ((vertices, one.bones[name], S), (mirrored, two.bones[name], np.eye(3))):
            assert np.isfinite(mesh @ bone[:3, :3].T @ sign).all()
        here = (vertices @ one.bones[name][:3, :3].T + one.bones[name][:3, 3]) @ S
        there = mirrored @ two.bones[name][:3, :3].T + two.bones[name][:3, 3]
        np.testing.assert_allclose(there, here, atol=1e-12)
        np.testing.assert_array_equal(corners, faces[:, ::-1])


def test_meshes_that_all_figures_share_cannot_be_changed():
    shared = bone_meshes("right")
    with pytest.raises(ValueError, match="read-only"):
        shared["scapula"][0][0] = 0.0
    shared.clear()
    assert set(bone_meshes("right")) == set(BONES)
    with pytest.raises(ep.UnknownName, match="side"):
        bone_meshes("both")


@pytest.mark.parametrize("side", ["left", "right"])
def test_bones_are_closed_skins_that_face_outwards(side):
    """The volume inside, by the divergence theorem, is positive, and for the humerus of a known size."""
    for name, (vertices, faces) in bone_meshes(side).items():
        a, b, c = (vertices[faces[:, k]] for k in range(3))
        volume = np.einsum("ti,ti->", a, np.cross(b, c)) / 6.0
        assert volume > 0.0, name
        if name == "humerus":
            assert 1e-4 < volume < 3e-4


def test_humerus_turns_about_o_and_elbow_is_where_it_should_be(scene, device):
    pose = device.pose(50, 30, 10)
    scene.show(pose)
    np.testing.assert_allclose(place(scene, "/meshcat/wearer/bones/humerus")[:3, 3], 0.0, atol=1e-12)
    ulna = place(scene, "/meshcat/wearer/bones/ulna")[:3, 3]
    assert np.linalg.norm(ulna - pose.as_matrix() @ WEARER.elbow_centre) < 0.015


def test_a_path_that_is_drawn_starts_and_ends_at_its_bones(scene, device):
    pose = device.pose(50, 30, 10)
    scene.show(pose)
    shape = limb_shape(pose.as_matrix(), WEARER.elbow_flexion, 0.0, WEARER.length_scale, True)
    for muscle, path in zip(MUSCLES, shape.paths, strict=True):
        drawn = paths_of(scene, muscle)
        np.testing.assert_allclose(drawn[[0, -1]], path[[0, -1]], atol=1e-12)


def test_trunk_and_harness_stay_together_where_the_device_is_fixed_to_the_torso(device):
    """With the path of the centre as offset, the torso moves against O exactly as the harness does."""
    scene = device.view(person=WEARER)
    seen = []
    for abduction in (0.0, 60.0, 90.0):
        scene.show(device.pose(0, abduction, 0), centre_offset=WEARER.centre_path())
        trunk = place(scene, "/meshcat/wearer/bones/trunk")[:3, 3]
        seen.append(trunk - place(scene, "/meshcat/exo/harness")[:3, 3])
    # The path is interpolated between its points.
    np.testing.assert_allclose(seen[1:], [seen[0]] * 2, atol=2e-4)


def test_colours_are_the_activations_and_the_arrow_is_the_contact_force(scene, device):
    pose = device.pose(30, 40, 0)
    reaction = scene.show(pose)
    contact = device.worn_by(WEARER).joint_contact(pose, WEARER, reaction)
    high = float(re.sub("[^0-9.]", "", panel(scene, "legend")["bars"][-1]["high"])) / 100.0
    assert contact.without_device.activations.max() <= high <= 2.0 * contact.without_device.activations.max()
    head = place(scene, "/meshcat/forces/contact/head_0")
    np.testing.assert_allclose(head[:3, 3] + head[:3, 2], scene.metres_per_newton * contact.force, atol=1e-9)
    # Where the force passes through the plane of the socket: on its line through O, inside the rim.
    ball = place(scene, "/meshcat/wearer/socket/force")[:3, 3]
    rim = place(scene, "/meshcat/wearer/socket/rim")
    np.testing.assert_allclose(np.cross(ball, contact.force), 0.0, atol=1e-9)
    local = np.linalg.inv(rim) @ [*ball, 1.0]
    assert abs(local[2]) < 1e-9
    assert np.hypot(*local[:2]) <= 1.0 + 1e-6
    texts = [label["text"] for label in panel(scene, "labels")]
    assert f"contact {contact.magnitude:.0f} N" in texts
    numbers = panel(scene, "numbers")
    assert numbers["values"][0] == {"name": "load of the joint", "value": f"{contact.magnitude:.1f} N"}
    assert f"without the device {contact.without_device.magnitude:.1f} N" in numbers["notes"][0]["text"]


def test_pose_outside_the_range_of_motion_is_drawn_grey_with_its_reason(scene, device):
    pose = device.pose(20, 30, 150)
    assert not WEARER.allows(pose)
    scene.show(pose)
    assert scene._stage.colours()["/meshcat/wearer/muscles/DELT1"][:3] == (0.85, 0.85, 0.85)
    notes = " ".join(note["text"] for note in panel(scene, "numbers")["notes"])
    assert "outside the range of motion" in notes


def test_a_motion_moves_bones_and_colours(scene, device):
    poses = device.pose(np.linspace(10, 70, 4), 30.0, 0.0)
    recording = scene.record(poses, np.linspace(0.0, 1.0, 4))
    moving, coloured = recording._frames["moving"], recording._frames["coloured"]
    assert "/meshcat/wearer/bones/humerus" in moving
    assert "/meshcat/wearer/bones/scapula" in moving
    assert any(path.startswith("/meshcat/wearer/muscles/DELT1/") for path in moving)
    assert "/meshcat/wearer/muscles/SUPSP" in coloured
    objects = [item["path"] for item in commands(scene) if item["type"] == "set_object"]
    assert len(objects) == len(set(objects))


def test_bare_arm_is_drawn_without_the_device(device):
    scene = device.view(person=WEARER, device=False)
    pose = device.pose(20, 60, 0)
    scene.show(pose)
    contact = WEARER.joint_contact(pose)
    hidden = [item for item in commands(scene) if item.get("property") == "visible" and item["path"] == "/meshcat/exo"]
    assert [item["value"] for item in hidden] == [False]
    numbers = panel(scene, "numbers")
    assert numbers["title"] == "Without a device"
    assert numbers["values"] == [{"name": "load of the joint", "value": f"{contact.magnitude:.1f} N"}]
    weight = 9.81 * WEARER.arm.mass
    texts = [label["text"] for label in panel(scene, "labels")]
    assert texts == [f"weight {weight:.0f} N", f"contact {contact.magnitude:.0f} N"]
    assert {item["text"] for item in panel(scene, "legend")["items"]} == {
        "joint's contact force",
        "weight of arm and device",
        "rim of the socket, and where the force passes",
    }
    load, motion = (
        ep.Load([0.0, 0.0, -10.0], at=[0.0, 0.0, -0.5], frame="arm"),
        ep.Motion([0.0, 1.0, 0.0], [0.0, 0.0, 0.0]),
    )
    scene.show(pose, load=load, motion=motion)
    loaded = WEARER.joint_contact(pose, motion, load)
    assert panel(scene, "numbers")["values"][0]["value"] == f"{loaded.magnitude:.1f} N"
    # A pose where the device would be singular is one like any other.
    prototype = ep.load("prototype").view(person=WEARER, device=False)
    prototype.show(device.pose(0, 90, 0))
    assert panel(prototype, "numbers")["headline"] == ""
    with pytest.raises(InvalidInput, match="give one"):
        device.view(device=False)


def test_wrong_calls_are_refused(device, monkeypatch):
    with pytest.raises(InvalidInput, match="Person"):
        device.view(person=WEARER.arm)
    monkeypatch.setattr("exo_pin.person.limb.skeleton.myoarm", _missing)
    monkeypatch.setattr("exo_pin.person.limb.skeleton._right_meshes", _missing)
    with pytest.raises(MissingExtra):
        device.view(person=WEARER)


def _missing(**_):
    raise MissingExtra("person", "myo_sim and mujoco")


def test_another_design_keeps_the_wearer():
    exo = ep.load("prototype")
    scene = Scene(exo, person=WEARER)
    before = scene.exo.arm.mass
    scene.replace_exo(exo.replace(geometry=exo.geometry.replace(r_A=0.14)))
    answer = scene.show(exo.pose(60, 30))
    worn = scene.exo
    assert worn.arm.mass == before == exo.worn_by(WEARER).arm.mass
    contact = worn.joint_contact(exo.pose(60, 30, 0), WEARER, answer)
    assert contact.has_result
    assert f"contact {contact.magnitude:.0f} N" in [label["text"] for label in panel(scene, "labels")]
