"""Shapes of URDF and SDF one by one: where their meshes are, their colours, sizes and places, and what has none."""

import xml.etree.ElementTree as ET
from dataclasses import replace

import numpy as np
import pinocchio as pin
import pytest
from rubbing_chains import slide
from scipy.spatial.transform import Rotation

from exo_pin.chain import ClosedChain
from exo_pin.chain.formats.bodies import world_link
from exo_pin.chain.formats.leaving_out import LeftOut
from exo_pin.chain.formats.mjcf.mjcf_writing import mjcf_text
from exo_pin.chain.formats.sdf.sdf_model import sdf_shapes, write_sdf_shape
from exo_pin.chain.formats.urdf.urdf_shapes import found_file, urdf_shapes, write_urdf_shape
from exo_pin.chain.formats.urdf.urdf_writing import urdf_text
from exo_pin.chain.formats.xml_elements import parse_xml
from exo_pin.chain.structure.description import Shape

pytestmark = pytest.mark.usefixtures("plain")

PLACE = pin.SE3(Rotation.from_euler("xyz", [0.3, -0.4, 0.9]).as_matrix(), np.array([0.1, -0.2, 0.3]))
SIZES = {
    "box": (0.1, 0.2, 0.3), "sphere": (0.4,), "cylinder": (0.1, 0.5), "capsule": (0.1, 0.5),
    "ellipsoid": (0.1, 0.2, 0.3), "mesh": (1.0, 2.0, 3.0),
}  # fmt: skip
COLOURS = [None, (0.1, 0.2, 0.3, 0.4)]


@pytest.mark.parametrize(
    ("name", "there"),
    [
        ("arm.stl", "robot/urdf/arm.stl"), ("../meshes/arm.stl", "robot/meshes/arm.stl"), ("none.stl", None),
        # Of a package an ancestor of the file's folder is the package, or holds it.
        ("package://robot/meshes/arm.stl", "robot/meshes/arm.stl"), ("package://other/hand.stl", "other/hand.stl"),
        ("package://robot/none.stl", None), ("package://none/arm.stl", None),
        ("package://meshes/arm.stl", "robot/meshes/arm.stl"),
        ("package://urdf/arm.stl", "robot/urdf/arm.stl"),
    ],
)  # fmt: skip
def test_where_a_mesh_is(name, there, tmp_path):
    for path in ("robot/urdf/arm.stl", "robot/meshes/arm.stl", "other/hand.stl"):
        (tmp_path / path).parent.mkdir(parents=True, exist_ok=True)
        (tmp_path / path).write_text("solid")
    expected = name if there is None else str((tmp_path / there).resolve())
    assert found_file(name, tmp_path / "robot" / "urdf") == expected
    # Without a folder only what is in the working directory is found.
    assert found_file(name, None) == name
    assert found_file(f"file://{tmp_path}/any.stl", None) == f"{tmp_path}/any.stl"


def urdf_of(shape):
    root = ET.Element("robot", name="r")
    link = ET.SubElement(root, "link", name=shape.frame)
    return write_urdf_shape(link, shape), ET.tostring(root, encoding="unicode")


def read(text, left=None, folder=None):
    return list(urdf_shapes(parse_xml(text), folder, (1, 0), LeftOut() if left is None else left))


def assert_same(found, shape, role):
    assert (found.frame, found.kind, found.role) == (shape.frame, shape.kind, role)
    np.testing.assert_allclose(found.size, shape.size, rtol=1e-15)
    np.testing.assert_allclose(found.place.homogeneous, shape.place.homogeneous, atol=1e-15)
    # A collision shape has no colour in either format.
    assert found.colour == (shape.colour if role == "visual" else None)
    assert found.file == shape.file


@pytest.mark.parametrize("colour", COLOURS)
@pytest.mark.parametrize("role", ["visual", "collision", "both"])
@pytest.mark.parametrize("kind", SIZES)
def test_shapes_come_back_from_both_formats(kind, role, colour):
    shape = Shape.at("arm", kind, SIZES[kind], PLACE, "none.stl" if kind == "mesh" else None, colour, role)
    link = ET.Element("link", name="arm")
    write_sdf_shape(link, shape, 3)
    parsed = parse_xml(ET.tostring(link, encoding="unicode"))
    for found, part in zip(sdf_shapes(parsed, "arm", None), shape.elements, strict=True):
        assert_same(found, shape, part)
    assert [child.attributes["name"] for child in parsed.children] == [f"{part}_3" for part in shape.elements]
    written, text = urdf_of(shape)
    assert written == (kind != "ellipsoid")
    if kind not in ("ellipsoid", "capsule"):
        for found, part in zip(read(text), shape.elements, strict=True):
            assert_same(found, shape, part)


@pytest.mark.parametrize(
    ("material", "colour"),
    [
        ("", None), ('<material name="blue"/>', (0.0, 0.0, 1.0, 1.0)), ('<material name="none"/>', None),
        ('<material name="blue"><color rgba="1 0 0 1"/></material>', (1.0, 0.0, 0.0, 1.0)),
        ('<material name="x"><color rgba="1 0 0"/></material>', None), ('<material name="bare"/>', None),
        ('<material name="blue"><texture filename="a.png"/></material>', (0.0, 0.0, 1.0, 1.0)),
    ],
)  # fmt: skip
def test_the_colour_of_a_urdfs_visual(material, colour):
    shape = f'<geometry><sphere radius="1"/></geometry>{material}'
    text = f"""<robot><material name="blue"><color rgba="0 0 1 1"/></material><material name="bare"/>
    <link name="a"><visual>{shape}</visual><collision>{shape}</collision></link></robot>"""
    assert [found.colour for found in read(text)] == [colour, None]


@pytest.mark.parametrize(
    ("diffuse", "colour"),
    [
        ("", None), ("<diffuse>0.1 0.2 0.3 0.4</diffuse>", (0.1, 0.2, 0.3, 0.4)),
        # Opaque unless it says so.
        ("<diffuse>0.1 0.2 0.3</diffuse>", (0.1, 0.2, 0.3, 1.0)), ("<ambient>1 1 1 1</ambient>", None),
    ],
)  # fmt: skip
def test_the_colour_of_an_sdfs_visual(diffuse, colour):
    shape = "<geometry><sphere><radius>1</radius></sphere></geometry>"
    text = f"<link><visual>{shape}<material>{diffuse}</material></visual></link>"
    (found,) = sdf_shapes(parse_xml(text), "a", None)
    assert (found.colour, found.size) == (colour, (1.0,))


FAULTY = [
    '<geometry><sphere radius="x"/></geometry>', "<geometry/>", "", "<geometry><sphere/></geometry>",
    '<geometry><torus radius="1"/></geometry>', '<geometry><sphere radius="1"/><sphere radius="1"/></geometry>',
    '<geometry><mesh scale="1 1 1"/></geometry>', '<geometry><box size="1 1"/></geometry>',
]  # fmt: skip


def test_pictures_with_a_fault_are_left_out_and_the_others_read():
    good = '<geometry><drake:x/><sphere radius="1"/></geometry>'
    pictures = "".join(f"<visual>{inside}</visual>" for inside in (*FAULTY, good))
    left = LeftOut()
    (found,) = read(f'<robot><link name="a">{pictures}</link></robot>', left)
    assert (found.kind, found.size) == ("sphere", (1.0,))
    (said,) = left.report
    assert "got 0" in said
    faulty = ["<pose relative_to='b'>0 0 0 0 0 0</pose><geometry><sphere><radius>1</radius></sphere></geometry>"]
    faulty += ["<geometry><sphere/></geometry>", "<geometry><mesh/></geometry>", "<pose>1</pose>"]
    good = "<pose>1 0 0 0 0 0</pose><geometry><drake:x/><sphere><radius>1</radius></sphere></geometry>"
    pictures = "".join(f"<visual>{inside}</visual>" for inside in (*faulty, good))
    (found,) = sdf_shapes(parse_xml(f"<link>{pictures}</link>"), "a", None)
    assert (found.kind, found.translation) == ("sphere", (1.0, 0.0, 0.0))


def test_a_mesh_has_its_own_size_unless_it_is_scaled(tmp_path):
    for text in ('<mesh filename="a.stl"/>', '<mesh filename="a.stl" scale="1 1 1"/>'):
        robot = f'<robot><link name="a"><visual><geometry>{text}</geometry></visual></link></robot>'
        assert read(robot, folder=tmp_path)[0].size == (1.0, 1.0, 1.0)
    (tmp_path / "robot").mkdir()
    (tmp_path / "robot" / "a.stl").write_text("solid")
    for uri, file in (("model://robot/a.stl", str((tmp_path / "robot" / "a.stl").resolve())), ("b.stl", "b.stl")):
        text = f"<link><visual><geometry><mesh><uri>{uri}</uri></mesh></geometry></visual></link>"
        (found,) = sdf_shapes(parse_xml(text), "a", tmp_path / "robot")
        assert (found.size, found.file) == ((1.0, 1.0, 1.0), file)


def test_shapes_of_the_world_are_on_its_link_and_what_urdf_has_not_is_said():
    chain = slide(0.4)
    link = next(frame.name for frame in chain.model.frames if frame.type == pin.FrameType.BODY and frame.parentJoint)
    shapes = (
        Shape("universe", "sphere", (0.1,)), Shape(link, "box", (0.1, 0.2, 0.3)), Shape(link, "ellipsoid", (1, 1, 1)),
        Shape(link, "ellipsoid", (1, 2, 3)), Shape("nowhere", "sphere", (0.1,)),
    )  # fmt: skip
    text, closures = urdf_text(ClosedChain(chain.model, replace(chain.description, shapes=shapes))._state)
    assert "left out: {ellipsoid: 2, sphere: 1}." in text
    again = ClosedChain.from_urdf(text, closures).description.shapes
    assert {shape.frame: (shape.kind, shape.size) for shape in again} == {
        link: ("box", (0.1, 0.2, 0.3)),
        world_link(chain._state): ("sphere", (0.1,)),
    }
    plain, _ = urdf_text(ClosedChain(chain.model, replace(chain.description, shapes=shapes[:2]))._state)
    assert "left out" not in plain


@pytest.mark.parametrize(
    ("name", "there", "written"),
    [
        ("a.obj", True, True), ("a.OBJ", True, True), ("a.obj", False, False),
        ("a.dae", True, False), ("a.dae", False, False),
    ],
)  # fmt: skip
def test_meshes_that_mujoco_reads_are_written_once(name, there, written, tmp_path):
    chain, path = slide(0.4), tmp_path / name
    if there:
        path.write_text("v 0 0 0\nv 1 0 0\nv 0 1 0\nv 0 0 1\nf 1 3 2\nf 1 2 4\nf 1 4 3\nf 2 3 4\n")
    link = next(frame.name for frame in chain.model.frames if frame.type == pin.FrameType.BODY and frame.parentJoint)
    meshes = [
        Shape(link, "mesh", (size,) * 3, (0.1 * k, 0, 0), file=str(path)) for k, size in enumerate((1.0, 1.0, 0.5))
    ]
    shapes = (*meshes, Shape(link, "sphere", (0.1,)))
    text = mjcf_text(ClosedChain(chain.model, replace(chain.description, shapes=shapes))._state, np.zeros(1))
    root = ET.fromstring(text)
    geoms = [(geom.get("type"), geom.get("mesh")) for geom in root.iter("geom")]
    if not written:
        assert geoms == [("sphere", None)]
        assert f"does not read: {path}. -->" in text
        assert root.find("asset") is None
        return
    # Two of one size are one mesh.
    assert geoms == [("mesh", "mesh_0"), ("mesh", "mesh_0"), ("mesh", "mesh_1"), ("sphere", None)]
    assert [mesh.get("scale") for mesh in root.iter("mesh")] == ["1.0 1.0 1.0", "0.5 0.5 0.5"]
    assert "does not read" not in text
