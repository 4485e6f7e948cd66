"""The device on MyoArm as one MJCF: its motion beside the plant's, both sides, and what a person's file must have."""

import mujoco
import numpy as np
import pytest
from places import REPOSITORY
from worn_on_person import PERSON, Worn, angles_apart, law_of_drives

import exo_pin as ep
from exo_pin import FileFormatError, InvalidInput, MissingData
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


@pytest.mark.full
@pytest.mark.parametrize(("name", "side"), [("myoarm_r", "right"), ("myoarms", "left")])
def test_the_person_of_the_package_is_written_as_it_is(exo, tmp_path, name, side):
    """Every mass, joint, muscle and path of the model that the package makes, beside what the device adds."""
    import myo_sim

    with pytest.warns(UserWarning, match="empty prefix"):
        before = myo_sim.load_spec(name).compile()
    written = ep.load(exo.name, side=side).export_on_person(tmp_path / "worn.xml")[0]
    assert "myo_sim, Apache License 2.0" in written.read_text()
    after = mujoco.MjModel.from_xml_path(str(written))
    for kind, fields in {
        "body": ("mass", "inertia", "pos", "quat"),
        "jnt": ("axis", "range", "stiffness"),
        "actuator": ("gainprm", "biasprm", "dynprm", "ctrlrange"),
        "geom": ("contype", "conaffinity", "size"),
        "tendon": ("stiffness", "width", "length0"),
        "eq": ("data", "solref"),
    }.items():
        count = getattr(before, {"jnt": "njnt", "actuator": "nu"}.get(kind, f"n{kind}"))
        named = {"jnt": "joint", "eq": "equality"}.get(kind, kind)
        same = (
            [getattr(after, named)(getattr(before, named)(k).name).id for k in range(count)] if kind != "geom" else None
        )
        same = np.arange(count) if same is None else same
        for field in fields:
            values = [getattr(model, f"{kind}_{field}") for model in (before, after)]
            np.testing.assert_allclose(values[1][same], values[0], rtol=1e-4, atol=1e-6, err_msg=f"{kind}_{field}")


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


@pytest.mark.parametrize(
    ("locked", "bones_only", "joints", "actuators"),
    [
        ((), False, 8, 6),
        ("scapula", False, 7, 6),
        ("elbow", False, 6, 6),
        ("wrist", False, 7, 5),
        (LOCKS, True, 4, 4),
    ],
)
def test_what_is_locked_is_gone_with_all_that_refers_to_it(
    exo, person, tmp_path, locked, bones_only, joints, actuators
):
    path = exo.export_on_person(tmp_path / "worn.xml", person, locked=locked, bones_only=bones_only)[0]
    model = mujoco.MjModel.from_xml_path(str(path))
    assert (model.nq, model.nu, model.neq) == (joints, actuators, 1 if "scapula" in locked else 2)
    assert model.nsensor == ("elbow" not in locked)
    assert (model.dof_damping.max() > 0.0) != bones_only
    assert (model.body_inertia[model.body("helper").id] == 1.0).all() != bones_only


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


def test_what_cannot_be_written_raises_a_typed_error(exo, person, tmp_path):
    target = tmp_path / "worn.xml"
    coupled = np.diag([3e3, 3e3, 3e3, 10.0, 10.0, 10.0])
    coupled[0, 1] = coupled[1, 0] = 1e3
    stiff = exo.replace(interfaces=ep.Interfaces(cuff=ep.Interface(coupled)))
    other = ep.load(REPOSITORY / "urdf" / "spherical-3rrr.urdf")
    (tmp_path / "other.xml").write_text("<mujoco><worldbody/></mujoco>")
    (tmp_path / "broken.xml").write_text("<mujoco>")
    for call, kind, said in (
        (lambda: exo.export_on_person(tmp_path / "worn.urdf", person), InvalidInput, "xml"),
        (lambda: exo.export_on_person(target, person, cuff="glue"), InvalidInput, "there are: spring, weld"),
        (lambda: exo.export_on_person(target, person, locked="neck"), InvalidInput, "scapula"),
        (lambda: exo.export_on_person(target, person, cuff="spring"), MissingData, "stiffness of the cuff"),
        (lambda: stiff.export_on_person(target, person, cuff="spring"), InvalidInput, "without coupling"),
        (lambda: exo.export_on_person(target, tmp_path / "other.xml"), FileFormatError, "clavicle_r"),
        (lambda: exo.export_on_person(target, tmp_path / "broken.xml"), FileFormatError, "MuJoCo cannot read"),
        (lambda: exo.export_on_person(target, tmp_path / "none.xml"), FileFormatError, "MuJoCo cannot read"),
        (lambda: other.export_on_person(target, person), InvalidInput, "limbs between"),
        (lambda: ep.load("four-cables").export_on_person(target, person), FileFormatError, "clavicle_l"),
    ):
        with pytest.raises(kind, match=said):
            call()
    assert not target.exists()
