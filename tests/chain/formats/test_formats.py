"""Reading and writing robots in other people's formats, against other people's readers."""

import xml.etree.ElementTree as ET

import mujoco
import numpy as np
import pinocchio as pin
import pytest
from closed_chains import CHAINS, off
from mechanisms import five_bar
from pydrake.multibody.parsing import Parser
from pydrake.multibody.plant import MultibodyPlant
from scipy.spatial.transform import Rotation

from exo_pin.chain import ClosedChain, Closures, read_closures
from exo_pin.core.errors import FileFormatError, InvalidInput, LoopNotClosed, UnknownName
from exo_pin.design import preset
from exo_pin.wrist_chain import AssumedMasses, mechanism_urdf

HEAVY = {
    part: ClosedChain.from_urdf(*mechanism_urdf(preset("prototype"), part, AssumedMasses()))
    for part in ("whole", "wrist", "floating")
}
MASSIVE = {name: case for name, case in CHAINS.items() if not name.startswith("wrist")} | {
    f"wrist-{part}": (chain, chain.close(chain.neutral())) for part, chain in HEAVY.items()
}
WRITTEN = {"cylindrical", "distance"}


@pytest.fixture(params=MASSIVE)
def case(request):
    return MASSIVE[request.param]


class AsMujoco:
    """A written chain in MuJoCo, asked in Pinocchio's coordinates."""

    def __init__(self, chain, path):
        self.chain = chain
        self.model = mujoco.MjModel.from_xml_path(str(path))
        self.data = mujoco.MjData(self.model)

    def velocity_map(self, q):
        """Shape (nv, nv of MuJoCo's own joints): a free body's linear velocity is in world axes there."""
        chain = self.chain
        T = np.zeros((self.model.nv, chain.model.nv))
        for joint in range(1, chain.model.njoints):
            name, part = chain.model.names[joint], chain.velocity_slice(chain.model.names[joint])
            start = int(self.model.joint(name).dofadr[0])
            T[start : start + part.stop - part.start, part] = np.eye(part.stop - part.start)
            if chain.model.joints[joint].shortname() == "JointModelFreeFlyer":
                T[start : start + 3, part.start : part.start + 3] = chain.placement(q, name).rotation
        return T

    def at(self, q, v=None):
        model, chain = self.model, self.chain
        mujoco.mj_resetDataKeyframe(model, self.data, 0)
        for joint in range(1, chain.model.njoints):
            name = chain.model.names[joint]
            own, start = q[chain.configuration_slice(name)], int(model.joint(name).qposadr[0])
            kind = chain.model.joints[joint].shortname()
            if kind == "JointModelFreeFlyer":
                own = own[[0, 1, 2, 6, 3, 4, 5]]
            elif kind == "JointModelSpherical":
                own = own[[3, 0, 1, 2]]
            self.data.qpos[start : start + len(own)] = own
        if v is not None:
            self.data.qvel[:] = self.velocity_map(q) @ v
        mujoco.mj_forward(model, self.data)
        return self.data


def test_mujoco_sees_the_same_tree(case, tmp_path):
    chain, q0 = case
    seen = AsMujoco(chain, chain.to_mjcf(tmp_path, q0))
    rng = np.random.default_rng(6)
    for _ in range(3):
        q = off(chain, q0, rng, 0.3)
        v = 0.5 * rng.normal(size=chain.model.nv)
        data = seen.at(q, v)
        for name, place in chain.placements(q).items():
            if mujoco.mj_name2id(seen.model, mujoco.mjtObj.mjOBJ_BODY, name) > 0:
                np.testing.assert_allclose(data.body(name).xpos, place.translation, atol=1e-12)
                np.testing.assert_allclose(data.body(name).xmat.reshape(3, 3), place.rotation, atol=1e-12)
        if any(closure.type in ("universal", "prismatic", "cylindrical") for closure in chain.closures):
            continue  # helper bodies add a millionth of the mass
        M = np.zeros((seen.model.nv,) * 2)
        mujoco.mj_fullM(seen.model, data, M)
        T = seen.velocity_map(q)
        ours = chain.model.createData()
        np.testing.assert_allclose(T.T @ M @ T, symmetric(pin.crba(chain.model, ours, q)), atol=1e-12)
        # Gravity and velocity forces; the two tell a free body's acceleration in different axes.
        if not any(joint.shortname() == "JointModelFreeFlyer" for joint in list(chain.model.joints)[1:]):
            bias = pin.nonLinearEffects(chain.model, ours, q, v)
            np.testing.assert_allclose(T.T @ data.qfrc_bias, bias, atol=1e-11)


def symmetric(upper):
    return np.triu(upper) + np.triu(upper, 1).T


def test_mujoco_closes_the_same_loops(case, tmp_path):
    chain, q0 = case
    seen = AsMujoco(chain, chain.to_mjcf(tmp_path, q0))
    rng = np.random.default_rng(7)
    data = mujoco.MjData(seen.model)
    mujoco.mj_resetDataKeyframe(seen.model, data, 0)
    mujoco.mj_forward(seen.model, data)
    assert np.abs(data.efc_pos[data.efc_type == 0]).max(initial=0.0) < 1e-11
    helped = any(closure.type in ("universal", "prismatic", "cylindrical") for closure in chain.closures)
    q = q0 if helped else chain.close(off(chain, q0, rng, 0.1))
    data = seen.at(q)
    equalities = data.efc_type == 0
    assert np.abs(data.efc_pos[equalities]).max(initial=0.0) < 1e-11
    # The same freedoms: what keeps our loops closed keeps theirs, and they forbid as much.
    J = np.zeros((data.nefc, seen.model.nv))
    if mujoco.mj_isSparse(seen.model):
        mujoco.mju_sparse2dense(J, data.efc_J, data.efc_J_rownnz, data.efc_J_rowadr, data.efc_J_colind)
    else:
        J[:] = data.efc_J[: J.size].reshape(J.shape)
    J = J[equalities]
    extra = seen.model.nv - chain.model.nv
    rank = np.linalg.matrix_rank(J, tol=1e-8)
    assert rank == chain.mobility(q).rank + extra
    if not helped:
        motions = seen.velocity_map(q) @ chain.reduced_jacobian(q)
        np.testing.assert_allclose(J @ motions, 0.0, atol=1e-8 * max(1.0, np.abs(motions).max()))


def test_an_open_loop_shows_the_same_gap_in_mujoco(tmp_path):
    for name in ("five_bar", "delta", "delta-rigid", "stewart", "loop-rigid", "loop-spherical", "loop-distance"):
        chain, q0 = CHAINS[name]
        seen = AsMujoco(chain, chain.to_mjcf(tmp_path, q0))
        q = off(chain, q0, np.random.default_rng(8), 0.05)
        data = seen.at(q)
        theirs = data.efc_pos[data.efc_type == 0]
        residual, start = chain.residual(q), 0
        for closure in chain.closures:
            own = residual[chain.rows(closure.name)]
            gap = theirs[start : start + len(own)]
            start += len(own)
            np.testing.assert_allclose(np.linalg.norm(gap[:3]), np.linalg.norm(own[:3]), atol=1e-12)


def test_writing_urdf_and_reading_it_again(case, tmp_path):
    chain, q = case
    again = ClosedChain.from_urdf(chain.to_urdf(tmp_path))
    assert list(again.model.names) == list(chain.model.names)
    assert again.closures == chain.closures
    assert again.roles == chain.roles
    np.testing.assert_allclose(again.residual(q), chain.residual(q), atol=1e-13)
    there = off(chain, q, np.random.default_rng(9), 0.3)
    np.testing.assert_allclose(again.residual(there), chain.residual(there), atol=1e-13)
    masses = [pin.crba(item.model, item.model.createData(), there) for item in (chain, again)]
    np.testing.assert_allclose(masses[0], masses[1], atol=1e-13)
    np.testing.assert_array_equal(again.model.gravity.linear, chain.model.gravity.linear)
    np.testing.assert_allclose(again.model.upperPositionLimit, chain.model.upperPositionLimit)


@pytest.mark.parametrize("pitch", [0.3, np.pi / 2, np.pi / 2 - 1e-9, -np.pi / 2, np.pi / 2 + 1e-5, 3.0])
def test_turned_joints_are_written_exactly(pitch, tmp_path):
    model = pin.Model()
    turn = Rotation.from_euler("ZYX", [0.7, pitch, -0.4]).as_matrix()
    joint = model.addJoint(0, pin.JointModelRX(), pin.SE3(turn, np.array([0.1, 0.2, 0.3])), "hinge")
    model.addJointFrame(joint, -1)
    model.addBodyFrame("link", joint, pin.SE3.Identity(), -1)
    again = ClosedChain.from_urdf(ClosedChain(model, Closures("turned")).to_urdf(tmp_path))
    np.testing.assert_allclose(again.placement(again.neutral(), "link").rotation, turn, atol=1e-15)


def test_sdf_is_read_strictly_and_is_closed(case, tmp_path):
    chain, q = case
    if WRITTEN & {closure.type for closure in chain.closures}:
        with pytest.raises(InvalidInput, match="SDF has no joint for the"):
            chain.to_sdf(tmp_path, q)
        return
    path = chain.to_sdf(tmp_path, q)
    plant = MultibodyPlant(0.0)
    parser = Parser(plant)
    parser.SetStrictParsing()  # an element that is not in the schema is an error
    parser.AddModels(str(path))
    kinds = [joint.shortname() for joint in list(chain.model.joints)[1:]]
    free = kinds.count("JointModelFreeFlyer")
    assert plant.num_joints() == len(kinds) - free + len(chain.closures)
    # Without the closing joints Drake builds the tree: same places, same masses.
    tree = ET.parse(path)
    model = tree.getroot().find("model")
    names = [frame.name for frame in chain.model.frames]
    joints = model.findall("joint")
    for joint in joints[len(joints) - len(chain.closures) :]:
        model.remove(joint)
    plant = MultibodyPlant(0.0)
    parser = Parser(plant)
    parser.AddModelsFromString(ET.tostring(tree.getroot(), encoding="unicode"), "sdf")
    plant.Finalize()
    context = plant.CreateDefaultContext()
    placements = chain.placements(q)
    checked = 0
    for link in model.findall("link"):
        assert link.get("name") in names
        if chain.model.frames[names.index(link.get("name"))].name in placements:
            pose = plant.EvalBodyPoseInWorld(context, plant.GetBodyByName(link.get("name")))
            np.testing.assert_allclose(pose.translation(), placements[link.get("name")].translation, atol=1e-12)
            np.testing.assert_allclose(pose.rotation().matrix(), placements[link.get("name")].rotation, atol=1e-12)
            checked += 1
    assert checked == chain.model.njoints - 1
    total = sum(inertia.mass for inertia in list(chain.model.inertias)[1:])
    assert plant.CalcTotalMass(context) == pytest.approx(total, rel=1e-12)
    # A hinge turned in Drake turns as in Pinocchio.
    index = next((k for k, kind in enumerate(kinds, 1) if kind.startswith("JointModelR")), None)
    name = chain.model.names[index]
    plant.GetJointByName(name).set_angle(context, 0.3)
    moved = q.copy()
    moved[chain.configuration_slice(name)] += 0.3
    for link, place in chain.placements(moved).items():
        if plant.HasBodyNamed(link) and link != "universe":
            there = plant.EvalBodyPoseInWorld(context, plant.GetBodyByName(link))
            np.testing.assert_allclose(there.translation(), place.translation, atol=1e-12)


def test_chains_without_mass_or_with_open_loops_are_not_written(tmp_path):
    chain, q = CHAINS["wrist-whole"]
    for write in (chain.to_mjcf, chain.to_sdf):
        with pytest.raises(InvalidInput, match="limb_1_platform_cross"):
            write(tmp_path, q)
    chain, q = CHAINS["five_bar"]
    for write in (chain.to_mjcf, chain.to_sdf):
        with pytest.raises(LoopNotClosed):
            write(tmp_path, q + 0.1)
    assert list(tmp_path.iterdir()) == []


def test_mjcf_written_and_read_again(tmp_path):
    for name in ("four_bar", "four_bar_link", "five_bar", "parallelogram", "delta-rigid", "loop-rigid"):
        chain, q = CHAINS[name]
        again = ClosedChain.from_mjcf(chain.to_mjcf(tmp_path, q))
        assert again.roles.actuated == chain.roles.actuated
        assert [(item.name, item.type) for item in again.closures] == [(i.name, i.type) for i in chain.closures]
        assert sorted(again.model.names) == sorted(chain.model.names)
        there = np.zeros(again.model.nq)
        for joint in list(again.model.names)[1:]:
            there[again.configuration_slice(joint)] = q[chain.configuration_slice(joint)]
        assert np.abs(again.residual(there)).max() < 1e-13
        one, other = chain.mobility(q), again.mobility(there)
        assert (one.rank, dict(one.redundant_closures), one.kinds) == (
            other.rank,
            dict(other.redundant_closures),
            other.kinds,
        )


MJCF = """<mujoco model="two"><worldbody>
  <body name="base" pos="0 0 1"><joint name="lift" type="slide" axis="0 0 1"/>
    <inertial pos="0.1 0 0" mass="1" diaginertia="1 2 2.5"/>
    <body name="b" pos="0.3 0 0" euler="0 30 0"><joint name="jb" axis="0 0.6 0.8" range="-60 90" pos="0.1 0 0"/>
      <inertial pos="0 0 0.1" mass="1" diaginertia="1 1 1"/><site name="sb" pos="0.2 0 0"/></body>
    <body name="c" pos="0 0.4 0"><joint name="jc" type="ball"/>
      <inertial pos="0 0.2 0" mass="2" diaginertia="1 1 1"/><site name="sc" pos="0 0.1 0" euler="10 20 30"/></body>
  </body></worldbody><equality>EQUALITY</equality>MORE</mujoco>"""


def mjcf(tmp_path, equality="", more=""):
    path = tmp_path / "two.xml"
    path.write_text(MJCF.replace("EQUALITY", equality).replace("MORE", more))
    return path


@pytest.mark.parametrize(
    "equality",
    [
        '<connect name="e" body1="b" body2="c" anchor="0.2 0 0.1"/>',
        '<connect name="e" body1="b" anchor="0.2 0 0.1"/>',
        '<connect name="e" site1="sb" site2="sc"/>',
        '<weld name="e" body1="b" body2="c"/>',
        '<weld name="e" body1="b" body2="c" relpose="0.1 0.2 0 0.6 0.8 0 0"/>',
        '<weld name="e" body1="b" body2="c" anchor="0.1 0.3 -0.2"/>',
        '<weld name="e" body1="b" body2="c" anchor="0.1 0.3 -0.2" relpose="0.1 0.2 0 0.6 0.8 0 0"/>',
        '<weld name="e" body1="c"/>',
        '<weld name="e" site1="sb" site2="sc"/>',
    ],
)
def test_mjcf_equalities_are_what_mujoco_makes_of_them(equality, tmp_path):
    path = mjcf(tmp_path, equality, more='<actuator><motor joint="jb"/></actuator>')
    chain = ClosedChain.from_mjcf(path)
    assert [closure.name for closure in chain.closures] == ["e"]
    assert chain.roles.actuated == ("jb",)
    model = mujoco.MjModel.from_xml_path(str(path))
    data = mujoco.MjData(model)
    rng = np.random.default_rng(10)
    for _ in range(3):
        q = pin.integrate(chain.model, chain.neutral(), rng.uniform(-0.5, 0.5, chain.model.nv))
        data.qpos[:] = [*q[:2], q[5], *q[2:5]]
        mujoco.mj_forward(model, data)
        gap = data.efc_pos[data.efc_type == 0]
        residual = chain.residual(q)
        assert len(gap) == len(residual)
        assert np.linalg.norm(gap[:3]) == pytest.approx(np.linalg.norm(residual[:3]), abs=1e-10)
        if len(gap) == 6:
            # MuJoCo's turn is the quaternion's vector part.
            turned = np.linalg.norm(residual[3:])
            torque = np.linalg.norm(gap[3:])
            assert (torque > 1e-6) == (turned > 1e-6)
        # Closed for us is closed for MuJoCo.
        try:
            closed = chain.close(q)
        except LoopNotClosed:
            continue  # not every one of these equalities can hold
        data.qpos[:] = [*closed[:2], closed[5], *closed[2:5]]
        mujoco.mj_forward(model, data)
        assert np.abs(data.efc_pos[data.efc_type == 0]).max() < 1e-10


YAML = """closed_loop: [["tip_a", "tip_b"]]
type: ["3d"]
name_mot: ["left_crank_hinge", "right_crank_hinge"]
"""


def parallel_robot(tmp_path, text=YAML):
    """The five-bar with a link at either forearm's tip, in the peers' layout."""
    urdf = five_bar().urdf
    tips = "".join(
        f'<link name="tip_{letter}"/><joint name="weld_{letter}" type="fixed"><parent link="{side}_forearm"/>'
        f'<child link="tip_{letter}"/><origin xyz="0.275 0 0"/></joint>'
        for letter, side in (("a", "left"), ("b", "right"))
    )
    (tmp_path / "robot.urdf").write_text(urdf.replace("</robot>", f"{tips}</robot>"))
    (tmp_path / "robot.yaml").write_text(text)
    return tmp_path


@pytest.mark.parametrize("kind", ["3d", "3D", "6d"])
def test_robot_yaml(kind, tmp_path):
    folder = parallel_robot(tmp_path, YAML.replace('"3d"', f'"{kind}"'))
    for path in (folder, folder / "robot.yaml"):
        chain = ClosedChain.from_parallel_robot(path)
        assert chain.roles.actuated == ("left_crank_hinge", "right_crank_hinge")
        assert chain.row_count == int(kind[0])
    if kind != "6d":
        named = five_bar()
        assert np.abs(chain.residual(named.q)).max() < 1e-15
        closed = chain.close(named.q + 0.1, hold=chain.roles.actuated)
        ours = named.chain().close(named.q + 0.1, hold=chain.roles.actuated)
        np.testing.assert_allclose(closed, ours, atol=1e-12)


@pytest.mark.parametrize(
    ("old", "new", "error", "said"),
    [
        ('"3d"', '"2d"', UnknownName, "type of a closed loop"),
        ('"3d"', "3", UnknownName, "3d, 6d"),
        ('["3d"]', '["3d", "6d"]', FileFormatError, "1 entries"),
        ('"tip_b"', '"tip_c"', UnknownName, "did you mean"),
        ('"tip_a", ', "", FileFormatError, "pairs"),
        ("name_mot", "motors", FileFormatError, "unknown key"),
        ('"left_crank_hinge", ', '"motor", ', UnknownName, "left_crank_hinge"),
        ("closed_loop: [", "closed_loop: [[", FileFormatError, "YAML"),
        ('type: ["3d"]', "", FileFormatError, "missing key 'type'"),
        ('type: ["3d"]', "type: 3d", FileFormatError, "list"),
        ("name_mot:", 'joint_name: ["a"]\njoint_type: ["HINGE"]\nname_mot:', UnknownName, "SPHERICAL"),
        ("name_mot:", 'joint_name: ["a"]\njoint_type: ["FIXED"]\nname_mot:', UnknownName, "joint 'a'"),
    ],
)
def test_a_bad_robot_yaml_is_refused(old, new, error, said, tmp_path):
    assert old in YAML
    with pytest.raises(error, match=said):
        ClosedChain.from_parallel_robot(parallel_robot(tmp_path, YAML.replace(old, new, 1)))


def test_robot_yaml_changes_joints(tmp_path):
    changed = (
        YAML + 'joint_name: ["left_forearm_hinge", "right_forearm_hinge"]\njoint_type: ["SPHERICAL", "UJOINT_ZX"]\n'
    )
    chain = ClosedChain.from_parallel_robot(parallel_robot(tmp_path, changed))
    names = list(chain.model.names)[1:]
    assert names == [
        "left_crank_hinge",
        "left_forearm_hinge",
        "right_crank_hinge",
        "right_forearm_hinge_Z",
        "right_forearm_hinge_X",
    ]
    assert chain.model.nv == 7
    # The same places, and a ball that turns about z as the hinge did.
    q5 = five_bar().q
    q = chain.neutral()
    for name in ("left_crank_hinge", "right_crank_hinge", "right_forearm_hinge_Z"):
        source = name.removesuffix("_Z")
        q[chain.configuration_slice(name)] = q5[five_bar().chain().configuration_slice(source)]
    q[chain.configuration_slice("left_forearm_hinge")] = Rotation.from_rotvec([0, 0, q5[1]]).as_quat()
    assert np.abs(chain.residual(q)).max() < 1e-14
    masses = [sum(inertia.mass for inertia in item.model.inertias) for item in (chain, five_bar().chain())]
    assert masses[0] == pytest.approx(masses[1])
    welded = YAML + 'joint_name: ["left_forearm_hinge"]\njoint_type: ["FIXED"]\n'
    assert ClosedChain.from_parallel_robot(parallel_robot(tmp_path, welded)).model.nv == 3


def test_closures_with_axes_and_distances_come_back(tmp_path):
    for name in ("loop-revolute", "loop-cylindrical", "loop-distance", "delta"):
        chain, _ = CHAINS[name]
        path = chain.to_urdf(tmp_path)
        assert read_closures(path.with_suffix(".closures.toml")).closures == chain.closures
