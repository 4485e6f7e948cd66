"""What is drawn of a robot stands in the same place in every format that it is written to."""

import mujoco
import numpy as np
import pytest

from exo_pin.chain import ClosedChain

INERTIAL = '<inertial><mass value="1"/><inertia ixx="1" ixy="0" ixz="0" iyy="1" iyz="0" izz="1"/></inertial>'
VISUAL = '<visual><origin xyz="{}" rpy="{}"/><geometry>{}</geometry>{}</visual>'
RED = '<material name="red"><color rgba="1 0 0 0.5"/></material>'
#: A pyramid, which MuJoCo reads.
OBJ = "v 0 0 0\nv 1 0 0\nv 0 1 0\nv 0 0 1\nf 1 3 2\nf 1 2 4\nf 1 4 3\nf 2 3 4\n"


@pytest.fixture
def robot(tmp_path):
    (tmp_path / "meshes").mkdir()
    (tmp_path / "meshes" / "tip.obj").write_text(OBJ)
    arm = VISUAL.format("0 0 0.2", "0 0.3 0", '<cylinder radius="0.05" length="0.4"/>', RED)
    arm += VISUAL.format("0.1 0 0", "0 0 0", '<box size="0.1 0.2 0.3"/>', '<material name="red"/>')
    hand = VISUAL.format("0 0 0.1", "0 0 1", '<mesh filename="meshes/tip.obj" scale="0.1 0.1 0.2"/>', "")
    hand += VISUAL.format("0 0.1 0", "0 0 0", '<mesh filename="package://nowhere/tip.dae"/>', "")
    hinge = '<axis xyz="0 1 0"/><limit lower="-1" upper="1" effort="1" velocity="1"/>'
    text = (
        f'<robot name="arm">{RED}<link name="base">{VISUAL.format("0 0 0", "0 0 0", "<sphere radius=.1/>", "")}</link>'
        f'<link name="upper">{INERTIAL}{arm}</link><link name="hand">{hand}</link>'
        f'<joint name="shoulder" type="revolute"><origin xyz="0 0 1" rpy="0.2 0 0"/><parent link="base"/>'
        f'<child link="upper"/>{hinge}</joint><joint name="grip" type="fixed"><origin xyz="0 0 0.4" rpy="0 0 0.5"/>'
        '<parent link="upper"/><child link="hand"/></joint></robot>'
    ).replace("radius=.1", 'radius="0.1"')
    (tmp_path / "arm.urdf").write_text(text)
    return ClosedChain.from_urdf(tmp_path / "arm.urdf")


def poses(chain):
    """Kind, size, colour and pose in the world of every shape."""
    q = np.full(chain.model.nq, 0.4) if chain.model.nq else chain.neutral()
    found = []
    for shape in chain.description.shapes:
        pose = (chain.placement(q, shape.frame) * shape.place).homogeneous
        found.append((shape.kind, np.round(shape.size, 9).tolist(), shape.colour, np.round(pose, 9).tolist()))
    return sorted(found, key=repr)


def test_shapes_of_a_urdf_are_read(robot, tmp_path):
    kinds = [shape.kind for shape in robot.description.shapes]
    assert kinds == ["sphere", "cylinder", "box", "mesh", "mesh"]
    files = [shape.file for shape in robot.description.shapes if shape.kind == "mesh"]
    assert files == [str((tmp_path / "meshes" / "tip.obj").resolve()), "package://nowhere/tip.dae"]
    assert [shape.colour for shape in robot.description.shapes] == [None, *[(1.0, 0.0, 0.0, 0.5)] * 2, None, None]


def test_shapes_are_written_as_urdf_and_sdf(robot, tmp_path):
    # The world's link is none of an SDF's.
    for chain, without in (
        (ClosedChain.from_urdf(robot.to_urdf(tmp_path / "out")), ()),
        (ClosedChain.from_sdf(robot.to_sdf(tmp_path / "out", np.zeros(1))), ("sphere",)),
    ):
        assert poses(chain) == [each for each in poses(robot) if each[0] not in without]


def test_shapes_are_written_as_mjcf(robot, tmp_path):
    path = robot.to_mjcf(tmp_path / "out")
    assert "package://nowhere/tip.dae" in path.read_text(encoding="utf-8")
    model = mujoco.MjModel.from_xml_path(str(path))
    data = mujoco.MjData(model)
    data.qpos[:] = 0.4
    mujoco.mj_forward(model, data)
    kinds = [mujoco.mjtGeom(int(kind)).name for kind in model.geom_type]
    assert kinds == ["mjGEOM_SPHERE", "mjGEOM_CYLINDER", "mjGEOM_BOX", "mjGEOM_MESH"]
    assert not model.geom_contype.any()
    q = np.array([0.4])
    for index, shape in enumerate(robot.description.shapes[:3]):
        pose = robot.placement(q, shape.frame) * shape.place
        np.testing.assert_allclose(data.geom_xpos[index], pose.translation, atol=1e-12)
        np.testing.assert_allclose(data.geom_xmat[index].reshape(3, 3), pose.rotation, atol=1e-12)
    np.testing.assert_allclose(model.geom_size[1][:2], [0.05, 0.2])
    # MuJoCo moves a mesh to its own centre: a corner of the drawn one is where its shape puts it.
    mesh = robot.description.shapes[3]
    corners = np.array([[0, 0, 0], [0.1, 0, 0], [0, 0.1, 0], [0, 0, 0.2]])
    pose = robot.placement(q, mesh.frame) * mesh.place
    wanted = corners @ pose.rotation.T + pose.translation
    found = model.mesh_vert @ data.geom_xmat[3].reshape(3, 3).T + data.geom_xpos[3]
    for corner in wanted:
        assert np.abs(found - corner).max(axis=1).min() < 1e-6
    # They weigh nothing and collide with nothing.
    again = ClosedChain.from_mjcf(path)
    assert again.description.left_out == ()
    assert again.model.inertias[1].mass == robot.model.inertias[1].mass
