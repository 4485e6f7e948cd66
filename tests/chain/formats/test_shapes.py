"""What is drawn of a robot stands in the same place in every format that it is written to."""

import mujoco
import numpy as np
import pytest

from exo_pin.chain import ClosedChain

#: A pyramid, which MuJoCo reads.
OBJ = "v 0 0 0\nv 1 0 0\nv 0 1 0\nv 0 0 1\nf 1 3 2\nf 1 2 4\nf 1 4 3\nf 2 3 4\n"


def poses(chain):
    """Kind, size, colour and pose in the world of every shape."""
    q = np.full(chain.model.nq, 0.4) if chain.model.nq else chain.neutral()
    found = []
    for shape in chain.description.shapes:
        pose = (chain.placement(q, shape.frame) * shape.place).homogeneous
        found.append((shape.kind, np.round(shape.size, 9).tolist(), shape.colour, np.round(pose, 9).tolist()))
    return sorted(found, key=repr)


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
