"""What is drawn of a robot stands in the same place in every format that it is written to."""

import xml.etree.ElementTree as ET

import mujoco
import numpy as np
import pytest
from scipy.spatial.transform import Rotation
from urdf_knee import BARE, GOOD
from written_robots import text_of, urdf_of

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


#: Size here, elements of SDF, and size in MuJoCo.
KINDS = {
    "box": ((0.1, 0.2, 0.3), "<size>0.1 0.2 0.3</size>", (0.05, 0.1, 0.15)),
    "sphere": ((0.4,), "<radius>0.4</radius>", (0.4,)),
    "cylinder": ((0.1, 0.5), "<radius>0.1</radius><length>0.5</length>", (0.1, 0.25)),
    "capsule": ((0.1, 0.5), "<radius>0.1</radius><length>0.5</length>", (0.1, 0.25)),
    "ellipsoid": ((0.1, 0.2, 0.3), "<radii>0.1 0.2 0.3</radii>", (0.1, 0.2, 0.3)),
    "mesh": ((1.0, 2.0, 3.0), "<uri>none.stl</uri><scale>1 2 3</scale>", ()),
}


def sdf_of(inside):
    body = "<inertial><mass>1</mass></inertial>"
    text = f'<sdf version="1.11"><model name="m"><link name="arm">{body}{inside}</link></model></sdf>'
    return ClosedChain.from_sdf(text)


def urdf_with(inside, head=""):
    old = GOOD[GOOD.index("<visual>") : GOOD.index("</visual>") + 9]
    return GOOD.replace(old, inside).replace('<link name="a"/>', f'{head}<link name="a"/>')


@pytest.mark.parametrize(
    ("name", "there"),
    [
        ("arm.stl", "robot/urdf/arm.stl"), ("../meshes/arm.stl", "robot/meshes/arm.stl"), ("none.stl", None),
        # Of a package an ancestor of the file's folder is the package, or holds it.
        ("package://robot/meshes/arm.stl", "robot/meshes/arm.stl"), ("package://other/hand.stl", "other/hand.stl"),
        ("package://robot/none.stl", None), ("package://none/arm.stl", None),
        ("package://meshes/arm.stl", "robot/meshes/arm.stl"), ("package://urdf/arm.stl", "robot/urdf/arm.stl"),
        ("file:///any.stl", "/any.stl"),
    ],
)  # fmt: skip
def test_where_a_mesh_is(name, there, tmp_path):
    for path in ("robot/urdf/arm.stl", "robot/meshes/arm.stl", "other/hand.stl"):
        (tmp_path / path).parent.mkdir(parents=True, exist_ok=True)
        (tmp_path / path).write_text("solid")
    text = urdf_with(f'<visual><geometry><mesh filename="{name}"/></geometry></visual>')
    (tmp_path / "robot" / "urdf" / "arm.urdf").write_text(text)
    (shape,) = ClosedChain.from_urdf(tmp_path / "robot" / "urdf" / "arm.urdf", BARE).description.shapes
    assert shape.file == (name if there is None else str((tmp_path / there).resolve()))
    assert shape.size == (1.0, 1.0, 1.0)
    # Without a folder only what is in the working directory is found.
    (shape,) = ClosedChain.from_urdf(text, BARE).description.shapes
    assert shape.file == name.removeprefix("file://")


@pytest.mark.parametrize("colour", [None, (0.1, 0.2, 0.3, 0.4)])
@pytest.mark.parametrize("role", ["visual", "collision"])
@pytest.mark.parametrize("kind", KINDS)
def test_shapes_come_back_from_all_formats(kind, role, colour):
    size, elements, theirs = KINDS[kind]
    colour = colour if role == "visual" else None
    material = f"<material><diffuse>{' '.join(map(str, colour))}</diffuse></material>" if colour else ""
    geometry = f"<geometry><{kind}>{elements}</{kind}></geometry>"
    given = sdf_of(f'<{role} name="p"><pose>0.1 -0.2 0.3 0.3 -0.4 0.9</pose>{geometry}{material}</{role}>')
    written = text_of(given, "sdf", given.neutral())
    assert f'<{role} name="{role}_0">' in written
    read = [given, ClosedChain.from_sdf(written)]
    if kind not in ("ellipsoid", "capsule"):
        read.append(ClosedChain.from_urdf(*urdf_of(given)))
    if kind == "capsule":
        # URDF 1.0 has a cylinder with a ball at either end.
        cylinder, *balls = ClosedChain.from_urdf(*urdf_of(given)).description.shapes
        assert [(part.kind, part.size, part.colour) for part in (cylinder, *balls)] == [
            (each, end, given.description.shapes[0].colour)
            for each, end in (("cylinder", size), ("sphere", size[:1]), ("sphere", size[:1]))
        ]
        np.testing.assert_allclose(
            cylinder.place.homogeneous, given.description.shapes[0].place.homogeneous, atol=1e-12
        )
        ends = sorted((cylinder.place.inverse() * ball.place).translation[2] for ball in balls)
        np.testing.assert_allclose(ends, [-0.25, 0.25], atol=1e-12)
    if theirs:
        text = text_of(given, "mjcf", given.neutral())
        model = mujoco.MjModel.from_xml_string(text)
        assert mujoco.mjtGeom(int(model.geom_type[0])).name == f"mjGEOM_{kind.upper()}"
        np.testing.assert_allclose(model.geom_size[0][: len(theirs)], theirs)
    for chain in read:
        (found,) = chain.description.shapes
        assert (found.frame, found.kind, found.role) == ("arm", kind, role)
        np.testing.assert_allclose(found.size, size, rtol=1e-15)
        np.testing.assert_allclose(found.place.translation, [0.1, -0.2, 0.3], atol=1e-15)
        turn = Rotation.from_euler("xyz", [0.3, -0.4, 0.9]).as_matrix()
        np.testing.assert_allclose(found.place.rotation, turn, atol=1e-15)
        assert found.colour == colour
        assert found.file == ("none.stl" if kind == "mesh" else None)


@pytest.mark.parametrize(
    ("name", "there", "is_read"),
    [
        ("a.obj", True, True), ("a.OBJ", True, True), ("a.obj", False, False),
        ("a.dae", True, False), ("a.dae", False, False),
    ],
)  # fmt: skip
def test_meshes_that_mujoco_reads_are_written_once(name, there, is_read, tmp_path):
    path = tmp_path / name
    if there:
        path.write_text("v 0 0 0\nv 1 0 0\nv 0 1 0\nv 0 0 1\nf 1 3 2\nf 1 2 4\nf 1 4 3\nf 2 3 4\n")
    meshes = "".join(
        f'<visual><geometry><mesh filename="{path}" scale="{size} {size} {size}"/></geometry></visual>'
        for size in (1.0, 1.0, 0.5)
    )
    text = urdf_with(f'{meshes}<visual><geometry><sphere radius="0.1"/></geometry></visual>')
    text = text_of(ClosedChain.from_urdf(text, BARE), "mjcf", np.zeros(1))
    root = ET.fromstring(text)
    geoms = [(geom.get("type"), geom.get("mesh")) for geom in root.iter("geom")]
    if not is_read:
        assert geoms == [("sphere", None)]
        assert f"does not read: {path}. -->" in text
        assert root.find("asset") is None
        return
    # Two of one size are one mesh.
    assert geoms == [("mesh", "mesh_0"), ("mesh", "mesh_0"), ("mesh", "mesh_1"), ("sphere", None)]
    assert [mesh.get("scale") for mesh in root.iter("mesh")] == ["1.0 1.0 1.0", "0.5 0.5 0.5"]
    assert "does not read" not in text


@pytest.mark.parametrize(
    ("written", "geometry", "sizes", "said"),
    [
        ("urdf", '<box size="1 2 3"><size>4 5 6</size></box>', [(1.0, 2.0, 3.0)], "unknown element <size>"),
        ("urdf", "<sphere><radius>2</radius></sphere>", [], "'radius' is missing"),
        ("urdf", '<ellipsoid radii="1 2 3"/>', [], "unknown element <ellipsoid>"),
        ("sdf", "<box><size>-1 2 3</size></box>", [], "sizes of zero or more"),
        ("sdf", "<box/>", [], ""),
    ],
)
def test_what_is_no_shape_of_a_format_is_left_out(written, geometry, sizes, said):
    link = f'<link name="a"><visual name="v"><geometry>{geometry}</geometry></visual></link>'
    around = {"urdf": '<robot name="r">{}</robot>', "sdf": '<sdf version="1.10"><model name="r">{}</model></sdf>'}
    given = getattr(ClosedChain, f"from_{written}")(around[written].format(link)).description
    assert [shape.size for shape in given.shapes] == sizes
    assert said in " ".join(given.left_out)


def test_a_quaternion_turns_a_shape_of_a_urdf():
    visual = '<visual><origin quat_xyzw="0 0 0.6 0.8"/><geometry><box size="1 2 3"/></geometry></visual>'
    chain = ClosedChain.from_urdf(f'<robot name="r" version="1.1"><link name="a">{visual}</link></robot>')
    np.testing.assert_allclose(chain.description.shapes[0].quaternion, [0.0, 0.0, 0.6, 0.8], atol=1e-15)
