"""The device on MyoArm as one MJCF: its motion beside the plant's, both sides, and what a person's file must have."""

import mujoco
import numpy as np
import pytest
from worn_on_person import PERSON, Worn, angles_apart, law_of_drives

import exo_pin as ep
from exo_pin.person.on_person import LOCKS

pytest.importorskip("myo_sim", reason="needs the extra person: pip install '.[person]'")


@pytest.fixture
def person(tmp_path):
    path = tmp_path / "person.xml"
    path.write_text(PERSON)
    return path


@pytest.fixture(scope="module")
def exo():
    return ep.load("four-cables-worn", side="right")


@pytest.mark.full
@pytest.mark.parametrize("side", ["right", "left"])
def test_with_locked_joints_it_moves_as_the_plant(tmp_path, side):
    """At a step of 1 ms within 1e-3 rad over 1 s."""
    exo = ep.load("four-cables-worn", side=side)
    written = exo.export_on_person(tmp_path / "worn.xml", locked=LOCKS, bones_only=True)
    assert angles_apart(exo.replace(**written.worn), Worn(written[0], side), 1e-3).max() < 1e-3


@pytest.mark.full
def test_stiff_drives_on_it_move_as_in_the_plant(tmp_path):
    """Linear actuators hold by where they stand; at a step of 0.1 ms."""
    exo = ep.load("four-linear-actuators-worn", side="right")
    written = exo.export_on_person(tmp_path / "worn.xml", locked=LOCKS, bones_only=True)
    own = exo.replace(**written.worn)
    assert angles_apart(own, Worn(written[0], "right"), 1e-4, law_of_drives(own)).max() < 1e-3


def test_a_file_of_ones_own_gets_limbs_drives_and_a_cuff(exo, person, tmp_path):
    written = exo.export_on_person(tmp_path / "worn.xml", person)
    assert (
        written[0]
        .read_text()
        .startswith("<!-- four-cables-worn on a person, written by exo_pin. The person is person.xml. -->")
    )
    worn = Worn(written[0], "")
    mujoco.mj_forward(worn.model, worn.data)
    assert worn.pose.magnitude() < 1e-6
    tendons = worn.numbers("tendon", 4)
    np.testing.assert_allclose(worn.data.ten_length[tendons], exo.inverse_kinematics(exo.pose()).lengths, atol=1e-6)
    # A control of 1 N pulls 1 N along the limb, at both ends.
    worn.data.ctrl[worn.numbers("actuator", 4)] = 1.0
    mujoco.mj_forward(worn.model, worn.data)
    turn = worn.data.body("exo_base").xmat.reshape(3, 3)
    points = np.array(exo.mechanism.geometry.platform_points)
    lines = np.array(exo.mechanism.geometry.base_points) - points
    moment = np.cross(points, lines / np.linalg.norm(lines, axis=1)[:, None]).sum(axis=0)
    axis = worn.data.joint("shoulder_elv").xaxis
    acts = worn.data.qfrc_actuator[worn.model.joint("shoulder_elv").dofadr[0]]
    assert acts == pytest.approx(axis @ turn @ moment, abs=1e-5)
    assert worn.model.actuator("limb_1").ctrlrange.tolist() == [0.0, 400.0]
    ends = exo.mechanism.limbs[0].length_range
    np.testing.assert_allclose(worn.model.tendon_range[tendons[0]], ends, atol=1e-6)
    # The person is whole, and the device's moving part is on the arm.
    assert worn.model.key("rest").qpos.shape == (8,)
    own = sum(part.mass for part in exo.arm.parts if part.device)
    assert worn.model.body("exo_cuff").mass[0] == pytest.approx(own)
    assert written.worn["arm"].mass == pytest.approx(3.9 + own)
    np.testing.assert_allclose(written.worn["gravity"], [0.0, 0.0, -9.81], atol=1e-9)


def test_a_cuff_on_springs_has_the_stiffness_of_the_design(exo, person, tmp_path):
    cuff = ep.Interface.upper_arm_cuff(0.15)
    soft = exo.replace(interfaces=ep.Interfaces(cuff=cuff))
    written = soft.export_on_person(tmp_path / "worn.xml", person, cuff="spring")
    assert written.lost == ("the damping of the cuff, which the design does not state",)
    model = mujoco.MjModel.from_xml_path(str(written[0]))
    data = mujoco.MjData(model)
    joints = [model.joint(f"exo_cuff_{k}") for k in range(6)]
    slip = np.array([2e-3, -1e-3, 3e-3, 0.01, -0.02, 0.03])
    for joint, value in zip(joints, slip, strict=True):
        data.qpos[joint.qposadr[0]] = value
    mujoco.mj_forward(model, data)
    force = data.qfrc_spring[[joint.dofadr[0] for joint in joints]]
    np.testing.assert_allclose(force, -cuff.stiffness @ slip, rtol=1e-4)
    turn = data.body("exo_arm").xmat.reshape(3, 3)
    moved = turn.T @ (data.body("exo_cuff").xpos - data.body("exo_arm").xpos)
    np.testing.assert_allclose(moved, np.asarray(cuff.at) + slip[:3], atol=1e-6)
