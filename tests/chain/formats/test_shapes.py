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
    urdf, sdf = robot.to_urdf(tmp_path / "out"), robot.to_sdf(tmp_path / "out", np.zeros(1))
    for chain in (ClosedChain.from_urdf(urdf), ClosedChain.from_sdf(sdf)):
        assert poses(chain) == poses(robot)


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


def collected(model, q):
    """Kind, size, colour and pose in the world of every geom of MuJoCo but planes; of a mesh its corners."""
    data, found = mujoco.MjData(model), []
    data.qpos[:] = q
    mujoco.mj_kinematics(model, data)
    for geom in range(model.ngeom):
        place, R = data.geom_xpos[geom], data.geom_xmat[geom].reshape(3, 3)
        kind, size = int(model.geom_type[geom]), model.geom_size[geom]
        if kind == mujoco.mjtGeom.mjGEOM_MESH:
            mesh = int(model.geom_dataid[geom])
            start = int(model.mesh_vertadr[mesh])
            corners = model.mesh_vert[start : start + int(model.mesh_vertnum[mesh])] @ R.T + place
            where = corners[np.lexsort(np.round(corners, 4).T)]
            size = np.zeros(3)
        else:
            where = np.column_stack([place, R])
        matid = int(model.geom_matid[geom])
        colour = model.geom_rgba[geom] if matid < 0 else model.mat_rgba[matid]
        touches = bool(model.geom_contype[geom] | model.geom_conaffinity[geom])
        if kind != mujoco.mjtGeom.mjGEOM_PLANE:
            found.append((kind, touches, bool(model.geom_group[geom] < 3), size, colour, where))
    return found


#: Geoms of every kind, on a moving body, on one welded to it and on the world; a mesh that MuJoCo moves.
GEOMS = """<mujoco><asset><mesh name="tip" file="tip.obj" scale="0.1 0.1 0.2"/>
  <mesh name="moved" file="tip.obj" refpos="0.3 0 0"/>
  <mesh name="inner" vertex="0 0 0 1 0 0 0 1 0 0 0 1"/><material name="blue" rgba="0 0 1 1"/></asset>
  <worldbody><geom name="floor" type="plane" size="1 1 1"/><geom type="sphere" size="0.1" pos="0 0 1"/>
  <body name="upper" pos="0 0 1" euler="10 0 0"><joint name="shoulder" axis="0 1 0" ref="20"/>
    <geom type="capsule" fromto="0 0 0 0.1 0 -0.4" size="0.03" rgba="1 0 0 0.5"/>
    <geom type="ellipsoid" size="0.1 0.2 0.05" pos="0.1 0 0" contype="0" conaffinity="0" group="1" material="blue"/>
    <body name="hand" pos="0 0 -0.4" euler="0 30 0"><geom type="box" size="0.1 0.05 0.02" group="3"/>
      <geom type="mesh" mesh="tip" pos="0.05 0 0" euler="0 0 40" contype="0" conaffinity="0"/>
      <geom type="mesh" mesh="inner" contype="0" conaffinity="0"/>
      <geom type="mesh" mesh="moved" contype="0" conaffinity="0"/>
      <geom type="cylinder" size="0.02 0.1" contype="0" conaffinity="0" group="4"/></body></body>
  </worldbody></mujoco>"""


@pytest.fixture
def geoms(tmp_path):
    (tmp_path / "tip.obj").write_text(OBJ)
    (tmp_path / "geoms.xml").write_text(GEOMS)
    return tmp_path / "geoms.xml"


def test_geoms_are_carried_from_mjcf_to_mjcf(geoms, tmp_path):
    chain = ClosedChain.from_mjcf(geoms)
    (said,) = (text for text in chain.description.left_out if text.startswith("geoms"))
    assert said.startswith("geoms: geom 'floor', a plane; geom number 6 (unnamed), a mesh without a file")
    assert "geom number 7 (unnamed)" in said
    roles = [shape.role for shape in chain.description.shapes]
    assert roles == ["both", "both", "visual", "collision", "visual", "collision"]
    path = chain.to_mjcf(tmp_path / "out")
    one, other = mujoco.MjModel.from_xml_path(str(geoms)), mujoco.MjModel.from_xml_path(str(path))
    # The file counts from its ref, and so does the one that is written.
    theirs, ours = collected(one, 0.4), collected(other, 0.4)
    del theirs[5:7]  # the meshes that are left out
    assert len(theirs) == len(ours) == 6
    for (kind, touches, shown, size, colour, where), mine in zip(theirs, ours, strict=True):
        # What is neither drawn nor touches others is written as a collision shape.
        assert mine[:3] == (kind, touches or not shown, shown)
        np.testing.assert_allclose(mine[3], size, atol=1e-12)
        np.testing.assert_allclose(mine[4], colour, atol=1e-6)
        np.testing.assert_allclose(mine[5], where, atol=1e-6)
    assert other.opt.disableflags & mujoco.mjtDisableBit.mjDSBL_CONTACT
    np.testing.assert_allclose(other.body_mass.sum(), one.body_mass[1:].sum())
    again = ClosedChain.from_mjcf(path)
    assert poses(again) == poses(chain)


def test_geoms_are_carried_to_sdf_and_urdf(geoms, tmp_path):
    chain = ClosedChain.from_mjcf(geoms)
    q = np.zeros(1)
    again = ClosedChain.from_sdf(chain.to_sdf(tmp_path / "out", q))
    # A shape for both becomes two.
    wanted = [(each, role) for each in chain.description.shapes for role in each.elements]
    for (shape, role), found in zip(wanted, again.description.shapes, strict=True):
        assert (found.kind, found.role, found.frame) == (
            shape.kind,
            role,
            "ground" if shape.kind == "sphere" else "upper",
        )
        np.testing.assert_allclose(found.size, shape.size)
        one, other = (robot.placement(q, each.frame) * each.place for robot, each in ((chain, shape), (again, found)))
        np.testing.assert_allclose(one.homogeneous, other.homogeneous, atol=1e-9)
    urdf = chain.to_urdf(tmp_path / "out")
    assert "left out: {ellipsoid: 1}" in urdf.read_text(encoding="utf-8")
    read = ClosedChain.from_urdf(urdf).description
    assert not any(text.startswith("pictures") for text in read.left_out)
    kinds = [(shape.kind, shape.role) for shape in read.shapes]
    # URDF 1.0 has no capsules.
    assert kinds.count(("cylinder", "visual")) == 1
    assert kinds.count(("cylinder", "collision")) == 2
    assert kinds.count(("sphere", "collision")) == 3
    assert kinds.count(("mesh", "visual")) == 1
