"""A device whose centre is not the shoulder's: drawn where its joints are, with the forces of that place."""

import dataclasses

import numpy as np
import pytest
from scenes import PERSON, URDF, commands, panel, place, placements, pose

import exo_pin as ep
from exo_pin.design import LimbGuide
from exo_pin.view import Scene

HARNESS, CUFF = np.array([0.004, -0.01, 0.012]), np.array([-0.006, 0.0, 0.015])


@pytest.fixture(scope="module")
def exo():
    return ep.load("prototype").worn_by(PERSON)


def joints(exo, orientation, harness, cuff):
    """Where A_i and B_i are, m."""
    return (
        exo.geometry.base_points + harness,
        (exo.geometry.platform_points + cuff) @ orientation.as_matrix().T,
    )


def assert_limbs_run(scene, a, b):
    """The halves of every limb lie on the line of its joints and start at them."""
    for i, line in enumerate((b - a) / np.linalg.norm(b - a, axis=1, keepdims=True)):
        for part, start in (("platform", b[i]), ("base", a[i])):
            drawn = place(scene, f"/meshcat/exo/visuals/limb_{i + 1}_{part}_body_0")
            np.testing.assert_allclose(np.cross(drawn[:3, 3] - start, line), 0.0, atol=1e-9)
            np.testing.assert_allclose(np.abs(drawn[:3, 2] @ line), 1.0, atol=1e-9)


def test_limbs_are_drawn_where_the_offset_has_them(exo):
    scene = Scene(exo, human=False)
    R = pose(60, 30, 0)
    answer = scene.show(R, centre_offset=ep.CentreOffset(HARNESS, CUFF))
    a, b = joints(exo, R, HARNESS, CUFF)
    assert_limbs_run(scene, a, b)
    # The arm itself stays on the shoulder, and the forces are those of the displaced limbs.
    before = Scene(exo, human=False)
    before.show(R)
    assert_limbs_run(before, *joints(exo, R, 0.0, 0.0))
    arm = "/meshcat/exo/visuals/arm_1"
    np.testing.assert_allclose(place(scene, arm), place(before, arm), atol=1e-12)
    expected = exo.reaction(R, centre_offset=ep.CentreOffset(HARNESS, CUFF))
    np.testing.assert_allclose(answer.shoulder_force, expected.shoulder_force)
    for i, f in enumerate(answer.actuator_forces):
        head = place(scene, f"/meshcat/forces/limb_{i + 1}/{'pull' if f > 0 else 'push'}/head_0")
        along = head[:3, 2] / np.linalg.norm(head[:3, 2])
        line = (a[i] - b[i]) / np.linalg.norm(a[i] - b[i])
        np.testing.assert_allclose(along, np.sign(f) * line, atol=1e-9)


def test_both_centres_are_named_on_the_page(exo):
    scene = Scene(exo, human=False)
    R = pose(60, 30, 0)

    def said():
        return [note["text"] for note in panel(scene, "numbers")["notes"] if "off" in note["text"]]

    scene.show(R, centre_offset=ep.CentreOffset(HARNESS, CUFF))
    assert said() == ["harness's centre, 16 mm off", "cuff's centre, 16 mm off"]
    # At rest a shift of both alike is one centre.
    scene.show(pose(0, 0, 0), centre_offset=HARNESS)
    assert said() == ["device's centre, 16 mm off"]
    # Without an offset nothing of it stays.
    scene.show(R)
    assert said() == []
    assert_limbs_run(scene, *joints(exo, R, 0.0, 0.0))


def test_the_drawn_forces_balance_the_arm(exo):
    """Side forces of stiff limbs, too: what the arrows show adds up to nothing."""
    tube = LimbGuide.tube(outer_radius=0.012, inner_radius=0.010, youngs_modulus=70e9, shear_modulus=26e9)
    guided = exo.replace(
        limbs=[dataclasses.replace(limb, guide=tube) for limb in exo.limbs], shoulder=ep.Shoulder(stiffness=2e4)
    )
    # A scale at which no arrow is cut.
    scene = Scene(guided, human=False, metres_per_newton=1e-4)
    answer = scene.show(pose(60, 30, 0), split="elastic", centre_offset=ep.CentreOffset(HARNESS, CUFF))
    assert np.abs(answer.constraint_forces).max() > 10.0
    total = np.zeros(3)
    for item in commands(scene):
        path = item.get("path", "")
        # The cuff's pull is between arm and device, whose forces are drawn.
        own = path.startswith("/meshcat/forces") and not path.startswith("/meshcat/forces/cuff")
        if item["type"] == "set_object" and own and path.endswith("head_0"):
            head = place(scene, path)
            size = np.linalg.norm(head[:3, 2])
            if size > 1e-5:
                total += drawn_force(scene, path.removesuffix("/head_0"))
    np.testing.assert_allclose(total / scene.metres_per_newton, 0.0, atol=0.02 * answer.magnitude)


def drawn_force(scene, path):
    """The vector of an arrow, m: from its shaft's foot to its last head's tip."""
    shaft = place(scene, f"{path}/shaft")
    last = "head_1" if f"{path}/head_1" in placements(scene) else "head_0"
    head = place(scene, f"{path}/{last}")
    start = shaft[:3, 3]
    return head[:3, 3] + head[:3, 2] - start


def test_a_moving_shoulder_moves_the_device_in_a_recording(exo):
    path = ep.CentrePath(np.radians([0.0, 60.0, 120.0]), np.array([[0, 0, 0], [0, 0.01, 0.01], [0, 0.02, 0.03]]))
    scene = Scene(exo, human=False)
    poses, times = pose([0.0, 30.0, 60.0], 10.0, 0.0), [0.0, 0.5, 1.0]
    recording = scene.record(poses, times, centre_offset=path)
    expected = exo.reaction(poses, centre_offset=path)
    np.testing.assert_allclose(recording.reaction.shoulder_force, expected.shoulder_force)
    last = path.offset(poses[2])
    assert_limbs_run(scene, *joints(exo, poses[2], last.base, last.cuff))
    assert "/meshcat/exo/harness" in recording._frames["moving"]
    np.testing.assert_allclose(place(scene, "/meshcat/exo/harness")[:3, 3], last.base, atol=1e-12)


def test_without_a_ball_joint_the_device_has_one_centre(exo):
    scene = Scene(exo, human=False)
    R = pose(60, 30, 0)
    scene.show(R, split="standalone", centre_offset=ep.CentreOffset(HARNESS, CUFF))
    assert_limbs_run(scene, *joints(exo, R, R.as_matrix() @ CUFF, CUFF))


@pytest.mark.parametrize("name", ["prototype", "3rps-passive-ball"])
def test_the_same_offset_draws_nothing_anew(name):
    exo = ep.load(URDF / f"{name}.urdf").worn_by(PERSON)
    scene = Scene(exo, human=False)
    for _ in range(2):
        before = scene.serial
        scene.show(exo.pose(20, 10), centre_offset=ep.CentreOffset(HARNESS / 4.0, CUFF / 4.0), limits="none")
    assert scene.serial == before
